//! What `--model auto` would do: a section of the explanation.

use std::fmt;

use serde::Serialize;

use super::explain::counted;
use super::stats::{CandidateRow, Outcome};
use crate::choice::Choice;
use crate::options::Size;

/// What `--model auto` would render, on a device.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct PlanRow {
    pub device: String,
    pub size: [u32; 2],
    pub tolerance: Option<f64>,
    pub time_budget: Option<f64>,
    pub is_expected: bool,
    pub unmeasured: Option<&'static str>,
    pub best: CandidateRow,
    pub others: Vec<CandidateRow>,
}

impl PlanRow {
    /// What `choice` found for a picture of `size`.
    pub(super) fn new(device: &str, size: Size, choice: &Choice) -> Self {
        Self {
            device: device.into(),
            size: [size.width, size.height],
            tolerance: choice.goal.tolerance,
            time_budget: choice.goal.seconds,
            is_expected: choice.is_expected,
            unmeasured: choice.unmeasured,
            best: CandidateRow::new(&choice.best),
            others: choice.others.iter().map(CandidateRow::new).collect(),
        }
    }

    /// What is asked for, in words.
    fn goal(&self) -> String {
        let asked = [
            self.tolerance.map(|x| format!("--tolerance {x}")),
            self.time_budget.map(|x| format!("--time-budget {x}")),
        ];
        asked.into_iter().flatten().collect::<Vec<_>>().join(" ")
    }
}

impl fmt::Display for PlanRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size;
        writeln!(f, "\nPlan for {}, {width}x{height} on {}", self.goal(), self.device)?;
        for (i, row) in [&self.best].into_iter().chain(&self.others).enumerate() {
            let Outcome { samples, gpu_ms, error } = row.expected;
            let expected = match (gpu_ms, error, samples) {
                (Some(ms), Some(error), Some(samples)) => {
                    format!(
                        "{:.2} s, {}, 95 % of the pixels within {error:.1e}",
                        ms * 1e-3,
                        counted(samples as usize, "sample")
                    )
                }
                _ => format!("by the effects of the scene: {}", self.unmeasured.unwrap_or_default()),
            };
            writeln!(f, "{} {:<48} {expected}", if i == 0 { '*' } else { ' ' }, row.options)?;
        }
        if !self.is_expected && self.unmeasured.is_none() {
            writeln!(f, "  nothing is expected to keep that; the first comes closest")?;
        }
        Ok(())
    }
}
