//! Switching between open spectra, and the dialogs that open and save files.

use eframe::egui;

use super::file_dialog::{FileDialog, Outcome, Purpose};
use super::loading::LoadSource;
use super::save;
use super::window::Window;

impl Window {
    /// Shows another open spectrum; the view stays.
    pub(super) fn switch_scene(&mut self, id: u32) {
        let Some(at) = self.other_scenes.iter().position(|(other, _)| *other == id) else { return };
        let (_, scene) = self.other_scenes.remove(at);
        if let Some(previous) = self.scene.replace(scene) {
            let at = self.other_scenes.partition_point(|(other, _)| *other < self.scene_id);
            self.other_scenes.insert(at, (self.scene_id, previous));
        }
        self.scene_id = id;
        (self.sweep_export, self.playing, self.isovalue_text) = (None, None, None);
    }

    /// Closes the shown spectrum if there are others.
    pub(super) fn close_scene(&mut self) {
        let Some(&(id, _)) = self.other_scenes.last() else { return };
        let closed = self.scene_id;
        self.switch_scene(id);
        if let Some(at) = self.other_scenes.iter().position(|(other, _)| *other == closed) {
            self.other_scenes.remove(at).1.close(&self.render_state);
        }
    }

    /// Opens a dialog.
    pub(super) fn open_file_dialog(&mut self, purpose: Purpose) {
        let name = match (&self.scene, purpose) {
            (Some(scene), Purpose::Save) => save::default_name(scene),
            (None, Purpose::Save) => return,
            (_, Purpose::Open) => String::new(),
        };
        self.file_dialog = Some(FileDialog::new(purpose, &self.folder, name));
    }

    /// Shows the open dialog, and opens or saves the chosen file.
    pub(super) fn show_file_dialog(&mut self, context: &egui::Context) {
        let Some(mut dialog) = self.file_dialog.take() else { return };
        let purpose = dialog.purpose();
        match (dialog.show(context), purpose) {
            (Outcome::Open, _) => self.file_dialog = Some(dialog),
            (Outcome::Cancelled, _) => {}
            (Outcome::Chosen(path), Purpose::Open) => self.load(LoadSource::File(path), context),
            (Outcome::Chosen(path), Purpose::Save) => {
                let Some(scene) = &mut self.scene else { return };
                let result = save::save_as(&path, scene, &self.view);
                self.show_result(context, result);
            }
        }
    }
}
