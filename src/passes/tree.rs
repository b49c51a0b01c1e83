//! The model `tree`: every pixel's reflections and refractions, enumerated by one compute shader; a second one lights the opaque
//! surfaces that the first has found.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Targets;
use super::resources::Resources;
use crate::gpu::{
    Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, Gpu, PassTime, Result, SamplePush, Use,
    shaders,
};
use crate::options::Trace;

/// How long one submission should take: a GPU's watchdog stays calm, and so does whoever waits at the screen.
const SLICE: Duration = Duration::from_millis(100);

/// Rows of a workgroup.
const GROUP: u32 = 8;

/// Pixels of a row that one invocation takes: `PIXELS` of `shaders/tree.glsl`.
const PIXELS: u32 = 8;

/// Pixels of a slice, where their samples wait for light.
const MOST_SAMPLES: u32 = 1 << 19;

/// Points of opaque surfaces that wait for light in a slice.
const MOST_RECORDS: u32 = 1 << 19;

/// Bytes of `Sample`, `Record` and what stands before the records, in `shaders/pixel.glsl` and `shaders/records.glsl`.
const SAMPLE_BYTES: u64 = 32;
const RECORD_BYTES: u64 = 80;
const HEADER_BYTES: u64 = 16;

pub(super) struct Tree {
    pipeline: ComputePipeline,
    lights: Option<Lights>,
    /// Rows of the next slice.
    rows: u32,
}

/// What lights opaque surfaces.
struct Lights {
    pipeline: ComputePipeline,
    /// The records' headers before a slice that may be repeated, and before one that may not.
    repeatable: Buffer,
    last: Buffer,
    /// The header after it.
    header: Buffer,
}

/// Samples and points of opaque surfaces that wait for their lights.
pub(super) struct Pending {
    samples: Arc<Buffer>,
    pub(super) records: Arc<Buffer>,
}

impl Pending {
    /// Room for both, next to none if no surface is opaque.
    pub(super) fn new(gpu: &Gpu, opaque: bool) -> Result<Self> {
        let buffer = |name, most: u32, bytes: u64| {
            let size = HEADER_BYTES + if opaque { u64::from(most) } else { 1 } * bytes;
            Buffer::new(gpu, &BufferDesc { name, size, usage: BufferUse::Storage }).map(Arc::new)
        };
        Ok(Self {
            samples: buffer("samples that wait for light", MOST_SAMPLES, SAMPLE_BYTES)?,
            records: buffer("points that wait for light", MOST_RECORDS, RECORD_BYTES)?,
        })
    }

    pub(super) fn bindings(&self) -> [Bind; 2] {
        [Bind::Buffer(self.samples.clone()), Bind::Buffer(self.records.clone())]
    }
}

impl Tree {
    pub(super) fn new(commands: &mut Commands, resources: &Resources, group: &BindGroup, trace: Trace) -> Result<Self> {
        let (tree, lights) = match trace {
            Trace::Hardware => (&shaders::TREE_HARDWARE_COMP, &shaders::LIGHTS_HARDWARE_COMP),
            Trace::Software => (&shaders::TREE_COMP, &shaders::LIGHTS_COMP),
        };
        let gpu = commands.gpu().clone();
        let bytes = size_of::<SamplePush>() as u32;
        let pipeline = |shader| ComputePipeline::new(&gpu, shader, group, bytes, &resources.specialization);
        let lights = match resources.opaque {
            false => None,
            true => Some(Lights {
                pipeline: pipeline(lights)?,
                repeatable: commands.upload_buffer("header of a slice", &[0, MOST_RECORDS, 1, 0])?,
                last: commands.upload_buffer("header of a last slice", &[0, MOST_RECORDS, 0, 0])?,
                header: Buffer::new(
                    &gpu,
                    &BufferDesc { name: "header read back", size: HEADER_BYTES, usage: BufferUse::Readback },
                )?,
            }),
        };
        Ok(Self { pipeline: pipeline(tree)?, lights, rows: 2 * GROUP })
    }

    /// One sample of every pixel, in slices of rows; each is as high as the last one's time suggests.
    pub(super) fn sample(
        &mut self,
        commands: &mut Commands,
        targets: &Targets,
        push: SamplePush,
    ) -> Result<Vec<PassTime>> {
        let Some(tree) = &targets.tree else { return Ok(Vec::new()) };
        let (width, height) = (targets.mean.width(), targets.mean.height());
        let most_rows = (MOST_SAMPLES / width / GROUP).max(1) * GROUP;
        let mut times = Vec::new();
        let mut first_row = 0;
        while first_row < height {
            let rows = self.rows.min(most_rows).min((height - first_row).next_multiple_of(GROUP));
            let push = SamplePush { first_row, ..push };
            let start = Instant::now();
            times.extend(commands.run(|cmd| {
                cmd.use_image(&targets.mean, Use::Storage);
                cmd.use_image(&tree.counts, Use::Storage);
                if let Some(lights) = &self.lights {
                    let header = if rows > GROUP { &lights.repeatable } else { &lights.last };
                    cmd.copy_buffer(header, &tree.pending.records);
                }
                cmd.timed("tree", |cmd| {
                    cmd.dispatch(&self.pipeline, &tree.group, &push, [width.div_ceil(GROUP * PIXELS), rows / GROUP, 1]);
                });
                if let Some(lights) = &self.lights {
                    cmd.wait_for_buffers();
                    cmd.timed("lights", |cmd| {
                        cmd.dispatch(&lights.pipeline, &tree.group, &push, [width.div_ceil(GROUP), rows / GROUP, 1]);
                    });
                    cmd.copy_buffer(&tree.pending.records, &lights.header);
                }
            })?);
            if rows > GROUP && self.lights.as_ref().is_some_and(Lights::lost_records) {
                self.rows = (rows / 2).next_multiple_of(GROUP);
                continue;
            }
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

impl Lights {
    /// Whether the last slice found more points than there is room for.
    fn lost_records(&self) -> bool {
        let found: Option<&[u8; 4]> = self.header.bytes().first_chunk();
        found.is_some_and(|&count| u32::from_ne_bytes(count) > MOST_RECORDS)
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
