//! `vitrum numerics`: the shaders' optics functions on a device against 64-bit arithmetic.

use std::path::PathBuf;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{Talk, devices, print};
use crate::gpu::{Gpu, Instance, complaint};
use crate::image::OutputFile;
use crate::numerics::{FUNCTIONS, Function, Table, suite};
use crate::options::range;
use crate::report::{NumericsFiles, NumericsReport};
use crate::{Error, Result};

/// Inputs in each region: 10^8 and more in all.
const COUNT: u64 = 2_750_000;

/// Options of `vitrum numerics`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, after_long_help = functions_help())]
pub(super) struct NumericsCommand {
    /// One function instead of all
    #[arg(long, value_name = "NAME")]
    function: Option<String>,

    /// A CSV file with a column for each input of --function, which is evaluated there; further columns are passed through
    #[arg(long, value_name = "IN.csv")]
    inputs: Option<PathBuf>,

    /// With --inputs the CSV file of the results [default: standard output]; else a folder for numerics.json, numerics.svg (plots of
    /// error against angle) and index.html
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,

    /// Inputs tried in each region of a function [default: 2750000]
    #[arg(long, value_name = "N", value_parser = range::inputs)]
    count: Option<u64>,

    /// Seed of the inputs [default: 0]
    #[arg(long, value_name = "N", value_parser = range::seed)]
    seed: Option<u64>,

    /// Vulkan device: part of its name, its index, or "list" [default: the best one]
    #[arg(long, value_name = "NAME|INDEX|list", env = "VITRUM_DEVICE")]
    device: Option<String>,

    /// Run under the validation layer; any message makes the run fail with 1
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL")]
    validation: Option<bool>,
}

impl NumericsCommand {
    pub(super) fn run(self, talk: Talk) -> Result<()> {
        if self.device.as_deref() == Some("list") {
            return print(&devices::table(&Instance::new(/* validation: */ false)?.devices()?));
        }
        let function = match &self.function {
            Some(name) => Some(Function::named(name).map_err(|error| Error::Usage(format!("--function: {error}")))?),
            None => None,
        };
        if self.inputs.is_some() && function.is_none() {
            let known: Vec<_> = FUNCTIONS.iter().map(|function| function.name).collect();
            let message = format!("--inputs are those of one function; add --function, one of {}", known.join(", "));
            return Err(Error::Usage(message));
        }
        let open = || -> Result<_> {
            let instance = Instance::new(self.validation == Some(true))?;
            let gpu = Gpu::open(&instance, instance.choose(self.device.as_deref())?)?;
            Ok((instance, gpu))
        };
        let (messages, verdict) = match (function, &self.inputs) {
            (Some(function), Some(inputs)) => {
                let output = self.output.as_deref().map(OutputFile::new).transpose()?;
                if let Some(output) = output.as_ref().filter(|output| output.replaces(inputs)) {
                    let message = "is read by this run and would be replaced; name another file";
                    return Err(Error::input(output.path(), 0, message));
                }
                let table = Table::read(function, inputs)?;
                let (instance, gpu) = open()?;
                for (given, name) in [(self.count, "--count"), (self.seed, "--seed")] {
                    if given.is_some() {
                        talk.note(&format!("note: {name} changes nothing: --inputs says what is evaluated"));
                    }
                }
                for name in table.shadowed() {
                    talk.note(&format!(
                        "note: column {name:?} is passed through; the device's follows it under the same name"
                    ));
                }
                talk.detail(&format!("device: {} ({})", gpu.info().name, gpu.info().driver));
                let text = table.evaluate(&gpu)?;
                match &output {
                    Some(output) => {
                        output.write(text.as_bytes())?;
                        talk.note(&format!(
                            "{}: {} at {} inputs",
                            output.path().display(),
                            function.name,
                            table.rows()
                        ));
                    }
                    None => print(&text)?,
                }
                (instance.messages(), Ok(()))
            }
            _ => {
                let is_table = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "csv");
                if let Some(path) = self.output.as_ref().filter(|path| is_table(path)) {
                    let message = "is to be a folder for reports; name one, or add --inputs for a CSV file";
                    return Err(Error::input(path, 0, message));
                }
                self.output.as_deref().map(NumericsFiles::check).transpose()?;
                let (instance, gpu) = open()?;
                let files = self.output.as_deref().map(NumericsFiles::new).transpose()?;
                talk.detail(&format!("device: {} ({})", gpu.info().name, gpu.info().driver));
                let (count, seed) = (self.count.unwrap_or(COUNT), self.seed.unwrap_or(0));
                let bar = self.progress_bar(talk);
                let only = self.function.as_deref();
                let regions = suite::run(&gpu, only, count, seed, &mut |done| bar.set_position(done))?;
                bar.finish_and_clear();
                let report = NumericsReport::new(gpu.info(), seed, regions);
                if !talk.quiet {
                    print(&report.table(talk.verbose > 0))?;
                }
                if let (Some(files), Some(folder)) = (files, &self.output) {
                    report.write(&files)?;
                    talk.note(&format!("{}: the report", folder.join("index.html").display()));
                }
                (instance.messages(), report.verdict())
            }
        };
        let said = complaint(&messages.all());
        match (verdict, said) {
            (Ok(()), None) => Ok(()),
            (Err(broken), Some(said)) => Err(Error::Check(format!("{broken}; and {said}"))),
            (Err(failed), None) | (Ok(()), Some(failed)) => Err(Error::Check(failed)),
        }
    }

    fn progress_bar(&self, talk: Talk) -> ProgressBar {
        if !talk.shows_progress() {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new(suite::regions(self.function.as_deref()) as u64);
        match ProgressStyle::with_template("{bar:40} {pos}/{len} regions {eta}") {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        }
    }
}

fn functions_help() -> String {
    let mut text = "Functions, with their columns:\n".to_owned();
    for Function { name, about, inputs, outputs, .. } in &FUNCTIONS {
        text += &format!("  {name}: {about}\n      {} -> {}\n", inputs.join(","), outputs.join(","));
    }
    text + "Directions are in the local frame, whose +z is the normal, and point away from the surface; eta is the index on \
            the side of -z over that on the side of +z. docs/numerics.md has the bounds."
}
