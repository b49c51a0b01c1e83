//! What accuracy costs in time: models and settings against a reference, effects against their absence. In flow a scene
//! and a device, out flow errors and times.
//!
//! The reference is the mean of two independent pictures of `path`. The square of an error is told by the product of the
//! differences from one and from the other: their noise, independent and of mean 0, drops out.

mod error;
mod settings;

use std::path::PathBuf;
use std::time::{Duration, Instant};

pub use error::Estimate;
pub(crate) use error::mean;
pub use settings::{Setting, settings};

use xxhash_rust::xxh3::xxh3_64;

use crate::compare::flip;
use crate::effects::{Effect, Effects};
use crate::gpu::Gpu;
use crate::options::{Model, RenderArgs, Size};
use crate::passes::{self, Rendered};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::{Error, Result};

/// Errors that are looked for among the settings.
pub const TARGETS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// The mean of standard error / (value + 0.1) of each half of the reference below which it is good enough.
const REFERENCE_TOLERANCE: f64 = 5e-3;

/// Runs of a setting, of which the median is told, while they take less than this in all.
const MOST_RUNS: usize = 3;
const LONG: Duration = Duration::from_secs(3);

/// A setting that is expected to take longer is left out.
const TOO_LONG_MS: f64 = 20e3;

/// How much smaller, in each direction, the picture is that tells how long a setting takes.
const PROBE: u32 = 4;

/// The longest chain of interfaces of the reference, where the user has no wish: what is trapped for longer is faint.
pub const REFERENCE_DEPTH: u32 = 1024;

/// Seeds of the halves of the reference, beside that of the pictures.
const REFERENCE_SEEDS: [u64; 2] = [0x5eed_0001, 0x5eed_0002];

/// What two independent pictures of `path` say.
pub struct Reference {
    /// The pictures.
    pub halves: [Vec<[f32; 3]>; 2],
    /// Their mean.
    pub mean: Vec<[f32; 3]>,
    /// The first as a screen shows it.
    pub display: Vec<[u8; 4]>,
    /// Samples per pixel, of both together.
    pub samples: u32,
    /// Of these, those that were found in files.
    pub resumed: u32,
    /// relMSE of the mean that is noise.
    pub noise: f64,
    /// Light in the scene that it lacks, in words.
    pub unseen: Vec<&'static str>,
    /// What a user should hear of.
    pub warnings: Vec<String>,
}

/// A setting, measured.
pub struct Measured {
    /// What was asked for.
    pub setting: Setting,
    /// What that amounts to.
    pub plan: Plan,
    /// Milliseconds of each run: on the device, or where that has no clock on the host, without set-up.
    pub times: Vec<f64>,
    /// Milliseconds until the pipelines had run once, the first time: less where the driver knew them already.
    pub pipelines_ms: f64,
    /// relMSE against the reference.
    pub relmse: Estimate,
    /// FLIP against the mean of the reference.
    pub flip: flip::Flip,
    /// The last run.
    pub rendered: Rendered,
    /// Whether nothing else is both faster and closer.
    pub is_best: bool,
}

/// The same frame with an effect and without it.
pub struct EffectCost {
    /// The effect.
    pub effect: Effect,
    /// The model that was asked.
    pub model: Model,
    /// Samples per pixel.
    pub samples: u32,
    /// With it.
    pub with: Share,
    /// Without it, and what needs it.
    pub without: Share,
}

/// Time and error of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// Median of the runs, in milliseconds.
    pub ms: f64,
    /// relMSE against the reference.
    pub relmse: Estimate,
}

/// Everything that is measured of a scene.
pub struct Cost {
    /// What it is held against.
    pub reference: Reference,
    /// Each model and setting.
    pub entries: Vec<Measured>,
    /// Settings that would have taken too long, and how many milliseconds that may have been.
    pub left_out: Vec<(Setting, f64)>,
    /// Each effect that the scene calls for.
    pub effects: Vec<EffectCost>,
    /// The time that all of it took.
    pub taken: Duration,
}

/// How a cost is measured.
pub struct Measurement<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// The scene, its camera framed.
    pub scene: &'a Scene,
    /// Size, seed, effects, tracer; the settings say the rest.
    pub options: RenderArgs,
    /// Where the halves of the reference are kept.
    pub folder: PathBuf,
    /// The longest chain of interfaces of the reference.
    pub depth: u32,
    /// How long each half of the reference may be worked at.
    pub half: Duration,
}

impl Measurement<'_> {
    /// Measures. `progress` hears what comes next, and how much is done, from 0 to 1.
    pub fn run(&self, progress: &mut dyn FnMut(&str, f64)) -> Result<Cost> {
        let start = Instant::now();
        let reference = self.reference(progress)?;
        let settings = settings(self.depth);
        let wanted = self.options.effects.clone().unwrap_or_default().resolve(self.scene);
        let steps = (settings.len() + wanted.iter().count()) as f64;
        let done = |step: usize| 0.4 + 0.6 * step as f64 / steps;
        let mut entries: Vec<Measured> = Vec::new();
        let mut left_out = Vec::new();
        for (step, setting) in settings.iter().enumerate() {
            progress(&setting.label(), done(step));
            let expected = self.expected_ms(setting, &entries)?;
            if expected < TOO_LONG_MS {
                entries.push(self.measure(setting, &reference)?);
            } else {
                left_out.push((setting.clone(), expected));
            }
        }
        mark_best(&mut entries);
        let mut effects = Vec::new();
        for (step, effect) in wanted.iter().enumerate() {
            progress(effect.name(), done(settings.len() + step));
            effects.extend(self.effect(effect, wanted, &reference, &entries)?);
        }
        Ok(Cost { reference, entries, left_out, effects, taken: start.elapsed() })
    }

    /// What `setting` may take, by one that differs in samples alone, or else by a small picture; 0 for models that are always quick.
    fn expected_ms(&self, setting: &Setting, entries: &[Measured]) -> Result<f64> {
        let is_alike = |entry: &&Measured| Setting { samples: setting.samples, ..entry.setting.clone() } == *setting;
        let (ms, samples) = match entries.iter().rev().find(is_alike) {
            Some(entry) => (entry.ms(), entry.setting.samples),
            None if !setting.model.traces() => return Ok(0.0),
            None => {
                let plan = Plan::new(self.scene, &Setting { samples: 1, ..setting.clone() }.on(&self.options))?;
                let small = |side: u32| side.div_ceil(PROBE);
                let size = Size { width: small(plan.size.width), height: small(plan.size.height) };
                let share = size.pixels() / plan.size.pixels();
                let (ms, _) = self.render(&Plan { size, ..plan })?;
                (ms / share, 1)
            }
        };
        Ok(ms * f64::from(setting.samples) / f64::from(samples))
    }

    fn reference(&self, progress: &mut dyn FnMut(&str, f64)) -> Result<Reference> {
        let mut samples = 0;
        let mut resumed = 0;
        let mut unseen = Vec::new();
        let mut warnings = Vec::new();
        let mut display = Vec::new();
        let mut halves = Vec::new();
        for (number, seed) in (0..).zip(REFERENCE_SEEDS) {
            progress("reference", 0.2 * f64::from(number));
            let file = self.folder.join(format!("reference-{:016x}-{}.state", self.hash(), number + 1));
            let args = RenderArgs {
                model: Some(Model::Path.into()),
                seed: Some(self.options.seed.unwrap_or(0) ^ seed),
                max_depth: Some(self.depth),
                tolerance: Some(REFERENCE_TOLERANCE),
                time_budget: Some(self.half.as_secs_f64()),
                checkpoint: Some(file.clone()),
                ..self.options.clone()
            };
            let plan = Plan::new(self.scene, &args)?;
            let half = match passes::render(self.gpu, self.scene, &plan, &mut |_| {}) {
                // What it holds is of a scene, a device or a program that have changed since.
                Err(error @ Error::Input { .. }) if passes::is_checkpoint(&file) => {
                    warnings.push(format!("{}; the reference is made anew", error.in_full()));
                    std::fs::remove_file(&file).map_err(|source| Error::file(&file, "remove", source))?;
                    passes::render(self.gpu, self.scene, &plan, &mut |_| {})?
                }
                result => result?,
            };
            samples += half.samples;
            resumed += half.resumed;
            if display.is_empty() {
                display = half.display;
            }
            warnings.extend(half.warnings);
            unseen = plan.unseen;
            halves.push(half.radiance);
        }
        let [first, second] = [halves.swap_remove(0), halves.swap_remove(0)];
        let mean = error::mean(&first, &second);
        let noise = error::noise(&first, &second, &mean);
        Ok(Reference { halves: [first, second], mean, display, samples, resumed, noise, unseen, warnings })
    }

    /// Tells references of different scenes and options apart, by their names.
    fn hash(&self) -> u64 {
        xxh3_64(format!("{} --max-depth {} {}", self.scene.name, self.depth, self.options).as_bytes())
    }

    fn measure(&self, setting: &Setting, reference: &Reference) -> Result<Measured> {
        let plan = Plan::new(self.scene, &setting.on(&self.options))?;
        let (times, pipelines_ms, rendered) = self.timed(&plan)?;
        let relmse = reference.relmse(&rendered.radiance);
        let width = plan.size.width as usize;
        let flip = flip::hdr(width, &rendered.radiance, &reference.mean);
        Ok(Measured { setting: setting.clone(), plan, times, pipelines_ms, relmse, flip, rendered, is_best: false })
    }

    /// A picture, and the milliseconds of it: of the device, or where that has no clock of the host, without set-up.
    fn render(&self, plan: &Plan) -> Result<(f64, Rendered)> {
        let begun = Instant::now();
        let rendered = passes::render(self.gpu, self.scene, plan, &mut |_| {})?;
        let device = rendered.gpu_ms();
        let host = begun.elapsed().saturating_sub(rendered.upload + rendered.pipelines);
        Ok((device.unwrap_or(host.as_secs_f64() * 1e3), rendered))
    }

    /// Renders until the time of it is known.
    fn timed(&self, plan: &Plan) -> Result<(Vec<f64>, f64, Rendered)> {
        let start = Instant::now();
        let mut times = Vec::new();
        let mut pipelines_ms = None;
        loop {
            let (ms, rendered) = self.render(plan)?;
            times.push(ms);
            let pipelines_ms = *pipelines_ms.get_or_insert(rendered.pipelines.as_secs_f64() * 1e3);
            if times.len() == MOST_RUNS || start.elapsed() > LONG {
                return Ok((times, pipelines_ms, rendered));
            }
        }
    }

    /// What `effect` costs and is worth, in the first model that simulates it as it is and that `entries` have with all that is wanted.
    fn effect(
        &self,
        effect: Effect,
        wanted: Effects,
        reference: &Reference,
        entries: &[Measured],
    ) -> Result<Option<EffectCost>> {
        let exact = |model: Model| effect.honoured_by(model) && !effect.approximated_by(model, self.scene);
        let simulates_all = |model: Model| wanted.iter().all(|e| e.honoured_by(model));
        let candidates = [Model::Tree, Model::Path].into_iter().filter(|&model| simulates_all(model) && exact(model));
        let whole = |model: Model| {
            let setting = Setting::of(model, settings::samples_of_effects(model));
            entries.iter().find(|entry| entry.setting == setting)
        };
        let Some(with) = candidates.filter_map(whole).next() else {
            return Ok(None);
        };
        let names = wanted.names().join(",");
        let effects = Some(format!("{names},-{}", effect.name()).parse().map_err(Error::Usage)?);
        let plan = Plan::new(self.scene, &RenderArgs { effects, ..with.setting.on(&self.options) })?;
        let (times, _, rendered) = self.timed(&plan)?;
        Ok(Some(EffectCost {
            effect,
            model: with.setting.model,
            samples: with.setting.samples,
            with: Share { ms: with.ms(), relmse: with.relmse },
            without: Share { ms: median(&times), relmse: reference.relmse(&rendered.radiance) },
        }))
    }
}

impl Reference {
    /// How far `picture` is from the truth.
    pub fn relmse(&self, picture: &[[f32; 3]]) -> Estimate {
        let [first, second] = &self.halves;
        error::relmse(picture, first, second, &self.mean)
    }
}

impl Measured {
    /// Median time of the runs, in milliseconds.
    pub fn ms(&self) -> f64 {
        median(&self.times)
    }
}

/// Marks what nothing else beats in both time and error; an error counts as its uncertainty at least.
fn mark_best(entries: &mut [Measured]) {
    let points: Vec<_> = entries.iter().map(|entry| (entry.ms(), entry.relmse.at_least())).collect();
    for (entry, is_best) in entries.iter_mut().zip(best(&points)) {
        entry.is_best = is_best;
    }
}

/// Which pairs no other one undercuts; none that is not finite.
fn best(points: &[(f64, f64)]) -> Vec<bool> {
    let is_beaten =
        |&(ms, error): &(f64, f64)| points.iter().any(|&(t, e)| t <= ms && e <= error && (t < ms || e < error));
    points.iter().map(|point| point.0.is_finite() && point.1.is_finite() && !is_beaten(point)).collect()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beaten_or_not_finite_is_not_best() {
        let points = [(1.0, 0.1), (2.0, 0.1), (2.0, 0.05), (3.0, f64::NAN), (f64::NAN, 0.01), (4.0, 0.04), (1.0, 0.1)];
        assert_eq!(best(&points), [true, false, true, false, false, true, true]);
        assert_eq!([median(&[3.0, 1.0]), median(&[3.0, 1.0, 2.0])], [1.0, 2.0]);
    }
}
