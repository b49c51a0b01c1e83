//! `vitrum validate`: every pass on every Vulkan device, under the validation layer.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{Talk, print};
use crate::gpu::Instance;
use crate::image::OutputFile;
use crate::options::range;
use crate::report::{validate_html, validate_summary, validate_table};
use crate::validate::{Check, Listed, Place, Record, Report, Run, Tested, work};
use crate::{Error, Result, shell};

/// The folder of the report, where the user names none.
const FOLDER: &str = "validate-report";

/// Seconds that one check may take.
const TIME_LIMIT: f64 = 900.0;

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
    #[arg(long, value_name = "SECONDS", default_value_t = TIME_LIMIT, value_parser = range::positive)]
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
        let checks = self.checks()?;
        if self.list {
            let width = checks.iter().map(|check| check.name.len()).max().unwrap_or(0);
            let lines = checks.iter().map(|check| format!("{:width$}  {}\n", check.name, check.about));
            return print(&lines.collect::<String>());
        }
        let start = Instant::now();
        let program = std::env::current_exe().map_err(|source| Error::file("this program", "find", source))?;
        let run = Run {
            program,
            manifests: self.driver.clone(),
            device: self.device.clone(),
            checks: &checks,
            folder,
            thorough: self.thorough,
            patience: Duration::try_from_secs_f64(self.time_limit).unwrap_or(Duration::MAX),
        };
        if self.device.as_deref() == Some("list") {
            return print(&run.table()?);
        }
        let [loader, layer] = Instance::versions()?;
        let devices = run.devices()?;
        let _lock = run.open_folder()?;
        let mut report = Report {
            schema: Report::SCHEMA,
            vitrum: env!("CARGO_PKG_VERSION").into(),
            command: self.again(),
            system: format!("{}, {}", std::env::consts::OS, std::env::consts::ARCH),
            loader,
            layer,
            finished: false,
            seconds: 0.0,
            devices: Vec::new(),
        };
        let write = |report: &Report| {
            let write = |name: &str, text: String| OutputFile::new(&folder.join(name))?.write(text.as_bytes());
            write(Report::FILE, report.json())?;
            write("index.html", validate_html(report))
        };
        for mut tested in devices {
            let usable = tested.device.missing.is_empty() && tested.checks.is_empty();
            report.devices.push(tested.clone());
            if usable {
                let Listed { name, driver, .. } = tested.device.clone();
                talk.note(&format!("{name} ({driver}): {} checks", checks.len()));
                let bar = progress_bar(checks.len(), &tested, talk);
                let mut written = Instant::now();
                run.test(&mut tested, &mut |tested| {
                    bar.set_position(tested.checks.len() as u64);
                    told(tested, &bar, talk);
                    // From time to time: what is done is there, whatever comes.
                    if written.elapsed() > WRITES {
                        report.devices.pop();
                        report.devices.push(tested.clone());
                        report.seconds = start.elapsed().as_secs_f64();
                        write(&report)?;
                        written = Instant::now();
                    }
                    Ok(())
                })?;
                bar.finish_and_clear();
            }
            report.devices.pop();
            report.devices.push(tested);
        }
        report.finished = true;
        report.seconds = start.elapsed().as_secs_f64();
        write(&report)?;
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
        // A part that none has is a slip, whatever the others find.
        let is_found = |part: &&String| !Check::matching(std::slice::from_ref(*part)).is_empty();
        if let Some(part) = self.filter.iter().find(|part| !is_found(part)) {
            return Err(Error::Usage(format!("--filter: no check has {part} in its name; see --list")));
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
        if self.time_limit != TIME_LIMIT {
            add("--time-limit", self.time_limit.to_string());
        }
        words.extend(self.thorough.then(|| "--thorough".into()));
        shell::line(words.iter().map(String::as_str))
    }
}

/// How often the report is written while checks are done.
const WRITES: Duration = Duration::from_secs(2);

/// Tells of the last check, where somebody wants that; where nobody looks at a bar, of groups of them.
fn told(tested: &Tested, bar: &ProgressBar, talk: Talk) {
    let [.., last] = &tested.checks[..] else { return };
    bar.set_message(last.name.clone());
    talk.detail(&format!("{:8} {} {:.2} s", last.outcome.name(), last.name, last.seconds));
    let group = |check: &Record| check.name.split('/').next().unwrap_or_default().to_owned();
    let is_wanted = bar.is_hidden() && talk.verbose == 0;
    if let [.., before, last] = &tested.checks[..]
        && is_wanted
        && group(before) != group(last)
    {
        let done = tested.checks.len() - 1;
        talk.note(&format!("{}: done with {}, {done} checks so far", tested.device.name, group(before)));
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
