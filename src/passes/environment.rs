//! The environment, behind everything.

use super::resources::Resources;
use super::{RADIANCE, Targets};
use crate::gpu::{
    Depth, Gpu, GraphicsPipeline, GraphicsPipelineDesc, Recorder, Result, SamplePush, Sides, Target, shaders,
};

pub(super) struct EnvironmentPass {
    pipeline: GraphicsPipeline,
}

impl EnvironmentPass {
    pub(super) fn new(gpu: &Gpu, resources: &Resources) -> Result<Self> {
        let pipeline = GraphicsPipeline::new(
            gpu,
            &GraphicsPipelineDesc {
                name: "environment",
                vertex: &shaders::FULLSCREEN_VERT,
                fragment: &shaders::ENVIRONMENT_FRAG,
                group: &resources.group,
                push_bytes: size_of::<SamplePush>() as u32,
                colors: &[RADIANCE],
                depth: Depth::Behind,
                specialization: &resources.specialization,
            },
        )?;
        Ok(Self { pipeline })
    }

    pub(super) fn record<'r>(
        &'r self,
        cmd: &mut Recorder<'_, 'r>,
        resources: &'r Resources,
        targets: &'r Targets,
        push: SamplePush,
    ) {
        let color = Target { image: &targets.radiance, clear: None };
        let depth = Target { image: &targets.depth, clear: None };
        cmd.render(&[color], Some(depth), |pass| {
            pass.bind(&self.pipeline, &resources.group);
            pass.draw(&push, 3, Sides::default());
        });
    }
}
