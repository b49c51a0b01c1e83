//! The page of a validation run: what was tested on which device, what the layer said, what was rendered.

use std::fmt::Write;

use super::numerics_page::escaped;
use super::validate::{groups, summary, what};
use crate::validate::{Outcome, Record, Report, Said, Tested};

const STYLE: &str = "\
body { font: 15px/1.45 sans-serif; color: #222; max-width: 1320px; margin: 2em auto; padding: 0 1em }
code { background: #f2f2f2; padding: .1em .3em; overflow-wrap: anywhere }
h2 { border-top: 1px solid #ccc; padding-top: .6em }
h3 { margin: 1.2em 0 .2em }
table { border-collapse: collapse; width: 100% }
td { text-align: left; padding: .15em 1em .15em 0; border-bottom: 1px solid #e5e5e5; vertical-align: top }
td.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums }
td:first-child { white-space: nowrap; width: 19em }
td:nth-child(2) { width: 5em }
td:nth-child(3) { width: 4.5em }
td:nth-child(5) { width: 30% }
tr.bad td { background: #fdd; color: #900 }
tr.skipped td { color: #777 }
td img { image-rendering: pixelated; background: #000; width: 96px; margin-right: .4em; vertical-align: top }
.hash { font: 11px monospace; color: #777 }
details { font-size: 13px }
pre { white-space: pre-wrap; background: #f6f6f6; padding: .5em; margin: .3em 0 }";

/// The page.
pub fn html(report: &Report) -> String {
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Vitrum validate</title>\n\
         <style>\n{STYLE}\n</style>\n</head>\n<body>\n<h1>Validation of Vulkan devices</h1>\n\
         <p>{}. Vitrum {}; loader {}; VK_LAYER_KHRONOS_validation {}; {}. <code>{}</code></p>\n",
        escaped(&summary(report)),
        report.vitrum,
        report.loader,
        report.layer,
        escaped(&report.system),
        escaped(&report.command)
    );
    let bad: Vec<_> = report.checks().filter(|(_, check)| !check.outcome.is_good()).collect();
    if !bad.is_empty() {
        text += "<p>To be looked at:</p>\n<ul>\n";
        for (tested, check) in bad {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "<li><a href=\"#{}\">{}: {}</a>, {}: {}</li>",
                anchor(&tested.folder, check),
                escaped(&tested.device.name),
                escaped(&check.name),
                check.outcome.name().to_lowercase(),
                escaped(check.reasons.first().map_or("", String::as_str))
            );
        }
        text += "</ul>\n";
    }
    for tested in &report.devices {
        device(&mut text, tested);
    }
    text + "</body>\n</html>\n"
}

fn device(text: &mut String, tested: &Tested) {
    let Tested { device, manifest, folder, checks } = tested;
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "<h2>{}</h2>\n<p>{}, {:.1} GiB, {} ray queries{}</p>",
        escaped(&what(tested)),
        if device.kind.is_empty() { "unknown" } else { &device.kind },
        device.memory_bytes as f64 / f64::from(1 << 30),
        if device.ray_query { "with" } else { "without" },
        manifest.as_ref().map_or(String::new(), |manifest| format!("; <code>{}</code>", escaped(manifest)))
    );
    if !device.missing.is_empty() {
        let _ = writeln!(text, "<p>Cannot be used: it lacks {}.</p>", escaped(&device.missing.join(", ")));
    }
    if checks.iter().any(|check| check.name == "numerics" && !check.facts.is_empty()) {
        let _ = writeln!(text, "<p><a href=\"{folder}/numerics/index.html\">The numerics table of this device</a></p>");
    }
    for group in groups(checks) {
        let _ = writeln!(text, "<h3>{}</h3>\n<table>", escaped(group.name));
        for check in group.checks {
            row(text, check, folder);
        }
        *text += "</table>\n";
    }
}

/// Where a check stands on the page.
fn anchor(folder: &str, check: &Record) -> String {
    format!("{folder}-{}", check.name.replace('/', "-"))
}

fn row(text: &mut String, check: &Record, folder: &str) {
    let class = match check.outcome {
        Outcome::Passed => "",
        Outcome::Skipped => "skipped",
        Outcome::Failed | Outcome::Crashed | Outcome::Hung => "bad",
    };
    let mut details = escaped(&check.about);
    for reason in &check.reasons {
        let _ = write!(details, "<br><b>{}</b>", escaped(reason));
    }
    for fact in &check.facts {
        let _ = write!(details, "<br>{}", escaped(fact));
    }
    for said in &check.said {
        details += &message(said);
    }
    let mut pictures = String::new();
    for picture in &check.pictures {
        let [width, height] = picture.size;
        let hash = &picture.hash[..picture.hash.len().min(12)];
        let _ = write!(
            pictures,
            "<img src=\"{folder}/{}\" alt=\"{}\" title=\"{width}x{height}, {}\" loading=\"lazy\"><span class=\"hash\">{hash}</span> ",
            picture.file, check.name, picture.hash
        );
    }
    let _ = writeln!(
        text,
        "<tr class=\"{class}\" id=\"{}\"><td>{}</td><td>{}</td><td class=\"n\">{:.2} s</td><td>{details}</td><td>{pictures}</td></tr>",
        anchor(folder, check),
        escaped(&check.name),
        check.outcome.name(),
        check.seconds
    );
}

fn message(said: &Said) -> String {
    let Said { message, times, allowed } = said;
    let objects: Vec<_> = message
        .objects
        .iter()
        .map(|object| format!("{} {}", object.kind, object.name.as_deref().unwrap_or("without a name")))
        .collect();
    let counts = if allowed.is_some() { "" } else { " open" };
    let mut text = format!("<details{counts}><summary>{}", escaped(&message.rule));
    if *times > 1 {
        let _ = write!(text, ", {times} times");
    }
    if let Some(why) = allowed {
        let _ = write!(text, " (counts for nothing: {})", escaped(why));
    }
    let _ = write!(text, "</summary>{}", escaped(&objects.join("; ")));
    if !message.passes.is_empty() {
        let _ = write!(text, "; in {}", escaped(&message.passes.join(", ")));
    }
    let _ = write!(text, "<pre>{}</pre></details>", escaped(&message.text));
    text
}
