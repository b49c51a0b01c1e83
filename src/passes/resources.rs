//! The scene on the device.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use half::f16;

use super::view::View;
use crate::effects::{Effect, SMOOTH};
use crate::gpu::{
    Bind, BindGroup, Commands, Format, Frame, Gpu, Image, ImageDesc, InstanceRecord, LightRecord, MaterialRecord,
    Result, Sides, Specialization, Use,
};
use crate::optics::compensation::AlbedoTable;
use crate::optics::rough::RoughInterface;
use crate::plan::{Budget, Plan};
use crate::scene::{Dielectric, Material, Mesh, Panorama, Scene, Surface, Surroundings};

/// The id of `ENVIRONMENT_IMAGE` in `shaders/environment.glsl`.
const ENVIRONMENT_IMAGE: u32 = 64;

/// Buffers and images that every pass sees, as one group.
pub(super) struct Resources {
    pub(super) group: BindGroup,
    /// The instances, in their order.
    pub(super) draws: Vec<Draw>,
    pub(super) specialization: Specialization,
    /// From lengths on the device to metres.
    pub(super) metres_per_unit: f64,
}

impl Resources {
    pub(super) fn new(commands: &mut Commands, scene: &Scene, plan: &Plan) -> Result<Self> {
        let view = View::new(&scene.camera, scene.bounds(), plan.size);
        let geometry = Geometry::new(scene, &view);
        let (materials, albedos) = materials(scene, plan);
        let lights = lights(scene, &view);
        let single = Panorama::new(1, 1, vec![[1.0; 3]]);
        let (panorama, specialization) = match &scene.environment.light {
            Surroundings::Image(panorama) => (panorama, true),
            Surroundings::Color(_) => (&single, false),
        };
        let levels = levels(commands.gpu(), panorama, scene, plan);
        let environment = upload_panorama(commands, panorama, levels)?;
        let frame = Frame {
            environment_size: [panorama.width, panorama.height],
            environment_levels: levels,
            ..frame(scene, plan, &view, lights.len() as u32)
        };
        let buffers = vec![
            commands.upload_buffer("frame", &[frame])?,
            commands.upload_buffer("instances", &geometry.instances)?,
            commands.upload_buffer("materials", &materials)?,
            commands.upload_buffer("lights", &lights)?,
            commands.upload_buffer("positions", &geometry.positions)?,
            commands.upload_buffer("normals", &geometry.normals)?,
            commands.upload_buffer("triangles", &geometry.triangles)?,
        ];
        commands.run(|cmd| cmd.use_image(&environment, Use::Sampled))?;
        let mut bindings: Vec<_> = buffers.into_iter().map(|buffer| Bind::Buffer(Arc::new(buffer))).collect();
        bindings.push(Bind::Sampled(Arc::new(environment)));
        bindings.push(Bind::Buffer(Arc::new(commands.upload_buffer("albedos", &albedos)?)));
        Ok(Self {
            group: BindGroup::new(commands.gpu(), "scene", bindings)?,
            draws: geometry.draws,
            specialization: Specialization::effects(plan.effects).with(ENVIRONMENT_IMAGE, specialization),
            metres_per_unit: 1.0 / view.units_per_metre,
        })
    }
}

/// An instance, as it is drawn.
#[derive(Clone, Copy)]
pub(super) struct Draw {
    pub(super) vertices: u32,
    pub(super) sides: Sides,
}

/// Every mesh once, and the instances of them that are dielectrics.
#[derive(Default)]
struct Geometry {
    positions: Vec<f32>,
    normals: Vec<f32>,
    triangles: Vec<u32>,
    instances: Vec<InstanceRecord>,
    draws: Vec<Draw>,
}

impl Geometry {
    fn new(scene: &Scene, view: &View) -> Self {
        let mut all = Self::default();
        let places: Vec<_> = scene.meshes.iter().map(|mesh| all.add(mesh)).collect();
        let to_device =
            DAffine3::from_scale(DVec3::splat(view.units_per_metre)) * DAffine3::from_translation(-view.position);
        for object in &scene.objects {
            if matches!(scene.materials[object.material].surface, Surface::Opaque(_)) {
                continue;
            }
            let mesh = &scene.meshes[object.mesh];
            let place = &places[object.mesh];
            let object_to_world = to_device * object.transform * place.to_mesh;
            let world_to_object = object_to_world.inverse();
            all.instances.push(InstanceRecord {
                object_to_world: object_to_world.into(),
                normal_to_world: world_to_object.matrix3.transpose().into(),
                ray_origin: world_to_object.translation.as_vec3(),
                first_triangle: place.first_triangle,
                world_to_object: DMat3::into(world_to_object.matrix3),
                first_vertex: place.first_vertex,
                material: object.material as u32,
                smooth_normals: u32::from(object.smooth && !mesh.normals.is_empty()),
                number: object.number as u32 + 1,
            });
            all.draws.push(Draw {
                vertices: 3 * mesh.triangles.len() as u32,
                sides: Sides {
                    clockwise: object_to_world.matrix3.determinant() < 0.0,
                    // What is nearest of such a body is a front, unless it cuts through itself inside out: leaving out the
                    // backs changes nothing but the time.
                    fronts_only: scene.is_seen_from_outside(object),
                },
            });
        }
        all
    }

    fn add(&mut self, mesh: &Mesh) -> Place {
        let bounds = mesh.bounds();
        let center = bounds.center();
        // A power of two, so that scaling rounds nothing.
        let scale = bounds.farthest(center).max(f64::MIN_POSITIVE).log2().ceil().exp2();
        let place = Place {
            first_vertex: (self.positions.len() / 3) as u32,
            first_triangle: (self.triangles.len() / 3) as u32,
            to_mesh: DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(scale)),
        };
        for &position in &mesh.positions {
            let unit = (Vec3::from(position).as_dvec3() - center) / scale;
            self.positions.extend(unit.as_vec3().to_array());
        }
        match mesh.normals.is_empty() {
            // Never read, but vertices share one numbering.
            true => self.normals.resize(self.positions.len(), 0.0),
            false => self.normals.extend(mesh.normals.iter().flatten()),
        }
        self.triangles.extend(mesh.triangles.iter().flatten());
        place
    }
}

/// Where a mesh lies in the buffers, scaled to the unit ball; `to_mesh` undoes that.
struct Place {
    first_vertex: u32,
    first_triangle: u32,
    to_mesh: DAffine3,
}

/// Materials, and the tables of what rough ones lose.
fn materials(scene: &Scene, plan: &Plan) -> (Vec<MaterialRecord>, Vec<f32>) {
    let mut tables: Vec<(RoughInterface, u32)> = Vec::new();
    let mut albedos = Vec::new();
    let record = |material: &Material| {
        let Surface::Dielectric(Dielectric { ior, roughness, .. }) = material.surface else {
            return MaterialRecord::default();
        };
        let mut albedo_table = 0;
        if plan.effects.contains(Effect::EnergyCompensation) && is_rough(material) {
            let interface = RoughInterface { alpha: roughness * roughness, eta_i: 1.0, eta_t: ior };
            albedo_table = match tables.iter().find(|(other, _)| *other == interface) {
                Some(&(_, first)) => first,
                None => {
                    let first = albedos.len() as u32;
                    albedos.extend(AlbedoTable::new(interface).nodes().iter().map(|&albedo| albedo as f32));
                    tables.push((interface, first));
                    first
                }
            };
        }
        MaterialRecord { refraction_index: ior as f32, roughness: roughness as f32, albedo_table }
    };
    (scene.materials.iter().map(record).collect(), albedos)
}

/// Whether light is spread by a surface of that material.
fn is_rough(material: &Material) -> bool {
    matches!(material.surface, Surface::Dielectric(Dielectric { ior, roughness, .. }) if roughness > SMOOTH && ior != 1.0)
}

fn lights(scene: &Scene, view: &View) -> Vec<LightRecord> {
    let scale = view.units_per_metre;
    let record = |light: &crate::scene::PointLight| LightRecord {
        position: ((light.position - view.position) * scale).as_vec3(),
        // Irradiance is intensity over distance squared, and distances are scaled.
        intensity: (light.intensity * scale * scale).as_vec3(),
        ..LightRecord::default()
    };
    scene.lights.iter().map(record).collect()
}

fn frame(scene: &Scene, plan: &Plan, view: &View, light_count: u32) -> Frame {
    let environment = &scene.environment;
    let radiance = match environment.light {
        Surroundings::Image(_) => DVec3::splat(environment.intensity),
        Surroundings::Color(color) => color * environment.intensity,
    };
    Frame {
        view_projection: Frame::columns(view.view_projection),
        ray_corner: view.ray_corner.as_vec3(),
        light_count,
        ray_right: view.ray_right.as_vec3(),
        environment_turn: (environment.rotation / std::f64::consts::TAU).rem_euclid(1.0) as f32,
        ray_down: view.ray_down.as_vec3(),
        environment_visible: environment.visible.into(),
        environment_radiance: radiance.as_vec3(),
        reflection_red: plan.debug.reflection_red,
        reflection_intensity: plan.debug.reflection_intensity,
        transmission_green: plan.debug.transmission_green,
        transmission_intensity: plan.debug.transmission_intensity,
        flipped_ratio: plan.debug.flipped_ratio.into(),
        seed: (plan.seed ^ (plan.seed >> 32)) as u32,
        normals: plan.normals(),
        normals_in_all: match plan.budget {
            Budget::Samples(samples) => samples.saturating_mul(plan.normals()),
            Budget::Seconds { .. } => 0,
        },
        ..Frame::default()
    }
}

/// The panorama; with `levels` above 1 it has its halves below, side by side, as `shaders/environment.glsl` finds them. An image
/// of its own levels would do if drivers fetched each pixel of a quad from the level that it asks for; lavapipe takes one for all.
fn upload_panorama(commands: &mut Commands, panorama: &Panorama, levels: u32) -> Result<Image> {
    let is_half = |value: &f32| f16::from_f32(*value).to_f32() == *value;
    // In half precision where that loses nothing of the image itself, as with images that came in it.
    let half = panorama.texels.iter().flatten().all(is_half);
    let format = if half { Format::Rgba16Float } else { Format::Rgba32Float };
    let width = panorama.width;
    let height = panorama.height + if levels > 1 { panorama.height / 2 } else { 0 };
    let desc = ImageDesc { name: "environment", width, height, format, uses: &[Use::CopyTarget, Use::Sampled] };
    if levels <= 1 {
        return commands.upload_image(&desc, &pack(&panorama.texels, half));
    }
    let mut texels = panorama.texels.clone();
    texels.resize((width * height) as usize, [0.0; 3]);
    let mut level = panorama.halved();
    for i in 1..levels {
        if i > 1 {
            level = level.halved();
        }
        let left = width - (width >> (i - 1));
        for (y, row) in (panorama.height..).zip(level.texels.chunks(level.width as usize)) {
            let start = (y * width + left) as usize;
            texels[start..start + row.len()].copy_from_slice(row);
        }
    }
    commands.upload_image(&desc, &pack(&texels, half))
}

/// Levels of the panorama that rough surfaces see averages of; 1 where nothing is rough, or where they would not fit.
fn levels(gpu: &Gpu, panorama: &Panorama, scene: &Scene, plan: &Plan) -> u32 {
    let fits = panorama.height + panorama.height / 2 <= gpu.max_image_side();
    let needed = plan.effects.contains(Effect::Roughness) && scene.materials.iter().any(is_rough);
    if needed && fits { panorama.width.min(panorama.height).ilog2() + 1 } else { 1 }
}

/// Texels as an image holds them.
fn pack(texels: &[[f32; 3]], half: bool) -> Vec<u8> {
    if half {
        let bits = |value: f32| f16::from_f32(value).to_bits();
        texels
            .iter()
            .flat_map(|&[r, g, b]| bytemuck::cast::<_, [u8; 8]>([bits(r), bits(g), bits(b), bits(1.0)]))
            .collect()
    } else {
        texels.iter().flat_map(|&[r, g, b]| bytemuck::cast::<_, [u8; 16]>([r, g, b, 1.0])).collect()
    }
}
