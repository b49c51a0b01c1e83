//! What is kept of a validation run: each check and what came of it, as JSON.

use serde::{Deserialize, Serialize};

use crate::gpu::Message;

/// How a check went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// As it should.
    Passed,
    /// Something came out otherwise, or the validation layer complained.
    Failed,
    /// The device, the layer or the system cannot.
    Skipped,
    /// The process that ran it died.
    Crashed,
    /// It took too long and was ended.
    Hung,
}

impl Outcome {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Passed, Self::Skipped, Self::Failed, Self::Crashed, Self::Hung];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "FAILED",
            Self::Skipped => "skipped",
            Self::Crashed => "CRASHED",
            Self::Hung => "HUNG",
        }
    }

    /// Whether nobody has to look at it.
    pub fn is_good(self) -> bool {
        matches!(self, Self::Passed | Self::Skipped)
    }
}

/// A picture that a check made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/validate.md describes the members")]
pub struct Picture {
    pub name: String,
    pub size: [u32; 2],
    /// Of its radiance, bit for bit.
    pub hash: String,
    /// In the folder of the report.
    pub file: String,
}

/// Something that the layer said, once or more often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/validate.md describes the members")]
pub struct Said {
    #[serde(flatten)]
    pub message: Message,
    pub times: usize,
    /// Why it counts for nothing, where it does not.
    pub allowed: Option<String>,
}

/// What came of a check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/validate.md describes the members")]
pub struct Record {
    pub name: String,
    pub about: String,
    pub outcome: Outcome,
    /// Why it did not pass.
    pub reasons: Vec<String>,
    /// What else was found.
    pub facts: Vec<String>,
    pub said: Vec<Said>,
    pub pictures: Vec<Picture>,
    pub seconds: f64,
}

impl Record {
    /// Of a check that is about to be done.
    pub fn new(name: &str, about: &str) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            outcome: Outcome::Passed,
            reasons: Vec::new(),
            facts: Vec::new(),
            said: Vec::new(),
            pictures: Vec::new(),
            seconds: 0.0,
        }
    }
}

/// A device and its checks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/validate.md describes the members")]
pub struct Tested {
    #[serde(flatten)]
    pub device: Listed,
    /// The driver's manifest, where one was named.
    pub manifest: Option<String>,
    /// The folder of its pictures in that of the report.
    pub folder: String,
    pub checks: Vec<Record>,
}

/// A device as `vitrum devices --json` lists it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/validate.md describes the members")]
pub struct Listed {
    pub index: usize,
    pub name: String,
    pub driver: String,
    pub api: String,
    #[serde(rename = "type")]
    pub kind: String,
    pub memory_bytes: u64,
    pub ray_query: bool,
    pub missing: Vec<String>,
}

/// Schema 1 of `validate.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "docs/validate.md describes the members")]
pub struct Report {
    pub schema: u32,
    pub vitrum: String,
    pub command: String,
    pub system: String,
    pub loader: String,
    pub layer: String,
    /// Whether everything was done; what was interrupted is kept as far as it went.
    pub finished: bool,
    pub seconds: f64,
    pub devices: Vec<Tested>,
}

impl Report {
    /// The schema that is written.
    pub const SCHEMA: u32 = 1;

    /// The file in the folder of a report.
    pub const FILE: &str = "validate.json";

    /// As JSON.
    pub fn json(&self) -> String {
        // Plain numbers and strings: nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Every check of every device.
    pub fn checks(&self) -> impl Iterator<Item = (&Tested, &Record)> {
        self.devices.iter().flat_map(|tested| tested.checks.iter().map(move |check| (tested, check)))
    }

    /// How many came out like that.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.checks().filter(|(_, check)| check.outcome == outcome).count()
    }

    /// Messages that count.
    pub fn messages(&self) -> usize {
        let said = self.checks().flat_map(|(_, check)| &check.said);
        said.filter(|said| said.allowed.is_none()).map(|said| said.times).sum()
    }
}
