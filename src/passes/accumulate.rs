//! The sum of all samples.

use super::Targets;
use crate::gpu::{Bind, BindGroup, ComputePipeline, Gpu, Image, Recorder, Result, Specialization, Use, shaders};

pub(super) struct Accumulate {
    pipeline: ComputePipeline,
}

pub(super) fn group(gpu: &Gpu, radiance: &Image, total: &Image) -> Result<BindGroup> {
    BindGroup::new(gpu, "accumulate", &[Bind::Sampled(radiance), Bind::Storage(total)])
}

impl Accumulate {
    pub(super) fn new(gpu: &Gpu, targets: &Targets) -> Result<Self> {
        let shader = &shaders::ACCUMULATE_COMP;
        let pipeline = ComputePipeline::new(gpu, shader, &targets.accumulate, 4, &Specialization::default())?;
        Ok(Self { pipeline })
    }

    pub(super) fn record(&self, cmd: &mut Recorder<'_>, targets: &Targets, index: u32) {
        cmd.use_image(&targets.radiance, Use::Sampled);
        cmd.use_image(&targets.total, Use::Storage);
        let groups = [targets.total.width().div_ceil(8), targets.total.height().div_ceil(8), 1];
        cmd.dispatch(&self.pipeline, &targets.accumulate, &index, groups);
    }
}
