//! The model `tree`: every pixel's reflections and refractions, enumerated by a compute shader.

use std::time::{Duration, Instant};

use super::Targets;
use super::resources::Resources;
use crate::gpu::{BindGroup, Commands, ComputePipeline, Gpu, PassTime, Result, SamplePush, Use, shaders};
use crate::options::Trace;

/// How long one submission should take: a GPU's watchdog stays calm, and so does whoever waits at the screen.
const SLICE: Duration = Duration::from_millis(100);

/// Rows of a workgroup.
const GROUP: u32 = 8;

/// Pixels of a row that one invocation takes: `PIXELS` of `shaders/tree.glsl`.
const PIXELS: u32 = 8;

pub(super) struct Tree {
    pipeline: ComputePipeline,
    /// Rows of the next slice.
    rows: u32,
}

impl Tree {
    pub(super) fn new(gpu: &Gpu, resources: &Resources, group: &BindGroup, trace: Trace) -> Result<Self> {
        let shader = match trace {
            Trace::Hardware => &shaders::TREE_HARDWARE_COMP,
            Trace::Software => &shaders::TREE_COMP,
        };
        let bytes = size_of::<SamplePush>() as u32;
        let pipeline = ComputePipeline::new(gpu, shader, group, bytes, &resources.specialization)?;
        Ok(Self { pipeline, rows: 2 * GROUP })
    }

    /// One sample of every pixel, in slices of rows; each is as high as the last one's time suggests.
    pub(super) fn sample(
        &mut self,
        commands: &mut Commands,
        targets: &Targets,
        push: SamplePush,
    ) -> Result<Vec<PassTime>> {
        let (Some(group), Some(counts)) = (&targets.tree, &targets.counts) else { return Ok(Vec::new()) };
        let (width, height) = (targets.mean.width(), targets.mean.height());
        let mut times = Vec::new();
        let mut first_row = 0;
        while first_row < height {
            let rows = self.rows.min((height - first_row).next_multiple_of(GROUP));
            let start = Instant::now();
            times.extend(commands.run(|cmd| {
                cmd.use_image(&targets.mean, Use::Storage);
                cmd.use_image(counts, Use::Storage);
                cmd.timed("tree", |cmd| {
                    let groups = [width.div_ceil(GROUP * PIXELS), rows / GROUP, 1];
                    cmd.dispatch(&self.pipeline, group, &SamplePush { first_row, ..push }, groups);
                });
            })?);
            first_row += rows;
            let spent = start.elapsed();
            if spent < SLICE / 2 {
                self.rows = rows.saturating_mul(2).min(height.next_multiple_of(GROUP));
            } else if spent > SLICE * 2 {
                self.rows = (rows / 2).next_multiple_of(GROUP).max(GROUP);
            }
        }
        Ok(times)
    }
}

/// What the model counted, as means over the samples of each pixel, row 0 at the top.
#[derive(Clone, Debug)]
pub struct TreeCounts {
    /// Throughput that was cut off.
    pub discarded: Vec<f32>,
    /// Interfaces that scattered light.
    pub interfaces: Vec<f32>,
    /// Rays in all.
    pub rays: u64,
}

impl TreeCounts {
    pub(super) fn new(mean: &[u8], counts: &[u8], samples: u32) -> Self {
        let texels = |bytes: &[u8]| bytemuck::allocation::pod_collect_to_vec::<u8, [f32; 4]>(bytes);
        let counts = texels(counts);
        let rays: f64 = counts.iter().map(|&[_, rays, ..]| f64::from(rays)).sum();
        Self {
            discarded: texels(mean).iter().map(|&[.., discarded]| discarded).collect(),
            interfaces: counts.iter().map(|&[interfaces, ..]| interfaces).collect(),
            rays: (rays * f64::from(samples)).round() as u64,
        }
    }
}
