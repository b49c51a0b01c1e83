//! `vitrum cost`: error against time for the models, settings and effects that apply to a scene.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{Changes, Talk, devices, print};
use crate::cost::{Measurement, REFERENCE_DEPTH};
use crate::effects::Selection;
use crate::gpu::{Gpu, Instance};
use crate::image::{check_folder, make_folder};
use crate::options::{RenderArgs, Size, Trace, range};
use crate::plan::DEPTH;
use crate::report::CostReport;
use crate::scene::Scene;
use crate::shell;
use crate::{Error, Result};

/// The size of the pictures, where the user has no wish: errors hardly depend on it, and time is pixels.
const SIZE: Size = Size { width: 320, height: 240 };

/// Seconds for the reference, where the user has no wish.
const REFERENCE_SECONDS: f64 = 60.0;

/// What is said of an output that is a file.
const NO_FOLDER: &str = "is a file; the report is a folder: name one";

/// Options of `vitrum cost`.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "docs/cost.md says how it is measured, and has the members of cost.json."
)]
pub(super) struct CostCommand {
    /// A .toml scene, a .glb or .gltf, or a bare .obj shown as clear glass; none: the built-in teapot and cups
    scene: Option<PathBuf>,

    /// Folder for cost.json, index.html, the pictures, and the reference, which a later run goes on with
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Size of the pictures [default: 320x240]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,

    /// Time for the reference, less if it is precise enough before [default: 60]
    #[arg(long, value_name = "SECONDS", value_parser = range::positive)]
    reference_time: Option<f64>,

    /// Effects simulated, as for render [default: auto]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    effects: Option<Selection>,

    /// Longest chain of interfaces of the reference, and of the settings of path that follow as long ones [default: 1024]
    #[arg(long, value_name = "N", value_parser = range::max_depth)]
    max_depth: Option<u32>,

    /// Seed of everything random [default: 0]
    #[arg(long, value_name = "N", value_parser = range::seed)]
    seed: Option<u64>,

    #[command(flatten)]
    changes: Changes,

    /// Vulkan device: part of its name, its index, or "list" [default: the best one]
    #[arg(long, value_name = "NAME|INDEX|list", env = "VITRUM_DEVICE")]
    device: Option<String>,

    /// How rays are traced [default: hardware on a GPU with ray queries, else software]
    #[arg(long, value_name = "HOW")]
    trace: Option<Trace>,
}

impl CostCommand {
    pub(super) fn run(self, talk: Talk) -> Result<()> {
        if self.device.as_deref() == Some("list") {
            return print(&devices::table(&Instance::new(/* validation: */ false)?.devices()?));
        }
        let folder =
            self.output.as_deref().ok_or_else(|| Error::Usage("cost needs a folder for its report: -o DIR".into()))?;
        check_folder(folder, NO_FOLDER)?;
        let page = folder.join("index.html");
        if page.exists() && !folder.join("cost.json").exists() {
            return Err(Error::input(
                page,
                0,
                "is no report of this command and would be replaced; name another folder",
            ));
        }
        if let Some(depth) = self.max_depth.filter(|&depth| depth < DEPTH) {
            let why = format!(
                "the settings follow up to {DEPTH} interfaces, and the reference must, too; give {DEPTH} or more"
            );
            return Err(Error::Usage(format!("--max-depth {depth}: {why}")));
        }
        let mut scene = Scene::load(self.scene.as_deref(), &self.changes.overrides())?;
        let size = self.size.unwrap_or(SIZE);
        scene.frame(f64::from(size.width) / f64::from(size.height));
        let options = RenderArgs {
            size: Some(size),
            seed: self.seed.or(scene.render.seed),
            effects: self.effects.clone().or(scene.render.effects.clone()),
            trace: self.trace.or(scene.render.trace),
            ..RenderArgs::default()
        };
        let instance = Instance::new(/* validation: */ false)?;
        let gpu = Gpu::open(&instance, instance.choose(self.device.as_deref())?)?;
        make_folder(folder, NO_FOLDER)?;
        for warning in &scene.warnings {
            talk.note(&format!("warning: {warning}"));
        }

        let bar = if talk.shows_progress() { ProgressBar::new(1000) } else { ProgressBar::hidden() };
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} % {msg}") {
            bar.set_style(style);
        }
        let measurement = Measurement {
            gpu: &gpu,
            scene: &scene,
            options,
            folder: folder.into(),
            depth: self.max_depth.unwrap_or(REFERENCE_DEPTH),
            half: Duration::from_secs_f64(self.reference_time.unwrap_or(REFERENCE_SECONDS) / 2.0),
        };
        let start = Instant::now();
        let cost = measurement.run(&mut |what, share| {
            talk.detail(&format!("{:5.0} s  {what}", start.elapsed().as_secs_f64()));
            bar.set_position((share * 1000.0) as u64);
            bar.set_message(what.to_owned());
        })?;
        bar.finish_and_clear();
        let report = CostReport::new(gpu.info(), &measurement, size, self.command(), &cost);
        report.write(folder, &cost)?;
        for warning in &cost.reference.warnings {
            talk.note(&format!("warning: {warning}"));
        }
        if !cost.reference.unseen.is_empty() {
            let what = cost.reference.unseen.join("; ");
            talk.note(&format!("note: the reference lacks {what}; what shows it counts as wrong"));
        }
        if !talk.quiet {
            print(&report.table())?;
        }
        talk.note(&format!("{}: {:.0} s", folder.join("index.html").display(), cost.taken.as_secs_f64()));
        Ok(())
    }

    /// The command line that repeats this.
    fn command(&self) -> String {
        let text = |value: Option<&dyn std::fmt::Display>| value.map(|value| value.to_string());
        let path = |path: &PathBuf| path.display().to_string();
        let Changes { ior, roughness, env, set, repair, smooth_angle } = &self.changes;
        let options = [
            ("size", text(self.size.as_ref().map(|x| x as _))),
            ("reference-time", text(self.reference_time.as_ref().map(|x| x as _))),
            ("effects", text(self.effects.as_ref().map(|x| x as _))),
            ("max-depth", text(self.max_depth.as_ref().map(|x| x as _))),
            ("seed", text(self.seed.as_ref().map(|x| x as _))),
            ("ior", text(ior.as_ref().map(|x| x as _))),
            ("roughness", text(roughness.as_ref().map(|x| x as _))),
            ("env", env.as_ref().map(path)),
            ("smooth-angle", text(smooth_angle.as_ref().map(|x| x as _))),
            ("device", self.device.clone()),
            ("trace", self.trace.map(|trace| trace.name().to_owned())),
            ("output", self.output.as_ref().map(path)),
        ];
        let given = options.into_iter().filter_map(|(name, value)| Some(format!("--{name}={}", value?)));
        let settings = set.iter().map(|setting| format!("--set={setting}"));
        let repair = repair.then(|| "--repair".to_owned());
        let scene = self.scene.as_ref().map(path);
        let words = ["vitrum".to_owned(), "cost".to_owned()]
            .into_iter()
            .chain(given)
            .chain(repair)
            .chain(settings)
            .chain(scene);
        shell::line(words)
    }
}
