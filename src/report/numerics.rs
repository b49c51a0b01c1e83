//! What `vitrum numerics` found: a table, JSON, plots, a page.

use std::fmt::Write;
use std::path::Path;

use serde::{Serialize, Serializer};

use super::{DeviceStats, numerics_page, plots};
use crate::gpu::DeviceInfo;
use crate::image::{OutputFile, check_folder, make_folder};
use crate::numerics::Function;
use crate::numerics::suite::{Finding, RegionReport};
use crate::{Error, Result};

/// Every region's findings on one device.
pub struct NumericsReport {
    pub(super) device: DeviceStats,
    seed: u64,
    pub(super) regions: Vec<RegionReport>,
}

/// The files of a report, all of which can be written.
pub struct NumericsFiles {
    json: OutputFile,
    plots: OutputFile,
    page: OutputFile,
}

/// What is said of an output that is a file.
const NO_FOLDER: &str = "is a file; without --inputs the output is a folder: name one";

impl NumericsFiles {
    /// Whether `folder` is one or can become one. Nothing is made yet.
    pub fn check(folder: &Path) -> Result<()> {
        check_folder(folder, NO_FOLDER)
    }

    /// Those in `folder`, which is made if it is not there.
    pub fn new(folder: &Path) -> Result<Self> {
        make_folder(folder, NO_FOLDER)?;
        let file = |name| OutputFile::new(&folder.join(name));
        Ok(Self { json: file("numerics.json")?, plots: file("numerics.svg")?, page: file("index.html")? })
    }
}

impl NumericsReport {
    /// A report.
    pub fn new(device: &DeviceInfo, seed: u64, regions: Vec<RegionReport>) -> Self {
        Self { device: DeviceStats::new(device), seed, regions }
    }

    fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.regions.iter().flat_map(|region| &region.findings)
    }

    fn broken(&self) -> Vec<&Finding> {
        self.findings().filter(|finding| !finding.holds()).collect()
    }

    fn bounds(&self) -> usize {
        self.findings().filter(|finding| finding.bound.is_finite()).count()
    }

    fn inputs(&self) -> u64 {
        self.regions.iter().map(|region| region.count).sum()
    }

    fn non_finite(&self) -> u64 {
        self.regions.iter().map(|region| region.non_finite).sum()
    }

    /// What broke a bound, if anything did.
    pub fn verdict(&self) -> Result<(), String> {
        let broken = self.broken();
        match (broken.first(), self.regions.iter().find(|region| region.non_finite > 0)) {
            (None, None) => Ok(()),
            (_, Some(region)) => Err(format!(
                "{} outputs are not finite, the first of {} at {}",
                self.non_finite(),
                region.function,
                named_cause(region.function, region.non_finite_cause.as_deref().unwrap_or_default())
            )),
            (Some(first), None) => Err(format!(
                "{} of {} bounds are broken, the first: {} ({}), {}: {}, bound {}, at {}",
                broken.len(),
                self.bounds(),
                first.function,
                first.region,
                first.measure,
                number(first.found()),
                bound(first.bound),
                named_cause(first.function, &first.cause)
            )),
        }
    }

    /// All in one line.
    pub fn summary(&self) -> String {
        format!(
            "{} inputs, {} outputs not finite, {} of {} bounds broken",
            self.inputs(),
            self.non_finite(),
            self.broken().len(),
            self.bounds()
        )
    }

    /// The table for a terminal: a block a function. The input that caused the worst error stands in its row where it is short, and
    /// below it where a bound is broken or `verbose` asks for it.
    pub fn table(&self, verbose: bool) -> String {
        let mut lines = vec![format!("{}, {}", self.device.name, self.device.driver)];
        let mut function = "";
        for region in &self.regions {
            if region.function != function {
                function = region.function;
                let head = format!("{function:NAME$}{:>9}{:>10}{:>10}", "bound", "found", "mean");
                let columns = columns(function);
                let head =
                    if columns.len() > INLINE { head } else { format!("{head}  worst at {}", columns.join(",")) };
                lines.extend([String::new(), head]);
            }
            lines.push(format!("  {}", region.region));
            for finding in &region.findings {
                let (mark, end) = if finding.holds() { (' ', "") } else { ('!', "  BROKEN") };
                let (measure, limit) = match finding.measure.strip_suffix(", textbook") {
                    Some(measure) => (measure, "textbook".into()),
                    None => (finding.measure.as_str(), bound(finding.bound)),
                };
                let (found, mean) = (number(finding.found()), number(finding.mean));
                let measure = format!("  {mark} {measure}");
                let row = format!("{measure:NAME$}{limit:>9}{found:>10}{mean:>10}{end}");
                let cause = values(&finding.cause);
                let has_cause = finding.worst > 0.0;
                let fits = finding.cause.len() <= INLINE && finding.holds();
                lines.push(if has_cause && fits { format!("{row}  {cause}") } else { row });
                if has_cause && !fits && (verbose || !finding.holds()) {
                    lines.push(format!("      at {}", named_cause(region.function, &finding.cause)));
                }
            }
            if region.non_finite > 0 || region.findings.is_empty() {
                let (mark, end) = if region.non_finite == 0 { (' ', "") } else { ('!', "  BROKEN") };
                let measure = format!("  {mark} outputs that are not finite");
                lines.push(format!("{measure:NAME$}{:>9}{:>10}{:>10}{end}", "0", region.non_finite, ""));
            }
            if let Some(cause) = &region.non_finite_cause {
                lines.push(format!("      at {}", named_cause(region.function, cause)));
            }
        }
        let mut text = String::new();
        for line in lines.iter().map(|line| line.trim_end()).chain(["", &self.summary()]) {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{line}");
        }
        text
    }

    /// Writes `numerics.json`, `numerics.svg` if there is something to plot, and `index.html`.
    pub fn write(&self, files: &NumericsFiles) -> Result<()> {
        let NumericsFiles { json, plots, page } = files;
        json.write(self.json().as_bytes())?;
        let svg = plots::svg(&self.regions).map_err(|source| Error::file(plots.path(), "draw", source))?;
        match &svg {
            Some(svg) => plots.write(svg.as_bytes())?,
            // Those of a report before are not of this one.
            None => match std::fs::remove_file(plots.path()) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::file(plots.path(), "remove", error));
                }
                _ => {}
            },
        }
        page.write(numerics_page::html(self, svg.as_deref()).as_bytes())
    }

    /// The report as one JSON object, schema 1. What is infinite, or does not apply, is null.
    pub fn json(&self) -> String {
        let file = NumericsJson {
            schema: 1,
            vitrum: env!("CARGO_PKG_VERSION"),
            device: &self.device,
            seed: self.seed,
            inputs: self.inputs(),
            non_finite: self.non_finite(),
            passed: self.verdict().is_ok(),
            regions: self.regions.iter().map(RegionJson::new).collect(),
        };
        // Plain numbers, strings and lists: nothing that could fail.
        serde_json::to_string_pretty(&file).unwrap_or_default() + "\n"
    }
}

/// Columns of the table that hold names.
const NAME: usize = 50;
/// Inputs of which a row has room for that many.
const INLINE: usize = 2;

fn columns(function: &str) -> &'static [&'static str] {
    Function::named(function).map_or(&[], |function| function.inputs)
}

/// A number that was found.
pub(super) fn number(x: f64) -> String {
    match x {
        0.0 => "0".into(),
        0.01..100.0 => format!("{x:.3}"),
        100.0..1e5 => format!("{x:.0}"),
        _ => format!("{x:.1e}"),
    }
}

/// A number that was chosen; `-` where there is none.
pub(super) fn bound(x: f64) -> String {
    match x {
        f64::INFINITY => "-".into(),
        0.0 | 0.01..1e4 => format!("{x}"),
        _ => format!("{x:e}"),
    }
}

/// As the CSV files of `--inputs` have them.
fn values(cause: &[f32]) -> String {
    cause.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(",")
}

pub(super) fn named_cause(function: &str, cause: &[f32]) -> String {
    columns(function).iter().zip(cause).map(|(column, x)| format!("{column}={x:?}")).collect::<Vec<_>>().join(" ")
}

/// docs/numerics.md describes the members.
#[derive(Serialize)]
struct NumericsJson<'a> {
    schema: u32,
    vitrum: &'static str,
    device: &'a DeviceStats,
    seed: u64,
    inputs: u64,
    non_finite: u64,
    passed: bool,
    regions: Vec<RegionJson<'a>>,
}

#[derive(Serialize)]
struct RegionJson<'a> {
    function: &'static str,
    region: &'static str,
    inputs: u64,
    non_finite: u64,
    non_finite_cause: Option<Cause<'a>>,
    findings: Vec<FindingJson<'a>>,
}

#[derive(Serialize)]
struct FindingJson<'a> {
    measure: &'a str,
    bound: Option<f64>,
    statistic: &'static str,
    found: f64,
    worst: f64,
    mean: f64,
    cause: Option<Cause<'a>>,
    by_angle_worst: Option<&'a [f64]>,
    holds: bool,
}

impl<'a> RegionJson<'a> {
    fn new(region: &'a RegionReport) -> Self {
        let cause = |values| Cause { function: region.function, values };
        let finding = |finding: &'a Finding| FindingJson {
            measure: &finding.measure,
            bound: finding.bound.is_finite().then_some(finding.bound),
            statistic: if finding.is_mean { "mean" } else { "worst" },
            found: finding.found(),
            worst: finding.worst,
            mean: finding.mean,
            cause: (finding.worst > 0.0).then(|| cause(&finding.cause)),
            by_angle_worst: finding.by_angle.as_deref(),
            holds: finding.holds(),
        };
        Self {
            function: region.function,
            region: region.region,
            inputs: region.count,
            non_finite: region.non_finite,
            non_finite_cause: region.non_finite_cause.as_deref().map(cause),
            findings: region.findings.iter().map(finding).collect(),
        }
    }
}

/// An object of columns and values, in the order of the columns.
struct Cause<'a> {
    function: &'static str,
    values: &'a [f32],
}

impl Serialize for Cause<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(columns(self.function).iter().zip(self.values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(worst: f64, non_finite: u64) -> NumericsReport {
        let device =
            DeviceStats { name: "<abacus>".into(), driver: "beads".into(), api: "1.4".into(), kind: "cpu".into() };
        let finding = |measure: &str, bound, worst| Finding {
            function: "fresnel",
            region: "somewhere",
            measure: measure.into(),
            bound,
            is_mean: false,
            count: 10,
            worst,
            cause: vec![0.1, 1.5],
            mean: worst / 2.0,
            by_angle: Some(vec![worst; 90]),
        };
        let findings = vec![
            finding("reflectance, absolute", 2e-6, worst),
            finding("reflectance, absolute, textbook", f64::INFINITY, 0.5),
        ];
        let non_finite_cause = (non_finite > 0).then(|| vec![0.0, 1.0]);
        let region = RegionReport {
            function: "fresnel",
            region: "somewhere",
            count: 10,
            non_finite,
            non_finite_cause,
            findings,
        };
        NumericsReport { device, seed: 3, regions: vec![region] }
    }

    #[test]
    fn broken_bounds_stand_out_and_name_their_cause() {
        assert_eq!(report(1e-6, 0).verdict(), Ok(()));
        let error = report(1e-5, 0).verdict().expect_err("a broken bound");
        assert!(error.starts_with("1 of 1 bounds are broken, the first: fresnel (somewhere)"), "{error}");
        assert!(error.ends_with("1.0e-5, bound 2e-6, at cos_i=0.1 eta=1.5"), "{error}");
        let table = report(1e-5, 0).table(false);
        assert!(table.contains("  ! reflectance, absolute") && table.contains("BROKEN"), "{table}");
        assert!(table.contains("textbook"), "{table}");
        assert!(!report(1e-6, 0).table(false).contains("BROKEN"));
        let error = report(f64::INFINITY, 2).verdict().expect_err("no numbers");
        assert_eq!(error, "2 outputs are not finite, the first of fresnel at cos_i=0.0 eta=1.0");
        assert!(report(f64::INFINITY, 2).table(true).lines().all(|line| line.len() <= 110));
    }

    #[test]
    fn json_has_no_number_where_there_is_none() {
        let json: serde_json::Value = serde_json::from_str(&report(f64::INFINITY, 1).json()).expect("JSON");
        assert_eq!((&json["schema"], &json["passed"], &json["inputs"]), (&1.into(), &false.into(), &10.into()));
        let region = &json["regions"][0];
        assert_eq!(region["non_finite_cause"]["eta"], 1.0);
        assert!(region["findings"][0]["found"].is_null() && region["findings"][0]["by_angle_worst"][0].is_null());
        assert!(region["findings"][1]["bound"].is_null());
        assert_eq!(region["findings"][1]["cause"]["cos_i"].to_string(), "0.1");
    }

    #[test]
    fn files_hold_what_was_found_and_names_are_escaped() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path().join("new/report");
        report(f64::INFINITY, 1).write(&NumericsFiles::new(&place).expect("files")).expect("written");
        let read = |name: &str| std::fs::read_to_string(place.join(name)).expect(name);
        assert!(read("index.html").contains("&lt;abacus&gt;") && read("index.html").contains("<svg"));
        assert!(read("numerics.svg").starts_with("<svg") && read("numerics.json").starts_with('{'));
        let error = NumericsFiles::check(&place.join("index.html/deeper")).expect_err("a file is there");
        assert!(error.to_string().contains("index.html: is a file"), "{error}");
    }
}
