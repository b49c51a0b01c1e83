//! What lies at the centre of each pixel: normal, distance, object. Not antialiased, so that values stay what they are.

use super::geometry::Draw;
use super::resources::Resources;
use super::view;
use crate::gpu::{
    BindGroup, Commands, Depth, Format, Gpu, GraphicsPipeline, GraphicsPipelineDesc, Image, ImageDesc, PassTime,
    Result, SamplePush, Target, Use, shaders,
};
use crate::options::Size;
use glam::DVec2;

const VALUES: Format = Format::Rgba32Float;

/// Values at the centres of the pixels, row 0 at the top; 0 where there is nothing but environment.
#[derive(Clone, Debug)]
pub struct Aovs {
    /// Shading normal, world space.
    pub normal: Vec<[f32; 3]>,
    /// Distance from the camera in metres.
    pub depth: Vec<f32>,
    /// Number of the object, from 1.
    pub object: Vec<f32>,
    /// Base colour; of dielectrics white.
    pub albedo: Vec<[f32; 3]>,
}

pub(super) struct AovPass {
    pipeline: GraphicsPipeline,
    /// The scene with its images, of models that trace.
    traced: Option<BindGroup>,
}

impl AovPass {
    pub(super) fn new(gpu: &Gpu, resources: &Resources) -> Result<Self> {
        let traced = (!resources.traced.is_empty())
            .then(|| BindGroup::new(gpu, "scene with images", resources.traced.clone()))
            .transpose()?;
        let pipeline = GraphicsPipeline::new(
            gpu,
            &GraphicsPipelineDesc {
                name: "aov",
                vertex: &shaders::FORWARD_VERT,
                fragment: if traced.is_some() { &shaders::AOV_TEXTURED_FRAG } else { &shaders::AOV_FRAG },
                group: traced.as_ref().unwrap_or(&resources.group),
                push_bytes: size_of::<SamplePush>() as u32,
                colors: &[VALUES, VALUES],
                depth: Depth::Nearest,
                specialization: &resources.specialization,
            },
        )?;
        Ok(Self { pipeline, traced })
    }

    pub(super) fn run(
        &self,
        commands: &mut Commands,
        resources: &Resources,
        draws: &[Draw],
        size: Size,
    ) -> Result<(Aovs, Vec<PassTime>)> {
        let gpu = commands.gpu().clone();
        let Size { width, height } = size;
        let uses = &[Use::ColorTarget, Use::CopySource];
        let image = |name| Image::new(&gpu, &ImageDesc { name, width, height, format: VALUES, uses });
        let (normal_depth, object) = (image("normal and depth")?, image("albedo and object")?);
        let desc =
            ImageDesc { name: "depth of aov", width, height, format: Format::Depth32, uses: &[Use::DepthTarget] };
        let depth = Image::new(&gpu, &desc)?;
        let clear = Some([0.0; 4]);
        let push = view::sample_push(size, DVec2::ZERO, 0);
        let time = commands.run(|cmd| {
            cmd.timed("aov", |cmd| {
                let colors = [Target { image: &normal_depth, clear }, Target { image: &object, clear }];
                cmd.render(&colors, Some(Target { image: &depth, clear }), |pass| {
                    pass.bind(&self.pipeline, self.traced.as_ref().unwrap_or(&resources.group));
                    for (instance_index, draw) in (0..).zip(draws) {
                        pass.draw(&SamplePush { instance_index, ..push }, draw.vertices, draw.sides);
                    }
                });
            });
        })?;
        let texels = |bytes: Vec<u8>| bytemuck::allocation::pod_collect_to_vec::<u8, [f32; 4]>(&bytes);
        let (normal_depth, object) =
            (texels(commands.read_image(&normal_depth)?), texels(commands.read_image(&object)?));
        let metres = |length: f32| (f64::from(length) * resources.metres_per_unit) as f32;
        let aovs = Aovs {
            normal: normal_depth.iter().map(|&[x, y, z, _]| [x, y, z]).collect(),
            depth: normal_depth.iter().map(|&[.., length]| metres(length)).collect(),
            object: object.iter().map(|&[.., number]| number).collect(),
            albedo: object.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        };
        Ok((aovs, time))
    }
}
