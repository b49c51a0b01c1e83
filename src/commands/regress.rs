//! `vitrum regress`: renders a suite and compares it with its references.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use super::{Talk, devices, print};
use crate::gpu::{Instance, complaint};
use crate::options::range;
use crate::regress::{Folder, Record, Report, Run, SCHEMA, Shard, Suite, Wishes, default_suite, merged};
use crate::report::{regress_html, regress_junit, regress_summary, regress_table};
use crate::{Error, Result};

/// The folder of the report, where the user names none.
const FOLDER: &str = "regress-report";

/// Options of `vitrum regress`.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "docs/regress.md has the format of suites and of regress.json; docs/ci.md shows jobs for CI systems."
)]
pub(super) struct RegressCommand {
    #[command(subcommand)]
    merge: Option<Merge>,

    /// The suite [default: regress.toml, or tests/regress/suite.toml]
    #[arg(value_name = "SUITE.toml")]
    suite: Option<PathBuf>,

    /// Folder for regress.json, junit.xml, index.html and the pictures; what an interrupted run left there is gone on with [default: regress-report]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Make references of what is rendered: of all, or of those with one of these parts in their names
    #[arg(long, value_name = "PARTS", num_args = 0..=1, require_equals = true, default_missing_value = "", value_delimiter = ',')]
    bless: Option<Vec<String>>,

    /// Only pictures with this in their name; may be repeated
    #[arg(long, value_name = "PART")]
    filter: Vec<String>,

    /// Only part i of n of the suite, as in 2/8; the reports of all are joined by vitrum regress merge
    #[arg(long, value_name = "i/n")]
    shard: Option<Shard>,

    /// Pictures that are rendered at a time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    jobs: u16,

    /// Seed of the pictures that are sampled at random, in the place of their own: what is right passes with any
    #[arg(long, value_name = "N", value_parser = range::seed, conflicts_with = "bless")]
    seed: Option<u64>,

    /// Vulkan device: part of its name, its index, or "list" [default: the best one]
    #[arg(long, value_name = "NAME|INDEX|list", env = "VITRUM_DEVICE")]
    device: Option<String>,

    /// Run under the validation layer; any message makes the run fail with 1
    #[arg(long)]
    validation: bool,
}

#[derive(Debug, Subcommand)]
enum Merge {
    /// Joins the reports of the parts of a suite into one
    Merge {
        /// The folders of all parts
        #[arg(required = true, value_name = "DIR")]
        parts: Vec<PathBuf>,

        /// Folder for the report of all
        #[arg(short, long, value_name = "DIR")]
        output: PathBuf,
    },
}

impl RegressCommand {
    pub(super) fn run(self, talk: Talk) -> Result<()> {
        if let Some(Merge::Merge { parts, output }) = &self.merge {
            let (folder, report) = merged(parts, output)?;
            let judged = finish(&folder, &report, talk);
            return match report.validation_messages {
                Some(count) if count > 0 => {
                    judged.and(Err(Error::Check(format!("the validation layer had {count} messages; see the parts"))))
                }
                _ => judged,
            };
        }
        if self.device.as_deref() == Some("list") {
            return print(&devices::table(&Instance::new(/* validation: */ false)?.devices()?));
        }
        let start = Instant::now();
        let path = self.suite.clone().map_or_else(default_suite, Ok)?;
        let suite = Suite::load(&path)?;
        let blessed = self.bless.iter().flatten().filter(|part| !part.is_empty());
        let filter: Vec<_> = self.filter.iter().chain(blessed).cloned().collect();
        if !self.filter.is_empty() && filter.len() > self.filter.len() {
            let message = "--bless names pictures and --filter others; name all that are meant in one of them";
            return Err(Error::Usage(message.into()));
        }
        let wishes = Wishes {
            blesses: self.bless.is_some(),
            filter,
            shard: self.shard,
            jobs: usize::from(self.jobs),
            seed: self.seed,
        };
        let chosen = Run::chosen(&suite, &wishes)?;
        let instance = Instance::new(self.validation)?;
        let device = instance.choose(self.device.as_deref())?;
        let folder = Folder::open(self.output.as_deref().unwrap_or(Path::new(FOLDER)))?;
        if folder.resumes {
            talk.note(&format!("note: {}: going on with an interrupted run", folder.path().display()));
        }
        talk.detail(&format!("device: {} ({})", device.name, device.driver));
        if let Some(driver) = suite.driver(&device.name, &device.driver) {
            talk.detail(&format!("known to the suite as {}: {}", driver.name, driver.why));
        }
        let bar = progress_bar(chosen.len(), talk);
        let run = Run { suite: &suite, wishes: &wishes, folder: &folder, instance: &instance, device: &device };
        let pictures = run.run(&|record: &Record| {
            bar.inc(1);
            bar.set_message(record.name.clone());
            talk.detail(&format!("{:13} {} {:.2} s", record.outcome.name(), record.name, record.seconds));
        })?;
        bar.finish_and_clear();
        // The layer's last words come when everything is destroyed.
        let messages = instance.messages();
        drop(instance);
        let report = Report {
            schema: SCHEMA,
            vitrum: env!("CARGO_PKG_VERSION").into(),
            suite: path.display().to_string(),
            suite_hash: suite.hash.clone(),
            shard: self.shard,
            blessed: wishes.blesses,
            seconds: start.elapsed().as_secs_f64(),
            validation_messages: self.validation.then(|| messages.count()),
            pictures,
        };
        let judged = finish(&folder, &report, talk);
        match complaint(&messages.all()) {
            Some(said) => judged.and(Err(Error::Check(said))),
            None => judged,
        }
    }
}

/// Writes the report and says what came out.
fn finish(folder: &Folder, report: &Report, talk: Talk) -> Result<()> {
    let page = folder.path().join("index.html");
    let xml = regress_junit(report).map_err(|source| Error::file(folder.path().join("junit.xml"), "write", source))?;
    folder.write("junit.xml", &xml)?;
    folder.write("index.html", regress_html(report).as_bytes())?;
    folder.write(Report::FILE, report.json().as_bytes())?;
    folder.finish()?;
    print(&regress_table(report, talk.quiet))?;
    talk.note(&format!("{}: {}", page.display(), regress_summary(report)));
    let bad: Vec<_> = report.pictures.iter().filter(|record| !record.outcome.is_good()).collect();
    let Some(first) = bad.first() else { return Ok(()) };
    let (all, of) = (bad.len(), report.pictures.len());
    let why = first.reasons.first().map_or(first.outcome.name(), String::as_str);
    Err(Error::Check(format!("{all} of {of} pictures are not as they should be; {}: {why}", first.name)))
}

fn progress_bar(pictures: usize, talk: Talk) -> ProgressBar {
    if !talk.shows_progress() || talk.verbose > 0 {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(pictures as u64);
    match ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
