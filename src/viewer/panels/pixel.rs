//! One pixel: its value, and the tree of reflections and refractions behind it, as a list and as rays in the scene.

use egui::{Color32, Painter, Rect, Stroke, Ui, pos2};
use glam::DVec3;

use super::super::inspect::{End, Event, Way};
use super::super::session::Session;
use super::super::state::Edits;
use super::name_of;
use crate::scene::Camera;

/// Lines of the list that are shown.
const MOST_LINES: usize = 120;

pub(super) fn pixel(ui: &mut Ui, session: &mut Session, edits: &mut Edits) {
    let Some([x, y]) = session.pixel.pixel else {
        ui.label("click a pixel");
        return;
    };
    ui.horizontal(|ui| {
        ui.strong(format!("{x}, {y}"));
        if ui.button("clear").clicked() {
            (session.pixel.pixel, session.pixel.inspection) = (None, None);
            edits.look = true;
        }
    });
    let picture = session.state.pictures[0].as_ref();
    let value = picture.and_then(|picture| picture.value).filter(|(of, _)| *of == [x, y]);
    if let Some((_, [r, g, b])) = value {
        ui.label(format!("radiance {r:.4}, {g:.4}, {b:.4}")).on_hover_text("linear Rec. 709");
    }
    let Some((of, inspection)) = &session.pixel.inspection else {
        ui.small("asking ...");
        return;
    };
    if *of != session.state.revision {
        ui.small("as it was before the last change");
    }
    if !inspection.is_followed && inspection.events.len() > 1 {
        ui.small("the model of the picture follows fewer of these");
    }
    ui.spacing_mut().item_spacing.y = 1.0;
    let followed: Vec<_> = inspection.events.iter().filter(|event| event.end != End::CutOff).collect();
    for event in followed.iter().take(MOST_LINES) {
        line(ui, session, event);
    }
    if followed.len() > MOST_LINES {
        ui.small(format!("and {} more", followed.len() - MOST_LINES));
    }
}

fn line(ui: &mut Ui, session: &Session, event: &Event) {
    let (way, color) = match event.way {
        Way::Camera => ("", Color32::LIGHT_GRAY),
        Way::Reflected => ("R ", Color32::from_rgb(240, 140, 120)),
        Way::Refracted => ("T ", Color32::from_rgb(130, 220, 150)),
        Way::Through => ("  ", Color32::GRAY),
    };
    let share = 100.0 * event.throughput.element_sum() / 3.0;
    let angle = event.angle.to_degrees();
    let end = match &event.end {
        End::Surroundings => "surroundings".into(),
        End::CutOff => "not followed".into(),
        End::Opaque => format!("opaque, {angle:.1} deg"),
        End::Nothing => "no change of index".into(),
        End::Interface { reflectance, refracted: Some(bent), .. } => {
            format!("{angle:.1} > {:.1} deg, F {reflectance:.3}", bent.to_degrees())
        }
        End::Interface { .. } => format!("{angle:.1} deg, total reflection"),
    };
    let indent = ".".repeat(event.depth.min(12) as usize);
    let text = format!("{indent}{way}{share:.1} % {end}");
    let scene = &session.state.scene;
    let label = ui.add(egui::Label::new(egui::RichText::new(text).size(11.0).color(color)).truncate());
    label.on_hover_ui(|ui| {
        if let Some(object) = event.object.filter(|&object| object < scene.objects.len()) {
            ui.label(name_of(scene, object));
        }
        if let End::Interface { eta_i, eta_t, .. } = event.end {
            ui.label(format!("index {eta_i:.4} to {eta_t:.4}"));
        }
        let [r, g, b] = event.throughput.to_array();
        ui.label(format!("throughput {r:.4}, {g:.4}, {b:.4}"));
        if event.distance.is_finite() {
            ui.label(format!("after {:.4} m", event.distance));
            let [x, y, z] = event.normal.to_array();
            ui.label(format!("normal {x:.3}, {y:.3}, {z:.3}"));
        }
    });
}

/// The rays of the tree, seen from the camera.
pub(super) fn rays(painter: &Painter, session: &Session, place: Rect) {
    let Some([x, y]) = session.pixel.pixel else { return };
    let size = session.state.size();
    let at = |x: f64, y: f64| pos2(place.left() + x as f32 * place.width(), place.top() + y as f32 * place.height());
    let pixel = at((f64::from(x) + 0.5) / f64::from(size.width), (f64::from(y) + 0.5) / f64::from(size.height));
    painter.circle_stroke(pixel, 5.0, Stroke::new(1.5, Color32::WHITE));
    let Some((_, inspection)) = session.pixel.inspection.as_ref().filter(|(of, _)| *of == session.state.revision)
    else {
        return;
    };
    let mut scene = session.state.scene.clone();
    let aspect = f64::from(size.width) / f64::from(size.height);
    scene.frame(aspect);
    let painter = painter.with_clip_rect(place);
    for event in inspection.events.iter().filter(|event| event.way != Way::Camera && event.end != End::CutOff) {
        let color = match event.way {
            Way::Reflected => Color32::from_rgb(255, 120, 90),
            _ => Color32::from_rgb(90, 230, 130),
        };
        let share = (event.throughput.element_sum() / 3.0).sqrt().clamp(0.3, 1.0) as f32;
        if let Some([from, to]) = seen(&scene.camera, aspect, event.from, event.to) {
            painter
                .line_segment([at(from[0], from[1]), at(to[0], to[1])], Stroke::new(2.5, color.gamma_multiply(share)));
        }
    }
}

/// Where a line lies in the picture, from 0 to 1, as far as it is in front of the camera.
fn seen(camera: &Camera, aspect: f64, from: DVec3, to: DVec3) -> Option<[[f64; 2]; 2]> {
    let back = (camera.position - camera.target).normalize();
    let right = camera.up.cross(back).normalize();
    let up = back.cross(right);
    let half = (camera.vertical_fov / 2.0).tan();
    let local = |point: DVec3| {
        let offset = point - camera.position;
        DVec3::new(offset.dot(right) / (half * aspect), offset.dot(up) / half, -offset.dot(back))
    };
    let (mut a, mut b) = (local(from), local(to));
    let near = 1e-3 * a.z.abs().max(b.z.abs());
    if a.z.max(b.z) <= near || near <= 0.0 {
        return None;
    }
    if a.z < near {
        a = a.lerp(b, (near - a.z) / (b.z - a.z));
    } else if b.z < near {
        b = b.lerp(a, (near - b.z) / (a.z - b.z));
    }
    Some([a, b].map(|point| [0.5 + 0.5 * point.x / point.z, 0.5 - 0.5 * point.y / point.z]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_front_of_the_camera() {
        let camera = Camera { position: DVec3::ZERO, target: -DVec3::Z, up: DVec3::Y, vertical_fov: 1.0 };
        let middle = seen(&camera, 2.0, -DVec3::Z, -2.0 * DVec3::Z).expect("in front");
        assert_eq!(middle, [[0.5, 0.5]; 2]);
        assert!(seen(&camera, 2.0, DVec3::Z, 2.0 * DVec3::Z).is_none());
        let [_, cut] = seen(&camera, 2.0, -DVec3::Z, DVec3::new(0.5, 0.0, 1.0)).expect("half of it");
        assert!(cut[0] > 1.0 && cut[0].is_finite(), "{cut:?}");
    }
}
