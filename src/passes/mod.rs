//! The frame: what is drawn on the device, pass after pass.
//!
//! In flow a scene, a plan and a device; out flows [`Rendered`]: linear radiance, display values, extra layers, times.
//! Each file is one pass; [`render`] is the list of them.

mod accumulate;
mod aov;
mod bvh;
mod checkpoint;
mod counts;
mod display;
mod double;
mod emitters;
mod environment;
mod geometry;
mod materials;
mod path;
mod probe;
mod renderer;
mod resources;
mod sampling;
mod single;
mod skylight;
mod slices;
mod tangents;
mod tree;
mod view;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use crate::gpu::{
    Bind, BindGroup, Commands, DeviceKind, Format, Gpu, GpuError, Image, ImageDesc, PassTime, Result, SamplePush, Use,
};
use crate::options::{Model, Size, Trace};
use crate::plan::{Budget, Plan};
use crate::scene::Scene;

use accumulate::Accumulate;
use aov::AovPass;
use checkpoint::{Checkpoint, Progress};
use display::Display;
use double::{Double, DoubleTargets};
use environment::EnvironmentPass;
use geometry::Draw;
use path::{Path, PathTargets};
use resources::Resources;
use sampling::Round;
use single::Single;
use slices::{AfterSlice, Place};
use tree::{Tree, TreeTargets};

pub use aov::Aovs;
pub use checkpoint::is_checkpoint;
pub use counts::{Counts, DARK, MOST_PIXELS, PIXELS_BY_STDERR, error_of, is_within, relative_error};
pub use probe::{Hit, Leaks, Ray, TraceProbe};
pub use renderer::{Refinement, Renderer, Step};
pub use sampling::{OPEN_BATCH, batches_of, pixel_offsets};

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
    /// What the model counted, if it does.
    pub counts: Option<Counts>,
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
    /// Samples per pixel that a checkpoint held already.
    pub resumed: u32,
    /// What went wrong beside the picture, that a user should hear of.
    pub warnings: Vec<String>,
}

impl Rendered {
    /// Milliseconds of all passes on the device, if it has a clock.
    pub fn gpu_ms(&self) -> Option<f64> {
        self.passes.iter().map(|pass| pass.gpu_ms).sum()
    }
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
pub fn render(gpu: &Gpu, scene: &Scene, plan: &Plan, progress: &mut dyn FnMut(u32)) -> crate::Result<Rendered> {
    Renderer::new(gpu, scene, plan)?.render(plan, progress)
}

/// The passes of a sample, in their order, and those that end the frame.
struct Passes {
    model: ModelPass,
    display: Display,
    aov: Option<AovPass>,
}

/// What is sampled, and where to.
struct Job<'a> {
    plan: &'a Plan,
    resources: &'a Resources,
    targets: &'a Targets,
    /// Whether the time is up after so many rounds.
    is_spent: &'a dyn Fn(u32) -> bool,
}

/// What came of sampling.
#[derive(Default)]
struct Sampled {
    times: Times,
    samples: u32,
    /// Of these, those that a checkpoint held.
    resumed: u32,
    warnings: Vec<String>,
}

/// The passes of one light transport model.
enum ModelPass {
    /// Rasterised: what is covered, what is not, the mean of both.
    Raster(Box<Raster>),
    /// The same with what lies behind the surface.
    Double(Box<Double>, EnvironmentPass),
    /// Every pixel's tree from the camera on.
    Tree(Box<Tree>),
    /// Every pixel's paths from the camera on.
    Path(Box<Path>),
}

struct Raster {
    single: Single,
    environment: EnvironmentPass,
    accumulate: Accumulate,
}

impl Passes {
    /// Makes every pipeline and runs each once on a few pixels, so that no time of a pass holds its compilation.
    fn new(commands: &mut Commands, resources: &Resources, plan: &Plan, trace: Option<Trace>) -> crate::Result<Self> {
        let gpu = commands.gpu().clone();
        let small = Size { width: 16, height: 16 };
        let targets = Targets::new(&gpu, &Plan { size: small, budget: Budget::Samples(2), ..plan.clone() }, resources)?;
        let model = match (&targets.model, trace) {
            (ModelTargets::Tree(tree), Some(trace)) => {
                ModelPass::Tree(Box::new(Tree::new(commands, resources, tree, trace)?))
            }
            (ModelTargets::Path(path), Some(trace)) => {
                ModelPass::Path(Box::new(Path::new(&gpu, resources, path, trace)?))
            }
            (ModelTargets::Double(double), _) => ModelPass::Double(
                Box::new(Double::new(&gpu, resources, double)?),
                EnvironmentPass::new(&gpu, resources)?,
            ),
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
        if let Some(Round { push, .. }) = sampling::rounds(plan).next() {
            let push = SamplePush { samples_in_batch: 1, ..push };
            let mut after = |_: &mut Commands, _| Ok(ControlFlow::Continue(()));
            passes.sample(commands, resources, &targets, &few, push, &mut after)?;
        }
        passes.display.run(commands, &targets, plan)?;
        if let Some(aov) = &passes.aov {
            aov.run(commands, resources, &few, small)?;
        }
        Ok(passes)
    }

    /// Samples until there are enough, from where `checkpoint` is on, if there is one.
    fn all_samples(
        &mut self,
        commands: &mut Commands,
        &Job { plan, resources, targets, is_spent }: &Job<'_>,
        mut checkpoint: Option<Checkpoint>,
        progress: &mut dyn FnMut(u32),
    ) -> crate::Result<Sampled> {
        let state = targets.state();
        let begun = match &checkpoint {
            Some(checkpoint) => {
                let most = Progress { rounds: sampling::rounds(plan).count() as u32, rows: 0 };
                checkpoint.resume(commands, &state, most, plan.size.height)?
            }
            None => Progress::default(),
        };
        let mut sampled = Sampled::default();
        let mut done = begun;
        // In the middle of a round pixels have different numbers of samples, and the uninterrupted render does not look.
        let is_between = begun.rounds > 0 && begun.rows == 0;
        let mut is_enough = is_between && is_precise(commands, targets, plan, begun.rounds)?;
        for (rounds, round) in (1..).zip(sampling::rounds(plan)) {
            if rounds <= begun.rounds {
                sampled.samples += round.samples;
                sampled.resumed += round.samples;
                continue;
            }
            if is_enough {
                break;
            }
            let first_row = if rounds == begun.rounds + 1 { begun.rows } else { 0 };
            let push = SamplePush { first_row, ..round.push };
            let mut after = |commands: &mut Commands, Place { row, column }| {
                if let Some(checkpoint) = checkpoint.as_mut().filter(|checkpoint| column == 0 && checkpoint.is_due()) {
                    checkpoint.save(commands, &state, Progress::within(rounds, row, plan.size.height));
                }
                Ok(ControlFlow::Continue(()))
            };
            sampled.times.add(self.sample(commands, resources, targets, &resources.draws, push, &mut after)?);
            sampled.samples += round.samples;
            progress(sampled.samples);
            done = Progress { rounds, rows: 0 };
            is_enough = is_spent(rounds - begun.rounds) || is_precise(commands, targets, plan, rounds)?;
        }
        if let Some(checkpoint) = &mut checkpoint {
            if done != begun {
                checkpoint.save(commands, &state, done);
            }
            sampled.warnings.extend(checkpoint.failure.take().map(|error| error.in_full()));
        }
        Ok(sampled)
    }

    fn sample(
        &mut self,
        commands: &mut Commands,
        resources: &Resources,
        targets: &Targets,
        draws: &[Draw],
        push: SamplePush,
        after: &mut AfterSlice<'_>,
    ) -> crate::Result<Vec<PassTime>> {
        match (&mut self.model, &targets.model) {
            (ModelPass::Tree(pass), ModelTargets::Tree(tree)) => pass.sample(commands, targets, tree, push, after),
            (ModelPass::Path(pass), ModelTargets::Path(path)) => pass.batch(commands, targets, path, push, after),
            (ModelPass::Raster(raster), _) => Ok(commands.run(|cmd| {
                cmd.timed("single", |cmd| raster.single.record(cmd, resources, targets, draws, push));
                cmd.timed("environment", |cmd| raster.environment.record(cmd, resources, targets, push));
                if !Arc::ptr_eq(&targets.mean, &targets.radiance) {
                    cmd.timed("accumulate", |cmd| raster.accumulate.record(cmd, targets, push.sample_index));
                }
            })?),
            (ModelPass::Double(pass, environment), ModelTargets::Double(double)) => Ok(commands.run(|cmd| {
                cmd.timed("double", |cmd| pass.record(cmd, resources, targets, double, draws, push));
                cmd.timed("environment", |cmd| environment.record(cmd, resources, targets, push));
                cmd.timed("accumulate", |cmd| pass.accumulate(cmd, targets, double, push.sample_index));
            })?),
            // A pass comes with its own targets.
            (ModelPass::Tree(_) | ModelPass::Path(_) | ModelPass::Double(..), _) => Ok(Vec::new()),
        }
    }
}

/// Images of the picture's size, and the groups that hold them.
struct Targets {
    accumulation: BindGroup,
    display: BindGroup,
    model: ModelTargets,
    radiance: Arc<Image>,
    mean: Arc<Image>,
    depth: Image,
}

/// What a model reads and writes beside the mean.
enum ModelTargets {
    Raster,
    Double(Box<DoubleTargets>),
    Tree(TreeTargets),
    Path(PathTargets),
}

impl Targets {
    fn new(gpu: &Gpu, plan: &Plan, resources: &Resources) -> Result<Self> {
        let Size { width, height } = plan.size;
        let image = |name, format, uses| Image::new(gpu, &ImageDesc { name, width, height, format, uses });
        let uses = [Use::ColorTarget, Use::Storage, Use::Sampled, Use::CopySource, Use::CopyTarget];
        let radiance = Arc::new(image("radiance", RADIANCE, &uses)?);
        // Of one sample, what is drawn is the mean.
        let mean = match (plan.model, plan.budget) {
            (Model::Single, Budget::Samples(1)) => radiance.clone(),
            _ => Arc::new(image("mean", RADIANCE, &uses[1..])?),
        };
        let depth = image("depth", Format::Depth32, &[Use::DepthTarget])?;
        let accumulation = vec![Bind::Sampled(radiance.clone()), Bind::Storage(mean.clone())];
        let model = match plan.model {
            Model::Tree => ModelTargets::Tree(TreeTargets::new(gpu, resources, &mean)?),
            Model::Path => ModelTargets::Path(PathTargets::new(gpu, resources, &mean)?),
            Model::Double => ModelTargets::Double(Box::new(DoubleTargets::new(gpu, resources, &radiance, &mean)?)),
            Model::Single => ModelTargets::Raster,
        };
        Ok(Self {
            accumulation: BindGroup::new(gpu, "accumulation", accumulation)?,
            display: BindGroup::new(gpu, "display", vec![Bind::Sampled(mean.clone())])?,
            model,
            radiance,
            mean,
            depth,
        })
    }

    /// Everything that rounds move, of models that can be interrupted.
    fn state(&self) -> Vec<&Image> {
        match &self.model {
            ModelTargets::Path(path) => path.state(&self.mean).to_vec(),
            ModelTargets::Tree(_) | ModelTargets::Double(_) | ModelTargets::Raster => Vec::new(),
        }
    }

    /// What the model counted; `mean` are the bytes of that image.
    fn counts(&self, commands: &mut Commands, mean: &[u8], samples: u32) -> Result<Option<Counts>> {
        Ok(match &self.model {
            ModelTargets::Raster => None,
            ModelTargets::Double(double) => Some(Counts::of_samples(mean, &commands.read_image(&double.spread)?)),
            ModelTargets::Tree(tree) => Some(Counts::of_trees(mean, &commands.read_image(&tree.counts)?, samples)),
            ModelTargets::Path(path) => {
                let counts = commands.read_image(&path.counts)?;
                Some(Counts::of_paths(&counts, &commands.read_image(&path.spread)?, samples))
            }
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

/// Rounds after which errors are estimated for the first time, and how many times as many make up the next.
const FIRST_ESTIMATE: u32 = 32;
const NEXT_ESTIMATE: f64 = 1.2;

/// Samples that `path` takes at least before it looks whether a tolerance is kept.
pub const FEWEST_OF_TOLERANCE: u32 = FIRST_ESTIMATE * OPEN_BATCH;

/// Whether the error of the picture is as small as was asked for, in models that estimate it.
fn is_precise(commands: &mut Commands, targets: &Targets, plan: &Plan, rounds: u32) -> Result<bool> {
    let spread = match &targets.model {
        ModelTargets::Path(path) => &path.spread,
        ModelTargets::Double(double) => &double.spread,
        ModelTargets::Raster | ModelTargets::Tree(_) => return Ok(false),
    };
    // Rounds grow by a constant factor between estimates: those cost little then.
    let step = |rounds: u32| (f64::from(rounds) / f64::from(FIRST_ESTIMATE)).log(NEXT_ESTIMATE).floor();
    if plan.tolerance == f64::INFINITY || rounds < FIRST_ESTIMATE || step(rounds) == step(rounds - 1) {
        return Ok(false);
    }
    let (mean, spread) = (commands.read_image(&targets.mean)?, commands.read_image(spread)?);
    Ok(counts::is_within_of(&mean, &spread, plan.tolerance))
}

/// Whether another round like those before would end after the time.
fn is_spent(budget: Budget, set_up: Duration, elapsed: Duration, rounds: u32) -> bool {
    match budget {
        Budget::Samples(_) => false,
        Budget::Seconds { seconds, .. } => {
            let sampling = elapsed.saturating_sub(set_up);
            (elapsed + sampling / rounds).as_secs_f64() > seconds
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
