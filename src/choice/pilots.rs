//! The pilots: small pictures of each model, and what they tell. In flow a scene and a device, out flows a [`Law`] of each model that was
//! tried.

use std::f64::consts::SQRT_2;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::law::{FEW, Law, Spread};
use super::{Candidate, Goal};
use crate::Result;
use crate::cost::mean;
use crate::gpu::{DeviceKind, Gpu};
use crate::options::{Model, RenderArgs, Size};
use crate::passes::{self, MOST_PIXELS, Rendered, Renderer};
use crate::plan::{DEPTH_OF_TOLERANCE, Plan};
use crate::scene::Scene;

/// Pixels of a pilot, at most, on devices that are only busy with many, and at least.
const PIXELS: f64 = 64.0 * 48.0;
const PIXELS_OF_GPUS: f64 = 256.0 * 192.0;
const FEWEST_PIXELS: f64 = 16.0 * 12.0;

/// Samples of the pilots; many those of `path` where more are quick.
pub const MORE: u32 = 16;
const MANY: u32 = 64;
const STEP: u32 = MORE / FEW;
const QUICK: Duration = Duration::from_millis(250);

/// Cut-offs and depths of `tree`, from the default on. Each is several times finer than the one before, so that what is left to that
/// one shows: a tolerance is four times the cut-off.
const RUNGS: [(Option<f64>, u32); 4] =
    [(None, 32), (Some(4e-3), 128), (Some(4e-4), 512), (Some(4e-5), DEPTH_OF_TOLERANCE)];

/// The power of the number of samples that errors fall with at most. That of edges under evenly spread points is 0.75, and footprints
/// shrink with 0.5; with 0.75 a hollow ball had 93.9 % of its pixels within a tolerance of 0.01 (`benches/estimates.rs`).
const EDGES: f64 = 0.65;

/// How many times the samples of a pilot a tolerance may take; beyond, another pilot is worth its time.
const NEAR: f64 = 16.0;

/// How much larger than the pilots say the error of samples may be: they are few pixels. `path` looks for itself, and is held to a
/// little more than the tolerance says.
const MARGIN: f64 = 1.6;
const MARGIN_OF_PATH: f64 = 1.1;

/// The share of the error that may be what is cut off, and of the pixels that are to keep it: where as many as may miss the tolerance
/// lost as much, samples had to be right in all others. (A hollow ball had 95.0 % within 0.01, the built-in scene 94.3 %.)
const CUT_SHARE: f64 = 1.0 / 3.0;
const NEARLY_ALL: f64 = 0.99;

/// The share of a time budget that pilots may take, and the longest one of `tree` that is followed by a finer one.
const PILOT_SHARE: f64 = 0.2;
const LONG: Duration = Duration::from_secs(1);

/// Small pictures, and what they tell.
pub struct Pilots<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    /// The options of the render but for the model, and what belongs to one.
    args: &'a RenderArgs,
    goal: Goal,
    start: Instant,
    size: Size,
    /// How many times the pixels of a pilot the whole picture has.
    pixels: f64,
    /// What was found.
    pub laws: Vec<(RenderArgs, Model, Law)>,
    /// The mean of what `path` saw, if it sees all there is.
    truth: Option<Vec<[f32; 3]>>,
    /// Set to end it.
    pub interrupt: Option<Arc<AtomicBool>>,
}

impl<'a> Pilots<'a> {
    /// None yet, of renders of `scene` with `args`.
    pub fn new(gpu: &'a Gpu, scene: &'a Scene, args: &'a RenderArgs, goal: Goal) -> Self {
        let size = args.size.unwrap_or(Plan::SIZE);
        let small = pilot_size(gpu, size);
        let pixels = size.pixels() / small.pixels();
        let (start, laws, truth, interrupt) = (Instant::now(), Vec::new(), None, None);
        Self { gpu, scene, args, goal, start, size: small, pixels, laws, truth, interrupt }
    }

    /// Of every model, as far as there is time.
    pub fn all(&mut self) -> Result<()> {
        // Where `tree` needs no truth to be held against, it is the likelier choice.
        if self.is_tree_exact() {
            self.tree()?;
            self.path()?;
        } else {
            self.path()?;
            self.tree()?;
        }
        self.raster(Model::Double)?;
        self.raster(Model::Single)
    }

    fn renderer(&self, plan: &Plan) -> Result<Renderer> {
        let mut renderer = Renderer::new(self.gpu, self.scene, plan)?;
        if let Some(interrupt) = &self.interrupt {
            renderer.interrupt_by(interrupt.clone());
            // Whoever interrupts waits for what is under way.
            renderer.set_patience(Duration::from_millis(25));
        }
        Ok(renderer)
    }

    /// `args` for one model; `None` where it refuses them.
    fn options(&self, model: Model, tolerance: Option<f64>, depth: Option<u32>) -> Option<RenderArgs> {
        let args = RenderArgs {
            model: Some(model.into()),
            tolerance,
            max_depth: self.args.max_depth.or(depth),
            ..self.args.clone()
        };
        Plan::new(self.scene, &args).is_ok().then_some(args)
    }

    /// The plan of a pilot of a render with `args`.
    fn plan(&self, args: &RenderArgs, samples: u32, seed: u64) -> Result<Plan> {
        let small = RenderArgs {
            size: Some(self.size),
            samples: Some(samples),
            seed: Some(self.args.seed.unwrap_or(0) ^ seed),
            time_budget: None,
            checkpoint: None,
            aov: None,
            ..args.clone()
        };
        // Of `path` a tolerance would end the pilot.
        let tolerance = small.tolerance.filter(|_| small.model == Some(Model::Tree.into()));
        Plan::new(self.scene, &RenderArgs { tolerance, ..small })
    }

    /// Whether there is time for another that takes so long.
    fn fits(&self, time: Duration) -> bool {
        self.goal.seconds.is_none_or(|seconds| (self.start.elapsed() + time).as_secs_f64() < PILOT_SHARE * seconds)
    }

    /// Milliseconds of a sample of the whole picture.
    fn ms(&self, rendered: &Rendered, host: Duration) -> f64 {
        rendered.gpu_ms().unwrap_or(host.as_secs_f64() * 1e3) * self.pixels / f64::from(rendered.samples)
    }

    fn is_tree_exact(&self) -> bool {
        let plan = self.options(Model::Tree, None, None).map(|args| Plan::new(self.scene, &args));
        plan.is_some_and(|plan| plan.is_ok_and(|plan| plan.lacks() == 0))
    }

    /// What to do without pilots: the first model that simulates all that is wanted, else the one that leaves out least.
    pub fn unmeasured(&self) -> Result<Candidate> {
        let options = |model| self.options(model, None, None);
        let plans = [Model::Tree, Model::Path, Model::Double, Model::Single].into_iter().filter_map(options);
        let plans: Vec<_> =
            plans.filter_map(|args| Plan::new(self.scene, &args).ok().map(|plan| (args, plan))).collect();
        let best = plans.into_iter().min_by_key(|(_, plan)| plan.lacks());
        // `path` takes all options, unless they are wrong for every model.
        let (args, plan) = match best {
            Some(best) => best,
            None => {
                let args = RenderArgs { model: Some(Model::Path.into()), ..self.args.clone() };
                let plan = Plan::new(self.scene, &args)?;
                (args, plan)
            }
        };
        let samples = self.args.samples.unwrap_or(MORE);
        Ok(Candidate { args, model: plan.model, samples, ms: f64::NAN, error: f64::NAN, lacks: plan.lacks() })
    }

    /// Two pictures of `path`: they tell its own error, and the truth for others.
    fn path(&mut self) -> Result<()> {
        if !self.fits(Duration::ZERO) {
            return Ok(());
        }
        let taken = self.options(Model::Path, self.goal.tolerance, Some(DEPTH_OF_TOLERANCE));
        // What it is not to write has no part in what is true.
        let args = taken.clone().unwrap_or(RenderArgs {
            model: Some(Model::Path.into()),
            tolerance: self.goal.tolerance,
            max_depth: self.args.max_depth.or(Some(DEPTH_OF_TOLERANCE)),
            aov: None,
            ..self.args.clone()
        });
        let plan = self.plan(&args, FEW, 0x5eed_0001)?;
        if !plan.unseen.is_empty() {
            return Ok(());
        }
        let mut renderer = self.renderer(&plan)?;
        let mut picture = |samples, seed| -> Result<(Rendered, Duration)> {
            let plan = self.plan(&args, samples, seed)?;
            renderer.set_limits(&plan)?;
            let start = Instant::now();
            Ok((renderer.render(&plan, &mut |_| {})?, start.elapsed()))
        };
        let (mut first, time) = picture(FEW, 0x5eed_0001)?;
        let of = |samples: u32| time * (samples / FEW);
        let samples = match () {
            () if of(MANY) < QUICK => MANY,
            () if self.fits(2 * of(MORE)) => MORE,
            () => FEW,
        };
        if samples > FEW {
            (first, _) = picture(samples, 0x5eed_0001)?;
        }
        let (second, time) = picture(samples, 0x5eed_0002)?;
        let ms = self.ms(&second, time);
        let truth = mean(&first.radiance, &second.radiance);
        // The difference of two has twice the variance of one.
        let error = most(differences(&first.radiance, &second.radiance)) / SQRT_2;
        if let Some(args) = taken {
            let law = Spread { error, samples, power: 0.5 }.law(0.0, MARGIN_OF_PATH, ms, 0);
            self.laws.push((args, Model::Path, law));
        }
        self.truth = Some(truth);
        Ok(())
    }

    /// Pictures of `tree`: with other seeds, and followed further and further.
    fn tree(&mut self) -> Result<()> {
        if !self.fits(Duration::ZERO) {
            return Ok(());
        }
        let rung = |&(tolerance, depth): &(Option<f64>, u32)| self.options(Model::Tree, tolerance, Some(depth));
        let rungs: Vec<_> = RUNGS.iter().filter_map(rung).collect();
        let Some(args) = rungs.first() else { return Ok(()) };
        let plan = self.plan(args, FEW, 0)?;
        let mut renderer = self.renderer(&plan)?;
        if plan.lacks() > 0 {
            return self.inexact(renderer, args.clone());
        }
        let spread = self.spread(&mut renderer, args, self.goal.tolerance)?;
        let mut found: Vec<(RenderArgs, Vec<[f32; 3]>, f64)> = Vec::new();
        for args in rungs {
            let plan = self.plan(&args, FEW, 0)?;
            renderer.set_limits(&plan)?;
            let start = Instant::now();
            let rendered = renderer.render(&plan, &mut |_| {})?;
            let host = start.elapsed();
            let ms = self.ms(&rendered, host);
            let floor = found.last().map(|(_, coarse, _)| share(NEARLY_ALL, errors(coarse, &rendered.radiance)));
            found.push((args, rendered.radiance, ms));
            let is_enough = floor.is_some_and(|floor| floor <= CUT_SHARE * self.goal.tolerance.unwrap_or(1e-3));
            if is_enough || host > LONG || !self.fits(Duration::ZERO) {
                break;
            }
        }
        // The last one tells what the others miss, and nothing what it misses.
        let Some((_, finest, _)) = found.pop() else { return Ok(()) };
        for (args, picture, ms) in found {
            let floor = share(NEARLY_ALL, errors(&picture, &finest));
            self.laws.push((args, Model::Tree, spread.law(floor, MARGIN, ms, 0)));
        }
        Ok(())
    }

    /// A rasterised model.
    fn raster(&mut self, model: Model) -> Result<()> {
        match self.options(model, None, None) {
            Some(args) if self.fits(Duration::ZERO) && self.truth.is_some() => {
                let renderer = self.renderer(&self.plan(&args, MORE, 0)?)?;
                self.inexact(renderer, args)
            }
            _ => Ok(()),
        }
    }

    /// A model that is known to be wrong: the truth tells by how much.
    fn inexact(&mut self, mut renderer: Renderer, args: RenderArgs) -> Result<()> {
        let Some(truth) = self.truth.take() else { return Ok(()) };
        let start = Instant::now();
        let spread = self.spread(&mut renderer, &args, None)?;
        let samples = if self.fits(start.elapsed() * 2) { MORE } else { FEW };
        let plan = self.plan(&args, samples, 0)?;
        renderer.set_limits(&plan)?;
        let start = Instant::now();
        let rendered = renderer.render(&plan, &mut |_| {})?;
        let ms = self.ms(&rendered, start.elapsed());
        // What is wrong in few pixels, as where a small object is missing, must not go unseen.
        let squares: f64 = errors(&rendered.radiance, &truth).map(|error| error * error).sum();
        let root = (squares / (3 * truth.len()) as f64).sqrt();
        let floor = most(errors(&rendered.radiance, &truth)).max(root);
        let ms = if plan.model.traces() { ms } else { self.raster_ms(&args)? };
        let law = spread.law(floor, MARGIN, ms, plan.lacks());
        self.laws.push((args, plan.model, law));
        self.truth = Some(truth);
        Ok(())
    }

    /// Milliseconds of a sample of the whole picture, of a model that is quick and whose time is not that of its pixels.
    fn raster_ms(&self, args: &RenderArgs) -> Result<f64> {
        let samples = Some(1);
        let whole = RenderArgs { samples, time_budget: None, tolerance: None, aov: None, ..args.clone() };
        let plan = Plan::new(self.scene, &whole)?;
        let mut renderer = self.renderer(&plan)?;
        let start = Instant::now();
        let rendered = renderer.render(&plan, &mut |_| {})?;
        Ok(rendered.gpu_ms().unwrap_or(start.elapsed().as_secs_f64() * 1e3))
    }

    /// How pictures of two seeds differ: of few samples, of more where there is time, and of a share of those that a tolerance takes.
    fn spread(&self, renderer: &mut Renderer, args: &RenderArgs, tolerance: Option<f64>) -> Result<Spread> {
        let mut error_of = |samples| -> Result<f64> {
            let mut picture = |seed| -> Result<Vec<[f32; 3]>> {
                let plan = self.plan(args, samples, seed)?;
                renderer.set_limits(&plan)?;
                Ok(renderer.render(&plan, &mut |_| {})?.radiance)
            };
            let (first, second) = (picture(0x5eed_0003)?, picture(0x5eed_0004)?);
            Ok(most(differences(&first, &second)) / SQRT_2)
        };
        let start = Instant::now();
        let mut spread = Spread { error: error_of(FEW)?, samples: FEW, power: 0.5 };
        let mut time = start.elapsed();
        loop {
            let is_near = spread.samples > FEW
                && tolerance.is_none_or(|tolerance| {
                    let needed = spread.law(0.0, MARGIN, 0.0, 0).samples(tolerance);
                    needed.is_none_or(|needed| f64::from(needed) <= NEAR * f64::from(spread.samples))
                });
            if is_near || spread.error <= 0.0 || !self.fits(time * STEP) {
                return Ok(spread);
            }
            let start = Instant::now();
            let samples = STEP * spread.samples;
            let error = error_of(samples)?;
            if error <= 0.0 {
                return Ok(spread);
            }
            time = start.elapsed();
            let power = (spread.error / error).ln() / f64::from(STEP).ln();
            spread = Spread { error, samples, power: power.clamp(0.5, EDGES) };
        }
    }
}

/// The size of small pictures that tell of one of `size`.
pub fn pilot_size(gpu: &Gpu, size: Size) -> Size {
    // Pixels of a picture as small are as wide, and err as much; of fewer, few tell little.
    let most = if gpu.info().kind == DeviceKind::Cpu { PIXELS } else { PIXELS_OF_GPUS };
    let scale = (size.pixels().clamp(FEWEST_PIXELS, most) / size.pixels()).sqrt();
    let side = |side: u32| (f64::from(side) * scale).round().clamp(1.0, f64::from(gpu.max_image_side())) as u32;
    Size { width: side(size.width), height: side(size.height) }
}

/// The error that all but the worst pixels of `picture` are within, where `truth` is right.
pub fn error_of_most(picture: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    most(errors(picture, truth))
}

/// What all but the worst are within.
fn most(errors: impl Iterator<Item = f64>) -> f64 {
    share(MOST_PIXELS, errors)
}

/// What a share of them is within.
fn share(share: f64, errors: impl Iterator<Item = f64>) -> f64 {
    let mut errors: Vec<_> = errors.collect();
    errors.sort_by(f64::total_cmp);
    let place = (errors.len() as f64 * share).ceil() as usize;
    errors.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

/// The errors of `picture`, of each channel, where `truth` is right.
fn errors(picture: &[[f32; 3]], truth: &[[f32; 3]]) -> impl Iterator<Item = f64> {
    pairs(picture, truth).map(|(x, r)| (x - r).abs() / (r.abs() + passes::DARK))
}

/// How far apart pictures are that are as right as each other.
fn differences(a: &[[f32; 3]], b: &[[f32; 3]]) -> impl Iterator<Item = f64> {
    pairs(a, b).map(|(a, b)| (a - b).abs() / (0.5 * (a + b).abs() + passes::DARK))
}

fn pairs(a: &[[f32; 3]], b: &[[f32; 3]]) -> impl Iterator<Item = (f64, f64)> {
    a.iter().flatten().zip(b.iter().flatten()).map(|(&a, &b)| (f64::from(a), f64::from(b)))
}
