//! The window before anything is opened.

use std::path::Path;

use eframe::egui::{Align, Button, Layout, RichText, ScrollArea, Ui, vec2};

/// A clicked button of the start screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StartChoice {
    /// Choose a file.
    Open,
    /// A built-in volume, by its name.
    Phantom(&'static str),
}

/// Built-in volumes whose spectra are computed within seconds, and their labels.
const PHANTOMS: [(&str, &str); 3] =
    [("hydrogen:32", "hydrogen"), ("torus:32", "torus"), ("gyroid:24", "gyroid")];

/// Height of the contents, points, without the space above.
const HEIGHT: f32 = 190.0;

/// Shows the start screen; returns the clicked button.
pub(super) fn show(ui: &mut Ui, folder: &Path) -> Option<StartChoice> {
    let mut choice = None;
    ScrollArea::vertical().show(ui, |ui| {
        ui.add_space((0.45 * (ui.available_height() - HEIGHT)).max(8.0));
        ui.with_layout(Layout::top_down(Align::Center), |ui| {
            ui.label(RichText::new("See all isosurfaces of a volume").size(22.0).strong());
            ui.add_space(6.0);
            let text = "a spectrum (.isp), or a volume, whose spectrum is computed here";
            ui.label(RichText::new(text).size(15.0));
            ui.add_space(14.0);
            let open = RichText::new("Open a file (Ctrl + O)").size(16.0);
            if ui.add(Button::new(open).min_size(vec2(220.0, 38.0))).clicked() {
                choice = Some(StartChoice::Open);
            }
            ui.add_space(6.0);
            let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
            ui.label(format!("or drop files here; saved files go to {}", folder.display()));
            ui.add_space(14.0);
            ui.label("or try a built-in one");
            ui.add_space(4.0);
            for (phantom, name) in PHANTOMS {
                if ui.add(Button::new(name).min_size(vec2(140.0, 26.0))).clicked() {
                    choice = Some(StartChoice::Phantom(phantom));
                }
            }
        });
    });
    choice
}
