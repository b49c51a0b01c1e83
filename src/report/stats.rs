//! The stats of a render, as JSON. What does not apply is null.

use std::time::Duration;

use serde::Serialize;

use crate::choice::{Candidate, Choice};
use crate::gpu::{DeviceInfo, PassTime};
use crate::options::Trace;
use crate::passes::{self, MOST_PIXELS, Rendered};
use crate::plan::Plan;
use crate::scene::Scene;

/// Schema 1 of `--stats`.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/stats.md describes the members")]
pub struct Stats {
    pub schema: u32,
    pub vitrum: &'static str,
    pub device: DeviceStats,
    pub scene: String,
    pub model: &'static str,
    pub size: [u32; 2],
    pub samples: u32,
    pub max_depth: Option<u32>,
    pub seed: u64,
    pub effects: Vec<&'static str>,
    pub unsupported: Vec<&'static str>,
    pub approximate: Vec<&'static str>,
    pub unseen: Vec<&'static str>,
    pub trace: &'static str,
    pub passes: Vec<PassStats>,
    pub gpu_ms: Option<f64>,
    pub build_ms: BuildTimes,
    pub wall_ms: f64,
    pub rays: Option<u64>,
    pub peak_gpu_bytes: u64,
    pub discarded: Option<DiscardedStats>,
    pub stderr: Option<StderrStats>,
    pub non_finite_pixels: usize,
    pub validation_messages: Option<usize>,
    pub auto: Option<AutoStats>,
}

/// What `--model auto` expected, and what came of it.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/auto.md describes the members")]
pub struct AutoStats {
    pub tolerance: Option<f64>,
    pub time_budget: Option<f64>,
    pub options: String,
    pub expected: Option<Outcome>,
    pub found: Outcome,
    pub others: Vec<CandidateRow>,
    pub pilots_ms: f64,
}

/// What a render takes, and the error that 95 % of its pixels keep.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/auto.md describes the members")]
pub struct Outcome {
    pub samples: Option<u32>,
    pub gpu_ms: Option<f64>,
    pub error: Option<f64>,
}

/// What else could have been done.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/auto.md describes the members")]
pub struct CandidateRow {
    pub options: String,
    #[serde(flatten)]
    pub expected: Outcome,
}

impl CandidateRow {
    /// That of one candidate.
    pub fn new(candidate: &Candidate) -> Self {
        Self { options: candidate.options(), expected: Outcome::expected(candidate) }
    }
}

impl Outcome {
    fn expected(candidate: &Candidate) -> Self {
        let known = |value: f64| value.is_finite().then_some(value);
        let (gpu_ms, error) = (known(candidate.ms), known(candidate.error));
        Self { samples: gpu_ms.map(|_| candidate.samples), gpu_ms, error }
    }

    /// The error where the samples of a model tell it, and it has no other.
    fn found(plan: &Plan, rendered: &Rendered) -> Self {
        let stderr = rendered.counts.as_ref().and_then(|counts| counts.stderr.as_deref());
        let stderr = stderr.filter(|_| plan.lacks() == 0);
        let error = stderr.map(|stderr| passes::error_of(MOST_PIXELS, &rendered.radiance, stderr));
        Self {
            samples: Some(rendered.samples),
            gpu_ms: rendered.gpu_ms(),
            error: error.filter(|error| error.is_finite()),
        }
    }
}

impl AutoStats {
    fn new(choice: &Choice, plan: &Plan, rendered: &Rendered) -> Self {
        Self {
            tolerance: choice.goal.tolerance,
            time_budget: choice.goal.seconds,
            options: choice.best.options(),
            expected: choice.unmeasured.is_none().then(|| Outcome::expected(&choice.best)),
            found: Outcome::found(plan, rendered),
            others: choice.others.iter().map(CandidateRow::new).collect(),
            pilots_ms: ms(choice.taken),
        }
    }
}

/// Which device it was.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/stats.md describes the members")]
pub struct DeviceStats {
    pub name: String,
    pub driver: String,
    pub api: String,
    #[serde(rename = "type")]
    pub kind: String,
}

impl DeviceStats {
    /// Those of `device`.
    pub fn new(device: &DeviceInfo) -> Self {
        Self {
            name: device.name.clone(),
            driver: device.driver.clone(),
            api: device.api.clone(),
            kind: device.kind.to_string(),
        }
    }
}

/// A pass, over all samples.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/stats.md describes the members")]
pub struct PassStats {
    pub name: &'static str,
    pub gpu_ms: Option<f64>,
}

/// Throughput that was cut off: of the worst pixel, and of the mean one.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/stats.md describes the members")]
pub struct DiscardedStats {
    pub max: f32,
    pub mean: f64,
}

impl DiscardedStats {
    pub(crate) fn new(discarded: &[f32]) -> Self {
        let sum: f64 = discarded.iter().map(|&x| f64::from(x)).sum();
        Self { max: discarded.iter().copied().fold(0.0, f32::max), mean: sum / discarded.len() as f64 }
    }
}

/// Standard error of the means, of all pixels and channels.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/stats.md describes the members")]
pub struct StderrStats {
    pub mean: f64,
}

impl StderrStats {
    /// None where samples are too few to tell.
    fn new(stderr: &[[f32; 3]]) -> Option<Self> {
        let sum: f64 = stderr.iter().flatten().map(|&x| f64::from(x)).sum();
        let mean = sum / (3 * stderr.len()) as f64;
        mean.is_finite().then_some(Self { mean })
    }
}

/// Host times before the first sample, in milliseconds.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/stats.md describes the members")]
pub struct BuildTimes {
    pub scene: f64,
    pub acceleration: Option<f64>,
    pub pipelines: f64,
}

/// What is only known when a command ends.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Host time until the scene was read.
    pub load: Duration,
    /// Host time of the whole command.
    pub wall: Duration,
    /// Most bytes of device memory in use at one time.
    pub peak_gpu_bytes: u64,
    /// Messages of the validation layer, if it was there.
    pub validation_messages: Option<usize>,
}

impl Stats {
    /// Those of one render.
    pub fn new(
        device: &DeviceInfo,
        scene: &Scene,
        plan: &Plan,
        rendered: &Rendered,
        choice: Option<&Choice>,
        run: Run,
    ) -> Self {
        let passes: Vec<_> =
            rendered.passes.iter().map(|&PassTime { name, gpu_ms }| PassStats { name, gpu_ms }).collect();
        let counts = rendered.counts.as_ref();
        let finite = |pixel: &&[f32; 3]| pixel.iter().all(|value| value.is_finite());
        Self {
            schema: 1,
            vitrum: env!("CARGO_PKG_VERSION"),
            device: DeviceStats::new(device),
            scene: scene.name.clone(),
            model: plan.model.name(),
            size: [plan.size.width, plan.size.height],
            samples: rendered.samples,
            max_depth: plan.max_depth,
            seed: plan.seed,
            effects: plan.effects.names(),
            unsupported: plan.unsupported.names(),
            approximate: plan.approximate.names(),
            unseen: plan.unseen.clone(),
            trace: rendered.trace.map_or("none", Trace::name),
            gpu_ms: rendered.gpu_ms(),
            passes,
            build_ms: BuildTimes {
                scene: ms(run.load + rendered.upload),
                acceleration: rendered.acceleration.map(ms),
                pipelines: ms(rendered.pipelines),
            },
            wall_ms: ms(run.wall),
            rays: counts.and_then(|counts| counts.rays),
            peak_gpu_bytes: run.peak_gpu_bytes,
            discarded: counts.and_then(|counts| counts.discarded.as_deref()).map(DiscardedStats::new),
            stderr: counts.and_then(|counts| counts.stderr.as_deref()).and_then(StderrStats::new),
            non_finite_pixels: rendered.radiance.len() - rendered.radiance.iter().filter(finite).count(),
            validation_messages: run.validation_messages,
            auto: choice.map(|choice| AutoStats::new(choice, plan, rendered)),
        }
    }

    /// One object, readable and ended by a newline.
    pub fn json(&self) -> String {
        // Plain numbers, strings and lists: nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
