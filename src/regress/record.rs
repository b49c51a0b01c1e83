//! What is kept of a run: a record of each picture, as JSON in the folder of the report.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::image::{FolderLock, OutputFile, make_folder};
use crate::{Error, Result};

/// Folders in that of the report.
pub const PICTURES: &str = "pictures";
const RESULTS: &str = "results";

/// The file that is there until all is done.
const UNFINISHED: &str = "unfinished";

/// What is said of an output that is a file.
const NO_FOLDER: &str = "is a file; the report is a folder: name one";

/// How it went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// It is within its limits.
    Passed,
    /// It is not.
    Failed,
    /// It was not compared: there is no reference that can be used.
    NoReference,
    /// It could not be rendered.
    Error,
    /// It is not within its limits, and that is known of this driver.
    KnownFault,
    /// It is within its limits, where a fault of this driver was expected.
    FaultGone,
    /// A reference was made.
    New,
    /// Another reference was made.
    Changed,
    /// The reference is what would be made again.
    Unchanged,
}

impl Outcome {
    /// Whether nobody has to look at it.
    pub fn is_good(self) -> bool {
        !matches!(self, Self::Failed | Self::NoReference | Self::Error | Self::FaultGone)
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "FAILED",
            Self::NoReference => "NO REFERENCE",
            Self::Error => "ERROR",
            Self::KnownFault => "known fault",
            Self::FaultGone => "FAULT IS GONE",
            Self::New => "new",
            Self::Changed => "changed",
            Self::Unchanged => "unchanged",
        }
    }
}

/// A number and its limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/regress.md describes the members")]
pub struct Measured {
    pub name: String,
    /// `None`: not finite.
    pub value: Option<f64>,
    pub limit: Option<f64>,
}

/// Where a picture was rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/regress.md describes the members")]
pub struct Device {
    pub name: String,
    pub driver: String,
    pub api: String,
}

/// What came of a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/regress.md describes the members")]
pub struct Record {
    /// Of all that it depends on.
    pub fingerprint: String,
    /// Its place in the suite.
    pub number: usize,
    pub name: String,
    pub why: String,
    pub outcome: Outcome,
    /// Why it is not good, or what is known.
    pub reasons: Vec<String>,
    pub measures: Vec<Measured>,
    pub samples: u32,
    pub seconds: f64,
    pub gpu_ms: Option<f64>,
    pub device: Device,
    /// The command that renders it again, and the one that compares it again.
    pub render: String,
    pub regress: String,
    /// What the reference says of its making.
    pub reference: Vec<(String, String)>,
    /// Which of the pictures there are: of the result, of the reference, of the error.
    pub has_result: bool,
    pub has_reference: bool,
}

/// A part of a suite, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/regress.md describes the members")]
pub struct Shard {
    pub index: usize,
    pub of: usize,
}

impl Shard {
    /// Whether the picture in this place of the suite is in it.
    pub fn has(self, number: usize) -> bool {
        number % self.of == self.index - 1
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text:?} is no part; expected i/n with 1 <= i <= n, as in 2/8");
        let (index, of) = text.split_once('/').ok_or_else(wrong)?;
        let (index, of) = (index.parse().map_err(|_| wrong())?, of.parse().map_err(|_| wrong())?);
        if index == 0 || index > of { Err(wrong()) } else { Ok(Self { index, of }) }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// Schema 1 of `regress.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/regress.md describes the members")]
pub struct Report {
    pub schema: u32,
    pub vitrum: String,
    pub suite: String,
    /// Of the suite's file.
    pub suite_hash: String,
    pub shard: Option<Shard>,
    pub blessed: bool,
    pub seconds: f64,
    pub validation_messages: Option<usize>,
    pub pictures: Vec<Record>,
}

impl Report {
    /// The file in the folder of a report.
    pub const FILE: &str = "regress.json";

    /// As JSON.
    pub fn json(&self) -> String {
        // Plain numbers and strings: nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// How many pictures came out like that.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.pictures.iter().filter(|record| record.outcome == outcome).count()
    }

    /// How many pictures somebody has to look at.
    pub fn failures(&self) -> usize {
        self.pictures.iter().filter(|record| !record.outcome.is_good()).count()
    }

    /// The report in a folder.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(Self::FILE);
        let text = fs::read_to_string(&path).map_err(|source| Error::file(&path, "read", source))?;
        let wrong = |error: serde_json::Error| Error::input(&path, error.line(), format!("is no report: {error}"));
        serde_json::from_str(&text).map_err(wrong)
    }
}

/// The folder of a report, with what an interrupted run left in it.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Whether there is something to go on from.
    pub resumes: bool,
    /// Held so that no other run writes there.
    _lock: FolderLock,
}

impl Folder {
    /// Opens or makes it. One that holds something else is refused.
    pub fn open(path: &Path) -> Result<Self> {
        make_folder(path, NO_FOLDER)?;
        let lock = FolderLock::take(path)?;
        let resumes = path.join(UNFINISHED).exists();
        let known = path.join(Report::FILE).exists() || resumes;
        if !known && path.join("index.html").exists() {
            let why = "is no report of this command and would be replaced; name another folder";
            return Err(Error::input(path.join("index.html"), 0, why));
        }
        for name in [RESULTS, PICTURES] {
            let folder = path.join(name);
            if !resumes && known && folder.is_dir() {
                fs::remove_dir_all(&folder).map_err(|source| Error::file(&folder, "empty", source))?;
            }
            make_folder(&folder, NO_FOLDER)?;
        }
        let folder = Self { path: path.into(), resumes, _lock: lock };
        folder.write(UNFINISHED, b"")?;
        Ok(folder)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Puts a file there.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        OutputFile::new(&self.path.join(name))?.write(bytes)
    }

    /// Puts a file among the pictures there.
    pub fn write_picture(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.write(&format!("{PICTURES}/{name}"), bytes)
    }

    /// Keeps a record for a run that goes on from here.
    pub fn keep(&self, record: &Record) -> Result<()> {
        let text = serde_json::to_string_pretty(record).unwrap_or_default();
        self.write(&format!("{RESULTS}/{}.json", record.name), text.as_bytes())
    }

    /// The record of a picture that an interrupted run was done with.
    pub fn kept(&self, name: &str, fingerprint: &str) -> Option<Record> {
        let text = fs::read_to_string(self.path.join(RESULTS).join(format!("{name}.json"))).ok()?;
        let record: Record = serde_json::from_str(&text).ok()?;
        (self.resumes && record.fingerprint == fingerprint).then_some(record)
    }

    /// Nothing is left to do.
    pub fn finish(&self) -> Result<()> {
        let path = self.path.join(UNFINISHED);
        fs::remove_file(&path).map_err(|source| Error::file(path, "remove", source))
    }
}

/// The files of a picture among [`PICTURES`]: result as EXR and PNG, reference and error as PNG.
pub fn files(name: &str) -> [String; 4] {
    ["exr", "png", "reference.png", "error.png"].map(|extension| format!("{name}.{extension}"))
}

/// The reports in these folders as one, and its pictures in `folder`.
pub fn merged(folders: &[PathBuf], output: &Path) -> Result<(Folder, Report)> {
    let reports: Vec<Report> = folders.iter().map(|folder| Report::read(folder)).collect::<Result<_>>()?;
    let wrong = |number: usize, message: String| Error::input(folders[number].join(Report::FILE), 0, message);
    let Some(first) = reports.first() else {
        return Err(Error::Usage("merge needs the folders of the parts; name them".into()));
    };
    let of = first.shard.map_or(1, |shard| shard.of);
    for (number, report) in reports.iter().enumerate() {
        let Some(shard) = report.shard else {
            return Err(wrong(number, "is of no part of a suite: it was made without --shard".into()));
        };
        if (&report.suite_hash, &report.vitrum, shard.of, report.schema)
            != (&first.suite_hash, &first.vitrum, of, first.schema)
        {
            let message = format!("is of another suite, version or division than {}", folders[0].display());
            return Err(wrong(number, message));
        }
        let same = |other: &Report| other.shard == report.shard;
        if let Some(before) = reports[..number].iter().position(same) {
            return Err(wrong(number, format!("is of part {shard}, as {} is", folders[before].display())));
        }
    }
    let missing = (1..=of).filter(|&index| !reports.iter().any(|one| one.shard.is_some_and(|one| one.index == index)));
    let missing: Vec<_> = missing.map(|index| format!("{index}/{of}")).collect();
    if !missing.is_empty() {
        return Err(Error::Usage(format!(
            "merge: the parts {} are missing; name their folders, too",
            missing.join(", ")
        )));
    }
    let is_part = |folder: &&PathBuf| folder.canonicalize().ok() == output.canonicalize().ok();
    if let Some(part) = folders.iter().filter(|_| output.exists()).find(is_part) {
        let why = "is one of the parts and would be replaced; name another folder for the report of all";
        return Err(Error::input(part, 0, why));
    }
    if let Some(part) = folders.iter().find(|folder| folder.join(UNFINISHED).exists()) {
        return Err(Error::input(part, 0, "holds a run that was interrupted; run that part again"));
    }
    let output = Folder::open(output)?;
    let mut pictures: Vec<Record> = Vec::new();
    for (folder, report) in folders.iter().zip(&reports) {
        for record in &report.pictures {
            for file in files(&record.name) {
                let from = folder.join(PICTURES).join(&file);
                if from.is_file() {
                    let bytes = fs::read(&from).map_err(|source| Error::file(&from, "read", source))?;
                    output.write_picture(&file, &bytes)?;
                }
            }
            pictures.push(record.clone());
        }
    }
    pictures.sort_by_key(|record| record.number);
    let messages = reports.iter().map(|report| report.validation_messages).sum();
    let seconds = reports.iter().map(|report| report.seconds).sum();
    let report = Report { shard: None, seconds, validation_messages: messages, pictures, ..first.clone() };
    Ok((output, report))
}
