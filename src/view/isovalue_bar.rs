//! The bar with the isovalue and its slider; the progress and help windows.

use eframe::egui::{
    self, Align2, Button, ComboBox, DragValue, Label, ProgressBar, ScrollArea, TextEdit, Ui, vec2,
};

use super::cost::in_time;
use super::file_dialog::Purpose;
use super::numbers::{format_number, parse_isovalue};
use super::plot;
use super::scene::Scene;
use super::window::Window;
use crate::keys::{KEYS, Place};

impl Window {
    /// Shows the isovalue as an editable text and on the slider.
    pub(super) fn show_isovalue_bar(&mut self, ui: &mut Ui) {
        let Some(scene) = self.scene.as_mut().filter(|scene| !scene.is_preview) else { return };
        let mut message = None;
        let mut request = None;
        ui.horizontal_wrapped(|ui| {
            let label = ui.label("isovalue");
            let text = self.isovalue_text.clone();
            let mut text = text.unwrap_or_else(|| format_number(scene.isovalue));
            let field = TextEdit::singleline(&mut text).id_salt("isovalue").desired_width(110.0);
            let field = ui.add(field).labelled_by(label.id);
            if field.changed() {
                self.isovalue_text = Some(text.clone());
            }
            if field.lost_focus() && self.isovalue_text.take().is_some() {
                let range = scene.spectrum.range();
                match parse_isovalue(&text, range, scene.statistics.as_ref()) {
                    Ok(isovalue) => {
                        (scene.isovalue, self.playing) = (isovalue, None);
                        // An earlier error is settled.
                        self.message = None;
                    }
                    Err(error) => message = Some(error),
                }
            }
            let play = if self.playing.is_some() { "stop (Space)" } else { "play (Space)" };
            if ui.button(play).clicked() {
                self.playing = if self.playing.is_some() { None } else { Some(1.0) };
            }
            let speed = DragValue::new(&mut self.speed).range(0.1..=10.0).speed(0.02);
            ui.add(speed.prefix("speed ").fixed_decimals(1));
            if ui.add(Button::new("help (H)").selected(self.is_help_open)).clicked() {
                self.is_help_open = !self.is_help_open;
            }
            if ui.button("open").clicked() {
                request = Some(Request::Dialog(Purpose::Open));
            }
            if ui.button("save as").clicked() {
                request = Some(Request::Dialog(Purpose::Save));
            }
            if !self.other_scenes.is_empty() {
                let choice = scene_choice(ui, self.scene_id, &scene.name, &self.other_scenes);
                request = choice.or(request.take());
            }
            if let Some((message, _)) = &self.message {
                ui.label(message);
            }
        });
        if let Some(isovalue) = plot::show(ui, scene, &mut self.visible_curves) {
            (scene.isovalue, self.playing) = (isovalue, None);
        }
        if let Some(message) = message {
            self.show_message(ui.ctx(), message);
        }
        match request {
            Some(Request::Dialog(purpose)) => self.open_file_dialog(purpose),
            Some(Request::Switch(id)) => self.switch_scene(id),
            Some(Request::Close) => self.close_scene(),
            None => {}
        }
    }

    /// Shows the progress of loading or of saving a sweep, with a button that cancels it.
    pub(super) fn show_progress(&mut self, context: &egui::Context) {
        let (progress, name, text) = match (&self.loading, &self.sweep_export) {
            (Some(loading), _) => {
                let (progress, task) = loading.progress();
                let left = loading.time_left();
                let left = left.map(|left| format!(", {} left", in_time(left)));
                (progress, loading.name.clone(), format!("{task}{}", left.unwrap_or_default()))
            }
            (None, Some(export)) => (export.progress(), String::new(), "saving pictures".into()),
            (None, None) => return,
        };
        let anchor = vec2(0.0, 40.0);
        let area = egui::Window::new("working").title_bar(false).resizable(false);
        area.anchor(Align2::CENTER_TOP, anchor).show(context, |ui| {
            if !name.is_empty() {
                ui.strong(name);
            }
            ui.add(ProgressBar::new(progress as f32).show_percentage().desired_width(260.0));
            ui.horizontal(|ui| {
                if ui.button("cancel").clicked() {
                    self.loading = None;
                    self.close_preview();
                    let export = self.sweep_export.take();
                    if let (Some(export), Some(scene)) = (export, &mut self.scene) {
                        export.finish(scene);
                    }
                }
                ui.label(text);
            });
        });
    }

    pub(super) fn show_help(&mut self, context: &egui::Context) {
        let height = context.content_rect().height() - 80.0;
        let window = egui::Window::new("help").open(&mut self.is_help_open);
        window.resizable(false).default_height(height).show(context, |ui| {
            ScrollArea::vertical().max_height(height).show(ui, |ui| {
                egui::Grid::new("help").max_col_width(HELP_WIDTH).show(ui, |ui| {
                    for key in KEYS.iter().filter(|key| key.place != Place::Page) {
                        ui.strong(key.input.replace('`', ""));
                        ui.add(Label::new(key.meaning.replace('`', "")).wrap());
                        ui.end_row();
                    }
                });
            });
        });
    }
}

/// Maximum width of a column of the help, points.
const HELP_WIDTH: f32 = 420.0;

/// A request of the isovalue bar.
#[derive(Clone, Copy)]
enum Request {
    /// Open a file dialog.
    Dialog(Purpose),
    /// Show another open spectrum.
    Switch(u32),
    /// Close the shown spectrum.
    Close,
}

/// The choice among the open spectra, and a button that closes the shown one.
fn scene_choice(ui: &mut Ui, id: u32, name: &str, others: &[(u32, Scene)]) -> Option<Request> {
    let mut request = None;
    let label = |id: u32, name: &str| format!("{}: {name}", id + 1);
    ComboBox::from_id_salt("opened").selected_text(label(id, name)).show_ui(ui, |ui| {
        for (other, scene) in others {
            if ui.selectable_label(false, label(*other, &scene.name)).clicked() {
                request = Some(Request::Switch(*other));
            }
        }
    });
    if ui.button("close").clicked() {
        request = Some(Request::Close);
    }
    request
}
