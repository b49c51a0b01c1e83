//! `vitrum render`: one image, off screen.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{Talk, devices, print};
use crate::choice::{Choice, choose};
use crate::gpu::{Gpu, Instance, complaint};
use crate::image::{ImageFormat, OutputFile, encode_exr, encode_png};
use crate::options::{MOST_DEPTH, Model, ModelChoice, RenderArgs};
use crate::passes::{self, PIXELS_BY_STDERR, Rendered};
use crate::plan::{Budget, Plan};
use crate::report::{Run, Stats, float_image, metadata};
use crate::scene::{Overrides, Scene};
use crate::{Error, Result};

/// Bodies that a ray can be in at one time: as in `shaders/media.glsl`.
const MOST_BODIES: usize = 8;

/// Options of `vitrum render`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(super) struct RenderCommand {
    /// A .toml scene, a .glb or .gltf, or a bare .obj shown as clear glass; none: the built-in teapot and cups
    scene: Option<PathBuf>,

    /// The image: .exr (linear radiance) or .png (tone mapped, sRGB)
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,

    #[command(flatten)]
    options: RenderArgs,
}

impl RenderCommand {
    pub(super) fn run(self, talk: Talk) -> Result<()> {
        let start = Instant::now();
        if self.options.device.as_deref() == Some("list") {
            return print(&devices::table(&Instance::new(/* validation: */ false)?.devices()?));
        }
        let output = self.output.as_deref().ok_or_else(|| {
            Error::Usage("render needs to know where the image goes: -o OUT.png or -o OUT.exr".into())
        })?;
        let format = ImageFormat::of(output)?;
        let output = OutputFile::new(output)?;

        let mut scene = Scene::load(self.scene.as_deref(), &Overrides::of(&self.options))?;
        let load = start.elapsed();
        let mut plan = self.plan(&scene, format)?;
        scene.frame(f64::from(plan.size.width) / f64::from(plan.size.height));
        let options = plan.options.clone();
        let stats_file = options.stats.as_deref().map(OutputFile::new).transpose()?;
        let checkpoint = options.checkpoint.as_deref().map(OutputFile::new).transpose()?;
        let outputs =
            [("the image", Some(&output)), ("the stats", stats_file.as_ref()), ("the checkpoint", checkpoint.as_ref())];
        self.keep_apart(outputs.into_iter().filter_map(|(what, file)| Some((what, file?))).collect(), &options)?;

        let validation = options.validation == Some(true);
        let instance = Instance::new(validation)?;
        let gpu = Gpu::open(&instance, instance.choose(options.device.as_deref())?)?;
        passes::check(&gpu, &plan)?;
        let asked = self.options.clone().or(scene.render.clone());
        let choice = match asked.model {
            Some(ModelChoice::Auto) => Some(choose(&gpu, &scene, &asked)?),
            _ => None,
        };
        if let Some(choice) = &choice {
            plan = Plan::new(&scene, &choice.best.args)?;
        }
        let device = gpu.info().clone();

        for warning in &scene.warnings {
            talk.note(&format!("warning: {warning}"));
        }
        for note in choice.iter().flat_map(chosen) {
            talk.note(&note);
        }
        for note in idle_options(&asked, plan.model, format) {
            talk.note(&note);
        }
        if plan.unsupported != Default::default() {
            let (model, names) = (plan.model.name(), plan.unsupported.names().join(", "));
            let all_of_path = plan.unsupported.iter().all(|effect| effect.honoured_by(Model::Path));
            let other = if all_of_path { "; --model path does" } else { "" };
            talk.note(&format!("note: model {model} does not simulate {names}{other}"));
        }
        if plan.approximate != Default::default() {
            let (model, names) = (plan.model.name(), plan.approximate.names().join(", "));
            talk.note(&format!("note: model {model} approximates {names}; see docs/{model}.md"));
        }
        if !plan.unseen.is_empty() {
            let (model, what) = (plan.model.name(), plan.unseen.join("; "));
            talk.note(&format!("note: model {model} cannot see {what}; see docs/path.md"));
        }
        let overlapping = if plan.model.traces() { scene.bodies_at_one_place() } else { 0 };
        if overlapping > MOST_BODIES {
            talk.note(&format!(
                "warning: {overlapping} bodies may overlap at one place; of more than {MOST_BODIES} the lowest in rank are lost"
            ));
        }
        talk.detail(&format!("device: {} ({})", device.name, device.driver));
        talk.detail(&format!("options: {}", plan.options));

        let bar = progress_bar(&plan, talk);
        plan.budget = plan.budget.less(start.elapsed());
        let rendered = passes::render(&gpu, &scene, &plan, &mut |done| bar.set_position(done.into()))?;
        bar.finish_and_clear();
        if rendered.resumed > 0 {
            talk.note(&format!("note: went on from {} samples of the checkpoint", rendered.resumed));
        }
        for warning in &rendered.warnings {
            talk.note(&format!("warning: {warning}"));
        }
        if let Some(budget) = plan.options.time_budget.filter(|&budget| start.elapsed().as_secs_f64() > 1.05 * budget) {
            let (taken, samples) = (start.elapsed().as_secs_f64(), rendered.samples);
            let what = if samples == 1 { "set-up and one sample, the least," } else { "it" };
            talk.note(&format!("note: --time-budget {budget} s: {what} took {taken:.2} s"));
        }

        let metadata = metadata(&device, &scene, &plan, rendered.samples);
        let bytes = match format {
            ImageFormat::Png => {
                let pixels: Vec<[u8; 3]> = rendered.display.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
                encode_png(plan.size.width, plan.size.height, &pixels, &metadata)
            }
            ImageFormat::Exr => encode_exr(&float_image(&rendered, &plan), &metadata),
        };
        let bytes = bytes.map_err(|source| Error::file(output.path(), "write", source))?;
        output.write(&bytes)?;

        // The layer's last words come when everything is destroyed.
        let peak_gpu_bytes = gpu.peak_bytes();
        let messages = instance.messages();
        drop((gpu, instance));
        let validation_messages = validation.then(|| messages.count());
        let run = Run { load, wall: start.elapsed(), peak_gpu_bytes, validation_messages };
        let stats = Stats::new(&device, &scene, &plan, &rendered, choice.as_ref(), run);
        if let Some(file) = &stats_file {
            file.write(stats.json().as_bytes())?;
        }
        if stats.non_finite_pixels > 0 {
            talk.note(&format!("warning: {} pixels are not finite", stats.non_finite_pixels));
        }
        // What was chosen knows of what it cuts off.
        let cut_off = if choice.is_none() { cut_off(&plan, &stats) } else { None };
        for note in [cut_off, too_rough(&plan, &rendered)].into_iter().flatten() {
            talk.note(&note);
        }
        talk.note(&summary(output.path(), &stats));
        complaint(&messages.all()).map_or(Ok(()), |said| Err(Error::Check(said)))
    }

    /// What is asked for, on the command line and in the scene. A conflict that the command line has no part in is the
    /// scene's.
    fn plan(&self, scene: &Scene, format: ImageFormat) -> Result<Plan> {
        let plan = |options: &RenderArgs| -> Result<Plan> {
            let plan = Plan::new(scene, options)?;
            if format == ImageFormat::Png && !plan.aovs.is_empty() {
                return Err(Error::Usage("--aov adds layers to an EXR; name the output .exr".into()));
            }
            Ok(plan)
        };
        // Which model it will be is not known yet: what `path` does not take none does.
        let plan = |options: &RenderArgs| match options.model {
            Some(ModelChoice::Auto) => plan(&RenderArgs { model: Some(Model::Path.into()), ..options.clone() }),
            _ => plan(options),
        };
        plan(&self.options.clone().or(scene.render.clone())).map_err(|error| match (plan(&self.options), &self.scene) {
            (Ok(_), Some(path)) => Error::input(path, 0, format!("[render]: {error}")),
            _ => error,
        })
    }

    /// An output must not replace an input, nor another output.
    fn keep_apart(&self, outputs: Vec<(&str, &OutputFile)>, options: &RenderArgs) -> Result<()> {
        let inputs = [self.scene.as_deref(), options.env.as_deref()];
        for (i, &(what, file)) in outputs.iter().enumerate() {
            if inputs.into_iter().flatten().any(|input| file.replaces(input)) {
                let message = "is read by this render and would be replaced; name another file";
                return Err(Error::input(file.path(), 0, message));
            }
            if let Some((other, _)) = outputs[..i].iter().find(|(_, other)| other.replaces(file.path())) {
                let message = format!("is to hold both {other} and {what}; name two files");
                return Err(Error::input(file.path(), 0, message));
            }
        }
        Ok(())
    }
}

/// What `--model auto` chose.
fn chosen(choice: &Choice) -> Vec<String> {
    let best = &choice.best;
    let options = best.options();
    let seconds = choice.taken.as_secs_f64();
    if let Some(why) = choice.unmeasured {
        return vec![format!("note: --model auto: {options}, by the effects of the scene: {why}")];
    }
    let (error, ms, samples) = (best.error, best.ms, best.samples);
    let mut notes = vec![format!(
        "note: --model auto: {options}; expected: {samples} samples in {:.2} s, 95 % of the pixels within {error:.1e} (found out in {seconds:.1} s)",
        ms * 1e-3
    )];
    if let (Some(tolerance), false) = (choice.goal.tolerance, choice.is_expected) {
        notes.push(format!(
            "note: --model auto: nothing is expected to keep --tolerance {tolerance}; this comes closest"
        ));
    }
    notes
}

/// Notes on options that are understood and change nothing here.
fn idle_options(options: &RenderArgs, model: Model, format: ImageFormat) -> Vec<String> {
    let exr = format == ImageFormat::Exr;
    let (single, double) = (model == Model::Single, model == Model::Double);
    let controls = "it is a control of model single";
    [
        (single && options.max_depth.is_some(), "--max-depth", "model single sees one interface"),
        (single && options.trace.is_some(), "--trace", "model single traces no rays"),
        (double && options.trace.is_some(), "--trace", "model double traces no rays"),
        (!single && options.transmission_green.is_some(), "--transmission-green", controls),
        (!single && options.reflection_red.is_some(), "--reflection-red", controls),
        (!single && options.transmission_intensity.is_some(), "--transmission-intensity", controls),
        (!single && options.reflection_intensity.is_some(), "--reflection-intensity", controls),
        (!single && options.flipped_ratio.is_some(), "--flipped-ratio", controls),
        (exr && options.exposure.is_some(), "--exposure", "an EXR holds radiance as it is"),
        (exr && options.tonemap.is_some(), "--tonemap", "an EXR holds radiance as it is"),
    ]
    .into_iter()
    .filter(|(given, ..)| *given)
    .map(|(_, name, why)| format!("note: {name} changes nothing: {why}"))
    .collect()
}

/// Light that an image may lack, where that could be seen, and what follows more of it.
fn cut_off(plan: &Plan, stats: &Stats) -> Option<String> {
    /// Below this share of the brightest radiance few would look for it.
    const SEEN: f32 = 0.05;
    let (most, depth) = (stats.discarded?.max, plan.max_depth?);
    let promised = plan.options.tolerance.map_or(SEEN, |tolerance| tolerance as f32);
    // A few paths are no measure.
    let few = if plan.model == Model::Path { 4.0 / stats.samples as f32 } else { 0.0 };
    let promised = promised.max(few);
    (most > promised).then(|| {
        let mean = stats.discarded.map_or(0.0, |discarded| discarded.mean);
        let advice = match plan.options.tolerance {
            Some(_) if depth >= MOST_DEPTH => "it is trapped".into(),
            Some(_) => format!("--max-depth above {depth} may follow more of it"),
            None => format!("--tolerance or a --max-depth above {depth} follow more of it"),
        };
        format!("note: cut off was up to {most:.2e} of a pixel's light, {mean:.1e} in the mean; {advice}")
    })
}

/// That an image has a larger error than was asked for, in models that estimate it.
fn too_rough(plan: &Plan, rendered: &Rendered) -> Option<String> {
    let (radiance, stderr) = (&rendered.radiance, rendered.counts.as_ref()?.stderr.as_ref()?);
    let missed = plan.tolerance.is_finite() && !passes::is_within(radiance, stderr, plan.tolerance);
    missed.then(|| {
        let (asked, samples, most) = (plan.tolerance, rendered.samples, passes::error_of(PIXELS_BY_STDERR, radiance, stderr));
        let mean = passes::relative_error(radiance, stderr);
        format!("note: --tolerance {asked}: after {samples} samples 96.5 % of the pixels are within {most:.2e}, and the mean relative error is {mean:.2e}; more time or --samples lower it")
    })
}

fn progress_bar(plan: &Plan, talk: Talk) -> ProgressBar {
    if !talk.shows_progress() {
        return ProgressBar::hidden();
    }
    let (bar, template) = match plan.budget {
        Budget::Samples(samples) => (ProgressBar::new(samples.into()), "{bar:40} {pos}/{len} samples {eta}"),
        Budget::Seconds { .. } => (ProgressBar::no_length(), "{spinner} {pos} samples {elapsed}"),
    };
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

fn summary(output: &Path, stats: &Stats) -> String {
    let samples = if stats.samples == 1 { "1 sample".into() } else { format!("{} samples", stats.samples) };
    let ([width, height], seconds) = (stats.size, stats.wall_ms * 1e-3);
    format!("{}: {width}x{height}, {samples}, {seconds:.2} s on {}", output.display(), stats.device.name)
}
