//! The Vulkan room by itself: what the host writes is what shaders read, and the validation layer is awake.

mod common;

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{DAffine3, DMat3, Vec2, Vec3};

use common::Validated;
use vitrum::gpu::{
    Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, Format, Frame, Gpu, Image, ImageDesc,
    InstanceRecord, LightRecord, MaterialRecord, SamplePush, Specialization, Use, shaders,
};

/// Numbers that tell members apart.
struct Counter(f32);

impl Counter {
    fn next(&mut self) -> f32 {
        self.0 += 1.0;
        self.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    fn matrix(&mut self) -> DAffine3 {
        let mut column = || self.vector().as_dvec3();
        let linear = DMat3::from_cols(column(), column(), column());
        DAffine3 { matrix3: linear, translation: column() }
    }
}

/// What the probe is given: one of each shared struct.
struct Records {
    frame: Frame,
    instance: InstanceRecord,
    material: MaterialRecord,
    light: LightRecord,
    position: f32,
    normal: f32,
    triangle: u32,
    albedo: f32,
    push: SamplePush,
}

impl Records {
    /// Members that count from 1 in the order of their declaration, and the last count.
    fn counting() -> (Self, usize) {
        let mut n = Counter(0.0);
        let pair = |n: &mut Counter| Vec2::new(n.next(), n.next());
        // Struct literals are evaluated in the order written, which is that of the declaration.
        let records = Self {
            frame: Frame {
                view_projection: std::array::from_fn(|_| std::array::from_fn(|_| n.next())),
                ray_corner: n.vector(),
                light_count: n.next() as u32,
                ray_right: n.vector(),
                environment_turn: n.next(),
                ray_down: n.vector(),
                environment_visible: n.next() as u32,
                environment_radiance: n.vector(),
                reflection_red: n.next(),
                reflection_intensity: n.next(),
                transmission_green: n.next(),
                transmission_intensity: n.next(),
                flipped_ratio: n.next() as u32,
                seed: n.next() as u32,
                normals: n.next() as u32,
                normals_in_all: n.next() as u32,
                environment_levels: n.next() as u32,
                environment_size: [n.next() as u32, n.next() as u32],
                max_depth: n.next() as u32,
                cutoff: n.next(),
                camera_bodies: std::array::from_fn(|_| n.next() as u32),
                camera_index: n.next(),
                camera_medium: n.next() as u32,
                tolerance: n.next(),
                first_tangent: n.next() as u32,
            },
            instance: InstanceRecord {
                object_to_world: n.matrix().into(),
                normal_to_world: n.matrix().into(),
                world_to_object: n.matrix().into(),
                first_triangle: n.next() as u32,
                first_vertex: n.next() as u32,
                first_node: n.next() as u32,
                material: n.next() as u32,
                smooth_normals: n.next() as u32,
                number: n.next() as u32,
                rank: n.next() as u32,
                overlaps: n.next() as u32,
            },
            material: MaterialRecord {
                absorption: n.vector(),
                refraction_index: n.next(),
                base_color: n.vector(),
                roughness: n.next(),
                emission: n.vector(),
                metallic: n.next(),
                sellmeier_strengths: n.vector(),
                dispersion: n.next(),
                sellmeier_resonances: n.vector(),
                specular: n.next(),
                kind: n.next() as u32,
                albedo_table: n.next() as u32,
                albedo_tables: n.next() as u32,
                color_map: n.next() as u32,
                finish_map: n.next() as u32,
                emission_map: n.next() as u32,
                transmission_map: n.next() as u32,
                normal_map: n.next() as u32,
                alpha_map: n.next() as u32,
                normal_scale: n.next(),
                alpha_cutoff: n.next(),
                alpha: n.next(),
                shines: n.next(),
                head: n.next(),
                transmission: n.next(),
                ..MaterialRecord::zeroed()
            },
            light: LightRecord {
                position: n.vector(),
                cone_scale: n.next(),
                intensity: n.vector(),
                cone_offset: n.next(),
                axis: n.vector(),
                ..LightRecord::zeroed()
            },
            position: n.next(),
            normal: n.next(),
            triangle: n.next() as u32,
            albedo: n.next(),
            push: SamplePush {
                jitter: pair(&mut n),
                clip_offset: pair(&mut n),
                instance_index: n.next() as u32,
                sample_index: n.next() as u32,
                first_row: n.next() as u32,
                wavelengths: n.next() as u32,
                footprint: n.next(),
                samples_in_batch: n.next() as u32,
                first_column: n.next() as u32,
                padding: 0,
                spectrum: std::array::from_fn(|_| std::array::from_fn(|_| n.next())),
            },
        };
        (records, n.0 as usize)
    }
}

/// Every member as the shader sees it; without `wait` the result is copied before the shader is known to be done.
fn probe(gpu: &Gpu, records: &Records, count: usize, wait: bool) -> vitrum::gpu::Result<Vec<f32>> {
    let mut commands = Commands::new(gpu)?;
    // Arrays hold the record second, so that the size of the first counts too.
    let buffers = [
        commands.upload_buffer("frame", &[records.frame])?,
        commands.upload_buffer("instances", &[InstanceRecord::zeroed(), records.instance])?,
        commands.upload_buffer("materials", &[MaterialRecord::zeroed(), records.material])?,
        commands.upload_buffer("lights", &[LightRecord::zeroed(), records.light])?,
        commands.upload_buffer("positions", &[0.0, records.position])?,
        commands.upload_buffer("normals", &[0.0, records.normal])?,
        commands.upload_buffer("triangles", &[0, records.triangle])?,
    ];
    let size = 4 * count as u64;
    let output = Buffer::new(gpu, &BufferDesc { name: "members", size, usage: BufferUse::Storage })?;
    let readback = Buffer::new(gpu, &BufferDesc { name: "readback", size, usage: BufferUse::Readback })?;
    let uses = &[Use::CopyTarget, Use::Sampled];
    let desc = ImageDesc { name: "environment", width: 1, height: 1, format: Format::Rgba32Float, uses };
    let environment = commands.upload_image(&desc, &[0; 16])?;
    let environment = Arc::new(environment);
    let output = Arc::new(output);
    let mut bindings: Vec<_> = buffers.into_iter().map(|buffer| Bind::Buffer(Arc::new(buffer))).collect();
    let albedos = Arc::new(commands.upload_buffer("albedos", &[0.0, records.albedo])?);
    bindings.extend([Bind::Sampled(environment.clone()), Bind::Buffer(albedos), Bind::Buffer(output.clone())]);
    let group = BindGroup::new(gpu, "probe", bindings)?;
    let push_bytes = size_of::<SamplePush>() as u32;
    let shader = &shaders::PROBE_LAYOUT_COMP;
    let pipeline = ComputePipeline::new(gpu, shader, &group, push_bytes, &Specialization::default())?;
    commands.run(|cmd| {
        cmd.use_image(&environment, Use::Sampled);
        cmd.dispatch(&pipeline, &group, &records.push, [1, 1, 1]);
        if wait {
            cmd.wait_for_buffers();
        }
        cmd.copy_buffer(&output, &readback);
    })?;
    Ok(bytemuck::allocation::pod_collect_to_vec(readback.bytes()))
}

#[test]
fn shaders_read_what_the_host_wrote_member_by_member() {
    let Some(validated) = Validated::open() else { return };
    let (records, count) = Records::counting();
    let members = probe(&validated.gpu, &records, count, /* wait: */ true).expect("the probe runs");
    let expected: Vec<f32> = (1..=count).map(|i| i as f32).collect();
    assert_eq!(members, expected);
    validated.verdict();
}

#[test]
fn a_planted_hazard_is_caught() {
    let Some(validated) = Validated::open() else { return };
    let (records, count) = Records::counting();
    probe(&validated.gpu, &records, count, /* wait: */ false).expect("the probe runs");
    let messages = validated.messages();
    assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{messages:#?}");
}

#[test]
fn images_come_back_as_they_went_also_in_bands() {
    let Some(validated) = Validated::open() else { return };
    let mut commands = Commands::new(&validated.gpu).expect("commands");
    for (width, height) in [(1, 1), (3, 5), (4096, 600)] {
        let uses = &[Use::CopyTarget, Use::CopySource, Use::Sampled];
        let format = Format::Rgba32Float;
        let desc = ImageDesc { name: "there and back", width, height, format, uses };
        let texels: Vec<f32> = (0..4 * width * height).map(|i| i as f32).collect();
        let image = commands.upload_image(&desc, bytemuck::cast_slice(&texels)).expect("upload");
        assert_eq!(commands.read_image(&image).expect("read"), bytemuck::cast_slice::<f32, u8>(&texels));
    }
    drop(commands);
    validated.verdict();
}

#[test]
fn a_planted_misuse_is_caught() {
    let Some(validated) = Validated::open() else { return };
    let mut commands = Commands::new(&validated.gpu).expect("commands");
    // It was not made to be copied from.
    let desc =
        ImageDesc { name: "planted", width: 4, height: 4, format: Format::Rgba32Float, uses: &[Use::ColorTarget] };
    let image = Image::new(&validated.gpu, &desc).expect("image");
    let _ = commands.read_image(&image);
    drop((image, commands));
    let messages = validated.messages();
    assert!(messages.iter().any(|m| m.contains("planted") && m.contains("TRANSFER_SRC")), "{messages:#?}");
}
