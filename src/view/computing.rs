//! From a volume to its spectrum: the dialog with the settings, and the preview.

use eframe::egui;

use super::compute_dialog::{ComputeDialog, Outcome, Ready};
use super::loading::{LoadSource, Loaded};
use super::window::Window;
use crate::error::Result;
use crate::prepared::{Noise, Prepared};
use crate::spectrum::Spectrum;
use crate::volume::{Preparation, Volume};

impl Window {
    /// Computes the spectrum of a volume as it is.
    pub(super) fn compute(&mut self, volume: Volume, context: &egui::Context) -> Result<()> {
        let prepared = Prepared::new(volume, Preparation::default(), Noise::default())?;
        let ready = Ready { prepared, parameters: self.parameters.clone() };
        self.load(LoadSource::Ready(Box::new(ready)), context);
        Ok(())
    }

    /// Opens the dialog for a volume, over one of its isosurfaces if nothing else is shown.
    pub(super) fn ask_how_to_compute(
        &mut self,
        volume: Volume,
        preview: Option<Box<Spectrum>>,
        context: &egui::Context,
    ) -> Result<()> {
        if let Some(spectrum) = preview.filter(|_| self.scene.is_none()) {
            self.show_scene(Loaded::preview(volume.name().to_owned(), *spectrum), context)?;
        }
        self.compute_dialog = Some(ComputeDialog::new(volume, self.parameters.clone()));
        Ok(())
    }

    /// Whether an isosurface of a volume is shown whose spectrum is not there yet.
    pub(super) fn shows_preview(&self) -> bool {
        self.scene.as_ref().is_some_and(|scene| scene.is_preview)
    }

    /// Ends the preview, if there is one.
    pub(super) fn close_preview(&mut self) {
        if let Some(mut preview) = self.scene.take_if(|scene| scene.is_preview) {
            preview.close(&self.render_state);
        }
    }

    /// Shows the dialog for a volume, and computes its spectrum when that is chosen.
    pub(super) fn show_compute_dialog(&mut self, context: &egui::Context) {
        let Some(mut dialog) = self.compute_dialog.take() else { return };
        match dialog.show(context) {
            Outcome::Open => self.compute_dialog = Some(dialog),
            Outcome::Cancelled => self.close_preview(),
            Outcome::Chosen(ready) => {
                self.load(LoadSource::Ready(ready), context);
            }
        }
    }
}
