//! What a run of a suite came to: a table for a terminal, JUnit's XML.

use std::fmt::Write;
use std::time::Duration;

use quick_junit::{NonSuccessKind, Report as JUnit, TestCase, TestCaseStatus, TestSuite};

use crate::regress::{Measured, Outcome, Record, Report};

/// The table: a picture a line, and what is wrong with it below.
pub fn table(report: &Report, only_bad: bool) -> String {
    let shown = || report.pictures.iter().filter(|record| !only_bad || !record.outcome.is_good());
    let width = shown().map(|record| record.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for record in shown() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{:13} {:width$} {:6.2} s", record.outcome.name(), record.name, record.seconds);
        let limited: Vec<_> = record.measures.iter().filter(|measure| measure.limit.is_some()).map(measured).collect();
        let _ = writeln!(text, "  {}", limited.join("  "));
        for reason in &record.reasons {
            let _ = writeln!(text, "    {reason}");
        }
        if !record.outcome.is_good() {
            let _ = writeln!(text, "    again: {}", record.regress);
        }
    }
    text
}

/// A measure and its limit.
pub(super) fn measured(measure: &Measured) -> String {
    let number = |value: f64| if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") };
    let value = measure.value.map_or("-".into(), number);
    match measure.limit {
        Some(limit) => format!("{} {value}/{limit}", measure.name),
        None => format!("{} {value}", measure.name),
    }
}

/// One line of all.
pub fn summary(report: &Report) -> String {
    let all = [
        Outcome::Passed,
        Outcome::Unchanged,
        Outcome::New,
        Outcome::Changed,
        Outcome::KnownFault,
        Outcome::Failed,
        Outcome::NoReference,
        Outcome::Error,
        Outcome::FaultGone,
    ];
    let counts = all.into_iter().map(|outcome| (report.count(outcome), outcome.name().to_lowercase()));
    let counts: Vec<_> =
        counts.filter(|(count, _)| *count > 0).map(|(count, name)| format!("{count} {name}")).collect();
    if report.pictures.is_empty() {
        return "no pictures in this part of the suite: nothing was compared".into();
    }
    let number = report.pictures.len();
    let pictures = if number == 1 { "picture" } else { "pictures" };
    format!("{number} {pictures} in {:.1} s: {}", report.seconds, counts.join(", "))
}

/// The XML that CI systems read.
pub fn junit(report: &Report) -> std::io::Result<Vec<u8>> {
    let mut suite = TestSuite::new(report.suite.clone());
    suite.set_time(Duration::from_secs_f64(report.seconds));
    for record in &report.pictures {
        let mut case = TestCase::new(record.name.clone(), status(record));
        case.set_classname(report.suite.clone()).set_time(Duration::from_secs_f64(record.seconds));
        let measures: Vec<_> = record.measures.iter().map(measured).collect();
        case.set_system_out(format!("{}\n{}\n{}", record.why, measures.join("\n"), record.regress));
        suite.add_test_case(case);
    }
    let mut whole = JUnit::new("vitrum regress");
    whole.set_time(Duration::from_secs_f64(report.seconds));
    whole.add_test_suite(suite);
    let mut bytes = Vec::new();
    whole.serialize(&mut bytes).map_err(std::io::Error::other)?;
    Ok(bytes)
}

fn status(record: &Record) -> TestCaseStatus {
    let mut status = match record.outcome {
        Outcome::Passed | Outcome::New | Outcome::Changed | Outcome::Unchanged => return TestCaseStatus::success(),
        Outcome::KnownFault => TestCaseStatus::skipped(),
        Outcome::Error | Outcome::NoReference => TestCaseStatus::non_success(NonSuccessKind::Error),
        Outcome::Failed | Outcome::FaultGone => TestCaseStatus::non_success(NonSuccessKind::Failure),
    };
    status.set_type(record.outcome.name().to_lowercase()).set_message(record.reasons.join("; "));
    status
}
