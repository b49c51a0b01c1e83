//! The page of a numerics report: the table and the plots in one file that needs no other.

use std::fmt::Write;

use super::NumericsReport;
use super::numerics::{bound, named_cause, number};

const STYLE: &str = "\
body { font: 15px/1.45 sans-serif; color: #222; max-width: 1320px; margin: 2em auto; padding: 0 1em }
svg { max-width: 100%; height: auto }
table { border-collapse: collapse; width: 100% }
th, td { text-align: left; padding: .15em .8em .15em 0; border-bottom: 1px solid #e5e5e5; vertical-align: top }
th { vertical-align: bottom; border-bottom-color: #888 }
th.n, td.n { text-align: right; padding-left: 1em; font-variant-numeric: tabular-nums; white-space: nowrap }
th.region, td:first-child { white-space: nowrap }
th.region { padding-top: 1.4em }
td.cause { font: 12px monospace; color: #555; padding-top: .4em }
tr.comparison td { color: #777 }
tr.broken td { background: #fdd; color: #900; font-weight: bold }";

/// The page.
pub(super) fn html(report: &NumericsReport, svg: Option<&str>) -> String {
    let device = escaped(&format!("{}, {}", report.device.name, report.device.driver));
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Vitrum numerics</title>\n\
         <style>\n{STYLE}\n</style>\n</head>\n<body>\n<h1>Optics functions against 64-bit arithmetic</h1>\n\
         <p>{device}. Vitrum {}. {}.</p>\n",
        env!("CARGO_PKG_VERSION"),
        report.summary()
    );
    if let Some(svg) = svg {
        text += "<h2>Worst error by angle of incidence, over all regions</h2>\n";
        text += svg;
    }
    text += "<h2>Regions</h2>\n<p>Rows in grey are for comparison: the textbook's formula in 32 bits.</p>\n<table>\n";
    for region in &report.regions {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "<tr><th class=\"region\">{}: {}</th><th class=\"n\">bound</th><th class=\"n\">found</th>\
             <th class=\"n\">mean</th><th>worst at, of {} inputs</th></tr>",
            region.function,
            escaped(region.region),
            region.count
        );
        let mut row = |class: &str, name: &str, numbers: [String; 3], cause: String| {
            let numbers = numbers.map(|number| format!("<td class=\"n\">{number}</td>")).concat();
            let name = escaped(name);
            let _ =
                writeln!(text, "<tr class=\"{class}\"><td>{name}</td>{numbers}<td class=\"cause\">{cause}</td></tr>");
        };
        for finding in &region.findings {
            let class = match (finding.holds(), finding.bound.is_finite()) {
                (false, _) => "broken",
                (true, false) => "comparison",
                (true, true) => "",
            };
            let cause = if finding.worst > 0.0 { named_cause(region.function, &finding.cause) } else { String::new() };
            let numbers = [bound(finding.bound), number(finding.found()), number(finding.mean)];
            row(class, &finding.measure, numbers, cause);
        }
        let class = if region.non_finite > 0 { "broken" } else { "" };
        let cause = region.non_finite_cause.as_deref().map(|cause| named_cause(region.function, cause));
        let numbers = ["0".into(), region.non_finite.to_string(), String::new()];
        row(class, "outputs that are not finite", numbers, cause.unwrap_or_default());
    }
    text + "</table>\n</body>\n</html>\n"
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
