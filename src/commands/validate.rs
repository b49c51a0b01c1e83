//! `vitrum validate`: every pass on every Vulkan device, under the validation layer.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{Talk, devices, print};
use crate::gpu::Instance;
use crate::image::OutputFile;
use crate::options::range;
use crate::report::{validate_html, validate_summary, validate_table};
use crate::validate::{Check, Place, Record, Report, Run, Tested, work};
use crate::{Error, Result, shell};

/// The folder of the report, where the user names none.
const FOLDER: &str = "validate-report";

/// Options of `vitrum validate`.
#[derive(Debug, Args)]
#[command(after_help = "docs/validate.md says what the checks are, and has the format of validate.json.")]
pub(super) struct ValidateCommand {
    /// Folder for validate.json, index.html and the pictures [default: validate-report]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// A driver's manifest in place of those that the loader finds; may be repeated
    #[arg(long, value_name = "MANIFEST.json")]
    driver: Vec<PathBuf>,

    /// Only this Vulkan device: part of its name, its index, or "list" [default: all]
    #[arg(long, value_name = "NAME|INDEX|list", env = "VITRUM_DEVICE")]
    device: Option<String>,

    /// Only checks with this in their name, and those of the layer itself; may be repeated
    #[arg(long, value_name = "PART")]
    filter: Vec<String>,

    /// Prints the checks, and does none
    #[arg(long)]
    list: bool,

    /// Also what takes many minutes: on processors GPU-assisted validation of every effect in the models that trace
    #[arg(long)]
    thorough: bool,

    /// How long one check may take, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 900.0, value_parser = range::positive)]
    time_limit: f64,

    /// Does the checks that standard input names, on the device of this index
    #[arg(long, value_name = "INDEX", hide = true)]
    worker: Option<usize>,
}

impl ValidateCommand {
    pub(super) fn run(self, talk: Talk) -> Result<()> {
        let folder = self.output.as_deref().unwrap_or(Path::new(FOLDER));
        if let Some(device) = self.worker {
            let place = Place { device, folder, thorough: self.thorough };
            return work(place, std::io::stdin().lock(), std::io::stdout());
        }
        if self.device.as_deref() == Some("list") {
            return print(&devices::table(&Instance::new(/* validation: */ false)?.devices()?));
        }
        let checks = self.checks()?;
        if self.list {
            let width = checks.iter().map(|check| check.name.len()).max().unwrap_or(0);
            let lines = checks.iter().map(|check| format!("{:width$}  {}\n", check.name, check.about));
            return print(&lines.collect::<String>());
        }
        let start = Instant::now();
        let [loader, layer] = Instance::versions()?;
        let program = std::env::current_exe().map_err(|source| Error::file("this program", "find", source))?;
        let run = Run {
            program,
            manifests: self.driver.clone(),
            device: self.device.clone(),
            checks: &checks,
            folder,
            thorough: self.thorough,
            patience: Duration::from_secs_f64(self.time_limit),
        };
        let devices = run.devices()?;
        run.open_folder()?;
        let mut report = Report {
            schema: Report::SCHEMA,
            vitrum: env!("CARGO_PKG_VERSION").into(),
            command: self.again(),
            system: format!("{}, {}", std::env::consts::OS, std::env::consts::ARCH),
            loader,
            layer,
            seconds: 0.0,
            devices: Vec::new(),
        };
        for mut tested in devices {
            let bar = progress_bar(checks.len(), &tested, talk);
            talk.detail(&format!("device: {} ({})", tested.device.name, tested.device.driver));
            if tested.device.missing.is_empty() {
                run.test(&mut tested, &mut |record: &Record| {
                    bar.inc(1);
                    bar.set_message(record.name.clone());
                    talk.detail(&format!("{:8} {} {:.2} s", record.outcome.name(), record.name, record.seconds));
                })?;
            }
            bar.finish_and_clear();
            report.devices.push(tested);
            report.seconds = start.elapsed().as_secs_f64();
            // After each: what is done is there, whatever comes.
            let write = |name: &str, text: String| OutputFile::new(&folder.join(name))?.write(text.as_bytes());
            write(Report::FILE, report.json())?;
            write("index.html", validate_html(&report))?;
        }
        print(&validate_table(&report, talk.quiet))?;
        talk.note(&format!("{}: {}", folder.join("index.html").display(), validate_summary(&report)));
        let bad: Vec<_> = report.checks().filter(|(_, check)| !check.outcome.is_good()).collect();
        let Some((tested, first)) = bad.first() else { return Ok(()) };
        let why = first.reasons.first().map_or(first.outcome.name(), String::as_str);
        let (bad, all, device) = (bad.len(), report.checks().count(), &tested.device.name);
        Err(Error::Check(format!("{bad} of {all} checks failed; {device}: {}: {why}", first.name)))
    }

    /// Those that are meant. Planted faults are always among them: without, silence proves nothing.
    fn checks(&self) -> Result<Vec<Check>> {
        if Check::matching(&self.filter).is_empty() {
            let parts = self.filter.join(", ");
            return Err(Error::Usage(format!("--filter: no check has {parts} in its name; see --list")));
        }
        let mut parts = self.filter.clone();
        parts.extend((!parts.is_empty()).then(|| "layer/".into()));
        Ok(Check::matching(&parts))
    }

    /// The command that does the same.
    fn again(&self) -> String {
        let mut words = vec!["vitrum".to_owned(), "validate".into()];
        let mut add = |option: &str, value: String| words.extend([option.to_owned(), value]);
        self.driver.iter().for_each(|driver| add("--driver", driver.display().to_string()));
        self.device.iter().for_each(|device| add("--device", device.clone()));
        self.filter.iter().for_each(|part| add("--filter", part.clone()));
        self.output.iter().for_each(|folder| add("--output", folder.display().to_string()));
        words.extend(self.thorough.then(|| "--thorough".into()));
        shell::line(words.iter().map(String::as_str))
    }
}

fn progress_bar(checks: usize, tested: &Tested, talk: Talk) -> ProgressBar {
    if !talk.shows_progress() || talk.verbose > 0 {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(checks as u64).with_prefix(tested.device.name.clone());
    match ProgressStyle::with_template("{prefix} {bar:40} {pos}/{len} {msg}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
