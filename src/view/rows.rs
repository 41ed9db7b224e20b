//! What is around the picture: the row of the isovalue with the slider, how far work is, the help.

use eframe::egui::{
    self, Align2, ComboBox, DragValue, ProgressBar, ScrollArea, TextEdit, Ui, vec2,
};

use super::actions::HELP;
use super::chooser::Purpose;
use super::scene::Scene;
use super::window::Window;
use super::{plot, typed};

impl Window {
    /// The isovalue: typed, and on the slider.
    pub(super) fn isovalue(&mut self, ui: &mut Ui) {
        let Some(scene) = &mut self.scene else { return };
        let mut complaint = None;
        let mut wanted = None;
        ui.horizontal_wrapped(|ui| {
            ui.label("isovalue");
            let mut text = self.typed.clone().unwrap_or_else(|| typed::shown(scene.isovalue));
            let field =
                ui.add(TextEdit::singleline(&mut text).id_salt("isovalue").desired_width(110.0));
            if field.changed() {
                self.typed = Some(text.clone());
            }
            if field.lost_focus() && self.typed.take().is_some() {
                let range = scene.spectrum.range();
                match typed::isovalue(&text, range, scene.statistics.as_ref()) {
                    Ok(isovalue) => (scene.isovalue, self.playing) = (isovalue, None),
                    Err(error) => complaint = Some(error),
                }
            }
            let play = if self.playing.is_some() { "stop (Space)" } else { "play (Space)" };
            if ui.button(play).clicked() {
                self.playing = if self.playing.is_some() { None } else { Some(1.0) };
            }
            let speed = DragValue::new(&mut self.speed).range(0.1..=10.0).speed(0.02);
            ui.add(speed.prefix("speed ").fixed_decimals(1));
            ui.toggle_value(&mut self.help, "help (H)");
            if ui.button("open").clicked() {
                wanted = Some(Wanted::Choose(Purpose::Open));
            }
            if ui.button("save as").clicked() {
                wanted = Some(Wanted::Choose(Purpose::Save));
            }
            if !self.others.is_empty() {
                wanted = opened(ui, (self.number, &scene.name), &self.others).or(wanted.take());
            }
            if let Some((message, _)) = &self.message {
                ui.label(message);
            }
        });
        if let Some(isovalue) = plot::show(ui, scene, &mut self.curves) {
            (scene.isovalue, self.playing) = (isovalue, None);
        }
        if let Some(complaint) = complaint {
            self.say(ui.ctx(), complaint);
        }
        match wanted {
            Some(Wanted::Choose(purpose)) => self.choose(purpose),
            Some(Wanted::Switch(number)) => self.switch(number),
            Some(Wanted::Close) => self.close(),
            None => {}
        }
    }

    /// How far a computation or a sweep is, with a way to stop it.
    pub(super) fn progress(&mut self, context: &egui::Context) {
        let (share, text) = match (&self.loading, &self.sweep) {
            (Some(loading), _) => loading.progress(),
            (None, Some(sweep)) => (sweep.share(), "saving pictures".into()),
            (None, None) => return,
        };
        let anchor = vec2(0.0, 40.0);
        let area = egui::Window::new("working").title_bar(false).resizable(false);
        area.anchor(Align2::CENTER_TOP, anchor).show(context, |ui| {
            ui.add(ProgressBar::new(share as f32).show_percentage().desired_width(260.0));
            ui.horizontal(|ui| {
                if ui.button("cancel").clicked() {
                    self.loading = None;
                    if let (Some(sweep), Some(scene)) = (self.sweep.take(), &mut self.scene) {
                        sweep.finish(scene);
                    }
                }
                ui.label(text);
            });
        });
    }

    pub(super) fn help(&mut self, context: &egui::Context) {
        let room = context.content_rect().height() - 80.0;
        let window =
            egui::Window::new("help").open(&mut self.help).resizable(false).default_height(room);
        window.show(context, |ui| {
            ScrollArea::vertical().max_height(room).show(ui, |ui| {
                egui::Grid::new("help").show(ui, |ui| {
                    for (input, meaning) in HELP {
                        ui.strong(input);
                        ui.label(meaning);
                        ui.end_row();
                    }
                });
            });
        });
    }
}

/// What the row of the isovalue asks for.
#[derive(Clone, Copy)]
enum Wanted {
    Choose(Purpose),
    Switch(u32),
    Close,
}

/// The spectra that are open, to choose among.
fn opened(ui: &mut Ui, (number, name): (u32, &str), others: &[(u32, Scene)]) -> Option<Wanted> {
    let mut wanted = None;
    let shown = |number: u32, name: &str| format!("{}: {name}", number + 1);
    ComboBox::from_id_salt("opened").selected_text(shown(number, name)).show_ui(ui, |ui| {
        for (other, scene) in others {
            if ui.selectable_label(false, shown(*other, &scene.name)).clicked() {
                wanted = Some(Wanted::Switch(*other));
            }
        }
    });
    if ui.button("close").clicked() {
        wanted = Some(Wanted::Close);
    }
    wanted
}
