//! The picture in the window: drawing it, and what the hand does on it.

use std::time::Duration;

use eframe::egui::{self, Color32, PointerButton, Rect, Response, Sense, Ui, pos2, vec2};
use glam::DVec2;

use super::actions::{self, Action};
use super::chooser::Purpose;
use super::cube;
use super::empty::{self, Choice};
use super::hand;
use super::history::REST;
use super::loading::Source;
use super::scene::Scene;
use super::window::Window;
use crate::error::Result;
use crate::render::View;
use crate::volume::phantom;

impl Window {
    /// The picture, in all of the rest of the window.
    pub(super) fn picture(&mut self, ui: &mut Ui) {
        if self.scene.is_none() {
            if self.loading.is_none() {
                self.offer(ui);
            }
            return;
        }
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        // The texture has a pixel for each of the window's, so both begin on one.
        let scale = ui.pixels_per_point();
        let corner = pos2((rect.left() * scale).round(), (rect.top() * scale).round());
        let size = (rect.size() * scale).floor().max(vec2(1.0, 1.0));
        let largest = self.gpu.device().limits().max_texture_dimension_2d;
        self.resize([size.x, size.y].map(|n| (n as u32).min(largest)));
        if let Err(error) = self.fit() {
            return self.say(ui.ctx(), error.to_string());
        }
        let Some(scene) = &mut self.scene else { return };
        let corner = corner / scale;
        let shown = Rect::from_min_size(corner, size / scale);
        drag(&response, scale, scene, &mut self.view);
        if response.double_clicked()
            && self.tool.is_none()
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
        let painted = scene
            .follow(&mut self.view)
            .and_then(|()| scene.paint((&self.render_state, ui.ctx()), &self.view));
        match painted {
            Ok(texture) => {
                let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                ui.painter().image(texture, shown, whole, Color32::WHITE);
                if let Some(sheet) = scene.written(ui.ctx(), &self.view) {
                    ui.painter().image(sheet, shown, whole, Color32::WHITE);
                }
            }
            Err(error) => self.say(ui.ctx(), error.to_string()),
        }
        self.point(ui, &response, shown, scale);
        let Some(scene) = &self.scene else { return };
        if let Some(side) = cube::show(ui, shown, &self.view.camera, scene.spectrum.volume()) {
            self.act(Action::Side(side), ui.ctx());
        }
        self.remember(ui.ctx());
    }

    /// Takes the size that the picture has from now on. What was made to fit another size, and is seen as it was then, is made to
    /// fit this one: parts of a window have their sizes from its second frame on.
    fn resize(&mut self, [width, height]: [u32; 2]) {
        let is_other = [self.view.width, self.view.height] != [width, height];
        (self.view.width, self.view.height) = (width, height);
        let seen = self.scene.as_ref().map(|scene| (self.view.camera, scene.isovalue));
        if is_other && self.fitted.is_some() && self.fitted == seen {
            hand::reset(&mut self.view, &self.first_camera);
            self.is_to_fit = true;
            self.history.settle();
        }
    }

    /// Makes the view fit the surface where that is wanted.
    ///
    /// # Errors
    ///
    /// As the scene's.
    pub(super) fn fit(&mut self) -> Result<()> {
        let Some(scene) = self.scene.as_mut().filter(|_| self.is_to_fit) else { return Ok(()) };
        self.is_to_fit = false;
        scene.follow(&mut self.view)?;
        scene.fit(&mut self.view)?;
        self.fitted = Some((self.view.camera, scene.isovalue));
        Ok(())
    }

    /// Keeps views in which one came to rest.
    fn remember(&mut self, context: &egui::Context) {
        let (time, is_held) = context.input(|input| (input.time, input.pointer.any_down()));
        if self.history.watch(&self.view, time, is_held) {
            context.request_repaint_after(Duration::from_secs_f64(REST));
        }
    }

    /// What the window offers while there is nothing in it.
    fn offer(&mut self, ui: &mut Ui) {
        match empty::show(ui, &self.folder) {
            Some(Choice::Open) => self.choose(Purpose::Open),
            Some(Choice::Phantom(name)) => match phantom(name) {
                Ok(volume) => self.load(Source::Volume(volume.into()), ui.ctx()),
                Err(error) => self.say(ui.ctx(), error.to_string()),
            },
            None => {}
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
            (false, true) => hand::shift(view, scene.spectrum.volume(), by),
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
