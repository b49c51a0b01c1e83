//! What `vitrum compare` found: a table, JSON.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use crate::compare::{Comparison, Exposures, Metric, NonFinite};

/// Schema 1 of `--json`. What is not finite is null.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/compare.md describes the members")]
pub struct CompareReport {
    pub schema: u32,
    pub vitrum: &'static str,
    pub test: String,
    pub reference: String,
    pub size: [u32; 2],
    pub metrics: MetricValues,
    pub max_at: [u32; 2],
    pub flip_kind: &'static str,
    pub exposures: Option<Exposures>,
    pub non_finite: NonFinite,
}

/// A member for each metric.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/compare.md describes the members")]
pub struct MetricValues {
    pub relmse: f64,
    pub mse: f64,
    pub psnr: f64,
    pub p99: f64,
    pub max: f64,
    pub flip: f64,
}

impl CompareReport {
    /// A report on the images at these paths.
    pub fn new(test: &Path, reference: &Path, found: &Comparison) -> Self {
        Self {
            schema: 1,
            vitrum: env!("CARGO_PKG_VERSION"),
            test: test.display().to_string(),
            reference: reference.display().to_string(),
            size: [found.width, found.height],
            metrics: MetricValues {
                relmse: found.relmse,
                mse: found.mse,
                psnr: found.psnr,
                p99: found.p99,
                max: found.max,
                flip: found.flip.mean,
            },
            max_at: found.max_at,
            flip_kind: if found.flip.exposures.is_some() { "hdr" } else { "ldr" },
            exposures: found.flip.exposures,
            non_finite: found.non_finite,
        }
    }

    /// The table for a terminal: a metric a line.
    pub fn table(&self) -> String {
        let MetricValues { relmse, mse, psnr, p99, max, flip } = self.metrics;
        let [x, y] = self.max_at;
        let kind = match self.exposures {
            Some(Exposures { start, count: 1, .. }) => format!("HDR-FLIP, exposure {start:+.2} EV"),
            Some(Exposures { start, stop, count }) => {
                format!("HDR-FLIP, {count} exposures from {start:+.2} to {stop:+.2} EV")
            }
            None => "LDR-FLIP".into(),
        };
        let mut rows = vec![
            (Metric::Relmse, format!("{relmse:.4e}"), String::new()),
            (Metric::Mse, format!("{mse:.4e}"), String::new()),
            (Metric::Psnr, format!("{psnr:.2}"), "dB".into()),
            (Metric::P99, format!("{p99:.4e}"), String::new()),
            (Metric::Max, format!("{max:.4e}"), format!("at {x},{y}")),
            (Metric::Flip, format!("{flip:.6}"), kind),
        ];
        if max == 0.0 {
            rows[4].2.clear();
        }
        let mut text = String::new();
        for (metric, value, more) in rows {
            let line = format!("{:8}{value:>12}  {more}", metric.name());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", line.trim_end());
        }
        let NonFinite { test, reference } = self.non_finite;
        if test + reference > 0 {
            let _ = writeln!(
                text,
                "not finite: {test} pixels of the image, {reference} of the reference, the first at {x},{y}"
            );
        }
        text
    }

    /// The report as one JSON object.
    pub fn json(&self) -> String {
        // Plain numbers and strings: nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}
