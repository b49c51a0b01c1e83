//! The page of a regression run: each picture beside its reference, blinking or with a wipe between them, and where they differ.

use std::fmt::Write;

use super::numerics_page::escaped;
use super::regress::{measured, summary};
use crate::regress::{PICTURES, Record, Report};

const STYLE: &str = "\
body { font: 15px/1.45 sans-serif; color: #222; max-width: 1320px; margin: 2em auto; padding: 0 1em }
code { background: #f2f2f2; padding: .1em .3em; overflow-wrap: anywhere }
h2 { margin-bottom: .2em }
section { border-top: 1px solid #ccc; padding-bottom: 1em }
.bad h2 { color: #a00 }
.views { display: grid; grid-template-columns: repeat(auto-fill, minmax(230px, 1fr)); gap: 1em }
figure { margin: 0 }
figure img, .pair { width: 100%; display: block; image-rendering: pixelated; background: #000 }
figcaption { font-size: 13px }
.pair { position: relative }
.pair img { width: 100%; display: block }
.pair img + img { position: absolute; inset: 0 }
.wipe img + img { clip-path: inset(0 0 0 var(--at, 50%)) }
.wipe input { width: 100% }
.blink img + img { animation: blink 1.2s steps(1) infinite }
@keyframes blink { 0% { opacity: 0 } 50% { opacity: 1 } }
details { font-size: 13px }
table { border-collapse: collapse }
td { padding: 0 1em 0 0; vertical-align: top }";

const SCRIPT: &str = "\
for (const input of document.querySelectorAll('.wipe input')) {
  input.addEventListener('input', () => input.previousElementSibling.style.setProperty('--at', input.value + '%'));
}
const good = document.getElementById('good');
good.addEventListener('change', () => document.body.classList.toggle('bad-only', !good.checked));
document.body.classList.toggle('bad-only', !good.checked);";

/// The page; pictures that somebody has to look at come first.
pub fn html(report: &Report) -> String {
    let failures = report.failures();
    let suite = escaped(&report.suite);
    let devices: std::collections::BTreeSet<_> = report
        .pictures
        .iter()
        .map(|record| format!("{}, {}, Vulkan {}", record.device.name, record.device.driver, record.device.api))
        .collect();
    let devices = escaped(&devices.into_iter().collect::<Vec<_>>().join("; "));
    let shard = report.shard.map_or(String::new(), |shard| format!(", part {shard}"));
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Vitrum regress: {suite}</title>\n\
         <style>\n{STYLE}\n.bad-only section.good {{ display: none }}\n</style>\n</head>\n<body>\n<h1>Regression renders: {suite}</h1>\n\
         <p>{devices}. Vitrum {}{shard}. {}.</p>\n\
         <p><label><input type=\"checkbox\" id=\"good\"{}> show what is as it should be</label></p>\n",
        report.vitrum,
        escaped(&summary(report)),
        if failures == 0 { " checked" } else { "" }
    );
    let (good, bad): (Vec<_>, Vec<_>) = report.pictures.iter().partition(|record| record.outcome.is_good());
    for record in bad.into_iter().chain(good) {
        text += &section(record, report.blessed);
    }
    text + "<script>\n" + SCRIPT + "\n</script>\n</body>\n</html>\n"
}

fn section(record: &Record, blessed: bool) -> String {
    let class = if record.outcome.is_good() { "good" } else { "bad" };
    let name = &record.name;
    let mut text = format!(
        "<section class=\"{class}\" id=\"{name}\">\n<h2>{name}: {}</h2>\n<p>{}</p>\n",
        record.outcome.name(),
        escaped(&record.why)
    );
    // Writing to a string cannot fail.
    for reason in &record.reasons {
        let _ = writeln!(text, "<p><b>{}</b></p>", escaped(reason));
    }
    let image = |kind: &str| format!("<img src=\"{PICTURES}/{name}{kind}.png\" alt=\"{name}{kind}\" loading=\"lazy\">");
    let (reference, result) = if blessed { ("before", "now") } else { ("reference", "result") };
    text += "<div class=\"views\">\n";
    let mut figure = |content: &str, caption: &str| {
        let _ = writeln!(text, "<figure>{content}<figcaption>{caption}</figcaption></figure>");
    };
    match (record.has_result, record.has_reference) {
        (true, true) => {
            let both = image(".reference") + &image("");
            figure(&image(".reference"), reference);
            figure(&image(""), result);
            figure(&image(".error"), "|x - r| / (|r| + 0.1), logarithmic: black 1e-6, pale yellow 1");
            let wipe = "<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"wipe\">";
            figure(
                &format!("<div class=\"wipe\"><div class=\"pair\">{both}</div>{wipe}</div>"),
                &format!("{reference} left, {result} right"),
            );
            figure(&format!("<div class=\"blink\"><div class=\"pair\">{both}</div></div>"), "blinking");
        }
        (true, false) => figure(&image(""), result),
        _ => {}
    }
    text += "</div>\n<table>\n";
    let measures: Vec<_> = record.measures.iter().map(measured).collect();
    let time = format!("{} samples, {:.2} s", record.samples, record.seconds);
    let mut row = |key: &str, value: String| {
        if !value.is_empty() {
            let _ = writeln!(text, "<tr><td>{key}</td><td>{value}</td></tr>");
        }
    };
    row("measures", escaped(&measures.join(", ")));
    row("took", time);
    row("again", format!("<code>{}</code>", escaped(&record.regress)));
    row("rendered alone", format!("<code>{}</code>", escaped(&record.render)));
    text += "</table>\n";
    if !record.reference.is_empty() {
        text += "<details><summary>what the reference was made with</summary>\n<table>\n";
        for (key, value) in &record.reference {
            let _ = writeln!(text, "<tr><td>{}</td><td>{}</td></tr>", escaped(key), escaped(value));
        }
        text += "</table></details>\n";
    }
    text + "</section>\n"
}
