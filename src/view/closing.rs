//! The question before the window closes with a computed spectrum that is in no file.

use eframe::egui::{self, Align2, ViewportCommand, vec2};

use super::file_dialog::Purpose;
use super::window::Window;

impl Window {
    /// Keeps the window open and asks, if it is to be closed with a spectrum that is not saved.
    pub(super) fn ask_before_closing(&mut self, context: &egui::Context) {
        let unsaved = self.unsaved();
        if context.input(|input| input.viewport().close_requested())
            && !self.may_close
            && !unsaved.is_empty()
        {
            context.send_viewport_cmd(ViewportCommand::CancelClose);
            self.is_closing = true;
        }
        if !self.is_closing || self.file_dialog.is_some() {
            return;
        }
        if unsaved.is_empty() {
            // It was saved meanwhile.
            self.close(context);
            return;
        }
        let area = egui::Window::new("not saved").collapsible(false).resizable(false);
        area.anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0)).show(context, |ui| {
            ui.label(format!("computed and not saved: {}", unsaved.join(", ")));
            ui.horizontal(|ui| {
                let shows_unsaved = self.scene.as_ref().is_some_and(|scene| scene.is_unsaved);
                if shows_unsaved && ui.button("save as").clicked() {
                    self.open_file_dialog(Purpose::Save);
                }
                if ui.button("close without saving").clicked() {
                    self.close(context);
                }
                if ui.button("cancel").clicked() {
                    self.is_closing = false;
                }
            });
        });
    }

    fn close(&mut self, context: &egui::Context) {
        self.may_close = true;
        context.send_viewport_cmd(ViewportCommand::Close);
    }

    /// The names of the open spectra that were computed here and not saved.
    fn unsaved(&self) -> Vec<String> {
        let scenes = self.scene.iter().chain(self.other_scenes.iter().map(|(_, scene)| scene));
        scenes.filter(|scene| scene.is_unsaved).map(|scene| scene.name.clone()).collect()
    }
}
