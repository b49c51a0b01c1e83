//! Files: the scene, the picture, and the command that repeats it.

use egui::{TextEdit, Ui};

use super::super::session::{Action, Session};

pub(super) fn file(ui: &mut Ui, session: &mut Session) {
    let state = &mut session.state;
    ui.horizontal(|ui| {
        ui.label("Scene");
        let name =
            state.path.as_ref().and_then(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned());
        let name = name.unwrap_or_else(|| state.scene.name.clone());
        ui.add(egui::Label::new(name).truncate()).on_hover_text(&state.scene.name);
    });
    ui.small("drop a scene, a mesh or an environment on the window to open it");
    ui.horizontal(|ui| {
        if ui.button("Reload").on_hover_text("reads the files again; what was changed here stays").clicked() {
            session.actions.push(Action::Reload);
        }
        if ui.button("Revert").on_hover_text("camera, materials and environment as the file has them").clicked() {
            session.actions.push(Action::Revert);
        }
        let button = ui.button("Copy command");
        if button.on_hover_ui(|ui| drop(ui.label(state.command()))).clicked() {
            session.actions.push(Action::Copy);
        }
    });
    ui.horizontal(|ui| {
        if ui
            .button("Save")
            .on_hover_text("renders the light of the picture with all its samples, by the command")
            .clicked()
        {
            session.actions.push(Action::Save);
        }
        ui.add(TextEdit::singleline(&mut state.output).desired_width(150.0).hint_text("picture.png or .exr"));
    });
    if !session.recent.files.is_empty() {
        ui.collapsing("Recent", |ui| {
            for path in &session.recent.files {
                let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
                if ui.link(name).on_hover_text(path.display().to_string()).clicked() {
                    session.actions.push(Action::Open(path.clone()));
                }
            }
        });
    }
}
