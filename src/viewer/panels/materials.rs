//! The windows of the report: what glass is made of, and the original's controls.

use egui::{Color32, DragValue, Grid, Ui};
use glam::DVec3;

use super::super::state::{Edits, State};
use super::slider;
use crate::options::Model;
use crate::scene::{Dielectric, Dispersion, GLASSES, Opaque, Surface};

/// Index and roughness of each glass, and what else there is to a material.
pub(super) fn glass(ui: &mut Ui, state: &mut State, edits: &mut Edits) {
    let mut any = false;
    for (number, material) in state.scene.materials.iter_mut().enumerate() {
        ui.push_id(number, |ui| match &mut material.surface {
            Surface::Dielectric(glass) => {
                any = true;
                ui.strong(&material.name);
                Grid::new("glass").num_columns(2).show(ui, |ui| {
                    let mut ior = glass.ior;
                    if slider(ui, "Refraction Index", &mut ior, 1.0..=2.42) {
                        glass.set_ior(ior);
                        edits.scene = true;
                    }
                    edits.scene |= slider(ui, "Roughness", &mut glass.roughness, 0.0..=1.0);
                });
                ui.collapsing("more", |ui| edits.scene |= more(ui, glass));
            }
            Surface::Opaque(opaque) => {
                ui.collapsing(&material.name, |ui| edits.scene |= self::opaque(ui, opaque));
            }
        });
    }
    if !any {
        ui.label("no glass in this scene");
    }
}

fn more(ui: &mut Ui, glass: &mut Dielectric) -> bool {
    let mut changes = false;
    ui.horizontal(|ui| {
        ui.label("Made of");
        let named = GLASSES.iter().find(|one| one.ior == glass.ior && one.dispersion == glass.dispersion);
        egui::ComboBox::from_id_salt("named").selected_text(named.map_or("-", |one| one.name)).show_ui(ui, |ui| {
            for one in &GLASSES {
                if ui.selectable_label(named.is_some_and(|now| now.name == one.name), one.name).clicked() {
                    (glass.ior, glass.dispersion) = (one.ior, one.dispersion);
                    changes = true;
                }
            }
        });
    });
    Grid::new("more").num_columns(2).show(ui, |ui| {
        let mut dispersion = match glass.dispersion {
            Dispersion::None => 0.0,
            Dispersion::Khr(number) => number,
            Dispersion::Sellmeier(_) => 20.0 * (glass.index_at(486.1) - glass.index_at(656.3)) / (glass.ior - 1.0),
        };
        if slider(ui, "Dispersion", &mut dispersion, 0.0..=1.0) {
            glass.dispersion = if dispersion > 0.0 { Dispersion::Khr(dispersion) } else { Dispersion::None };
            changes = true;
        }
        ui.label("Absorbs").on_hover_text("what white becomes over the distance");
        ui.horizontal(|ui| {
            changes |= color(ui, &mut glass.attenuation_color);
            let mut absorbs = glass.attenuation_distance.is_finite();
            if ui.checkbox(&mut absorbs, "").on_hover_text("over a finite distance").changed() {
                glass.attenuation_distance = if absorbs { 0.05 } else { f64::INFINITY };
                changes = true;
            }
            if absorbs {
                let distance = DragValue::new(&mut glass.attenuation_distance).range(1e-6..=1e6).suffix(" m");
                changes |= ui.add(distance.speed(0.001).max_decimals(4)).changed();
            }
        });
        ui.end_row();
        ui.label("Thin-walled");
        changes |= ui.checkbox(&mut glass.thin_walled, "").changed();
        ui.end_row();
        ui.label("Priority");
        changes |= ui.add(DragValue::new(&mut glass.priority).range(-99..=99)).changed();
        ui.end_row();
    });
    changes
}

fn opaque(ui: &mut Ui, opaque: &mut Opaque) -> bool {
    let mut changes = false;
    Grid::new("opaque").num_columns(2).show(ui, |ui| {
        ui.label("Base colour");
        match opaque.base_color_texture {
            Some(_) => {
                ui.label("an image");
            }
            None => changes |= color(ui, &mut opaque.base_color),
        }
        ui.end_row();
        changes |= slider(ui, "Metallic", &mut opaque.metallic, 0.0..=1.0);
        changes |= slider(ui, "Roughness", &mut opaque.roughness, 0.0..=1.0);
        changes |= slider(ui, "Specular", &mut opaque.specular, 0.0..=1.0);
    });
    changes
}

/// A linear colour from 0 to 1.
fn color(ui: &mut Ui, color: &mut DVec3) -> bool {
    let before = color.as_vec3().to_array();
    let mut rgb = before;
    ui.color_edit_button_rgb(&mut rgb);
    // It comes back from other colour spaces, rounded: what was not touched stays as it is.
    let is_moved = rgb.iter().zip(before).any(|(now, before)| (now - before).abs() > 1e-4);
    if is_moved {
        *color = DVec3::from_array(rgb.map(|value| (f64::from(value.clamp(0.0, 1.0)) * 1e4).round() * 1e-4));
    }
    is_moved
}

/// The controls of the original's debug window.
pub(super) fn debug(ui: &mut Ui, state: &mut State, edits: &mut Edits) {
    let is_single = state.model() == Model::Single;
    let args = &mut state.args;
    ui.add_enabled_ui(is_single, |ui| {
        Grid::new("debug").num_columns(2).show(ui, |ui| {
            for (name, value, default) in [
                ("Tran Green", &mut args.transmission_green, 0.0),
                ("Refl Red", &mut args.reflection_red, 0.0),
                ("Tran Intensity", &mut args.transmission_intensity, 1.0),
                ("Refl Intensity", &mut args.reflection_intensity, 1.0),
            ] {
                let mut shown = value.unwrap_or(default);
                if slider(ui, name, &mut shown, 0.0..=1.0) {
                    *value = Some(shown);
                    edits.scene = true;
                }
            }
        });
        let mut flipped = args.flipped_ratio == Some(true);
        if ui.checkbox(&mut flipped, "flipped ratio").changed() {
            args.flipped_ratio = Some(flipped);
            edits.scene = true;
        }
    });
    if !is_single {
        ui.colored_label(Color32::GRAY, "controls of the model single");
    }
}
