//! The effects of actions.

use eframe::egui::{self, ViewportCommand};

use glam::DVec2;

use super::actions::{Action, KEY_DEGREES, KEY_PIXELS};
use super::camera_control;
use super::file_dialog::Purpose;
use super::options::Command;
use super::pointer::Tool;
use super::window::Window;
use crate::render::Color;

impl Window {
    pub(super) fn perform(&mut self, action: Action, context: &egui::Context) {
        if self.shows_preview() && needs_spectrum(action) {
            return;
        }
        match (action, &mut self.scene) {
            (Action::Help, _) => self.is_help_open = !self.is_help_open,
            (Action::Wireframe, _) => {
                self.view.wireframe = self.view.wireframe.is_none().then_some(1.0);
            }
            (Action::Reset, _) => self.reset_view(),
            (Action::Axes, _) => {
                self.view.axes = !self.view.axes;
                self.view.scale_bar = self.view.axes;
            }
            (Action::Occlusion, _) => self.view.occlusion = !self.view.occlusion,
            (Action::Components, _) => {
                let is_plain = self.view.color == Color::None;
                self.view.color = if is_plain { Color::Component } else { Color::None };
            }
            (Action::Fullscreen, _) => {
                let is_full = context.input(|input| input.viewport().fullscreen.unwrap_or(false));
                context.send_viewport_cmd(ViewportCommand::Fullscreen(!is_full));
            }
            (Action::Caps, _) => self.view.open = !self.view.open,
            (Action::Turn([azimuth, elevation]), _) => {
                let camera = &mut self.view.camera;
                camera.azimuth = (camera.azimuth + azimuth * KEY_DEGREES).rem_euclid(360.0);
                camera.elevation = (camera.elevation + elevation * KEY_DEGREES).clamp(-90.0, 90.0);
            }
            (Action::Fit, _) => {
                self.view.camera.distance = 1.0;
                self.is_fit_pending = true;
            }
            (Action::FitAll, Some(scene)) => {
                self.view.camera.distance = 1.0;
                scene.fit_all(&mut self.view);
            }
            (Action::Move(steps), Some(scene)) => {
                let drag = KEY_PIXELS * DVec2::from_array(steps);
                camera_control::pan(&mut self.view, scene.spectrum.volume(), drag);
            }
            (Action::End { is_high }, Some(scene)) => {
                let (low, high) = scene.spectrum.range();
                (scene.isovalue, self.playing) = (if is_high { high } else { low }, None);
            }
            (Action::Zoom(factor), _) => camera_control::zoom(&mut self.view, factor),
            (Action::Undo, _) => _ = self.history.undo(&mut self.view),
            (Action::Redo, _) => _ = self.history.redo(&mut self.view),
            (Action::Open, _) => self.open_file_dialog(Purpose::Open),
            (Action::SaveAs, _) => self.open_file_dialog(Purpose::Save),
            (Action::Orthographic, Some(scene)) => {
                let is_parallel = !self.view.camera.orthographic;
                self.view.set_orthographic(scene.spectrum.volume(), is_parallel);
            }
            (Action::Side(side), Some(scene)) => {
                self.view.camera = self.view.camera.from_side(side, scene.spectrum.volume());
            }
            (Action::Event { is_up }, Some(scene)) => {
                self.playing = None;
                scene.go_to_event(is_up);
            }
            (Action::Step { steps, is_fine }, Some(scene)) => {
                self.playing = None;
                scene.step_by(steps, is_fine);
            }
            (Action::Play, Some(_)) => {
                self.playing = if self.playing.is_some() { None } else { Some(1.0) };
            }
            (Action::Picture, Some(_)) => self.run_command(Command::Picture, context),
            (Action::Pick { is_hiding }, Some(_)) => self.pick(is_hiding, context),
            (Action::ShowAll, Some(scene)) => {
                let result = scene.show_all(&mut self.view);
                self.show_error(context, result);
            }
            (Action::Measure, Some(scene)) => {
                scene.measured.clear();
                let is_measuring = self.tool == Some(Tool::Measure);
                self.tool = (!is_measuring).then_some(Tool::Measure);
            }
            (_, None) => {}
        }
    }
}

/// Whether an action has no meaning for the only isosurface of a volume whose spectrum is not there yet.
fn needs_spectrum(action: Action) -> bool {
    matches!(
        action,
        Action::Step { .. }
            | Action::End { .. }
            | Action::Event { .. }
            | Action::Play
            | Action::Picture
            | Action::SaveAs
            | Action::Pick { .. }
            | Action::ShowAll
            | Action::Measure
    )
}
