//! `vitrum render`: one image, off screen.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{Talk, devices, print};
use crate::gpu::{Gpu, Instance};
use crate::image::{FloatImage, ImageFormat, Layer, OutputFile, encode_exr, encode_png};
use crate::options::RenderArgs;
use crate::passes::{self, Aovs, Rendered};
use crate::plan::{Budget, Plan};
use crate::report::Stats;
use crate::scene::{Overrides, Scene};
use crate::{Error, Result};

/// Options of `vitrum render`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(super) struct RenderCommand {
    /// A .toml scene, or a bare .obj shown as clear glass; none: the built-in teapot and cups
    scene: Option<PathBuf>,

    /// The image: .exr (linear radiance) or .png (tone mapped, sRGB)
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,

    #[command(flatten)]
    options: RenderArgs,

    /// Run under the validation layer; any message makes the run fail with 1
    #[arg(long)]
    validation: bool,

    /// Write what the render took, as JSON
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
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
        let stats_file = self.stats.as_deref().map(OutputFile::new).transpose()?;

        let overrides = Overrides {
            ior: self.options.ior,
            roughness: self.options.roughness,
            environment: self.options.env.clone(),
        };
        let scene = Scene::load(self.scene.as_deref(), &overrides)?;
        let load = start.elapsed();
        let idle = idle_options(&self.options, format);
        let args = self.options.or(scene.render.clone());
        let mut plan = Plan::new(&scene, &args)?;
        if format == ImageFormat::Png && !plan.aovs.is_empty() {
            return Err(Error::Usage("--aov adds layers to an EXR; name the output .exr".into()));
        }
        let instance = Instance::new(self.validation)?;
        let gpu = Gpu::open(&instance, instance.choose(args.device.as_deref())?)?;

        for warning in &scene.warnings {
            talk.note(&format!("warning: {warning}"));
        }
        for note in idle {
            talk.note(&note);
        }
        if plan.unsupported != Default::default() {
            let (model, names) = (plan.model.name(), plan.unsupported.names().join(", "));
            talk.note(&format!("note: model {model} does not simulate what the scene calls for: {names}"));
        }
        let device = gpu.info().clone();
        talk.detail(&format!("device: {} ({})", device.name, device.driver));
        let bar = progress_bar(&plan, talk);
        plan.budget = plan.budget.less(start.elapsed());
        let rendered = passes::render(&gpu, &scene, &plan, &mut |done, _| bar.set_position(done.into()))?;
        bar.finish_and_clear();

        let mut stats = Stats::new(&device, &scene, &plan, &rendered, load);
        stats.peak_gpu_bytes = gpu.peak_bytes();
        let metadata = metadata(&stats, &plan);
        let bytes = match format {
            ImageFormat::Png => {
                let pixels: Vec<[u8; 3]> = rendered.display.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
                encode_png(plan.size.width, plan.size.height, &pixels, &metadata)
            }
            ImageFormat::Exr => encode_exr(&float_image(rendered, &plan), &metadata),
        };
        let bytes = bytes.map_err(|source| Error::file(output.path(), "write", source))?;
        output.write(&bytes)?;

        // The layer's last words come when everything is destroyed.
        let messages = instance.messages();
        drop((gpu, instance));
        stats.validation_messages = self.validation.then(|| messages.count());
        stats.finish(start.elapsed());
        if let Some(file) = &stats_file {
            file.write(stats.json().as_bytes())?;
        }
        if stats.non_finite_pixels > 0 {
            talk.note(&format!("warning: {} pixels are not finite", stats.non_finite_pixels));
        }
        talk.note(&summary(output.path(), &stats, start.elapsed()));
        match messages.all().as_slice() {
            [] => Ok(()),
            [first, rest @ ..] => {
                let first = first.lines().next().unwrap_or_default();
                Err(Error::Check(format!("the validation layer has {} messages, the first: {first}", rest.len() + 1)))
            }
        }
    }
}

/// Notes on options that are understood and change nothing here.
fn idle_options(options: &RenderArgs, format: ImageFormat) -> Vec<String> {
    let exr = format == ImageFormat::Exr;
    [
        (options.max_depth.is_some(), "--max-depth", "model single sees one interface"),
        (options.trace.is_some(), "--trace", "model single traces no rays"),
        (exr && options.exposure.is_some(), "--exposure", "an EXR holds radiance as it is"),
        (exr && options.tonemap.is_some(), "--tonemap", "an EXR holds radiance as it is"),
    ]
    .into_iter()
    .filter(|(given, ..)| *given)
    .map(|(_, name, why)| format!("note: {name} changes nothing: {why}"))
    .collect()
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

fn float_image(rendered: Rendered, plan: &Plan) -> FloatImage {
    let mut layers = Vec::new();
    if let Some(Aovs { normal, depth, object }) = rendered.aovs {
        let channel = |name: &str, values: Vec<f32>| (name.to_owned(), values);
        for aov in &plan.aovs {
            let axis = |axis: usize| normal.iter().map(|normal| normal[axis]).collect();
            let channels = match aov.name() {
                "normal" => vec![channel("X", axis(0)), channel("Y", axis(1)), channel("Z", axis(2))],
                "depth" => vec![channel("Z", depth.clone())],
                _ => vec![channel("ID", object.clone())],
            };
            layers.push(Layer { name: aov.name().into(), channels });
        }
    }
    FloatImage { width: plan.size.width, height: plan.size.height, pixels: rendered.radiance, layers }
}

/// What the image says about its making; nothing that differs from run to run.
fn metadata(stats: &Stats, plan: &Plan) -> Vec<(String, String)> {
    let mut options = format!(
        "--model {} --size {} --samples {} --seed {} --effects {}",
        stats.model, plan.size, stats.samples, stats.seed, plan.selection
    );
    options += &format!(" --exposure {} --tonemap {}", plan.exposure, plan.tonemap.name());
    let debug = &plan.debug;
    options += &format!(
        " --transmission-green {} --reflection-red {} --transmission-intensity {} --reflection-intensity {}",
        debug.transmission_green, debug.reflection_red, debug.transmission_intensity, debug.reflection_intensity
    );
    options += &format!(" --flipped-ratio {}", debug.flipped_ratio);
    [
        ("Software", format!("vitrum {}", stats.vitrum)),
        ("vitrum:device", format!("{}, {}, Vulkan {}", stats.device.name, stats.device.driver, stats.device.api)),
        ("vitrum:scene", stats.scene.clone()),
        ("vitrum:options", options),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into()
}

fn summary(output: &Path, stats: &Stats, wall: Duration) -> String {
    format!(
        "{}: {}x{}, {} samples, {:.2} s on {}",
        output.display(),
        stats.size[0],
        stats.size[1],
        stats.samples,
        wall.as_secs_f64(),
        stats.device.name
    )
}
