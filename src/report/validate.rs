//! What a validation run came to: a table for a terminal, and one line.

use std::fmt::Write;

use crate::validate::{Outcome, Record, Report, Tested};

/// The table: a group of checks a line, and below it what did not pass.
pub fn table(report: &Report, only_bad: bool) -> String {
    let mut text = String::new();
    for tested in &report.devices {
        let Tested { device, checks, .. } = tested;
        if only_bad && checks.iter().all(|check| check.outcome.is_good()) {
            continue;
        }
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", what(tested));
        if !device.missing.is_empty() {
            let _ = writeln!(text, "  cannot be used: it lacks {}", device.missing.join(", "));
        }
        for group in groups(checks) {
            if !only_bad || group.checks.iter().any(|check| !check.outcome.is_good()) {
                let seconds: f64 = group.checks.iter().map(|check| check.seconds).sum();
                let counts = counts(group.checks.iter().map(|check| check.outcome));
                let _ = writeln!(text, "  {:16} {seconds:7.1} s  {counts}", group.name);
            }
            for check in group.checks.iter().filter(|check| !check.outcome.is_good()) {
                let _ = writeln!(text, "    {} {}", check.outcome.name(), check.name);
                for reason in &check.reasons {
                    let _ = writeln!(text, "      {reason}");
                }
            }
            for why in why_skipped(group.checks) {
                if !only_bad {
                    let _ = writeln!(text, "    skipped: {why}");
                }
            }
        }
    }
    text
}

/// What was tested: a device and its driver, or a manifest that drives none.
pub(super) fn what(tested: &Tested) -> String {
    let Tested { device, manifest, .. } = tested;
    match (device.api.is_empty(), manifest) {
        (true, Some(manifest)) => manifest.clone(),
        _ => format!("{}, {}, Vulkan {}", device.name, device.driver, device.api),
    }
}

/// One line of all.
pub fn summary(report: &Report) -> String {
    let is_usable = |tested: &&Tested| tested.device.missing.is_empty() && !tested.device.api.is_empty();
    let usable = report.devices.iter().filter(is_usable).count();
    let devices = if usable == 1 { "device" } else { "devices" };
    let (checks, messages) = (report.checks().count(), report.messages());
    let counts = counts(report.checks().map(|(_, check)| check.outcome));
    let state = if report.finished { "" } else { "not finished: " };
    format!("{state}{usable} {devices}, {checks} checks in {:.0} s: {counts}; {messages} messages", report.seconds)
}

/// Checks whose names start alike.
pub(super) struct Group<'a> {
    pub(super) name: &'a str,
    pub(super) checks: &'a [Record],
}

pub(super) fn groups(checks: &[Record]) -> impl Iterator<Item = Group<'_>> {
    let name = |check: &Record| check.name.split('/').next().unwrap_or_default().to_owned();
    checks
        .chunk_by(move |a, b| name(a) == name(b))
        .map(|checks| Group { name: checks[0].name.split('/').next().unwrap_or_default(), checks })
}

/// Each reason once.
fn why_skipped(checks: &[Record]) -> Vec<&str> {
    let skipped = checks.iter().filter(|check| check.outcome == Outcome::Skipped);
    let mut all: Vec<&str> = Vec::new();
    for reason in skipped.flat_map(|check| &check.reasons) {
        if !all.contains(&reason.as_str()) {
            all.push(reason);
        }
    }
    all
}

fn counts(outcomes: impl Iterator<Item = Outcome>) -> String {
    let all: Vec<_> = outcomes.collect();
    let count = |outcome: Outcome| all.iter().filter(|&&one| one == outcome).count();
    let some = Outcome::ALL.into_iter().filter(|&outcome| count(outcome) > 0);
    some.map(|outcome| format!("{} {}", count(outcome), outcome.name().to_lowercase())).collect::<Vec<_>>().join(", ")
}
