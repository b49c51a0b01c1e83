//! What `vitrum cost` found: a table, JSON, pictures, a page.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::cost_page;
use super::stats::DeviceStats;
use crate::cost::{Cost, EffectCost, Estimate, Measured, Measurement, Setting, TARGETS};
use crate::gpu::DeviceInfo;
use crate::image::{OutputFile, encode_png, make_folder};
use crate::options::{MOST_SAMPLES, Model, Size};
use crate::{Error, Result};

/// The folder of the pictures, in that of the report.
const PICTURES: &str = "pictures";

/// Schema 1 of `cost.json`. What is not finite, or does not apply, is null.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/cost.md describes the members")]
pub struct CostReport {
    pub schema: u32,
    pub vitrum: &'static str,
    pub device: DeviceStats,
    pub scene: String,
    pub size: [u32; 2],
    pub command: String,
    pub seconds: f64,
    pub reference: ReferenceRow,
    pub entries: Vec<EntryRow>,
    pub left_out: Vec<LeftOutRow>,
    pub targets: Vec<TargetRow>,
    pub effects: Vec<EffectRow>,
}

/// What everything is held against.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/cost.md describes the members")]
pub struct ReferenceRow {
    pub model: &'static str,
    pub samples: u32,
    pub resumed: u32,
    pub noise: f64,
    pub max_depth: u32,
    pub unseen: Vec<&'static str>,
    pub image: String,
}

/// A model and setting.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/cost.md describes the members")]
pub struct EntryRow {
    pub label: String,
    pub model: &'static str,
    pub options: String,
    pub samples: u32,
    pub max_depth: Option<u32>,
    pub gpu_ms: f64,
    pub gpu_ms_runs: Vec<f64>,
    pub pipelines_ms: f64,
    pub relmse: f64,
    pub relmse_error: f64,
    pub flip: f64,
    pub rays: Option<u64>,
    pub pareto: bool,
    pub approximate: Vec<&'static str>,
    pub unsupported: Vec<&'static str>,
    pub image: String,
    pub map: String,
}

/// A setting that was not rendered, and the time that it might have taken.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/cost.md describes the members")]
pub struct LeftOutRow {
    pub options: String,
    pub expected_ms: f64,
}

/// The fastest setting that has at most this error.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/cost.md describes the members")]
pub struct TargetRow {
    pub relmse: f64,
    pub options: Option<String>,
    pub gpu_ms: Option<f64>,
    /// Beyond what was measured: more samples of `path`, whose error falls as 1 / n.
    pub extrapolated: bool,
}

/// The same frame with an effect and without it.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/cost.md describes the members")]
pub struct EffectRow {
    pub effect: &'static str,
    pub model: &'static str,
    pub samples: u32,
    pub gpu_ms_with: f64,
    pub gpu_ms_without: f64,
    pub relmse_with: f64,
    pub relmse_with_error: f64,
    pub relmse_without: f64,
    pub relmse_without_error: f64,
}

impl CostReport {
    /// A report on what was measured; `command` repeats it.
    pub fn new(device: &DeviceInfo, measurement: &Measurement<'_>, size: Size, command: String, cost: &Cost) -> Self {
        let (scene, depth) = (measurement.scene, measurement.depth);
        let reference = &cost.reference;
        Self {
            schema: 1,
            vitrum: env!("CARGO_PKG_VERSION"),
            device: DeviceStats::new(device),
            scene: scene.name.clone(),
            size: [size.width, size.height],
            command,
            seconds: cost.taken.as_secs_f64(),
            reference: ReferenceRow {
                model: "path",
                samples: reference.samples,
                resumed: reference.resumed,
                noise: reference.noise,
                max_depth: depth,
                unseen: reference.unseen.clone(),
                image: format!("{PICTURES}/reference.png"),
            },
            entries: cost.entries.iter().enumerate().map(EntryRow::new).collect(),
            left_out: cost.left_out.iter().map(LeftOutRow::new).collect(),
            targets: TARGETS.map(|target| TargetRow::new(target, &cost.entries)).into(),
            effects: cost.effects.iter().map(EffectRow::new).collect(),
        }
    }

    /// One object, readable and ended by a newline.
    pub fn json(&self) -> String {
        // Plain numbers, strings and lists: nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Writes `cost.json`, `index.html` and the pictures into `folder`.
    pub fn write(&self, folder: &Path, cost: &Cost) -> Result<()> {
        make_folder(&folder.join(PICTURES), "is a file; the pictures of the report belong there: move it")?;
        let [width, height] = self.size;
        let png = |name: &str, pixels: &[[u8; 3]]| -> Result<()> {
            let file = OutputFile::new(&folder.join(name))?;
            let bytes = encode_png(width, height, pixels, &[]).map_err(|e| Error::file(file.path(), "write", e))?;
            file.write(&bytes)
        };
        let opaque = |pixels: &[[u8; 4]]| -> Vec<[u8; 3]> { pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect() };
        png(&self.reference.image, &opaque(&cost.reference.display))?;
        for (row, entry) in self.entries.iter().zip(&cost.entries) {
            png(&row.image, &opaque(&entry.rendered.display))?;
            png(&row.map, &entry.flip.colors())?;
        }
        let page = cost_page::html(self).map_err(|source| Error::file(folder, "draw plots for", source))?;
        OutputFile::new(&folder.join("cost.json"))?.write(self.json().as_bytes())?;
        OutputFile::new(&folder.join("index.html"))?.write(page.as_bytes())
    }

    /// The tables for a terminal.
    pub fn table(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{}, {}x{}, on {}: against path with {} samples (noise {:.1e})\n",
            self.scene, self.size[0], self.size[1], self.device.name, self.reference.samples, self.reference.noise
        );
        let _ = writeln!(text, "  {:<34} {:>10} {:>9}  {:>7}", "setting", "ms", "relMSE", "FLIP");
        for row in &self.entries {
            let best = if row.pareto { '*' } else { ' ' };
            let (label, ms, relmse, flip) = (&row.label, row.gpu_ms, error(row.relmse, row.relmse_error), row.flip);
            let _ = writeln!(text, "{best} {label:<34} {ms:>10.1} {relmse:>9}  {flip:>7.4}");
        }
        text += "* nothing else is both faster and closer\n";
        for row in &self.left_out {
            let _ = writeln!(text, "  left out: {}, about {:.0} s", row.options, row.expected_ms * 1e-3);
        }
        text += "\n";
        for target in &self.targets {
            let how = match (&target.options, target.gpu_ms) {
                (Some(options), Some(ms)) if target.extrapolated => format!("{ms:.0} ms (not tried)  {options}"),
                (Some(options), Some(ms)) => format!("{ms:.1} ms  {options}"),
                _ => "none".into(),
            };
            let _ = writeln!(text, "  relMSE {:.0e}: {how}", target.relmse);
        }
        if !self.effects.is_empty() {
            let _ = writeln!(
                text,
                "\n  {:<20} {:<6} {:>10} {:>10} {:>9} {:>9}",
                "effect", "model", "ms with", "ms without", "relMSE", "without"
            );
        }
        for row in &self.effects {
            let with = error(row.relmse_with, row.relmse_with_error);
            let without = error(row.relmse_without, row.relmse_without_error);
            let _ = writeln!(
                text,
                "  {:<20} {:<6} {:>10.1} {:>10.1} {with:>9} {without:>9}",
                row.effect, row.model, row.gpu_ms_with, row.gpu_ms_without
            );
        }
        text
    }
}

/// An error with its digits; below its uncertainty, that.
pub(super) fn error(value: f64, uncertainty: f64) -> String {
    if !value.is_finite() {
        "not finite".into()
    } else if value > uncertainty {
        format!("{value:.1e}")
    } else {
        format!("<{uncertainty:.0e}")
    }
}

impl EntryRow {
    fn new((number, entry): (usize, &Measured)) -> Self {
        let Estimate { value: relmse, error: relmse_error } = entry.relmse;
        Self {
            label: entry.setting.label(),
            model: entry.setting.model.name(),
            options: entry.setting.options(),
            samples: entry.rendered.samples,
            max_depth: entry.plan.max_depth,
            gpu_ms: entry.ms(),
            gpu_ms_runs: entry.times.clone(),
            pipelines_ms: entry.pipelines_ms,
            relmse,
            relmse_error,
            flip: entry.flip.mean,
            rays: entry.rendered.counts.as_ref().and_then(|counts| counts.rays),
            pareto: entry.is_best,
            approximate: entry.plan.approximate.names(),
            unsupported: entry.plan.unsupported.names(),
            image: format!("{PICTURES}/{number:02}.png"),
            map: format!("{PICTURES}/{number:02}-flip.png"),
        }
    }
}

impl LeftOutRow {
    fn new((setting, expected_ms): &(Setting, f64)) -> Self {
        Self { options: setting.options(), expected_ms: *expected_ms }
    }
}

impl TargetRow {
    fn new(relmse: f64, entries: &[Measured]) -> Self {
        let fastest =
            entries.iter().filter(|entry| entry.relmse.at_least() <= relmse).min_by(|a, b| a.ms().total_cmp(&b.ms()));
        if let Some(entry) = fastest {
            let options = Some(entry.setting.options());
            return Self { relmse, options, gpu_ms: Some(entry.ms()), extrapolated: false };
        }
        // Paths as long as those of the reference have no error that stays.
        let unbiased = |entry: &&Measured| entry.setting.model == Model::Path && entry.setting.max_depth.is_some();
        let last = entries.iter().rfind(unbiased);
        let Some(last) = last.filter(|entry| entry.relmse.value > entry.relmse.error) else {
            return Self { relmse, options: None, gpu_ms: None, extrapolated: false };
        };
        let samples = (f64::from(last.rendered.samples) * last.relmse.value / relmse).ceil();
        if samples > f64::from(MOST_SAMPLES) {
            return Self { relmse, options: None, gpu_ms: None, extrapolated: false };
        }
        Self {
            relmse,
            options: Some(Setting { samples: samples as u32, ..last.setting.clone() }.options()),
            gpu_ms: Some(last.ms() * samples / f64::from(last.rendered.samples)),
            extrapolated: true,
        }
    }
}

impl EffectRow {
    fn new(cost: &EffectCost) -> Self {
        let EffectCost { effect, model, samples, with, without } = cost;
        Self {
            effect: effect.name(),
            model: model.name(),
            samples: *samples,
            gpu_ms_with: with.ms,
            gpu_ms_without: without.ms,
            relmse_with: with.relmse.value,
            relmse_with_error: with.relmse.error,
            relmse_without: without.relmse.value,
            relmse_without_error: without.relmse.error,
        }
    }
}
