//! The windows within the window. Each says what it changed.

mod cost;
mod file;
mod materials;
mod pixel;
mod render;

use egui::{
    Align2, Color32, Context, CursorIcon, Painter, Pos2, Rect, Response, RichText, Sense, Slider, SliderClamping,
    Stroke, Ui, Window, pos2, vec2,
};

use super::session::Session;
use super::state::{Edits, model_of};
use super::worker::Picture;
use super::{heights, orbit};
use crate::gpu::Placed;
use crate::options::Size;
use crate::scene::{Bounds, Scene};

/// Steps of flight a second, and how many times less they are with Shift.
const FLIGHT: f64 = 10.0;
const SLOW: f64 = 5.0;

/// How wide a column of windows is, and how far from the edge.
const WIDTH: f32 = 252.0;
const MARGIN: f32 = 10.0;

/// The height of a window that is folded, with the gap below.
const FOLDED: f32 = 42.0;

/// All of them, around the picture.
pub(super) fn all(ui: &mut Ui, session: &mut Session) -> Edits {
    let mut edits = Edits::default();
    picture(ui, session, &mut edits);
    let context = ui.ctx().clone();
    let area = context.content_rect();
    let roomy = area.height() > 560.0;
    let mut left = Column::new(&context, area.left() + MARGIN, 2);
    left.window("Material Properties", true, |ui| materials::glass(ui, &mut session.state, &mut edits));
    left.window("Debug", roomy, |ui| materials::debug(ui, &mut session.state, &mut edits));
    let mut right = Column::new(&context, area.right() - MARGIN - WIDTH, 4);
    right.window("Render", roomy, |ui| render::render(ui, session, &mut edits));
    right.window("File", false, |ui| file::file(ui, session));
    session.cost.is_open = right.window("Cost", session.cost.opens, |ui| cost::cost(ui, session, &mut edits));
    let was_open = session.pixel.is_open;
    session.pixel.is_open = right.window("Pixel", false, |ui| pixel::pixel(ui, session, &mut edits));
    edits.look |= session.pixel.is_open && !was_open && session.pixel.pixel.is_some();
    let state = &session.state;
    for (text, color) in [(&state.error, Color32::LIGHT_RED), (&state.notice, Color32::LIGHT_GREEN)] {
        let Some(text) = text else { continue };
        let bar = Window::new(if color == Color32::LIGHT_RED { "Error" } else { "Notice" }).title_bar(false);
        let bar = bar.anchor(Align2::CENTER_BOTTOM, vec2(0.0, -MARGIN)).resizable(false);
        bar.max_width((area.width() - 2.0 * (WIDTH + 3.0 * MARGIN)).max(200.0)).show(&context, |ui| {
            ui.label(RichText::new(text).color(color));
        });
        break;
    }
    edits
}

/// Windows one below the other, so that none covers another whatever is unfolded.
struct Column<'c> {
    context: &'c Context,
    x: f32,
    y: f32,
    /// Windows that are to come.
    left: usize,
}

impl<'c> Column<'c> {
    fn new(context: &'c Context, x: f32, windows: usize) -> Self {
        Self { context, x, y: context.content_rect().top() + MARGIN, left: windows }
    }

    /// The next one, as high as leaves the others their titles; whether it is unfolded.
    fn window(&mut self, title: &'static str, open: bool, content: impl FnOnce(&mut Ui)) -> bool {
        self.left -= 1;
        let bottom = self.context.content_rect().bottom() - MARGIN - self.left as f32 * FOLDED;
        let most = (bottom - self.y - FOLDED - 6.0).max(40.0);
        let window = Window::new(title).fixed_pos(pos2(self.x, self.y)).default_open(open).resizable(false);
        let window = window.auto_sized().max_width(WIDTH);
        let shown = window.show(self.context, |ui| {
            egui::ScrollArea::vertical().max_height(most).auto_shrink([false, true]).show(ui, |ui| {
                ui.set_width(WIDTH - 24.0);
                content(ui);
            });
        });
        let Some(shown) = shown else { return false };
        self.y = shown.response.rect.bottom() + 6.0;
        shown.inner.is_some()
    }
}

/// The picture behind all, with the camera in the pointer's hands.
fn picture(ui: &mut Ui, session: &mut Session, edits: &mut Edits) {
    let state = &mut session.state;
    let area = ui.max_rect();
    let scale = ui.ctx().pixels_per_point();
    let pixels = |points: f32| ((points * scale).round() as u32).max(1);
    let window = Size { width: pixels(area.width()), height: pixels(area.height()) };
    if !state.sized && state.args.size != Some(window) {
        state.args.size = Some(window);
        edits.scene = true;
    }
    let response = ui.allocate_rect(area, Sense::click_and_drag());
    let painter = ui.painter().clone();
    let whole = state.size();
    // As large as it is, or as there is room for.
    let fits = (f64::from(window.width) / f64::from(whole.width))
        .min(f64::from(window.height) / f64::from(whole.height))
        .min(1.0);
    let side = |side: u32| ((f64::from(side) * fits).round() as u32).max(1);
    let size = [side(whole.width), side(whole.height)];
    let at = [(window.width as i32 - size[0] as i32) / 2, (window.height as i32 - size[1] as i32) / 2];
    let points = |[x, y]: [i32; 2]| area.min + vec2(x as f32, y as f32) / scale;
    let place = Rect::from_min_max(points(at), points([at[0] + size[0] as i32, at[1] + size[1] as i32]));
    let placed = |picture: &Picture, columns| Placed { image: picture.image.clone(), at, size, columns };
    session.placed.clear();
    session.placed.extend(state.pictures[0].as_ref().map(|picture| placed(picture, [0, i32::MAX])));
    if state.beside.is_some() {
        let line = at[0] + (state.wipe * size[0] as f32).round() as i32;
        session.placed.extend(state.pictures[1].as_ref().map(|picture| placed(picture, [line, i32::MAX])));
        wipe(ui, session, place);
    }
    let state = &mut session.state;
    if session.pixel.is_open {
        if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.clicked()) {
            let at = (pointer - place.min) / place.size();
            let size = state.size();
            if (0.0..1.0).contains(&at.x) && (0.0..1.0).contains(&at.y) {
                session.pixel.pixel = Some([(at.x * size.width as f32) as u32, (at.y * size.height as f32) as u32]);
                edits.look = true;
            }
        }
        if response.hovered() {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
        pixel::rays(&painter, session, place);
    }
    camera(ui, &response, session, area.height(), edits);
}

/// What is beside the picture, to the right of a line that can be moved.
fn wipe(ui: &mut Ui, session: &mut Session, place: Rect) {
    let state = &mut session.state;
    let x = place.left() + state.wipe * place.width();
    let line = Rect::from_center_size(pos2(x, place.center().y), vec2(12.0, place.height()));
    let response = ui.interact(line, ui.id().with("wipe"), Sense::drag());
    if response.dragged() {
        state.wipe = (state.wipe + response.drag_delta().x / place.width()).clamp(0.02, 0.98);
    }
    if response.hovered() || response.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let painter = ui.painter();
    painter.vline(x, place.y_range(), Stroke::new(1.5, Color32::WHITE));
    painter.circle_filled(pos2(x, place.center().y), 6.0, Color32::WHITE);
    let Some(beside) = &state.beside else { return };
    let bottom = place.bottom() - MARGIN;
    named(painter, pos2(x - 12.0, bottom), Align2::RIGHT_BOTTOM, model_of(&state.args).name());
    named(painter, pos2(x + 12.0, bottom), Align2::LEFT_BOTTOM, &beside.name);
}

/// A text on the picture, readable on whatever is there.
fn named(painter: &Painter, at: Pos2, align: Align2, text: &str) {
    let font = egui::FontId::proportional(14.0);
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand(4.0), 3.0, Color32::from_black_alpha(180));
    painter.galley(rect.min, galley, Color32::WHITE);
}

fn camera(ui: &Ui, response: &Response, session: &mut Session, height: f32, edits: &mut Edits) {
    use egui::{Key, PointerButton};
    let state = &mut session.state;
    let drag = heights(response.drag_delta(), height);
    let shift = ui.input(|input| input.modifiers.shift);
    let pans = response.dragged_by(PointerButton::Middle) || response.dragged_by(PointerButton::Secondary);
    if drag != glam::DVec2::ZERO {
        if pans || shift {
            state.drag(|camera| orbit::pan(camera, drag));
        } else {
            state.drag(|camera| orbit::turn(camera, drag));
        }
        edits.scene = true;
    }
    let scroll = f64::from(ui.input(|input| input.smooth_scroll_delta().y)) / 50.0;
    if response.hovered() && scroll != 0.0 {
        state.drag(|camera| orbit::dolly(camera, scroll));
        edits.scene = true;
    }
    let typing = ui.ctx().egui_wants_keyboard_input();
    // With others they are something else's.
    let typing = typing || ui.input(|input| input.modifiers.command || input.modifiers.alt);
    let pressed = |key| !typing && ui.input(|input| input.key_pressed(key));
    let held = |key| !typing && ui.input(|input| input.key_down(key));
    let flight = if shift { FLIGHT / SLOW } else { FLIGHT };
    for (key, steps) in [(Key::W, 1.0), (Key::S, -1.0)] {
        if held(key) {
            // As fast whatever the pictures take.
            let time = f64::from(ui.input(|input| input.stable_dt)).min(0.1);
            state.drag(|camera| orbit::fly(camera, steps * flight * time));
            ui.ctx().request_repaint();
            edits.scene = true;
        }
    }
    if pressed(Key::Home) || pressed(Key::F) {
        let bounds = state.scene.bounds().unwrap_or(Bounds::EMPTY);
        let size = state.size();
        let aspect = f64::from(size.width) / f64::from(size.height);
        state.drag(|camera| orbit::frame(camera, bounds, aspect));
        edits.scene = true;
    }
}

fn slider(ui: &mut Ui, name: &str, value: &mut f64, range: std::ops::RangeInclusive<f64>) -> bool {
    ui.label(name);
    // What a scene has beyond the slider's ends stays until it is moved.
    let slider = Slider::new(value, range).max_decimals(3).clamping(SliderClamping::Edits);
    ui.spacing_mut().slider_width = 84.0;
    let changed = ui.add(slider).changed();
    ui.end_row();
    changed
}

/// What a list calls an object.
fn name_of(scene: &Scene, object: usize) -> String {
    let object = &scene.objects[object];
    format!("{} ({})", scene.meshes[object.mesh].name, scene.materials[object.material].name)
}
