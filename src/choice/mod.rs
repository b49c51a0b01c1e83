//! `--model auto`: the model and settings that keep a tolerance at the least cost, or that are best within a time.
//!
//! In flow a scene and a device, out flows what to ask of a render, and what to expect of it. Small pictures of each model, the pilots,
//! tell how long a sample takes and how the error falls with their number. The error of a picture is the |x - r| / (r + 0.1) that 95 %
//! of the pixels keep, each channel for itself.
//!
//! A model that simulates all that is wanted errs by its samples and by what it cuts off: pilots of different seeds, and of finer
//! cut-offs, tell. What the other models make of the scene is held against `path`, the noise of which counts as their error: where it
//! is larger than the tolerance, they are not chosen.

mod law;
mod pilots;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::Result;
use crate::gpu::Gpu;
use crate::options::{MOST_SAMPLES, Model, RenderArgs};
use crate::passes;
use crate::scene::Scene;
use law::Law;
use pilots::{MORE, Pilots};
pub use pilots::{error_of_most, pilot_size};

/// What is tolerated where nothing is said: few see it.
pub const TOLERANCE: f64 = 0.05;

/// Budgets below this leave no time for pilots.
const SHORT: f64 = 5.0;

/// What is asked of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// The error that 95 % of the pixels should keep.
    pub tolerance: Option<f64>,
    /// Seconds that it may take.
    pub seconds: Option<f64>,
}

/// A model with settings, and what is expected of it.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// What to ask of a render.
    pub args: RenderArgs,
    /// What that amounts to.
    pub model: Model,
    /// Samples per pixel.
    pub samples: u32,
    /// Milliseconds of all samples: of the device, or where that has no clock of the host.
    pub ms: f64,
    /// The error that 95 % of the pixels are expected to keep.
    pub error: f64,
    /// How much the model leaves out or approximates.
    pub lacks: usize,
}

impl Candidate {
    /// The options that belong to the model, as text.
    pub fn options(&self) -> String {
        let RenderArgs { model, samples, max_depth, tolerance, time_budget, .. } = self.args;
        RenderArgs { model, samples, max_depth, tolerance, time_budget, ..RenderArgs::default() }.to_string()
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Choice {
    /// What was asked for.
    pub goal: Goal,
    /// What is chosen.
    pub best: Candidate,
    /// What else could be done, the better ones first.
    pub others: Vec<Candidate>,
    /// Whether the best keeps what was asked for, as far as is known.
    pub is_expected: bool,
    /// Why nothing was measured, if so: errors and times are not known then, and not finite.
    pub unmeasured: Option<&'static str>,
    /// The time that it took to find out.
    pub taken: Duration,
}

/// Finds what to ask of a render of `scene` with `args`, whose model is to be chosen. The camera is framed already.
pub fn choose(gpu: &Gpu, scene: &Scene, args: &RenderArgs) -> Result<Choice> {
    let start = Instant::now();
    let goal = Goal {
        tolerance: args.tolerance.or(args.time_budget.is_none().then_some(TOLERANCE)),
        seconds: args.time_budget,
    };
    let mut pilots = Pilots::new(gpu, scene, args, goal);
    if goal.seconds.is_none_or(|seconds| seconds >= SHORT) {
        pilots.all()?;
    }
    let taken = start.elapsed();
    let (mut candidates, is_expected) = ranked(&pilots.laws, args, goal, taken);
    if candidates.is_empty() {
        let unmeasured = Some(if goal.seconds.is_some() { NO_TIME } else { NO_TRUTH });
        return Ok(Choice {
            goal,
            best: pilots.unmeasured()?,
            others: candidates,
            is_expected: false,
            unmeasured,
            taken,
        });
    }
    let best = candidates.remove(0);
    Ok(Choice { goal, best, others: candidates, is_expected, unmeasured: None, taken })
}

/// What every model takes and how it errs, measured once: what is best for any goal follows.
#[derive(Clone, Debug)]
pub struct Measurements {
    args: RenderArgs,
    laws: Vec<(RenderArgs, Model, Law)>,
}

impl Measurements {
    /// Of renders of `scene` with `args`, whose model counts for nothing and whose camera is framed already. It ends with
    /// [`GpuError::Interrupted`](crate::gpu::GpuError::Interrupted) where `interrupt` is set.
    pub fn new(gpu: &Gpu, scene: &Scene, args: &RenderArgs, interrupt: Arc<AtomicBool>) -> Result<Self> {
        let args = RenderArgs { tolerance: None, time_budget: None, samples: None, model: None, ..args.clone() };
        let mut pilots = Pilots::new(gpu, scene, &args, Goal { tolerance: None, seconds: None });
        pilots.interrupt = Some(interrupt);
        pilots.all()?;
        let laws = pilots.laws;
        Ok(Self { args, laws })
    }

    /// What each model has to offer for a goal, the best first. All have their samples given.
    pub fn ranked(&self, goal: Goal) -> Vec<Candidate> {
        let (mut all, _) = ranked(&self.laws, &self.args, goal, Duration::ZERO);
        for one in &mut all {
            one.args.samples = Some(one.samples);
            one.args.tolerance = match one.model {
                Model::Path => None,
                _ => one.args.tolerance,
            };
        }
        all
    }

    /// Milliseconds and errors of each model with 1, 2, 4, ... samples, as far as `most_ms`; where it has several settings, their depths
    /// tell them apart.
    pub fn curves(&self, most_ms: f64) -> Vec<(Model, Option<u32>, Vec<[f64; 2]>)> {
        let several = |model: Model| self.laws.iter().filter(|(_, other, _)| *other == model).count() > 1;
        let curve = |(args, model, law): &(RenderArgs, Model, Law)| {
            let samples = (0..20).map(|power| 1_u32 << power);
            let points = samples.map(|samples| [law.ms * f64::from(samples), law.error(samples)]);
            let depth = args.max_depth.filter(|_| several(*model));
            (*model, depth, points.take_while(|&[ms, error]| ms <= most_ms && error > 0.0).collect())
        };
        self.laws.iter().map(curve).collect()
    }
}

/// Why nothing was measured.
const NO_TIME: &str = "there is no time to try";
const NO_TRUTH: &str = "nothing tells how far off a model is";

/// What each law comes to for what is asked, the best first, and whether that keeps it.
fn ranked(laws: &[(RenderArgs, Model, Law)], args: &RenderArgs, goal: Goal, taken: Duration) -> (Vec<Candidate>, bool) {
    let most = args.samples.unwrap_or(MOST_SAMPLES);
    let left_ms = goal.seconds.map_or(f64::INFINITY, |seconds| (seconds - taken.as_secs_f64()).max(0.0) * 1e3);
    let candidate = |(options, model, law): &(RenderArgs, Model, Law)| {
        let affordable = (left_ms / law.ms).floor().clamp(1.0, f64::from(most)) as u32;
        let needed = goal.tolerance.and_then(|tolerance| law.samples(tolerance));
        // Where nothing is enough, as many as there may be of what comes closer with each, a few of what does not.
        let closer = left_ms.is_finite() || goal.tolerance.is_some_and(|tolerance| law.floor < tolerance);
        let mut samples = needed.unwrap_or(if closer { most } else { most.min(MORE) }).min(affordable);
        if *model == Model::Path && args.samples.is_none() {
            // It takes whole batches, and so many before it looks at a tolerance.
            let least = if goal.tolerance.is_some() { passes::FEWEST_OF_TOLERANCE } else { passes::OPEN_BATCH };
            let most = (affordable / passes::OPEN_BATCH * passes::OPEN_BATCH).max(passes::OPEN_BATCH);
            samples = samples.next_multiple_of(passes::OPEN_BATCH).max(least).min(most);
        }
        // With a time budget as many as fit, and `path` stops by its own tolerance.
        let open = *model == Model::Path || needed.is_none() && goal.seconds.is_some();
        let args = RenderArgs { samples: if open { args.samples } else { Some(samples) }, ..options.clone() };
        let (ms, error) = (law.ms * f64::from(samples), law.error(samples));
        Candidate { args, model: *model, samples, ms, error, lacks: law.lacks }
    };
    let mut all: Vec<_> =
        laws.iter().map(candidate).filter(|one| one.error.is_finite() && one.ms.is_finite()).collect();
    let keeps = |one: &Candidate| {
        let close = goal.tolerance.is_none_or(|tolerance| one.error <= tolerance * (1.0 + 1e-9));
        close && one.ms <= left_ms
    };
    // Those that keep it by their time, then the others by their error; without a tolerance all by their error.
    all.sort_by(|a, b| {
        let both = goal.tolerance.is_some() && keeps(a) && keeps(b);
        let by_error = a.error.total_cmp(&b.error).then(a.lacks.cmp(&b.lacks)).then(a.ms.total_cmp(&b.ms));
        keeps(b).cmp(&keeps(a)).then(if both { a.ms.total_cmp(&b.ms) } else { by_error })
    });
    let is_expected = all.first().is_some_and(keeps);
    (all, is_expected)
}
