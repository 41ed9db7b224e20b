//! The window itself: what is in which part of it, and what the user's input does.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use eframe::egui::{
    self, CentralPanel, FontId, Frame, Panel, ScrollArea, TextStyle, Theme, Ui, ViewportCommand,
};

use super::actions;
use super::chooser::Chooser;
use super::history::History;
use super::loading::{Loaded, Loading, Source};
use super::options::{self, Command, Options};
use super::pointing::{Pointing, Tool};
use super::save::{self, Sweep};
use super::scene::Scene;
use super::{Content, Opening, hand, plot, typed};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::render::{Background, Camera, Color, Surface, View};
use crate::sweep::Parameters;
use crate::volume::Volume;

/// Seconds in which a played sweep goes through the range.
const SWEEP_SECONDS: f64 = 12.0;

/// Longest a message stays.
const MESSAGE_TIME: Duration = Duration::from_secs(12);

/// Height of the smallest letters, points.
const LEAST_LETTERS: f32 = 11.5;

/// Most spectra that are open at once: each lies on the device.
const MOST_SCENES: usize = 8;

/// The window.
pub(super) struct Window {
    pub(super) gpu: Arc<Gpu>,
    pub(super) render_state: eframe::egui_wgpu::RenderState,
    /// A second field that colours can show.
    pub(super) field: Option<Arc<Volume>>,
    pub(super) scene: Option<Scene>,
    pub(super) loading: Option<Loading>,
    pub(super) sweep: Option<Sweep>,
    pub(super) view: View,
    pub(super) first_camera: Camera,
    /// Whether the next picture fits the surface that it shows.
    pub(super) is_to_fit: bool,
    /// The view that was made to fit, and of which isovalue.
    pub(super) fitted: Option<(Camera, f64)>,
    pub(super) options: Options,
    pub(super) history: History,
    /// The dialog that is open.
    pub(super) chooser: Option<Chooser>,
    /// Other spectra that were opened, in the order in which they were.
    pub(super) others: Vec<(u32, Scene)>,
    /// The number of the one that is shown, and of the next one.
    pub(super) number: u32,
    pub(super) next_number: u32,
    /// Files that wait until the one before is there.
    pub(super) waiting: Vec<PathBuf>,
    pub(super) curves: plot::Shown,
    pub(super) parameters: Parameters,
    pub(super) folder: PathBuf,
    /// What is being typed into the field of the isovalue.
    pub(super) typed: Option<String>,
    /// Direction of the sweep that plays.
    pub(super) playing: Option<f64>,
    /// How much faster it plays than usual.
    pub(super) speed: f64,
    /// What the next click on the surface does.
    pub(super) tool: Option<Tool>,
    pub(super) pointing: Pointing,
    pub(super) help: bool,
    pub(super) message: Option<(String, f64)>,
    pub(super) title: String,
    /// Where an error goes that ends the window.
    pub(super) failure: Arc<Mutex<Option<Error>>>,
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
        context.all_styles_mut(|style| {
            style.text_styles.insert(TextStyle::Small, FontId::proportional(LEAST_LETTERS));
        });
        let Opening { content, volume, field, surfaces, marks, view, parameters, folder, .. } =
            opening;
        let mut window = Window {
            gpu,
            render_state,
            field: field.map(Arc::new),
            scene: None,
            loading: None,
            sweep: None,
            first_camera: view.camera,
            is_to_fit: true,
            fitted: None,
            view,
            options: Options::default(),
            history: History::default(),
            chooser: None,
            others: Vec::new(),
            number: 0,
            next_number: 0,
            waiting: Vec::new(),
            curves: [true, false, true, false],
            parameters,
            folder,
            typed: None,
            playing: None,
            speed: 1.0,
            tool: None,
            pointing: Pointing::default(),
            help: false,
            message: None,
            title: String::new(),
            failure,
        };
        match content {
            Content::Nothing => {}
            Content::Spectrum(name, spectrum) => {
                let loaded = Loaded::new(name, *spectrum, volume.map(Arc::new));
                window.show_first(loaded, (surfaces, marks), context)?;
            }
            Content::Folder(name, folder) => {
                let volume = volume.map(Arc::new);
                let isovalue = surfaces.first().map(|first| first.isovalue);
                let loaded = Loaded::of_folder(name, *folder, volume, isovalue)?;
                window.show_first(loaded, (surfaces, marks), context)?;
            }
            Content::Volume(volume) => window.load(Source::Volume(volume), context),
        }
        Ok(window)
    }

    /// Shows what the window opens with: isosurfaces, and isovalues that are offered.
    fn show_first(
        &mut self,
        loaded: Loaded,
        (surfaces, marks): (Vec<Surface>, Vec<(f64, String)>),
        context: &egui::Context,
    ) -> Result<()> {
        self.show_scene(loaded, context)?;
        if let Some(scene) = &mut self.scene {
            self.options = Options::with_clip(self.view.clip, scene.spectrum.volume());
            scene.marks = marks;
            scene.show_surfaces(&surfaces)?;
        }
        Ok(())
    }

    pub(super) fn load(&mut self, source: Source, context: &egui::Context) {
        self.loading = Some(Loading::start(source, self.parameters.clone(), context));
    }

    fn show_scene(&mut self, loaded: Loaded, context: &egui::Context) -> Result<()> {
        let scene = Scene::new(&self.gpu, loaded, self.field.clone(), context)?;
        // Another spectrum may not have what the colours showed.
        if !scene.painter.sources().have(self.view.color) {
            self.view.color = Color::None;
        }
        let number = std::mem::replace(&mut self.number, self.next_number);
        self.next_number += 1;
        if let Some(before) = self.scene.replace(scene) {
            self.others.push((number, before));
        }
        // The oldest goes.
        if self.others.len() == MOST_SCENES {
            self.others.remove(0).1.close(&self.render_state);
        }
        (self.sweep, self.playing, self.typed) = (None, None, None);
        self.reset();
        self.history = History::default();
        Ok(())
    }

    /// Back to the first direction, with the surface that is shown filling the picture.
    pub(super) fn reset(&mut self) {
        hand::reset(&mut self.view, &self.first_camera);
        self.is_to_fit = true;
    }

    /// Shows a line for a while.
    pub(super) fn say(&mut self, context: &egui::Context, text: impl Into<String>) {
        let until = context.input(|input| input.time) + MESSAGE_TIME.as_secs_f64();
        self.message = Some((text.into(), until));
        context.request_repaint_after(MESSAGE_TIME);
    }

    pub(super) fn say_result(&mut self, context: &egui::Context, result: Result<String>) {
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
        let dropped: Vec<PathBuf> = context.input(|input| {
            input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect()
        });
        self.waiting.extend(dropped);
        if self.loading.is_none() && !self.waiting.is_empty() {
            let path = self.waiting.remove(0);
            self.load(Source::File(path), context);
        }
    }

    pub(super) fn save(&mut self, command: Command, context: &egui::Context) {
        // What was asked for before this shows in it.
        if let Err(error) = self.fit() {
            return self.say(context, error.to_string());
        }
        let Some(scene) = &mut self.scene else { return };
        if let Err(error) = scene.follow(&mut self.view) {
            return self.say(context, error.to_string());
        }
        let result = match command {
            Command::Picture => save::picture(&self.folder, scene, &self.view)
                .map(|path| format!("saved {}", path.display())),
            Command::Mesh(extension) => save::mesh(&self.folder, scene, &self.view, extension)
                .map(|(path, n_triangles)| save::mesh_saved(&path, n_triangles)),
            Command::Act(action) => return self.act(action, context),
            Command::GoTo(isovalue) => {
                (scene.isovalue, self.playing) = (isovalue, None);
                return;
            }
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
            match sweep.step(scene, &mut self.view) {
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
            let (low, high) = scene.spectrum.range();
            let seconds = f64::from(context.input(|input| input.stable_dt)).min(0.25);
            scene.isovalue += *direction * (high - low) * self.speed * seconds / SWEEP_SECONDS;
            if !(low..=high).contains(&scene.isovalue) {
                scene.isovalue = scene.isovalue.clamp(low, high);
                *direction = -*direction;
            }
            context.request_repaint();
        }
    }

    /// The title tells what is seen.
    fn name_window(&mut self, context: &egui::Context) {
        let title = match (&self.scene, &self.loading) {
            (_, Some(_)) => "isospectrum - working".to_owned(),
            (Some(scene), None) if scene.is_reading() => {
                format!("{} - isovalue {} - reading", scene.name, typed::shown(scene.isovalue))
            }
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
        // A dialog takes the keys.
        let pressed = if self.chooser.is_some() { Vec::new() } else { actions::pressed(&context) };
        for action in pressed {
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
        if let Some(scene) = &mut self.scene {
            Panel::right("options").default_size(230.0).show(ui, |ui| {
                ScrollArea::vertical().show(ui, |ui| {
                    command = options::show(
                        ui,
                        scene,
                        (&mut self.view, &mut self.tool),
                        &mut self.options,
                    );
                });
            });
        }
        if let Some(command) = command {
            self.save(command, &context);
        }
        // A picture fills its part to the last pixel; words want ground under them.
        let frame = match self.scene {
            Some(_) => Frame::NONE,
            None => Frame::central_panel(ui.style()),
        };
        CentralPanel::default().frame(frame).show(ui, |ui| self.picture(ui));
        self.progress(&context);
        self.chosen(&context);
        self.help(&context);
        self.name_window(&context);
    }
}
