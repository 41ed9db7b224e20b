//! The window itself: what is in which part of it, and what the user's input does.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use eframe::egui::{
    self, Align2, CentralPanel, Color32, Frame, Panel, PointerButton, ProgressBar, Rect, Response,
    Sense, TextEdit, Theme, Ui, ViewportCommand, pos2, vec2,
};
use glam::DVec2;

use super::actions::{self, Action, HELP};
use super::loading::{Loaded, Loading, Source};
use super::options::{self, Command, Options};
use super::save::{self, Sweep};
use super::scene::Scene;
use super::{Content, Opening, hand, plot, typed};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::render::{Background, Camera, Color, View};
use crate::sweep::Parameters;
use crate::volume::Volume;

/// Seconds in which a played sweep goes through the range.
const SWEEP_SECONDS: f64 = 12.0;

/// Longest a message stays.
const MESSAGE_TIME: Duration = Duration::from_secs(12);

/// The window.
pub(super) struct Window {
    gpu: Arc<Gpu>,
    render_state: eframe::egui_wgpu::RenderState,
    /// A second field that colours can show.
    field: Option<Volume>,
    scene: Option<Scene>,
    loading: Option<Loading>,
    sweep: Option<Sweep>,
    view: View,
    first_camera: Camera,
    /// Whether the next picture fits the surface that it shows.
    is_to_fit: bool,
    options: Options,
    curves: plot::Shown,
    parameters: Parameters,
    folder: PathBuf,
    /// What is being typed into the field of the isovalue.
    typed: Option<String>,
    /// Direction of the sweep that plays.
    playing: Option<f64>,
    help: bool,
    message: Option<(String, f64)>,
    title: String,
    /// Where an error goes that ends the window.
    failure: Arc<Mutex<Option<Error>>>,
}

impl Window {
    /// The window with what it opens with.
    pub(super) fn new(
        creation: &eframe::CreationContext<'_>,
        gpu: Arc<Gpu>,
        opening: Opening,
        failure: Arc<Mutex<Option<Error>>>,
    ) -> Result<Self> {
        let render_state = creation.wgpu_render_state.clone();
        let render_state =
            render_state.ok_or_else(|| Error::Gpu("the window has no device".into()))?;
        let context = &creation.egui_ctx;
        let Opening { content, volume, field, isovalue, view, parameters, folder, .. } = opening;
        let mut window = Window {
            gpu,
            render_state,
            field,
            scene: None,
            loading: None,
            sweep: None,
            first_camera: view.camera,
            is_to_fit: true,
            view,
            options: Options::default(),
            curves: [true, false, true, false],
            parameters,
            folder,
            typed: None,
            playing: None,
            help: false,
            message: None,
            title: String::new(),
            failure,
        };
        match content {
            Content::Nothing => {}
            Content::Spectrum(name, spectrum) => {
                let loaded = Loaded::new(name, *spectrum, volume.map(Arc::new));
                window.show_scene(loaded, context)?;
                if let (Some(scene), Some(isovalue)) = (&mut window.scene, isovalue) {
                    scene.spectrum.check_isovalue(isovalue)?;
                    scene.isovalue = isovalue;
                }
            }
            Content::Volume(volume) => window.load(Source::Volume(volume), context),
        }
        Ok(window)
    }

    fn load(&mut self, source: Source, context: &egui::Context) {
        self.loading = Some(Loading::start(source, self.parameters.clone(), context));
    }

    fn show_scene(&mut self, loaded: Loaded, context: &egui::Context) -> Result<()> {
        let scene = Scene::new(&self.gpu, loaded, self.field.as_ref(), context)?;
        // Another spectrum may not have what the colours showed.
        if !scene.painter.sources().have(self.view.color) {
            self.view.color = Color::None;
        }
        if let Some(mut old) = self.scene.replace(scene) {
            old.close(&self.render_state);
        }
        (self.sweep, self.playing, self.typed) = (None, None, None);
        self.reset();
        Ok(())
    }

    /// Back to the first direction, with the surface that is shown filling the picture.
    fn reset(&mut self) {
        hand::reset(&mut self.view, &self.first_camera);
        self.is_to_fit = true;
    }

    /// Shows a line for a while.
    fn say(&mut self, context: &egui::Context, text: impl Into<String>) {
        let until = context.input(|input| input.time) + MESSAGE_TIME.as_secs_f64();
        self.message = Some((text.into(), until));
        context.request_repaint_after(MESSAGE_TIME);
    }

    fn say_result(&mut self, context: &egui::Context, result: Result<String>) {
        self.say(context, result.unwrap_or_else(|error| error.to_string()));
    }

    /// Takes what the threads have ready and what was dropped.
    fn receive(&mut self, context: &egui::Context) {
        if let Some(result) = self.loading.as_ref().and_then(Loading::poll) {
            self.loading = None;
            let shown = result.and_then(|loaded| self.show_scene(loaded, context));
            if let Err(error) = shown {
                self.say(context, error.to_string());
            }
        }
        let dropped: Option<PathBuf> =
            context.input(|input| Some(input.raw.dropped_files.first()?.path().to_owned()));
        if let Some(path) = dropped {
            self.load(Source::File(path), context);
        }
    }

    fn act(&mut self, action: Action, context: &egui::Context) {
        match (action, &mut self.scene) {
            (Action::Help, _) => self.help = !self.help,
            (Action::Wireframe, _) => {
                self.view.wireframe = self.view.wireframe.is_none().then_some(1.0);
            }
            (Action::Reset, _) => self.reset(),
            (Action::Step { notches, is_fine }, Some(scene)) => {
                self.playing = None;
                scene.step_by(notches, is_fine);
            }
            (Action::Play, Some(_)) => {
                self.playing = if self.playing.is_some() { None } else { Some(1.0) };
            }
            (Action::Picture, Some(_)) => self.save(Command::Picture, context),
            (_, None) => {}
        }
    }

    fn save(&mut self, command: Command, context: &egui::Context) {
        let Some(scene) = &mut self.scene else { return };
        let result = match command {
            Command::Picture => save::picture(&self.folder, scene, &self.view)
                .map(|path| format!("saved {}", path.display())),
            Command::Mesh(extension) => save::mesh(&self.folder, scene, &self.view, extension)
                .map(|(path, n_triangles)| save::mesh_saved(&path, n_triangles)),
            Command::Sweep(n_frames) => {
                self.playing = None;
                match Sweep::start(&self.folder, scene, n_frames) {
                    Ok(sweep) => {
                        self.sweep = Some(sweep);
                        return;
                    }
                    Err(error) => Err(error),
                }
            }
        };
        self.say_result(context, result);
    }

    /// Moves what moves by itself: the sweep that plays, the sweep that is saved.
    fn advance(&mut self, context: &egui::Context) {
        let Some(scene) = &mut self.scene else { return };
        if let Some(mut sweep) = self.sweep.take() {
            match sweep.step(scene, &self.view) {
                Ok(_) if !sweep.is_done() => self.sweep = Some(sweep),
                Ok(_) => {
                    let text = sweep.finish(scene);
                    self.say(context, text);
                }
                Err(error) => {
                    sweep.finish(scene);
                    self.say(context, error.to_string());
                }
            }
            context.request_repaint();
        } else if let Some(direction) = &mut self.playing {
            let (low, high) = scene.spectrum.range;
            let seconds = f64::from(context.input(|input| input.stable_dt)).min(0.25);
            scene.isovalue += *direction * (high - low) * seconds / SWEEP_SECONDS;
            if !(low..=high).contains(&scene.isovalue) {
                scene.isovalue = scene.isovalue.clamp(low, high);
                *direction = -*direction;
            }
            context.request_repaint();
        }
    }

    /// The picture, in all of the rest of the window.
    fn picture(&mut self, ui: &mut Ui) {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let Some(scene) = &mut self.scene else {
            let hint = "drop a spectrum (.isp) or a volume here";
            let color = ui.visuals().text_color();
            let font = egui::FontId::proportional(18.0);
            ui.painter().text(rect.center(), Align2::CENTER_CENTER, hint, font, color);
            return;
        };
        // The texture has a pixel for each of the window's, so both begin on one.
        let scale = ui.pixels_per_point();
        let corner = pos2((rect.left() * scale).round(), (rect.top() * scale).round());
        let size = (rect.size() * scale).floor().max(vec2(1.0, 1.0));
        let largest = self.gpu.device().limits().max_texture_dimension_2d;
        self.view.width = (size.x as u32).min(largest);
        self.view.height = (size.y as u32).min(largest);
        if std::mem::take(&mut self.is_to_fit)
            && let Err(error) = scene.fit(&mut self.view)
        {
            let text = error.to_string();
            return self.say(ui.ctx(), text);
        }
        let corner = corner / scale;
        let shown = Rect::from_min_size(corner, size / scale);
        drag(&response, scale, scene, &mut self.view);
        if response.double_clicked()
            && let Some(at) = response.interact_pointer_pos()
        {
            let pixel = (at - corner) * scale;
            let pixel = DVec2::new(f64::from(pixel.x), f64::from(pixel.y));
            self.view.look_at = scene.point_under(&self.view, pixel).map(|p| p.to_array());
        }
        let wheel = if response.contains_pointer() { ui.input(actions::wheel) } else { None };
        if let Some(Action::Step { notches, is_fine }) = wheel {
            self.playing = None;
            scene.step_by(notches, is_fine);
        }
        match scene.paint(&self.render_state, &self.view) {
            Ok(texture) => {
                let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                ui.painter().image(texture, shown, whole, Color32::WHITE);
            }
            Err(error) => self.say(ui.ctx(), error.to_string()),
        }
    }

    /// The isovalue: typed, and on the slider.
    fn isovalue(&mut self, ui: &mut Ui) {
        let Some(scene) = &mut self.scene else { return };
        let mut complaint = None;
        ui.horizontal(|ui| {
            ui.label("isovalue");
            let mut text = self.typed.clone().unwrap_or_else(|| typed::shown(scene.isovalue));
            let field =
                ui.add(TextEdit::singleline(&mut text).id_salt("isovalue").desired_width(110.0));
            if field.changed() {
                self.typed = Some(text.clone());
            }
            if field.lost_focus() && self.typed.take().is_some() {
                let range = scene.spectrum.range;
                match typed::isovalue(&text, range, scene.statistics.as_ref()) {
                    Ok(isovalue) => (scene.isovalue, self.playing) = (isovalue, None),
                    Err(error) => complaint = Some(error),
                }
            }
            let play = if self.playing.is_some() { "stop (Space)" } else { "play (Space)" };
            if ui.button(play).clicked() {
                self.playing = if self.playing.is_some() { None } else { Some(1.0) };
            }
            ui.toggle_value(&mut self.help, "help (H)");
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
    }

    /// How far a computation or a sweep is, with a way to stop it.
    fn progress(&mut self, context: &egui::Context) {
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

    fn help(&mut self, context: &egui::Context) {
        egui::Window::new("help").open(&mut self.help).resizable(false).show(context, |ui| {
            egui::Grid::new("help").show(ui, |ui| {
                for (input, meaning) in HELP {
                    ui.strong(input);
                    ui.label(meaning);
                    ui.end_row();
                }
            });
        });
    }

    /// The title tells what is seen.
    fn name_window(&mut self, context: &egui::Context) {
        let title = match (&self.scene, &self.loading) {
            (_, Some(_)) => "isospectrum - working".to_owned(),
            (Some(scene), None) => format!(
                "{} - isovalue {} - {} triangles",
                scene.name,
                typed::shown(scene.isovalue),
                scene.n_triangles()
            ),
            (None, None) => "isospectrum".to_owned(),
        };
        if title != self.title {
            context.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }
}

/// What dragging on the picture does.
fn drag(response: &Response, scale: f32, scene: &Scene, view: &mut View) {
    let pixels = response.drag_delta() * scale;
    let by = DVec2::new(f64::from(pixels.x), f64::from(pixels.y));
    let is_down = |button| response.ctx.input(|input| input.pointer.button_down(button));
    if response.dragged() && by != DVec2::ZERO {
        let (left, middle, right) = (
            is_down(PointerButton::Primary),
            is_down(PointerButton::Middle),
            is_down(PointerButton::Secondary),
        );
        match (left, middle || right) {
            (true, true) => hand::zoom(view, (-0.01 * by.y).exp()),
            (true, false) => hand::turn(view, by),
            (false, true) => hand::shift(view, &scene.spectrum.volume, by),
            (false, false) => {}
        }
    }
    if response.contains_pointer() {
        let zoom = response.ctx.input(egui::InputState::zoom_delta);
        if zoom != 1.0 {
            hand::zoom(view, f64::from(zoom));
        }
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        if let Err(error) = self.gpu.check() {
            *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            context.send_viewport_cmd(ViewportCommand::Close);
            return;
        }
        let is_dark = self.view.background == Background::Dark;
        let theme = if is_dark { Theme::Dark } else { Theme::Light };
        if context.theme() != theme {
            // It holds from the next frame on.
            context.set_theme(theme);
            context.request_repaint();
        }
        self.receive(&context);
        if self.message.as_ref().is_some_and(|(_, until)| context.input(|i| i.time) > *until) {
            self.message = None;
        }
        for action in actions::pressed(&context) {
            self.act(action, &context);
        }
        self.advance(&context);
        Panel::bottom("isovalue").show(ui, |ui| {
            self.isovalue(ui);
            if self.scene.is_none()
                && let Some((message, _)) = &self.message
            {
                ui.label(message);
            }
        });
        let mut command = None;
        Panel::right("options").default_size(230.0).show(ui, |ui| {
            if let Some(scene) = &mut self.scene {
                command = options::show(ui, scene, &mut self.view, &mut self.options);
            }
        });
        if let Some(command) = command {
            self.save(command, &context);
        }
        CentralPanel::default().frame(Frame::NONE).show(ui, |ui| self.picture(ui));
        self.progress(&context);
        self.help(&context);
        self.name_window(&context);
    }
}
