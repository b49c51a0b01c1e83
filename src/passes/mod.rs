//! The frame: what is drawn on the device, pass after pass.
//!
//! In flow a scene, a plan and a device; out flows [`Rendered`]: linear radiance, display values, extra layers, times.
//! Each file is one pass; [`render`] is the list of them.

mod accumulate;
mod aov;
mod bvh;
mod display;
mod environment;
mod geometry;
mod probe;
mod resources;
mod sampling;
mod single;
mod tree;
mod view;

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::gpu::{
    Bind, BindGroup, Commands, DeviceKind, Format, Gpu, GpuError, Image, ImageDesc, PassTime, Result, SamplePush, Use,
};
use crate::options::{Model, Size, Trace};
use crate::plan::{Budget, Plan};
use crate::scene::Scene;

use accumulate::Accumulate;
use aov::AovPass;
use display::Display;
use environment::EnvironmentPass;
use geometry::Draw;
use resources::Resources;
use single::Single;
use tree::{Pending, Tree};

pub use aov::Aovs;
pub use probe::{Hit, Leaks, Ray, TraceProbe};
pub use sampling::pixel_offsets;
pub use tree::TreeCounts;

/// Radiance in flight, and means of it.
const RADIANCE: Format = Format::Rgba32Float;

/// A finished picture and what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Mean radiance of each pixel, linear Rec. 709, row 0 at the top.
    pub radiance: Vec<[f32; 3]>,
    /// The same as a screen shows it: sRGB, 8 bits a channel.
    pub display: Vec<[u8; 4]>,
    /// What lies at the centres of the pixels, if it was asked for.
    pub aovs: Option<Aovs>,
    /// What the model `tree` counted.
    pub tree: Option<TreeCounts>,
    /// How rays were traced, if any were.
    pub trace: Option<Trace>,
    /// Samples per pixel.
    pub samples: u32,
    /// Device time of each pass, over all samples.
    pub passes: Vec<PassTime>,
    /// Host time until the scene was on the device.
    pub upload: Duration,
    /// Host time of that for hierarchies over triangles, if rays were traced.
    pub acceleration: Option<Duration>,
    /// Host time until every pipeline had run once: drivers compile at the first use.
    pub pipelines: Duration,
}

/// Whether `gpu` can do what `plan` says.
pub fn check(gpu: &Gpu, plan: &Plan) -> Result<()> {
    let limit = gpu.max_image_side();
    if plan.size.width.max(plan.size.height) > limit {
        return Err(GpuError::TooLarge {
            what: "--size".into(),
            size: plan.size.to_string(),
            limit: format!("{limit} a side"),
            advice: "use a smaller --size",
        });
    }
    trace_of(gpu, plan).map(|_| ())
}

/// How rays are traced, if they are: as the plan wishes, else as is faster.
fn trace_of(gpu: &Gpu, plan: &Plan) -> Result<Option<Trace>> {
    let info = gpu.info();
    match plan.trace {
        _ if !plan.model.traces() => Ok(None),
        Some(Trace::Hardware) if !info.ray_query => Err(GpuError::NoRayQuery { name: info.name.clone() }),
        Some(trace) => Ok(Some(trace)),
        None if info.ray_query && info.kind != DeviceKind::Cpu => Ok(Some(Trace::Hardware)),
        None => Ok(Some(Trace::Software)),
    }
}

/// Renders `scene` as `plan` says. `progress` hears how many samples are done.
pub fn render(gpu: &Gpu, scene: &Scene, plan: &Plan, progress: &mut dyn FnMut(u32)) -> Result<Rendered> {
    let start = Instant::now();
    check(gpu, plan)?;
    let mut commands = Commands::new(gpu)?;
    let trace = trace_of(gpu, plan)?;
    let resources = Resources::new(&mut commands, scene, plan, trace)?;
    let upload = start.elapsed();

    let mut passes = Passes::new(&mut commands, &resources, plan, trace)?;
    let set_up = start.elapsed();

    let targets = Targets::new(gpu, plan.size, &resources, plan.model)?;
    let mut times = Times::default();
    let mut samples = 0;
    for offset in sampling::pixel_offsets(plan.budget, plan.seed) {
        let push = view::sample_push(plan.size, offset, samples);
        let push = passes.model.lit(push, plan.budget);
        times.add(passes.sample(&mut commands, &resources, &targets, &resources.draws, push)?);
        samples += 1;
        progress(samples);
        if is_spent(plan.budget, set_up, start.elapsed(), samples) {
            break;
        }
    }

    let (display, time) = passes.display.run(&mut commands, &targets, plan)?;
    times.add(time);
    let mean = commands.read_image(&targets.mean)?;
    let radiance = radiance(&mean)?;
    let tree = match &targets.tree {
        Some(tree) => Some(TreeCounts::new(&mean, &commands.read_image(&tree.counts)?, samples)),
        None => None,
    };
    let mut aovs = None;
    if let Some(pass) = &passes.aov {
        let (values, time) = pass.run(&mut commands, &resources, &resources.draws, plan.size)?;
        times.add(time);
        aovs = Some(values);
    }
    Ok(Rendered {
        radiance,
        display,
        aovs,
        tree,
        trace,
        samples,
        passes: times.0,
        upload,
        acceleration: resources.acceleration,
        pipelines: set_up - upload,
    })
}

/// The passes of a sample, in their order, and those that end the frame.
struct Passes {
    model: ModelPass,
    display: Display,
    aov: Option<AovPass>,
}

/// The passes of one light transport model.
enum ModelPass {
    /// Rasterised: what is covered, what is not, the mean of both.
    Raster(Box<Raster>),
    /// Every pixel from the camera on.
    Tree(Box<Tree>),
}

struct Raster {
    single: Single,
    environment: EnvironmentPass,
    accumulate: Accumulate,
}

impl ModelPass {
    /// What a sample tells the shaders beyond its place in the pixel.
    fn lit(&self, push: SamplePush, budget: Budget) -> SamplePush {
        match self {
            Self::Raster(_) => push,
            Self::Tree(_) => sampling::footprint(sampling::spectrum(push, budget), budget),
        }
    }
}

impl Passes {
    /// Makes every pipeline and runs each once on a few pixels, so that no time of a pass holds its compilation.
    fn new(commands: &mut Commands, resources: &Resources, plan: &Plan, trace: Option<Trace>) -> Result<Self> {
        let gpu = commands.gpu().clone();
        let small = Size { width: 16, height: 16 };
        let targets = Targets::new(&gpu, small, resources, plan.model)?;
        let model = match (&targets.tree, trace) {
            (Some(tree), Some(trace)) => ModelPass::Tree(Box::new(Tree::new(commands, resources, &tree.group, trace)?)),
            _ => ModelPass::Raster(Box::new(Raster {
                single: Single::new(&gpu, resources)?,
                environment: EnvironmentPass::new(&gpu, resources)?,
                accumulate: Accumulate::new(&gpu, &targets)?,
            })),
        };
        let mut passes = Self {
            model,
            display: Display::new(&gpu, &targets)?,
            aov: if plan.aovs.iter().any(|aov| aov.is_of_surfaces()) {
                Some(AovPass::new(&gpu, resources)?)
            } else {
                None
            },
        };
        let few: Vec<_> =
            resources.draws.iter().take(1).map(|draw| Draw { vertices: draw.vertices.min(3), ..*draw }).collect();
        let push = passes.model.lit(SamplePush::default(), plan.budget);
        passes.sample(commands, resources, &targets, &few, push)?;
        passes.display.run(commands, &targets, plan)?;
        if let Some(aov) = &passes.aov {
            aov.run(commands, resources, &few, small)?;
        }
        Ok(passes)
    }

    fn sample(
        &mut self,
        commands: &mut Commands,
        resources: &Resources,
        targets: &Targets,
        draws: &[Draw],
        push: SamplePush,
    ) -> Result<Vec<PassTime>> {
        match &mut self.model {
            ModelPass::Raster(raster) => commands.run(|cmd| {
                cmd.timed("single", |cmd| raster.single.record(cmd, resources, targets, draws, push));
                cmd.timed("environment", |cmd| raster.environment.record(cmd, resources, targets, push));
                cmd.timed("accumulate", |cmd| raster.accumulate.record(cmd, targets, push.sample_index));
            }),
            ModelPass::Tree(tree) => tree.sample(commands, targets, push),
        }
    }
}

/// Images of the picture's size, and the groups that hold them.
struct Targets {
    accumulation: BindGroup,
    display: BindGroup,
    /// What `tree` reads and writes.
    tree: Option<TreeTargets>,
    radiance: Arc<Image>,
    mean: Arc<Image>,
    depth: Image,
}

/// What the model `tree` reads and writes beside the mean.
struct TreeTargets {
    /// All of it, and the scene.
    group: BindGroup,
    counts: Arc<Image>,
    pending: Pending,
}

impl TreeTargets {
    fn new(gpu: &Gpu, resources: &Resources, mean: &Arc<Image>) -> Result<Self> {
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

impl Targets {
    fn new(gpu: &Gpu, Size { width, height }: Size, resources: &Resources, model: Model) -> Result<Self> {
        let image = |name, format, uses| Image::new(gpu, &ImageDesc { name, width, height, format, uses });
        let radiance = Arc::new(image("radiance", RADIANCE, &[Use::ColorTarget, Use::Sampled])?);
        let mean = Arc::new(image("mean", RADIANCE, &[Use::Storage, Use::Sampled, Use::CopySource])?);
        let depth = image("depth", Format::Depth32, &[Use::DepthTarget])?;
        let accumulation = vec![Bind::Sampled(radiance.clone()), Bind::Storage(mean.clone())];
        let tree = match model {
            Model::Tree => Some(TreeTargets::new(gpu, resources, &mean)?),
            Model::Single | Model::Double | Model::Path => None,
        };
        Ok(Self {
            accumulation: BindGroup::new(gpu, "accumulation", accumulation)?,
            display: BindGroup::new(gpu, "display", vec![Bind::Sampled(mean.clone())])?,
            tree,
            radiance,
            mean,
            depth,
        })
    }
}

/// Device times, summed by the name of the pass.
#[derive(Default)]
struct Times(Vec<PassTime>);

impl Times {
    fn add(&mut self, times: Vec<PassTime>) {
        for time in times {
            match self.0.iter_mut().find(|sum| sum.name == time.name) {
                Some(sum) => sum.gpu_ms = sum.gpu_ms.zip(time.gpu_ms).map(|(a, b)| a + b),
                None => self.0.push(time),
            }
        }
    }
}

/// Whether another sample like those before would end after the time.
fn is_spent(budget: Budget, set_up: Duration, elapsed: Duration, samples: u32) -> bool {
    match budget {
        Budget::Samples(_) => false,
        Budget::Seconds { seconds, .. } => {
            let sampling = elapsed.saturating_sub(set_up);
            (elapsed + sampling / samples).as_secs_f64() > seconds
        }
    }
}

/// The colours of an image of [`RADIANCE`].
fn radiance(texels: &[u8]) -> Result<Vec<[f32; 3]>> {
    let mut radiance = Vec::new();
    radiance.try_reserve_exact(texels.len() / 16).map_err(|_| GpuError::OutOfMemory {
        what: "the image on the host".into(),
        state: "the system has no more".into(),
    })?;
    radiance.extend(texels.chunks_exact(16).map(|texel| {
        let [r, g, b, _]: [f32; 4] = bytemuck::pod_read_unaligned(texel);
        [r, g, b]
    }));
    Ok(radiance)
}
