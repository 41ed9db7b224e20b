//! The picture in the window, and mouse input on it.

use std::time::Duration;

use eframe::egui::{self, Color32, PointerButton, Rect, Response, Sense, Ui, pos2, vec2};
use glam::DVec2;

use super::actions::{self, Action};
use super::camera_control::{self, orbit, pan, zoom};
use super::cube;
use super::file_dialog::Purpose;
use super::history::REST_SECONDS;
use super::scene::Scene;
use super::start_screen::{self, StartChoice};
use super::window::Window;
use crate::error::Result;
use crate::render::View;
use crate::volume::phantom;

impl Window {
    /// Shows the picture in the remaining area of the window.
    pub(super) fn show_picture(&mut self, ui: &mut Ui) {
        if self.scene.is_none() {
            if self.loading.is_none() && self.compute_dialog.is_none() {
                self.show_start_screen(ui);
            }
            return;
        }
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        // The texture has one texel per pixel of the window, so its corner is aligned with a pixel.
        let scale = ui.pixels_per_point();
        let corner = pos2((rect.left() * scale).round(), (rect.top() * scale).round());
        let size = (rect.size() * scale).floor().max(vec2(1.0, 1.0));
        let largest = self.gpu.device().limits().max_texture_dimension_2d;
        self.resize([size.x, size.y].map(|n| (n as u32).min(largest)));
        if let Err(error) = self.fit_if_pending() {
            return self.show_message(ui.ctx(), error.to_string());
        }
        let Some(scene) = &mut self.scene else { return };
        let corner = corner / scale;
        let picture = Rect::from_min_size(corner, size / scale);
        control_camera(&response, scale, scene, &mut self.view);
        if response.double_clicked()
            && self.tool.is_none()
            && let Some(at) = response.interact_pointer_pos()
        {
            let pixel = (at - corner) * scale;
            let pixel = DVec2::new(f64::from(pixel.x), f64::from(pixel.y));
            self.view.look_at = scene.point_under(&self.view, pixel).map(|p| p.to_array());
        }
        let wheel = if response.contains_pointer() { ui.input(actions::wheel) } else { None };
        match wheel {
            Some(Action::Step { steps, is_fine }) if !scene.is_preview => {
                self.playing = None;
                scene.step_by(steps, is_fine);
            }
            Some(Action::Zoom(factor)) => zoom(&mut self.view, factor),
            _ => {}
        }
        let painted = scene
            .update_picks(&mut self.view)
            .and_then(|()| scene.paint(&self.render_state, ui.ctx(), &self.view));
        match painted {
            Ok(texture) => {
                let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                ui.painter().image(texture, picture, uv, Color32::WHITE);
                if let Some(annotations) = scene.annotations(ui.ctx(), &self.view) {
                    ui.painter().image(annotations, picture, uv, Color32::WHITE);
                }
            }
            Err(error) => self.show_message(ui.ctx(), error.to_string()),
        }
        self.handle_pointer(ui, &response, picture, scale);
        let Some(scene) = &self.scene else { return };
        if let Some(side) = cube::show(ui, picture, &self.view.camera, scene.spectrum.volume()) {
            self.perform(Action::Side(side), ui.ctx());
        }
        self.record_view(ui.ctx());
    }

    /// Sets the size of the picture. Repeats the last fit for the new size if camera and isovalue have not changed since,
    /// because the panels of a new window get their sizes in its second frame.
    fn resize(&mut self, [width, height]: [u32; 2]) {
        let has_changed = [self.view.width, self.view.height] != [width, height];
        (self.view.width, self.view.height) = (width, height);
        let current = self.scene.as_ref().map(|scene| (self.view.camera, scene.isovalue));
        if has_changed && self.last_fit.is_some() && self.last_fit == current {
            camera_control::reset(&mut self.view, &self.first_camera);
            self.is_fit_pending = true;
            self.history.ignore_next_change();
        }
    }

    /// Fits the view to the surface if this is pending.
    ///
    /// # Errors
    ///
    /// As the scene's.
    pub(super) fn fit_if_pending(&mut self) -> Result<()> {
        let scene = self.scene.as_mut().filter(|_| self.is_fit_pending);
        let Some(scene) = scene else { return Ok(()) };
        self.is_fit_pending = false;
        scene.update_picks(&mut self.view)?;
        scene.fit(&mut self.view)?;
        self.last_fit = Some((self.view.camera, scene.isovalue));
        Ok(())
    }

    /// Records the view in the history once it has come to rest.
    fn record_view(&mut self, context: &egui::Context) {
        let (time, is_dragging) = context.input(|input| (input.time, input.pointer.any_down()));
        if self.history.observe(&self.view, time, is_dragging) {
            context.request_repaint_after(Duration::from_secs_f64(REST_SECONDS));
        }
    }

    /// Shows the start screen, and loads what is chosen on it.
    fn show_start_screen(&mut self, ui: &mut Ui) {
        match start_screen::show(ui, &self.folder) {
            Some(StartChoice::Open) => self.open_file_dialog(Purpose::Open),
            Some(StartChoice::Phantom(name)) => match phantom(name) {
                Ok(volume) => {
                    let started = self.compute(volume, ui.ctx());
                    self.show_error(ui.ctx(), started);
                }
                Err(error) => self.show_message(ui.ctx(), error.to_string()),
            },
            None => {}
        }
    }
}

/// Moves the camera by drags and zoom gestures on the picture.
fn control_camera(response: &Response, scale: f32, scene: &Scene, view: &mut View) {
    let pixels = response.drag_delta() * scale;
    let drag = DVec2::new(f64::from(pixels.x), f64::from(pixels.y));
    let is_down = |button| response.ctx.input(|input| input.pointer.button_down(button));
    if response.dragged() && drag != DVec2::ZERO {
        let (left, middle, right) = (
            is_down(PointerButton::Primary),
            is_down(PointerButton::Middle),
            is_down(PointerButton::Secondary),
        );
        match (left, middle || right) {
            (true, true) => zoom(view, (-0.01 * drag.y).exp()),
            (true, false) => orbit(view, drag),
            (false, true) => pan(view, scene.spectrum.volume(), drag),
            (false, false) => {}
        }
    }
    if response.contains_pointer() {
        let factor = response.ctx.input(egui::InputState::zoom_delta);
        if factor != 1.0 {
            zoom(view, f64::from(factor));
        }
    }
}
