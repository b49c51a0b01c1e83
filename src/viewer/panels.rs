//! The windows within the window. Each says whether it changed anything that a picture shows.

use egui::{
    Align2, Color32, ComboBox, DragValue, Rect, Response, RichText, Slider, SliderClamping, TextureId, Ui, Window,
    pos2, vec2,
};

use super::{State, heights, orbit};
use crate::options::{Model, ModelChoice, Size, Tonemap};
use crate::scene::{Bounds, Surface};

/// All of them, around the picture.
pub(super) fn all(ui: &mut Ui, state: &mut State, texture: Option<TextureId>) -> bool {
    let mut changes = picture(ui, state, texture);
    let context = ui.ctx().clone();
    let window =
        |title: &'static str, at: [f32; 2]| Window::new(title).default_pos(at).default_width(250.0).resizable(false);
    window("Material Properties", [12.0, 12.0]).show(&context, |ui| changes |= material(ui, state));
    window("Debug", [12.0, 260.0]).show(&context, |ui| changes |= debug(ui, state));
    let right = context.content_rect().width() - 290.0;
    window("Render", [right, 12.0]).show(&context, |ui| changes |= render(ui, state));
    if let Some(error) = &state.error {
        let bar = Window::new("Error").title_bar(false).anchor(Align2::CENTER_BOTTOM, vec2(0.0, -12.0));
        bar.resizable(false).show(&context, |ui| ui.label(RichText::new(error).color(Color32::LIGHT_RED)));
    }
    changes
}

/// The picture behind all, with the camera in the pointer's hands.
fn picture(ui: &mut Ui, state: &mut State, texture: Option<TextureId>) -> bool {
    let area = ui.max_rect();
    let scale = ui.ctx().pixels_per_point();
    let mut changes = false;
    let pixels = |points: f32| ((points * scale).round() as u32).max(1);
    let window = Size { width: pixels(area.width()), height: pixels(area.height()) };
    if !state.sized && state.args.size != Some(window) {
        state.args.size = Some(window);
        changes = true;
    }
    let response = ui.allocate_rect(area, egui::Sense::click_and_drag());
    ui.painter().rect_filled(area, 0.0, Color32::from_gray(24));
    if let (Some(texture), Some(shown)) = (texture, &state.picture) {
        let whole = vec2(shown.whole.width as f32, shown.whole.height as f32) / scale;
        // As large as it is, or as there is room for.
        let fits = (area.width() / whole.x).min(area.height() / whole.y).min(1.0);
        let place = Rect::from_center_size(area.center(), whole * fits);
        let place = place.translate((place.min.to_vec2() * scale).round() / scale - place.min.to_vec2());
        let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(texture, place, all, Color32::WHITE);
    }
    changes | camera(ui, &response, state, area.height())
}

fn camera(ui: &Ui, response: &Response, state: &mut State, height: f32) -> bool {
    use egui::{Key, PointerButton};
    let drag = heights(response.drag_delta(), height);
    let shift = ui.input(|input| input.modifiers.shift);
    let pans = response.dragged_by(PointerButton::Middle) || response.dragged_by(PointerButton::Secondary);
    let mut changes = false;
    if drag != glam::DVec2::ZERO {
        if pans || shift {
            state.drag(|camera| orbit::pan(camera, drag));
        } else {
            state.drag(|camera| orbit::turn(camera, drag));
        }
        changes = true;
    }
    let scroll = f64::from(ui.input(|input| input.smooth_scroll_delta().y)) / 50.0;
    if response.hovered() && scroll != 0.0 {
        state.drag(|camera| orbit::dolly(camera, scroll));
        changes = true;
    }
    let typing = ui.ctx().egui_wants_keyboard_input();
    let pressed = |key| !typing && ui.input(|input| input.key_pressed(key));
    let held = |key| !typing && ui.input(|input| input.key_down(key));
    for (key, steps) in [(Key::W, 1.0), (Key::S, -1.0)] {
        if held(key) {
            state.drag(|camera| orbit::fly(camera, steps));
            ui.ctx().request_repaint();
            changes = true;
        }
    }
    if pressed(Key::Home) || pressed(Key::F) {
        let bounds = state.scene.bounds().unwrap_or(Bounds::EMPTY);
        let size = state.size();
        let aspect = f64::from(size.width) / f64::from(size.height);
        state.drag(|camera| orbit::frame(camera, bounds, aspect));
        changes = true;
    }
    changes
}

fn slider(ui: &mut Ui, name: &str, value: &mut f64, range: std::ops::RangeInclusive<f64>) -> bool {
    ui.label(name);
    // What a scene has beyond the slider's ends stays until it is moved.
    let slider = Slider::new(value, range).max_decimals(3).clamping(SliderClamping::Edits);
    let changed = ui.add(slider).changed();
    ui.end_row();
    changed
}

/// Index and roughness of each glass.
fn material(ui: &mut Ui, state: &mut State) -> bool {
    let mut changes = false;
    let mut any = false;
    for (number, material) in state.scene.materials.iter_mut().enumerate() {
        let Surface::Dielectric(glass) = &mut material.surface else { continue };
        any = true;
        ui.push_id(number, |ui| {
            ui.strong(&material.name);
            egui::Grid::new("glass").num_columns(2).show(ui, |ui| {
                changes |= slider(ui, "Refraction Index", &mut glass.ior, 1.0..=2.42);
                changes |= slider(ui, "Roughness", &mut glass.roughness, 0.0..=1.0);
            });
        });
    }
    if !any {
        ui.label("no glass in this scene");
    }
    changes
}

/// The controls of the original's debug window.
fn debug(ui: &mut Ui, state: &mut State) -> bool {
    let is_single = matches!(state.args.model, None | Some(ModelChoice::Only(Model::Single)));
    let args = &mut state.args;
    let mut changes = false;
    ui.add_enabled_ui(is_single, |ui| {
        egui::Grid::new("debug").num_columns(2).show(ui, |ui| {
            for (name, value, default) in [
                ("Tran Green", &mut args.transmission_green, 0.0),
                ("Refl Red", &mut args.reflection_red, 0.0),
                ("Tran Intensity", &mut args.transmission_intensity, 1.0),
                ("Refl Intensity", &mut args.reflection_intensity, 1.0),
            ] {
                let mut shown = value.unwrap_or(default);
                if slider(ui, name, &mut shown, 0.0..=1.0) {
                    *value = Some(shown);
                    changes = true;
                }
            }
        });
        let mut flipped = args.flipped_ratio == Some(true);
        if ui.checkbox(&mut flipped, "flipped ratio").changed() {
            args.flipped_ratio = Some(flipped);
            changes = true;
        }
    });
    if !is_single {
        ui.small("controls of the model single");
    }
    changes
}

/// The model, and what is asked of the picture.
fn render(ui: &mut Ui, state: &mut State) -> bool {
    let mut changes = false;
    let now = match state.args.model {
        Some(ModelChoice::Only(model)) => model,
        _ => Model::Single,
    };
    egui::Grid::new("render").num_columns(2).show(ui, |ui| {
        ui.label("Model");
        ComboBox::from_id_salt("model").selected_text(now.name()).show_ui(ui, |ui| {
            for model in Model::ALL {
                if ui.selectable_label(model == now, model.name()).clicked() && model != now {
                    state.args.model = Some(model.into());
                    changes = true;
                }
            }
        });
        ui.end_row();
        ui.label("Samples");
        let mut samples = state.args.samples.unwrap_or(if now == Model::Path { 256 } else { 16 });
        if ui.add(DragValue::new(&mut samples).range(1..=65536)).changed() {
            state.args.samples = Some(samples);
            changes = true;
        }
        ui.end_row();
        if now != Model::Single {
            ui.label("Depth");
            let mut depth = state.args.max_depth.unwrap_or(crate::plan::DEPTH);
            if ui.add(DragValue::new(&mut depth).range(1..=1024)).changed() {
                state.args.max_depth = Some(depth);
                changes = true;
            }
            ui.end_row();
        }
        let mut exposure = state.args.exposure.unwrap_or(0.0);
        if slider(ui, "Exposure", &mut exposure, -8.0..=8.0) {
            state.args.exposure = Some(exposure);
            changes = true;
        }
        ui.label("Tone curve");
        let curve = state.args.tonemap.unwrap_or_default();
        ComboBox::from_id_salt("curve").selected_text(curve.name()).show_ui(ui, |ui| {
            for other in [Tonemap::None, Tonemap::Neutral, Tonemap::Agx] {
                if ui.selectable_label(other == curve, other.name()).clicked() && other != curve {
                    state.args.tonemap = Some(other);
                    changes = true;
                }
            }
        });
        ui.end_row();
    });
    if let Some(picture) = &state.picture {
        ui.separator();
        let of = picture.of.map_or(String::new(), |of| format!(" of {of}"));
        let stands_in = picture.size != picture.whole;
        ui.label(match stands_in {
            true => format!("stand-in, {}", picture.size),
            false => format!("{}: {}{of} samples", picture.size, picture.samples),
        });
        for pass in &picture.passes {
            if let Some(ms) = pass.gpu_ms.filter(|_| !stands_in) {
                ui.small(format!("{}: {:.1} ms a sample", pass.name, ms / f64::from(picture.samples)));
            }
        }
        for lacking in &picture.lacks {
            ui.small(lacking);
        }
    }
    changes
}
