//! The original model: a depth-tested forward pass over the objects.

use super::geometry::Draw;
use super::resources::Resources;
use super::{RADIANCE, Targets};
use crate::gpu::{Depth, Gpu, GraphicsPipeline, GraphicsPipelineDesc, Recorder, Result, SamplePush, Target, shaders};

pub(super) struct Single {
    pipeline: GraphicsPipeline,
}

impl Single {
    pub(super) fn new(gpu: &Gpu, resources: &Resources) -> Result<Self> {
        let pipeline = GraphicsPipeline::new(
            gpu,
            &GraphicsPipelineDesc {
                name: "single",
                vertex: &shaders::FORWARD_VERT,
                fragment: &shaders::SINGLE_FRAG,
                group: &resources.group,
                push_bytes: size_of::<SamplePush>() as u32,
                colors: &[RADIANCE],
                depth: Depth::Nearest,
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
        draws: &[Draw],
        push: SamplePush,
    ) {
        let color = Target { image: &targets.radiance, clear: Some([0.0; 4]) };
        let depth = Target { image: &targets.depth, clear: Some([0.0; 4]) };
        cmd.render(&[color], Some(depth), |pass| {
            pass.bind(&self.pipeline, &resources.group);
            for (instance_index, draw) in (0..).zip(draws) {
                pass.draw(&SamplePush { instance_index, ..push }, draw.vertices, draw.sides);
            }
        });
    }
}
