//! The mean of all samples.

use super::Targets;
use crate::gpu::{ComputePipeline, Gpu, Recorder, Result, Specialization, Use, shaders};

pub(super) struct Accumulate {
    pipeline: ComputePipeline,
}

impl Accumulate {
    pub(super) fn new(gpu: &Gpu, targets: &Targets) -> Result<Self> {
        let shader = &shaders::ACCUMULATE_COMP;
        let pipeline = ComputePipeline::new(gpu, shader, &targets.accumulation, 4, &Specialization::default())?;
        Ok(Self { pipeline })
    }

    pub(super) fn record<'r>(&'r self, cmd: &mut Recorder<'_, 'r>, targets: &'r Targets, index: u32) {
        cmd.use_image(&targets.radiance, Use::Sampled);
        cmd.use_image(&targets.mean, Use::Storage);
        let groups = [targets.mean.width().div_ceil(8), targets.mean.height().div_ceil(8), 1];
        cmd.dispatch(&self.pipeline, &targets.accumulation, &index, groups);
    }
}
