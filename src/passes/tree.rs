//! The model `tree`: every pixel's reflections and refractions, enumerated by one compute shader; a second one lights the opaque
//! surfaces that the first has found.

use std::sync::Arc;
use std::time::Instant;

use super::resources::Resources;
use super::slices::{AfterSlice, GROUP, Place, Slices};
use super::{RADIANCE, Targets};
use crate::gpu::{
    Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, Gpu, Image, ImageDesc, PassTime, Result,
    SamplePush, Use, shaders,
};
use crate::options::Trace;

/// Pixels of a row that one invocation takes: `PIXELS` of `shaders/tree.glsl`.
const PIXELS: u32 = 8;

/// Pixels of a row of a workgroup.
const COLUMNS: u32 = GROUP * PIXELS;

/// Pixels of a slice, where their samples wait for light.
const MOST_SAMPLES: u32 = 1 << 19;

/// Points of opaque surfaces that wait for light in a slice.
const MOST_RECORDS: u32 = 1 << 19;

/// Bytes of `Sample`, `Record` and what stands before the records, in `shaders/pixel.glsl` and `shaders/records.glsl`.
const SAMPLE_BYTES: u64 = 32;
const RECORD_BYTES: u64 = 96;
const HEADER_BYTES: u64 = 16;

pub(super) struct Tree {
    pipeline: ComputePipeline,
    lights: Option<Lights>,
    slices: Slices,
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
struct Pending {
    samples: Arc<Buffer>,
    records: Arc<Buffer>,
}

impl Pending {
    /// Room for both, next to none if no surface is opaque.
    fn new(gpu: &Gpu, opaque: bool) -> Result<Self> {
        let buffer = |name, most: u32, bytes: u64| {
            let size = HEADER_BYTES + if opaque { u64::from(most) } else { 1 } * bytes;
            Buffer::new(gpu, &BufferDesc { name, size, usage: BufferUse::Storage }).map(Arc::new)
        };
        Ok(Self {
            samples: buffer("samples that wait for light", MOST_SAMPLES, SAMPLE_BYTES)?,
            records: buffer("points that wait for light", MOST_RECORDS, RECORD_BYTES)?,
        })
    }

    fn bindings(&self) -> [Bind; 2] {
        [Bind::Buffer(self.samples.clone()), Bind::Buffer(self.records.clone())]
    }
}

/// What the model `tree` reads and writes beside the mean.
pub(super) struct TreeTargets {
    /// All of it, and the scene.
    group: BindGroup,
    pub(super) counts: Arc<Image>,
    pending: Pending,
}

impl TreeTargets {
    pub(super) fn new(gpu: &Gpu, resources: &Resources, mean: &Arc<Image>) -> Result<Self> {
        let (width, height) = (mean.width(), mean.height());
        let uses = &[Use::Storage, Use::CopySource];
        let counts = Arc::new(Image::new(gpu, &ImageDesc { name: "counts", width, height, format: RADIANCE, uses })?);
        let pending = Pending::new(gpu, resources.opaque)?;
        let mut bindings = resources.traced.clone();
        bindings.extend([Bind::Storage(mean.clone()), Bind::Storage(counts.clone())]);
        bindings.extend(pending.bindings());
        Ok(Self { group: BindGroup::new(gpu, "tree", bindings)?, counts, pending })
    }
}

impl Tree {
    pub(super) fn new(
        commands: &mut Commands,
        resources: &Resources,
        targets: &TreeTargets,
        trace: Trace,
    ) -> Result<Self> {
        let (tree, lights) = match trace {
            Trace::Hardware => (&shaders::TREE_HARDWARE_COMP, &shaders::LIGHTS_HARDWARE_COMP),
            Trace::Software => (&shaders::TREE_COMP, &shaders::LIGHTS_COMP),
        };
        let gpu = commands.gpu().clone();
        let bytes = size_of::<SamplePush>() as u32;
        let pipeline = |shader| ComputePipeline::new(&gpu, shader, &targets.group, bytes, &resources.specialization);
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
        Ok(Self { pipeline: pipeline(tree)?, lights, slices: Slices::new(COLUMNS) })
    }

    /// One sample of every pixel from where `push` says on, in slices, until `after` says so; slices shrink where they leave more points
    /// than there is room for.
    pub(super) fn sample(
        &mut self,
        commands: &mut Commands,
        targets: &Targets,
        tree: &TreeTargets,
        push: SamplePush,
        after: &mut AfterSlice<'_>,
    ) -> crate::Result<Vec<PassTime>> {
        let size = [targets.mean.width(), targets.mean.height()];
        // No more pixels than have room to wait.
        let most_rows = (MOST_SAMPLES / size[0] / GROUP).max(1) * GROUP;
        let mut times = Vec::new();
        let mut at = Place { row: push.first_row, column: push.first_column };
        while at.row < size[1] {
            let slice = self.slices.next(at, [size[0], size[1].min(at.row + most_rows)], 1);
            let push = SamplePush { first_row: at.row, first_column: at.column, ..push };
            let (rows, columns) = (slice.rows, slice.columns);
            let is_least = rows == GROUP && columns <= COLUMNS;
            let start = Instant::now();
            times.extend(commands.run(|cmd| {
                cmd.use_image(&targets.mean, Use::Storage);
                cmd.use_image(&tree.counts, Use::Storage);
                if let Some(lights) = &self.lights {
                    let header = if is_least { &lights.last } else { &lights.repeatable };
                    cmd.copy_buffer(header, &tree.pending.records);
                }
                cmd.timed("tree", |cmd| {
                    cmd.dispatch(&self.pipeline, &tree.group, &push, [columns.div_ceil(COLUMNS), rows / GROUP, 1]);
                });
                if let Some(lights) = &self.lights {
                    cmd.wait_for_buffers();
                    cmd.timed("lights", |cmd| {
                        let groups = [columns.div_ceil(GROUP), rows / GROUP, 1];
                        cmd.dispatch(&lights.pipeline, &tree.group, &push, groups);
                    });
                    cmd.copy_buffer(&tree.pending.records, &lights.header);
                }
            })?);
            if !is_least && self.lights.as_ref().is_some_and(Lights::lost_records) {
                self.slices.halve(&slice);
                continue;
            }
            self.slices.took(&slice, start.elapsed(), commands.patience());
            at = slice.end(size[0]);
            if after(commands, at)?.is_break() {
                break;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_have_the_same_sizes() {
        let shader = include_str!("../../shaders/tree.glsl");
        assert!(shader.contains(&format!("const int PIXELS = {PIXELS};")));
        assert!(shader.contains(&format!("layout(local_size_x = {GROUP}, local_size_y = {GROUP}) in;")));
        let words = |text: &str, name: &str| {
            let body = text.split(&format!("struct {name} {{")).nth(1).and_then(|rest| rest.split("};").next());
            let lines = body.expect("a struct").lines().filter_map(|line| line.split_whitespace().next());
            let size = |kind: &str| match kind {
                "float" | "uint" => 1,
                "uvec2" => 2,
                "vec3" => 3,
                "vec4" | "uvec4" => 4,
                other => panic!("{other}"),
            };
            lines.map(size).sum::<u64>()
        };
        assert_eq!(4 * words(include_str!("../../shaders/pixel.glsl"), "Sample"), SAMPLE_BYTES);
        assert_eq!(4 * words(include_str!("../../shaders/records.glsl"), "Record"), RECORD_BYTES);
    }
}
