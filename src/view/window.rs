//! The window: its layout and its state.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use eframe::egui::{
    self, CentralPanel, FontId, Frame, Panel, ScrollArea, Stroke, TextStyle, Theme, Ui,
    ViewportCommand,
};

use super::compute_dialog::ComputeDialog;
use super::controls::ControlList;
use super::file_dialog::FileDialog;
use super::history::History;
use super::loading::{LoadSource, Loaded, LoadedContent, Loading};
use super::numbers::format_number;
use super::opening::{Content, Opening};
use super::options::{self, Command, Options};
use super::pointer::{Pointer, Tool};
use super::save::{self, SweepExport};
use super::scene::Scene;
use super::{actions, camera_control, plot};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::render::{Background, Camera, Color, Surface, View};
use crate::sweep::Parameters;
use crate::volume::Volume;

/// Seconds for the range of isovalues while a sweep plays at speed 1.
const SWEEP_SECONDS: f64 = 12.0;

/// Time until a message disappears.
const MESSAGE_TIME: Duration = Duration::from_secs(12);

/// Size of the smallest font, points.
const MIN_FONT_SIZE: f32 = 11.5;

/// Opacity of the outlines of buttons and fields.
const OUTLINE: f32 = 0.45;

/// Maximum number of open spectra, because each is uploaded to the device.
const MAX_SCENES: usize = 8;

/// The window.
pub(super) struct Window {
    pub(super) gpu: Arc<Gpu>,
    pub(super) render_state: eframe::egui_wgpu::RenderState,
    /// A second field for colours.
    pub(super) field: Option<Arc<Volume>>,
    pub(super) scene: Option<Scene>,
    pub(super) loading: Option<Loading>,
    pub(super) sweep_export: Option<SweepExport>,
    pub(super) view: View,
    pub(super) first_camera: Camera,
    /// Whether the next picture is to be fitted to its surface.
    pub(super) is_fit_pending: bool,
    /// Camera and isovalue of the last fit.
    pub(super) last_fit: Option<(Camera, f64)>,
    pub(super) options: Options,
    pub(super) history: History,
    /// The open dialog.
    pub(super) file_dialog: Option<FileDialog>,
    /// The dialog for a volume that was read.
    pub(super) compute_dialog: Option<ComputeDialog>,
    /// Other open spectra by their ids, in the order of opening.
    pub(super) other_scenes: Vec<(u32, Scene)>,
    /// The id of the shown spectrum, and of the next one.
    pub(super) scene_id: u32,
    pub(super) next_scene_id: u32,
    /// Files to be opened after the one that is loading.
    pub(super) pending_files: Vec<PathBuf>,
    pub(super) visible_curves: plot::VisibleCurves,
    pub(super) parameters: Parameters,
    max_triangles: u64,
    pub(super) folder: PathBuf,
    /// The text in the field of the isovalue while it is edited.
    pub(super) isovalue_text: Option<String>,
    /// Direction of the playing sweep, 1 or -1.
    pub(super) playing: Option<f64>,
    /// Speed of the playing sweep, relative to [`SWEEP_SECONDS`].
    pub(super) speed: f64,
    /// The effect of the next click on the surface.
    pub(super) tool: Option<Tool>,
    pub(super) pointer: Pointer,
    pub(super) is_help_open: bool,
    /// Whether the window asks what to do with spectra that are not saved, and whether it may close without them.
    pub(super) is_closing: bool,
    pub(super) may_close: bool,
    /// The message and the time, seconds, when it disappears.
    pub(super) message: Option<(String, f64)>,
    pub(super) title: String,
    /// The error that closes the window.
    pub(super) failure: Arc<Mutex<Option<Error>>>,
}

impl Window {
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
            style.text_styles.insert(TextStyle::Small, FontId::proportional(MIN_FONT_SIZE));
            // What can be clicked has an outline.
            let widgets = &mut style.visuals.widgets;
            let outline = widgets.noninteractive.fg_stroke.color.gamma_multiply(OUTLINE);
            widgets.inactive.bg_stroke = Stroke::new(1.0, outline);
        });
        if let Some(path) = &opening.controls {
            ControlList::start(path.clone(), failure.clone(), context);
        }
        let Opening { content, volume, field, surfaces, marks, view, parameters, folder, .. } =
            opening;
        let max_triangles = opening.max_triangles;
        let mut window = Window {
            gpu,
            render_state,
            field: field.map(Arc::new),
            scene: None,
            loading: None,
            sweep_export: None,
            first_camera: view.camera,
            is_fit_pending: true,
            last_fit: None,
            view,
            options: Options::default(),
            history: History::default(),
            file_dialog: None,
            compute_dialog: None,
            other_scenes: Vec::new(),
            scene_id: 0,
            next_scene_id: 0,
            pending_files: Vec::new(),
            visible_curves: [true, false, true, false],
            parameters,
            max_triangles,
            folder,
            isovalue_text: None,
            playing: None,
            speed: 1.0,
            tool: None,
            pointer: Pointer::default(),
            is_help_open: false,
            is_closing: false,
            may_close: false,
            message: None,
            title: String::new(),
            failure,
        };
        match content {
            Content::Nothing => {}
            Content::Spectrum(name, spectrum) => {
                let loaded = Loaded::new(name, *spectrum, volume.map(Arc::new));
                window.show_first(loaded, &surfaces, marks, context)?;
            }
            Content::File(name, file) => {
                let volume = volume.map(Arc::new);
                let isovalue = surfaces.first().map(|first| first.isovalue);
                let loaded = Loaded::of_file(name, file, volume, isovalue, max_triangles)?;
                window.show_first(loaded, &surfaces, marks, context)?;
            }
            Content::Volume(volume) => window.load(LoadSource::Volume(volume), context),
            Content::Phantom(volume) => window.compute(*volume, context)?,
        }
        Ok(window)
    }

    /// Shows the initial spectrum with its isosurfaces and offered isovalues.
    fn show_first(
        &mut self,
        loaded: Loaded,
        surfaces: &[Surface],
        marks: Vec<(f64, String)>,
        context: &egui::Context,
    ) -> Result<()> {
        self.show_scene(loaded, context)?;
        if let Some(scene) = &mut self.scene {
            self.options = Options::with_clip(self.view.clip, scene.spectrum.volume());
            scene.marks = marks;
            scene.show_surfaces(surfaces)?;
        }
        Ok(())
    }

    pub(super) fn load(&mut self, source: LoadSource, context: &egui::Context) {
        self.loading = Some(Loading::start(source, self.max_triangles, context));
    }

    pub(super) fn show_scene(&mut self, loaded: Loaded, context: &egui::Context) -> Result<()> {
        self.close_preview();
        let scene = Scene::new(&self.gpu, loaded, self.field.clone(), context)?;
        // The new spectrum may lack the data for the colours.
        if !scene.painter.sources().support(self.view.color) {
            self.view.color = Color::None;
        }
        let id = std::mem::replace(&mut self.scene_id, self.next_scene_id);
        self.next_scene_id += 1;
        if let Some(previous) = self.scene.replace(scene) {
            self.other_scenes.push((id, previous));
        }
        if self.other_scenes.len() == MAX_SCENES {
            let (_, mut oldest) = self.other_scenes.remove(0);
            oldest.close(&self.render_state);
        }
        (self.sweep_export, self.playing, self.isovalue_text) = (None, None, None);
        self.reset_view();
        self.history = History::default();
        Ok(())
    }

    /// Returns to the first direction, and fits the picture to the surface.
    pub(super) fn reset_view(&mut self) {
        camera_control::reset(&mut self.view, &self.first_camera);
        self.is_fit_pending = true;
    }

    /// Shows a message for [`MESSAGE_TIME`].
    pub(super) fn show_message(&mut self, context: &egui::Context, text: impl Into<String>) {
        let until = context.input(|input| input.time) + MESSAGE_TIME.as_secs_f64();
        self.message = Some((text.into(), until));
        context.request_repaint_after(MESSAGE_TIME);
    }

    /// Shows the message of an error, if there is one.
    pub(super) fn show_error<T>(&mut self, context: &egui::Context, result: Result<T>) {
        if let Err(error) = result {
            self.show_message(context, error.to_string());
        }
    }

    pub(super) fn show_result(&mut self, context: &egui::Context, result: Result<String>) {
        self.show_message(context, result.unwrap_or_else(|error| error.to_string()));
    }

    /// Shows a spectrum when its thread has finished, and loads dropped files.
    fn poll_files(&mut self, context: &egui::Context) {
        if let Some(result) = self.loading.as_ref().and_then(Loading::poll) {
            self.loading = None;
            let shown = result.and_then(|content| match content {
                LoadedContent::Spectrum(loaded) => self.show_scene(*loaded, context),
                LoadedContent::Volume(volume, preview) => {
                    self.ask_how_to_compute(*volume, preview, context)
                }
            });
            if shown.is_err() {
                self.close_preview();
            }
            self.show_error(context, shown);
        }
        let dropped: Vec<PathBuf> = context.input(|input| {
            input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect()
        });
        self.pending_files.extend(dropped);
        if self.loading.is_none() && self.compute_dialog.is_none() && !self.pending_files.is_empty()
        {
            let path = self.pending_files.remove(0);
            self.load(LoadSource::File(path), context);
        }
    }

    pub(super) fn run_command(&mut self, command: Command, context: &egui::Context) {
        // Pending changes of the view must be in the saved picture.
        if let Err(error) = self.fit_if_pending() {
            return self.show_message(context, error.to_string());
        }
        let Some(scene) = &mut self.scene else { return };
        if let Err(error) = scene.update_picks(&mut self.view) {
            return self.show_message(context, error.to_string());
        }
        let result = match command {
            Command::Picture => save::picture(&self.folder, scene, &self.view),
            Command::Mesh(extension) => save::mesh(&self.folder, scene, &self.view, extension),
            Command::Perform(action) => return self.perform(action, context),
            Command::GoTo(isovalue) => {
                (scene.isovalue, self.playing) = (isovalue, None);
                return;
            }
            Command::Sweep(n_frames) => {
                self.playing = None;
                match SweepExport::start(&self.folder, scene, n_frames) {
                    Ok(export) => {
                        self.sweep_export = Some(export);
                        return;
                    }
                    Err(error) => Err(error),
                }
            }
        };
        self.show_result(context, result);
    }

    /// Advances the sweep that is saved or played.
    fn advance_sweep(&mut self, context: &egui::Context) {
        let Some(scene) = &mut self.scene else { return };
        if let Some(mut export) = self.sweep_export.take() {
            match export.step(scene, &mut self.view) {
                Ok(_) if !export.is_done() => self.sweep_export = Some(export),
                Ok(_) => {
                    let text = export.finish(scene);
                    self.show_message(context, text);
                }
                Err(error) => {
                    export.finish(scene);
                    self.show_message(context, error.to_string());
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

    /// Shows name, isovalue and number of triangles in the title.
    fn update_title(&mut self, context: &egui::Context) {
        let title = match (&self.scene, &self.loading) {
            (_, Some(loading)) => format!("{} - working", loading.name),
            (Some(scene), None) if scene.is_preview => scene.name.clone(),
            (Some(scene), None) => {
                let state = match scene.is_reading() {
                    true => "reading".to_owned(),
                    false => format!("{} triangles", scene.n_triangles()),
                };
                let isovalue = format_number(scene.isovalue);
                format!("{} - isovalue {isovalue} - {state}", scene.name)
            }
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
            // The new theme takes effect in the next frame.
            context.set_theme(theme);
            context.request_repaint();
        }
        self.poll_files(&context);
        if self.message.as_ref().is_some_and(|(_, until)| context.input(|i| i.time) > *until) {
            self.message = None;
        }
        // An open dialog receives the keys instead.
        if self.file_dialog.is_none() && self.compute_dialog.is_none() {
            for action in actions::pressed(&context) {
                self.perform(action, &context);
            }
        }
        self.advance_sweep(&context);
        Panel::bottom("isovalue").show(ui, |ui| {
            self.show_isovalue_bar(ui);
            if self.scene.is_none()
                && let Some((message, _)) = &self.message
            {
                ui.label(message);
            }
        });
        let mut command = None;
        if let Some(scene) = self.scene.as_mut().filter(|scene| !scene.is_preview) {
            Panel::right("options").default_size(230.0).show(ui, |ui| {
                ScrollArea::vertical().show(ui, |ui| {
                    let (view, options) = (&mut self.view, &mut self.options);
                    command = options::show(ui, scene, view, &mut self.tool, options);
                });
            });
        }
        if let Some(command) = command {
            self.run_command(command, &context);
        }
        // A picture fills its panel to the last pixel; text needs margins.
        let frame = match self.scene {
            Some(_) => Frame::NONE,
            None => Frame::central_panel(ui.style()),
        };
        CentralPanel::default().frame(frame).show(ui, |ui| self.show_picture(ui));
        self.show_progress(&context);
        self.show_file_dialog(&context);
        self.show_compute_dialog(&context);
        self.show_help(&context);
        self.ask_before_closing(&context);
        self.update_title(&context);
    }
}
