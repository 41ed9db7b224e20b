//! The dialog before the spectrum of a volume is computed: range, smoothing, persistence and tolerance, with what they cost.
//!
//! A thread prepares the volume with the settings in the fields and estimates; when they have changed meanwhile, another one follows. The sweep
//! takes the prepared volume and its topology from the last one. A thread runs to its end, even if the dialog is closed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use eframe::egui::{self, Align2, Button, DragValue, Grid, Key, RichText, TextEdit, Ui, vec2};

use super::cost::Cost;
use super::numbers::format_number;
use crate::error::{Error, Result};
use crate::prepared::Prepared;
use crate::settings::{IsovalueRange, Length, NoiseSettings, PreparationSettings, SweepSettings};
use crate::sweep::Parameters;
use crate::volume::Volume;

/// Width of the fields, points.
const FIELD_WIDTH: f32 = 150.0;

/// Distance of the dialog from the corner of the window, points.
const MARGIN: f32 = 16.0;

/// Width of the line with the cost, points.
const COST_WIDTH: f32 = 420.0;

/// The settings as they are in the fields.
#[derive(Clone, Debug, PartialEq)]
struct Settings {
    range: String,
    /// Standard deviation of the smoothing, voxels.
    smoothing: f64,
    persistence: String,
    error: f64,
}

/// A volume with the parameters of its sweep.
#[derive(Debug)]
pub(super) struct Ready {
    pub(super) prepared: Prepared,
    pub(super) parameters: Parameters,
}

impl Settings {
    /// Prepares a volume, and resolves the parameters.
    fn apply(&self, volume: Volume, parameters: &Parameters) -> Result<Ready> {
        let parsed = |text: &str| (!text.trim().is_empty()).then(|| text.trim().to_owned());
        let range = parsed(&self.range).map(|text| text.parse::<IsovalueRange>()).transpose()?;
        let persistence = parsed(&self.persistence).map(|text| text.parse()).transpose()?;
        let smooth = (self.smoothing > 0.0).then_some(Length { value: self.smoothing, unit: None });
        let preparation = PreparationSettings { smooth, ..PreparationSettings::default() };
        let preparation = preparation.resolve(&volume)?;
        let noise = NoiseSettings { persistence, min_component: None }.resolve(&volume);
        let prepared = Prepared::new(volume, preparation, noise)?;
        let parameters = parameters.clone().with_error(self.error);
        let sweep = SweepSettings { range, start: None, parameters };
        let parameters = sweep.resolve(prepared.volume().range(), prepared.samples())?;
        Ok(Ready { prepared, parameters })
    }
}

/// A prepared volume, and what computing it costs.
type Estimate = Result<(Ready, Cost)>;

/// The result of a frame of the dialog.
#[derive(Debug)]
pub(super) enum Outcome {
    /// The dialog is still open.
    Open,
    /// Closed without a choice.
    Cancelled,
    /// The spectrum is to be computed.
    Chosen(Box<Ready>),
}

/// The dialog.
#[derive(Debug)]
pub(super) struct ComputeDialog {
    volume: Volume,
    parameters: Parameters,
    settings: Settings,
    /// The settings of the last estimate, and the estimate.
    estimated: Option<(Settings, Estimate)>,
    /// A thread that estimates, with its settings.
    estimating: Option<(Settings, Receiver<Estimate>)>,
    /// Whether the spectrum is computed as soon as the volume is prepared.
    is_chosen: bool,
}

impl ComputeDialog {
    pub(super) fn new(volume: Volume, parameters: Parameters) -> Self {
        let settings = Settings {
            range: String::new(),
            smoothing: 0.0,
            persistence: String::new(),
            error: parameters.error,
        };
        let (estimated, estimating, is_chosen) = (None, None, false);
        ComputeDialog { volume, parameters, settings, estimated, estimating, is_chosen }
    }

    /// Shows the dialog.
    pub(super) fn show(&mut self, window: &egui::Context) -> Outcome {
        self.estimate(window);
        let mut outcome = Outcome::Open;
        let dialog = egui::Window::new(format!("compute the spectrum of {}", self.volume.name()));
        let dialog = dialog.id(egui::Id::unique("compute")).collapsible(false).resizable(false);
        // In a corner, beside the isosurface that is shown already.
        dialog.anchor(Align2::LEFT_TOP, vec2(MARGIN, MARGIN)).show(window, |ui| {
            Grid::new("settings").num_columns(3).spacing([10.0, 8.0]).show(ui, |ui| {
                self.fields(ui);
            });
            ui.add_space(6.0);
            ui.set_min_width(COST_WIDTH);
            ui.label(self.cost_in_words());
            ui.add_space(6.0);
            ui.horizontal(|ui| {
                let can_compute = !self.is_chosen && !self.is_refused();
                let is_entered = ui.input(|input| input.key_pressed(Key::Enter));
                let button = ui.add_enabled(can_compute, Button::new("compute"));
                self.is_chosen |= button.clicked() || (can_compute && is_entered);
                let is_escaped = ui.input(|input| input.key_pressed(Key::Escape));
                if ui.button("cancel").clicked() || is_escaped {
                    outcome = Outcome::Cancelled;
                }
            });
        });
        match outcome {
            Outcome::Open if self.is_chosen => self.chosen(),
            outcome => outcome,
        }
    }

    fn fields(&mut self, ui: &mut Ui) {
        let Settings { range, smoothing, persistence, error } = &mut self.settings;
        let [low, high] = [self.volume.range().0, self.volume.range().1].map(format_number);
        let text = |ui: &mut Ui, name: &str, text: &mut String, hint: &str, help: &str| {
            let label = ui.label(name);
            let field = TextEdit::singleline(text).hint_text(hint).desired_width(FIELD_WIDTH);
            ui.add(field).labelled_by(label.id);
            ui.label(RichText::new(help).small());
            ui.end_row();
        };
        let number = |ui: &mut Ui, name: &str, value: &mut f64, range, help: &str| {
            let label = ui.label(name);
            let field = DragValue::new(value).range(range).speed(0.01).max_decimals(3);
            ui.add_sized(vec2(FIELD_WIDTH, 20.0), field).labelled_by(label.id);
            ui.label(RichText::new(help).small());
            ui.end_row();
        };
        let whole = format!("{low}:{high}");
        text(ui, "range", range, &whole, "isovalues, also p5:p99 or 10%:60%");
        number(ui, "smoothing", smoothing, 0.0..=8.0, "voxels; takes noise out first");
        text(ui, "persistence", persistence, "none", "weaker events go, such as 5 or 2%");
        number(ui, "tolerance", error, 0.01..=2.0, "voxels; larger is faster and smaller");
    }

    /// Starts an estimate for other settings, and takes a finished one.
    fn estimate(&mut self, window: &egui::Context) {
        if let Some((settings, result)) = &self.estimating {
            let finished = match result.try_recv() {
                Err(TryRecvError::Empty) => return,
                Ok(estimate) => estimate,
                Err(TryRecvError::Disconnected) => Err(Error::internal("the estimate panicked")),
            };
            self.estimated = Some((settings.clone(), finished));
            self.estimating = None;
        }
        if self.estimated.as_ref().is_some_and(|(settings, _)| *settings == self.settings) {
            return;
        }
        let (sender, result) = channel();
        let (settings, volume) = (self.settings.clone(), self.volume.clone());
        let (parameters, window) = (self.parameters.clone(), window.clone());
        self.estimating = Some((settings.clone(), result));
        thread::spawn(move || {
            let run = || -> Estimate {
                let ready = settings.apply(volume, &parameters)?;
                let range = ready.parameters.range.unwrap_or(ready.prepared.volume().range());
                let forecast = ready.prepared.forecast(range, ready.parameters.error)?;
                Ok((ready, Cost::of(&forecast)))
            };
            let estimate = catch_unwind(AssertUnwindSafe(run))
                .unwrap_or_else(|_| Err(Error::internal("the estimate panicked")));
            // The receiver is gone if the dialog is closed.
            let _ = sender.send(estimate);
            window.request_repaint();
        });
    }

    /// The estimate for the settings in the fields.
    fn current(&self) -> Option<&Estimate> {
        let (settings, estimate) = self.estimated.as_ref()?;
        (*settings == self.settings).then_some(estimate)
    }

    fn is_refused(&self) -> bool {
        self.current().is_some_and(Result::is_err)
    }

    fn cost_in_words(&self) -> String {
        match self.current() {
            None if self.is_chosen => "preparing ...".into(),
            None => "estimating the cost ...".into(),
            Some(Ok((_, cost))) => cost.in_words(),
            Some(Err(error)) => error.to_string(),
        }
    }

    /// The prepared volume once it is there.
    fn chosen(&mut self) -> Outcome {
        if self.is_refused() {
            self.is_chosen = false;
        }
        match self.estimated.take_if(|(settings, _)| *settings == self.settings) {
            Some((_, Ok((ready, _)))) => Outcome::Chosen(Box::new(ready)),
            refused => {
                self.estimated = refused;
                Outcome::Open
            }
        }
    }
}
