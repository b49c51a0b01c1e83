//! From the mean of all samples to what a screen shows.

use bytemuck::{Pod, Zeroable};

use super::Targets;
use crate::gpu::{
    Commands, Depth, Format, Gpu, GraphicsPipeline, GraphicsPipelineDesc, Image, ImageDesc, PassTime, Result, Sides,
    Specialization, Target, Use, shaders,
};
use crate::plan::Plan;

/// Encoded by the shader, so that the tone curve sees the same values on every kind of target.
pub(super) const DISPLAY: Format = Format::Bgra8Srgb;

pub(super) struct Display {
    pipeline: GraphicsPipeline,
}

/// `Push` of `shaders/display.frag`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    scale: f32,
    curve: u32,
}

impl Display {
    pub(super) fn new(gpu: &Gpu, targets: &Targets) -> Result<Self> {
        let pipeline = GraphicsPipeline::new(
            gpu,
            &GraphicsPipelineDesc {
                name: "display",
                vertex: &shaders::FULLSCREEN_VERT,
                fragment: &shaders::DISPLAY_FRAG,
                group: &targets.display,
                push_bytes: size_of::<Push>() as u32,
                colors: &[DISPLAY],
                depth: Depth::Ignored,
                specialization: &Specialization::default(),
            },
        )?;
        Ok(Self { pipeline })
    }

    /// An image of sRGB values, ready to be copied, and the time of the pass.
    pub(super) fn run(
        &self,
        commands: &mut Commands,
        targets: &Targets,
        plan: &Plan,
    ) -> Result<(Image, Vec<PassTime>)> {
        let screen = Image::new(
            commands.gpu(),
            &ImageDesc {
                name: "display",
                width: targets.mean.width(),
                height: targets.mean.height(),
                format: DISPLAY,
                uses: &[Use::ColorTarget, Use::CopySource],
            },
        )?;
        let push = Push { scale: plan.exposure.exp2() as f32, curve: plan.tonemap as u32 };
        let time = commands.run(|cmd| {
            cmd.timed("display", |cmd| {
                cmd.use_image(&targets.mean, Use::Sampled);
                cmd.render(&[Target { image: &screen, clear: Some([0.0; 4]) }], None, |pass| {
                    pass.bind(&self.pipeline, &targets.display);
                    pass.draw(&push, 3, Sides::default());
                });
                cmd.use_image(&screen, Use::CopySource);
            });
        })?;
        Ok((screen, time))
    }
}
