//! The model `path`: paths of light at random, a batch of samples of every pixel at a time, by one compute shader.

use std::sync::Arc;
use std::time::Instant;

use super::resources::Resources;
use super::slices::{AfterSlice, GROUP, Place, Slices};
use super::{RADIANCE, Targets};
use crate::gpu::{
    Bind, BindGroup, Commands, ComputePipeline, Gpu, Image, ImageDesc, PassTime, Result, SamplePush, Use, shaders,
};
use crate::options::Trace;

pub(super) struct Path {
    pipeline: ComputePipeline,
    slices: Slices,
}

/// What the model reads and writes beside the mean.
pub(super) struct PathTargets {
    /// All of it, and the scene.
    group: BindGroup,
    pub(super) counts: Arc<Image>,
    /// Sums of squared differences between the means of batches.
    pub(super) spread: Arc<Image>,
}

impl PathTargets {
    /// All that a batch moves.
    pub(super) fn state<'t>(&'t self, mean: &'t Image) -> [&'t Image; 3] {
        [mean, &self.counts, &self.spread]
    }

    pub(super) fn new(gpu: &Gpu, resources: &Resources, mean: &Arc<Image>) -> Result<Self> {
        let (width, height) = (mean.width(), mean.height());
        let uses = &[Use::Storage, Use::CopySource, Use::CopyTarget];
        let image = |name| Image::new(gpu, &ImageDesc { name, width, height, format: RADIANCE, uses }).map(Arc::new);
        let (counts, spread) = (image("counts")?, image("spread")?);
        let mut bindings = resources.traced.clone();
        bindings.extend([mean, &counts, &spread].map(|image| Bind::Storage(image.clone())));
        bindings.push(resources.emitters.clone());
        Ok(Self { group: BindGroup::new(gpu, "path", bindings)?, counts, spread })
    }
}

impl Path {
    pub(super) fn new(gpu: &Gpu, resources: &Resources, targets: &PathTargets, trace: Trace) -> Result<Self> {
        let shader = match trace {
            Trace::Hardware => &shaders::PATH_HARDWARE_COMP,
            Trace::Software => &shaders::PATH_COMP,
        };
        let bytes = size_of::<SamplePush>() as u32;
        let pipeline = ComputePipeline::new(gpu, shader, &targets.group, bytes, &resources.specialization)?;
        Ok(Self { pipeline, slices: Slices::new(GROUP) })
    }

    /// One batch of samples of every pixel from where `push` says on, in slices, until `after` says so.
    pub(super) fn batch(
        &mut self,
        commands: &mut Commands,
        targets: &Targets,
        path: &PathTargets,
        push: SamplePush,
        after: &mut AfterSlice<'_>,
    ) -> crate::Result<Vec<PassTime>> {
        let size = [targets.mean.width(), targets.mean.height()];
        let mut times = Vec::new();
        let mut at = Place { row: push.first_row, column: push.first_column };
        while at.row < size[1] {
            let slice = self.slices.next(at, size, push.samples_in_batch);
            let push = SamplePush { first_row: at.row, first_column: at.column, ..push };
            let start = Instant::now();
            times.extend(commands.run(|cmd| {
                for image in path.state(&targets.mean) {
                    cmd.use_image(image, Use::Storage);
                }
                cmd.timed("path", |cmd| {
                    let groups = [slice.columns.div_ceil(GROUP), slice.rows / GROUP, 1];
                    cmd.dispatch(&self.pipeline, &path.group, &push, groups);
                });
            })?);
            self.slices.took(&slice, start.elapsed(), commands.patience());
            at = slice.end(size[0]);
            if after(commands, at)?.is_break() {
                break;
            }
        }
        Ok(times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shader_has_the_same_sizes() {
        let shader = include_str!("../../shaders/path.glsl");
        assert!(shader.contains(&format!("layout(local_size_x = {GROUP}, local_size_y = {GROUP}) in;")));
    }
}
