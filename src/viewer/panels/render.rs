//! The model, what is asked of the picture, and what it is held against.

use egui::{ComboBox, DragValue, Grid, Ui};

use super::super::session::Session;
use super::super::state::{Beside, Edits, Shows, State};
use super::super::worker::Picture;
use super::slider;
use crate::choice::TOLERANCE;
use crate::effects::Effect;
use crate::options::{MOST_SAMPLES, Model, RenderArgs, Tonemap};
use crate::plan::{DEPTH, DEPTH_OF_TOLERANCE};

pub(super) fn render(ui: &mut Ui, session: &mut Session, edits: &mut Edits) {
    let state = &mut session.state;
    let now = state.model();
    Grid::new("render").num_columns(2).show(ui, |ui| {
        ui.label("Model");
        ComboBox::from_id_salt("model").selected_text(now.name()).show_ui(ui, |ui| {
            for model in Model::ALL {
                if ui.selectable_label(model == now, model.name()).clicked() && model != now {
                    state.args = RenderArgs { tolerance: None, max_depth: None, ..state.args.clone() };
                    state.args.model = Some(model.into());
                    if !state.shows.is_of(model) {
                        state.shows = Shows::Light;
                    }
                    edits.model = true;
                }
            }
        });
        ui.end_row();
        ui.label("Samples");
        let mut samples = state.args.samples.unwrap_or(if now == Model::Path { 256 } else { 16 });
        if ui.add(DragValue::new(&mut samples).range(1..=MOST_SAMPLES)).changed() {
            state.args.samples = Some(samples);
            edits.model = true;
        }
        ui.end_row();
        if now != Model::Single {
            ui.label("Depth");
            let follows = state.args.tolerance.is_some() && now.traces();
            let mut depth = state.args.max_depth.unwrap_or(if follows { DEPTH_OF_TOLERANCE } else { DEPTH });
            if ui.add(DragValue::new(&mut depth).range(1..=1024)).changed() {
                state.args.max_depth = Some(depth);
                edits.model = true;
            }
            ui.end_row();
            ui.label("Tolerance");
            ui.horizontal(|ui| {
                let mut tolerates = state.args.tolerance.is_some();
                if ui.checkbox(&mut tolerates, "").changed() {
                    state.args.tolerance = tolerates.then_some(TOLERANCE);
                    edits.model = true;
                }
                if let Some(tolerance) = &mut state.args.tolerance {
                    let value = DragValue::new(tolerance).range(1e-5..=1.0).speed(1e-3).max_decimals(5);
                    edits.model |= ui.add(value).changed();
                }
            });
            ui.end_row();
        }
        let mut exposure = state.args.exposure.unwrap_or(0.0);
        if slider(ui, "Exposure", &mut exposure, -8.0..=8.0) {
            state.args.exposure = Some(exposure);
            edits.look = true;
        }
        ui.label("Tone curve");
        let curve = state.args.tonemap.unwrap_or_default();
        ComboBox::from_id_salt("curve").selected_text(curve.name()).show_ui(ui, |ui| {
            for other in [Tonemap::None, Tonemap::Neutral, Tonemap::Agx] {
                if ui.selectable_label(other == curve, other.name()).clicked() && other != curve {
                    state.args.tonemap = Some(other);
                    edits.look = true;
                }
            }
        });
        ui.end_row();
        ui.label("Shows");
        ComboBox::from_id_salt("shows").selected_text(state.shows.name()).show_ui(ui, |ui| {
            for shows in Shows::ALL {
                let can = shows.is_of(now);
                let label = ui.add_enabled(can, egui::Button::selectable(shows == state.shows, shows.name()));
                if label.clicked() && shows != state.shows {
                    state.shows = shows;
                    edits.look = true;
                }
            }
        });
        ui.end_row();
        beside(ui, state, edits);
    });
    ui.collapsing("Environment", |ui| environment(ui, session, edits));
    ui.collapsing("Effects", |ui| effects(ui, session, edits));
    progress(ui, session);
}

/// What is on the other side of the wipe.
fn beside(ui: &mut Ui, state: &mut State, edits: &mut Edits) {
    ui.label("Beside");
    let name = state.beside.as_ref().map_or("nothing", |beside| beside.name.as_str()).to_owned();
    ComboBox::from_id_salt("beside").selected_text(&name).show_ui(ui, |ui| {
        if ui.selectable_label(name == "nothing", "nothing").clicked() {
            (state.beside, state.pictures[1]) = (None, None);
            edits.beside = true;
        }
        for model in Model::ALL {
            if ui.selectable_label(name == model.name(), model.name()).clicked() {
                let args = RenderArgs { tolerance: None, max_depth: None, samples: None, ..state.args.clone() };
                let args = RenderArgs { model: Some(model.into()), ..args };
                state.beside = Some(Beside { scene: None, args, name: model.name().into() });
                edits.beside = true;
            }
        }
        if ui.selectable_label(name == "as it is now", "as it is now").clicked() {
            let (scene, args) = (Some(state.scene.clone()), state.args.clone());
            state.beside = Some(Beside { scene, args, name: "as it was".into() });
            edits.beside = true;
        }
    });
    ui.end_row();
}

fn environment(ui: &mut Ui, session: &mut Session, edits: &mut Edits) {
    let light = &mut session.state.scene.environment;
    Grid::new("environment").num_columns(2).show(ui, |ui| {
        let mut degrees = light.rotation.to_degrees();
        if slider(ui, "Rotation", &mut degrees, -180.0..=180.0) {
            light.rotation = degrees.to_radians();
            edits.scene = true;
        }
        edits.scene |= slider(ui, "Intensity", &mut light.intensity, 0.0..=4.0);
        ui.label("Visible");
        edits.scene |= ui.checkbox(&mut light.visible, "").changed();
        ui.end_row();
    });
}

/// Each effect: on, off, or as the scene calls for it, and why.
fn effects(ui: &mut Ui, session: &mut Session, edits: &mut Edits) {
    let state = &mut session.state;
    let model = state.model();
    for effect in Effect::all() {
        let called = effect.called_for_by(&state.scene);
        let wish = state.wish(effect);
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            for (text, value) in [("auto", None), ("on", Some(true)), ("off", Some(false))] {
                if ui.selectable_label(wish == value, text).clicked() && wish != value {
                    state.set_wish(effect, value);
                    edits.scene = true;
                }
            }
            let is_on = wish.unwrap_or(called);
            let color = if is_on { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() };
            let why = match called {
                true => state.why(effect),
                false => effect.absent().to_owned(),
            };
            let lacking = is_on && !effect.honoured_by(model);
            let mark = if lacking { format!("{} !", effect.name()) } else { effect.name().to_owned() };
            let label = egui::Label::new(egui::RichText::new(mark).size(11.5).color(color)).truncate();
            let label = ui.add(label).on_hover_text(why);
            if lacking {
                label.on_hover_text(format!("model {} does not simulate it", model.name()));
            }
        });
    }
}

/// Lines that what is said of the picture has at least: what is below does not move with each of them.
const LINES: f32 = 36.0;

fn progress(ui: &mut Ui, session: &Session) {
    let state = &session.state;
    let Some(picture) = &state.pictures[0] else { return };
    ui.separator();
    ui.vertical(|ui| {
        ui.set_min_height(LINES);
        let share = state.progress.map_or(String::new(), |share| format!("; {:.0} %", 100.0 * share));
        ui.label(format!("{}{share}", made(picture)));
        if let Some(legend) = picture.legend {
            let ends = format!("black {}, pale yellow {}", legend.low, legend.high);
            ui.small(format!("{}: {ends}", state.shows.name()));
        }
        for lacking in &picture.lacks {
            ui.small(lacking);
        }
    });
    let Some((beside, other)) = state.beside.as_ref().zip(state.pictures[1].as_ref()) else { return };
    ui.label(format!("{}: {}", beside.name, made(other)));
    for lacking in &other.lacks {
        ui.small(lacking);
    }
}

/// What a picture is.
fn made(picture: &Picture) -> String {
    let Picture { size, samples, stand_in, .. } = picture;
    let of = picture.of.map_or(String::new(), |of| format!(" of {of}"));
    let unit = if picture.of.unwrap_or(*samples) == 1 { "sample" } else { "samples" };
    match stand_in {
        true => format!("stand-in, {size}"),
        false => format!("{size}: {samples}{of} {unit}"),
    }
}
