//! What the picture costs and how far off it is, what else there is, and what chooses by that.

use egui::{Align2, Color32, Rangef, Slider, Ui};
use egui_plot::{AxisHints, Line, MarkerShape, Plot, PlotPoint, PlotPoints, Points, Text, uniform_grid_spacer};

use super::super::session::{Session, Target};
use super::super::state::Edits;
use crate::choice::Goal;
use crate::options::{Model, RenderArgs};

/// How long curves are drawn.
const MOST_MS: f64 = 3.6e6;

fn color(model: Model) -> Color32 {
    match model {
        Model::Single => Color32::from_rgb(240, 160, 60),
        Model::Double => Color32::from_rgb(120, 200, 90),
        Model::Tree => Color32::from_rgb(90, 170, 240),
        Model::Path => Color32::from_rgb(220, 110, 190),
    }
}

pub(super) fn cost(ui: &mut Ui, session: &mut Session, edits: &mut Edits) {
    // What is in the hand comes first: what grows below does not move it.
    targets(ui, session, edits);
    ui.separator();
    error(ui, session);
    offers(ui, session);
    ui.separator();
    times(ui, session);
}

/// Milliseconds a sample, now and before.
fn times(ui: &mut Ui, session: &Session) {
    let history = &session.cost.history;
    let Some(last) = history.back() else { return };
    let all: f64 = last.iter().map(|(_, ms)| ms).sum();
    ui.label(format!("{all:.1} ms a sample on the device"));
    for (name, ms) in last {
        ui.small(format!("{name} {ms:.1} ms"));
    }
    let sums = history.iter().enumerate().map(|(i, passes)| [i as f64, passes.iter().map(|(_, ms)| ms).sum()]);
    let line = Line::new("ms", PlotPoints::from_iter(sums)).color(Color32::LIGHT_BLUE);
    let plot = Plot::new("times").height(60.0).show_x(false).allow_drag(false).allow_zoom(false).allow_scroll(false);
    plot.show_axes([false, true]).include_y(0.0).show(ui, |plot| plot.line(line));
}

/// How far off the picture is.
fn error(ui: &mut Ui, session: &Session) {
    let revision = session.state.revision;
    let cost = &session.cost;
    if let Some((_, why)) = cost.no_error.as_ref().filter(|(of, _)| *of == revision) {
        ui.label(why);
        return;
    }
    match cost.error.filter(|(of, _)| *of == revision) {
        Some((_, measured)) => {
            let label = ui.label(format!("95 % of the pixels are within {}", short(measured.error)));
            label.on_hover_text("|x - r| / (r + 0.1), each channel for itself, against a reference that converges");
            let (model, samples) = (measured.model.name(), measured.samples);
            let noise = match measured.noise > 0.0 {
                true => format!(", itself within {}", short(measured.noise)),
                false => String::new(),
            };
            one_line(ui, format!("of {model}, {}{noise}", counted(samples)));
        }
        None => {
            ui.label("measuring how far off this is ...");
            one_line(ui, String::new());
        }
    }
}

/// An error with two digits.
fn short(error: f64) -> String {
    if (0.01..10.0).contains(&error) { format!("{error:.2}") } else { format!("{error:.1e}") }
}

fn counted(samples: u32) -> String {
    if samples == 1 { "1 sample".into() } else { format!("{samples} samples") }
}

/// Text that takes one line, however long it is.
fn one_line(ui: &mut Ui, text: String) {
    ui.add(egui::Label::new(egui::RichText::new(if text.is_empty() { " ".into() } else { text }).small()).truncate());
}

/// A tolerance or a frame rate that chooses the model.
fn targets(ui: &mut Ui, session: &mut Session, edits: &mut Edits) {
    let cost = &mut session.cost;
    ui.horizontal(|ui| {
        ui.label("Choose by");
        ui.selectable_value(&mut cost.target, Target::None, "hand");
        ui.selectable_value(&mut cost.target, Target::Tolerance, "error");
        ui.selectable_value(&mut cost.target, Target::FrameRate, "rate");
    });
    ui.spacing_mut().slider_width = 120.0;
    match cost.target {
        Target::None => {}
        Target::Tolerance => {
            ui.add(Slider::new(&mut cost.tolerance, 1e-3..=0.5).logarithmic(true).max_decimals(3).text("error"));
        }
        Target::FrameRate => {
            ui.add(Slider::new(&mut cost.rate, 0.1..=120.0).logarithmic(true).max_decimals(1).text("a second"));
        }
    }
    let goal = match cost.target {
        Target::None => return,
        Target::Tolerance => Goal { tolerance: Some(cost.tolerance), seconds: None },
        Target::FrameRate => Goal { tolerance: None, seconds: Some(1.0 / cost.rate) },
    };
    let Some((of, offers)) = cost.offers.as_ref().filter(|(of, _)| *of == session.state.scene_revision) else {
        one_line(ui, "as soon as it is known what there is".into());
        return;
    };
    let asked = (*of, cost.target, cost.tolerance, cost.rate);
    let changed = cost.applied != Some(asked);
    let Some(best) = offers.ranked(goal).into_iter().next() else {
        one_line(ui, "nothing tells how far off a model is".into());
        return;
    };
    let (name, samples, ms, error) = (best.model.name(), best.samples, best.ms, best.error);
    let time = if ms < 1e3 { format!("{ms:.0} ms") } else { format!("{:.1} s", ms * 1e-3) };
    one_line(ui, format!("{name}, {}: {time}", counted(samples)));
    one_line(ui, format!("95 % of the pixels expected within {}", short(error)));
    session.cost.applied = Some(asked);
    let RenderArgs { model, samples, max_depth, tolerance, .. } = best.args;
    let args = &mut session.state.args;
    let now = (args.model, args.samples, args.max_depth, args.tolerance);
    if changed && now != (model, samples, max_depth, tolerance) {
        (args.model, args.samples, args.max_depth, args.tolerance) = (model, samples, max_depth, tolerance);
        edits.model = true;
    }
}

/// Error against time, of all models.
fn offers(ui: &mut Ui, session: &Session) {
    let revision = session.state.revision;
    let Some((of, offers)) = &session.cost.offers else {
        one_line(ui, "measuring what the models have to offer ...".into());
        return;
    };
    let is_old = *of != session.state.scene_revision;
    one_line(
        ui,
        if is_old { "as it was before the last change".into() } else { "error against time; * is here".into() },
    );
    let log = |[ms, error]: [f64; 2]| [ms.max(1e-3).log10(), error.max(1e-9).log10()];
    let decade = |mark: egui_plot::GridMark, _: &_| format!("1e{:.0}", mark.value);
    let close = Rangef::new(12.0, 24.0);
    let milliseconds = AxisHints::new_x().label("ms").formatter(decade).label_spacing(close);
    let errors = AxisHints::new_y().label("error").formatter(decade).label_spacing(close);
    let grid = || uniform_grid_spacer(|_| [1.0, 1.0, 1.0]);
    let plot = Plot::new("offers").height(170.0).custom_x_axes(vec![milliseconds]).custom_y_axes(vec![errors]);
    let plot = plot.x_grid_spacer(grid()).y_grid_spacer(grid()).show_x(false).show_y(false);
    let plot = plot.allow_scroll(false).allow_drag(false).allow_zoom(false);
    let here = session.cost.error.filter(|(of, _)| *of == revision).map(|(_, measured)| measured.error);
    let picture = session.state.pictures[0].as_ref();
    let ms = picture.filter(|picture| !picture.stand_in).and_then(|picture| {
        let one: Option<f64> = picture.passes.iter().map(|pass| pass.gpu_ms).sum();
        Some(one? / f64::from(picture.samples) * f64::from(picture.of.unwrap_or(picture.samples)))
    });
    plot.show(ui, |plot| {
        for (model, depth, curve) in offers.curves(MOST_MS) {
            let points: Vec<_> = curve.into_iter().map(log).collect();
            // Named where it begins.
            if let Some(&[x, y]) = points.first() {
                let name = match depth {
                    Some(depth) => format!("{} {depth}", model.name()),
                    None => model.name().into(),
                };
                let name = egui::RichText::new(name).small().color(color(model));
                let side = if model.traces() { Align2::RIGHT_TOP } else { Align2::LEFT_TOP };
                plot.text(Text::new(model.name(), PlotPoint::new(x, y), name).anchor(side));
            }
            plot.line(Line::new(model.name(), PlotPoints::from_iter(points)).color(color(model)));
        }
        if let (Some(error), Some(ms)) = (here, ms) {
            let here = Points::new("here", PlotPoints::from_iter([log([ms, error])]));
            plot.points(here.shape(MarkerShape::Asterisk).radius(7.0).color(Color32::WHITE));
        }
    });
}
