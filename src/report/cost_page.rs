//! The page of a cost report: plots and tables in one file, beside the pictures that it shows.

use std::fmt::Write;

use plotters::prelude::*;

use super::cost::{CostReport, EntryRow, error};
use super::numerics_page::escaped;
use super::plots::{Axis, COLORS, Drawn, GRID, INK, power_of_ten};
use crate::options::Model;

const STYLE: &str = "\
body { font: 15px/1.45 sans-serif; color: #222; max-width: 1320px; margin: 2em auto; padding: 0 1em }
svg { max-width: 100%; height: auto }
code { background: #f2f2f2; padding: .1em .3em }
table { border-collapse: collapse }
th, td { text-align: left; padding: .15em 1.2em .15em 0; border-bottom: 1px solid #e5e5e5; vertical-align: top }
th { border-bottom-color: #888 }
th.n, td.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
tr.best td { font-weight: bold }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(600px, 1fr)); gap: 1.2em }
figure { margin: 0 }
figure img { width: 49%; image-rendering: pixelated; background: #000 }
figcaption { font-size: 13px }";

/// The page.
pub(super) fn html(report: &CostReport) -> std::io::Result<String> {
    let device = escaped(&format!("{}, {}", report.device.name, report.device.driver));
    let scene = escaped(&report.scene);
    let [width, height] = report.size;
    let reference = &report.reference;
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Vitrum cost: {scene}</title>\n\
         <style>\n{STYLE}\n</style>\n</head>\n<body>\n<h1>What accuracy costs: {scene}</h1>\n\
         <p>{device}. Vitrum {}. {width}x{height} pixels, measured in {:.0} s: <code>{}</code></p>\n\
         <p>Errors are relMSE against <code>path</code> with {} samples per pixel, in two halves whose noise (relMSE {:.1e}) \
         drops out; what is below its uncertainty is told as that. Times are milliseconds of the device, the median of the \
         runs, without set-up.</p>\n",
        report.vitrum,
        report.seconds,
        escaped(&report.command),
        reference.samples,
        reference.noise
    );
    text += "<h2>Error against time</h2>\n";
    text += &plot(report)?;

    text += "<h2>What an error costs</h2>\n<table>\n<tr><th class=\"n\">relMSE</th><th class=\"n\">ms</th><th>options</th></tr>\n";
    for target in &report.targets {
        let ms = target.gpu_ms.map_or("-".into(), |ms| format!("{ms:.1}"));
        let tried = if target.extrapolated { " (not tried: extrapolated)" } else { "" };
        let how =
            target.options.as_deref().map_or("none was that close".into(), |o| format!("<code>{o}</code>{tried}"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "<tr><td class=\"n\">{:.0e}</td><td class=\"n\">{ms}</td><td>{how}</td></tr>",
            target.relmse
        );
    }
    text += "</table>\n<h2>Settings</h2>\n<p>In bold: nothing else is both faster and closer.</p>\n<table>\n\
             <tr><th>setting</th><th class=\"n\">ms</th><th class=\"n\">pipelines, ms</th><th class=\"n\">relMSE</th>\
             <th class=\"n\">FLIP</th><th>approximates</th><th>leaves out</th></tr>\n";
    for row in &report.entries {
        let class = if row.pareto { " class=\"best\"" } else { "" };
        let _ = writeln!(
            text,
            "<tr{class}><td><code>{}</code></td><td class=\"n\">{:.1}</td><td class=\"n\">{:.0}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{:.4}</td><td>{}</td><td>{}</td></tr>",
            row.options,
            row.gpu_ms,
            row.pipelines_ms,
            escaped(&error(row.relmse, row.relmse_error)),
            row.flip,
            row.approximate.join(", "),
            row.unsupported.join(", ")
        );
    }
    text += "</table>\n";
    for row in &report.left_out {
        let _ = writeln!(text, "<p>Left out: <code>{}</code>, about {:.0} s</p>", row.options, row.expected_ms * 1e-3);
    }
    if !report.effects.is_empty() {
        text += "<h2>Effects</h2>\n<p>The same frame with an effect and without it: what it costs, and how far off the picture is. \
                 The noise of <code>path</code> is in both.</p>\n<table>\n<tr><th>effect</th><th>model</th><th class=\"n\">ms with</th><th class=\"n\">without</th>\
                 <th class=\"n\">relMSE with</th><th class=\"n\">without</th></tr>\n";
    }
    for row in &report.effects {
        let with = escaped(&error(row.relmse_with, row.relmse_with_error));
        let without = escaped(&error(row.relmse_without, row.relmse_without_error));
        let _ = writeln!(
            text,
            "<tr><td>{}</td><td><code>{}</code>, {} samples</td><td class=\"n\">{:.1}</td><td class=\"n\">{:.1}</td>\
             <td class=\"n\">{with}</td><td class=\"n\">{without}</td></tr>",
            row.effect, row.model, row.samples, row.gpu_ms_with, row.gpu_ms_without
        );
    }
    if !report.effects.is_empty() {
        text += "</table>\n";
    }
    text += "<h2>Pictures</h2>\n<p>Right of each its FLIP against the reference: black is none, pale yellow is 1.</p>\n\
             <div class=\"pictures\">\n";
    let _ = writeln!(
        text,
        "<figure><img src=\"{}\" alt=\"reference\"><figcaption>the first half of the reference</figcaption></figure>",
        reference.image
    );
    for row in &report.entries {
        let _ = writeln!(
            text,
            "<figure><img src=\"{}\" alt=\"{}\"> <img src=\"{}\" alt=\"FLIP\"><figcaption><code>{}</code>: {:.1} ms, relMSE {}, FLIP \
             {:.4}</figcaption></figure>",
            row.image,
            row.label,
            row.map,
            row.options,
            row.gpu_ms,
            escaped(&error(row.relmse, row.relmse_error)),
            row.flip
        );
    }
    Ok(text + "</div>\n</body>\n</html>\n")
}

/// Pixels of the plot.
const SIZE: (u32, u32) = (1280, 620);

fn point(row: &EntryRow) -> (f64, f64) {
    (row.gpu_ms.max(1e-6).log10(), row.relmse.max(row.relmse_error).max(1e-12).log10())
}

/// What a plot can show.
fn shown(report: &CostReport) -> impl Iterator<Item = &EntryRow> + Clone {
    report.entries.iter().filter(|row| row.relmse.is_finite() && row.gpu_ms.is_finite())
}

/// An axis over whole powers of ten.
fn axis(values: impl Iterator<Item = f64>) -> Axis {
    let (least, most) =
        values.filter(|x| x.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let (from, to) = if least <= most { ((least - 0.1).floor(), (most + 0.2).ceil()) } else { (0.0, 1.0) };
    Axis { from, to, ticks: (from as i32..=to as i32).map(f64::from).collect() }
}

/// Pixels of a label's font, and about as many of a letter.
const LABEL: i32 = 13;
const LETTER: i32 = 7;

/// The boxes of labels: left, top, right, bottom.
#[derive(Default)]
struct Labels(Vec<[i32; 4]>);

impl Labels {
    /// Where `text` goes, seen from its point, so that it covers no other: above, below or left of it, else nowhere.
    fn place(&mut self, (x, y): (i32, i32), text: &str) -> Option<(i32, i32)> {
        let width = LETTER * text.len() as i32;
        let places = [(8, -LABEL - 3), (8, 4), (-8 - width, -LABEL - 3), (-8 - width, 4)];
        places.into_iter().find(|(dx, dy)| {
            let [left, top] = [x + dx, y + dy];
            let own = [left, top, left + width, top + LABEL];
            let is_free = !self
                .0
                .iter()
                .any(|other| own[0] < other[2] && other[0] < own[2] && own[1] < other[3] && other[1] < own[3]);
            if is_free {
                self.0.push(own);
            }
            is_free
        })
    }
}

/// relMSE against milliseconds, both logarithmic: a curve for each model, settings apart from its samples as points.
fn plot(report: &CostReport) -> std::io::Result<String> {
    let mut text = String::new();
    let points = || shown(report).map(point);
    let draw = |text| -> Drawn {
        let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let small = ("sans-serif", 15).into_font().color(&INK);
        let mut chart = ChartBuilder::on(&root)
            .margin(24)
            .x_label_area_size(48)
            .y_label_area_size(72)
            .build_cartesian_2d(axis(points().map(|(x, _)| x)), axis(points().map(|(_, y)| y)))?;
        chart
            .configure_mesh()
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(INK)
            .label_style(small.clone())
            .axis_desc_style(small.clone())
            .x_desc("milliseconds")
            .y_desc("relMSE")
            .x_label_formatter(&|place| power_of_ten(place.round() as i32))
            .y_label_formatter(&|place| power_of_ten(place.round() as i32))
            .draw()?;
        let mut best: Vec<_> = shown(report).filter(|row| row.pareto).map(point).collect();
        best.sort_by(|a, b| a.0.total_cmp(&b.0));
        chart
            .draw_series(DashedLineSeries::new(best, 6, 5, INK.stroke_width(1)))?
            .label("nothing else is both faster and closer")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 26, y)], INK.stroke_width(1)));
        let mut labels = Labels::default();
        for (model, color) in Model::ALL.into_iter().zip(COLORS) {
            let rows = || shown(report).filter(move |row| row.model == model.name());
            let is_plain =
                |row: &&EntryRow| !row.options.contains("--max-depth") && !row.options.contains("--tolerance");
            chart
                .draw_series(LineSeries::new(rows().filter(is_plain).map(point), color.stroke_width(2)))?
                .label(model.name())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 26, y)], color.stroke_width(3)));
            chart.draw_series(rows().map(|row| Circle::new(point(row), 5, color.filled())))?;
            let style = ("sans-serif", LABEL).into_font().color(&color);
            for row in rows() {
                let label = row.label.split_once(", ").map_or("", |(_, rest)| rest);
                if let Some(place) = labels.place(chart.backend_coord(&point(row)), label) {
                    let text = Text::new(label.to_owned(), place, style.clone());
                    chart.draw_series([EmptyElement::at(point(row)) + text])?;
                }
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .label_font(small)
            .draw()?;
        root.present()
    };
    draw(&mut text).map_err(std::io::Error::other)?;
    Ok(text)
}
