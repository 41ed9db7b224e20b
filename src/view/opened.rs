//! The spectra that are open, and the dialogs that open and save.

use eframe::egui;

use super::chooser::{Chooser, Outcome, Purpose};
use super::loading::Source;
use super::save;
use super::window::Window;

impl Window {
    /// Shows another of the spectra that are open, from where one looks now.
    pub(super) fn switch(&mut self, number: u32) {
        let Some(at) = self.others.iter().position(|(other, _)| *other == number) else { return };
        let (_, scene) = self.others.remove(at);
        if let Some(before) = self.scene.replace(scene) {
            let place = self.others.partition_point(|(other, _)| *other < self.number);
            self.others.insert(place, (self.number, before));
        }
        self.number = number;
        (self.sweep, self.playing, self.typed) = (None, None, None);
    }

    /// Closes the spectrum that is shown, if there are others.
    pub(super) fn close(&mut self) {
        let Some(&(number, _)) = self.others.last() else { return };
        let closed = self.number;
        self.switch(number);
        if let Some(at) = self.others.iter().position(|(other, _)| *other == closed) {
            self.others.remove(at).1.close(&self.render_state);
        }
    }

    /// Opens a dialog.
    pub(super) fn choose(&mut self, purpose: Purpose) {
        let name = match (&self.scene, purpose) {
            (Some(scene), Purpose::Save) => save::usual_name(scene),
            (None, Purpose::Save) => return,
            (_, Purpose::Open) => String::new(),
        };
        self.chooser = Some(Chooser::new(purpose, &self.folder, name));
    }

    /// Shows the dialog that is open, and does what was chosen.
    pub(super) fn chosen(&mut self, context: &egui::Context) {
        let Some(mut chooser) = self.chooser.take() else { return };
        let purpose = chooser.purpose();
        match (chooser.show(context), purpose) {
            (Outcome::Open, _) => self.chooser = Some(chooser),
            (Outcome::Cancelled, _) => {}
            (Outcome::Chosen(path), Purpose::Open) => self.load(Source::File(path), context),
            (Outcome::Chosen(path), Purpose::Save) => {
                let Some(scene) = &mut self.scene else { return };
                let result = save::save_as(&path, scene, &self.view);
                self.say_result(context, result);
            }
        }
    }
}
