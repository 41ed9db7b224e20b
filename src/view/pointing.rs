//! The pointer over the picture: coordinates under it, picking components, measuring distances.

use eframe::egui::{Context, FontId, Pos2, Rect, Response, Stroke, Ui, vec2};
use glam::{DVec2, DVec3};

use super::history::REST_SECONDS;
use super::numbers::{format_number, format_short};
use super::picks::PickedComponents;
use super::pointer::{Rest, Tool};
use super::scene::Scene;
use super::window::Window;
use crate::error::Result;
use crate::render::View;
use crate::spectrum::{Keep, VolumeInfo};
use crate::volume::Unit;

impl Window {
    /// Handles the pointer over the picture in `picture`, with `scale` pixels per point.
    pub(super) fn handle_pointer(
        &mut self,
        ui: &Ui,
        response: &Response,
        picture: Rect,
        scale: f32,
    ) {
        let pixel_of = |at: Pos2| {
            let pixel = (at - picture.min) * scale;
            DVec2::new(f64::from(pixel.x), f64::from(pixel.y))
        };
        self.pointer.pixel = response.hover_pos().map(pixel_of);
        if response.clicked()
            && let (Some(tool), Some(at)) = (self.tool, response.interact_pointer_pos())
        {
            self.use_tool(tool, pixel_of(at), ui);
        }
        self.update_readout(ui);
        let Some(scene) = &self.scene else { return };
        draw_measurement(ui, scene, &self.view, picture, scale);
        if let Some(readout) = &self.pointer.readout {
            let (visuals, font) = (ui.visuals(), FontId::proportional(13.0));
            let text = ui.painter().layout_no_wrap(readout.clone(), font, visuals.text_color());
            let at = picture.left_top() + vec2(8.0, 6.0);
            let background = Rect::from_min_size(at, text.size()).expand(3.0);
            ui.painter().rect_filled(background, 3.0, visuals.panel_fill.gamma_multiply(0.85));
            ui.painter().galley(at, text, visuals.text_color());
        }
    }

    /// Keeps only the component under the pointer, or hides it.
    pub(super) fn pick(&mut self, is_hiding: bool, context: &Context) {
        if let Some(pixel) = self.pointer.pixel {
            self.pick_at(pixel, is_hiding, context);
        }
    }

    /// Keeps only the component at a pixel, or hides it; returns whether there is one.
    fn pick_at(&mut self, pixel: DVec2, is_hiding: bool, context: &Context) -> bool {
        let Some(scene) = &mut self.scene else { return false };
        scene.pick(&self.view, pixel, is_hiding).unwrap_or_else(|error| {
            self.show_message(context, error.to_string());
            false
        })
    }

    fn use_tool(&mut self, tool: Tool, pixel: DVec2, ui: &Ui) {
        match tool {
            Tool::Keep | Tool::Hide => {
                let is_hiding = tool == Tool::Hide;
                if self.pick_at(pixel, is_hiding, ui.ctx()) && !is_hiding {
                    self.tool = None;
                }
            }
            Tool::Measure => {
                let Some(scene) = &mut self.scene else { return };
                if let Some(distance) = scene.measure(&self.view, pixel) {
                    let unit = unit(scene.spectrum.volume());
                    let text = format!("distance {}{unit}", format_short(distance));
                    self.show_message(ui.ctx(), text);
                }
            }
        }
    }

    /// Computes the readout once the pointer rests, because finding the point visits all active triangles.
    fn update_readout(&mut self, ui: &Ui) {
        let pointer = &mut self.pointer;
        let (Some(pixel), Some(scene)) = (pointer.pixel, &self.scene) else {
            (pointer.rest, pointer.readout) = (None, None);
            return;
        };
        let now = ui.input(|input| input.time);
        let state = (pixel, scene.isovalue, self.view.clone());
        let rest = match pointer.rest.take().filter(|rest| rest.state == state) {
            Some(rest) => pointer.rest.insert(rest),
            None => {
                pointer.readout = None;
                pointer.rest.insert(Rest { state, since: now })
            }
        };
        if now - rest.since < REST_SECONDS {
            ui.ctx().request_repaint_after_secs(REST_SECONDS as f32);
        } else if rest.since.is_finite() {
            rest.since = f64::NEG_INFINITY;
            pointer.readout = scene.point_under(&self.view, pixel).map(|point| {
                let volume = scene.spectrum.volume();
                let position = volume.placement.world_of_voxel(point.as_vec3().to_array());
                let position = position.map(format_short).join(", ");
                let value = format_number(scene.isovalue);
                format!("x, y, z: {position}{}; value {value}", unit(volume))
            });
        }
    }
}

impl Scene {
    /// Adds the point under a pixel to the measurement; returns the distance in the world once there are two points.
    fn measure(&mut self, view: &View, pixel: DVec2) -> Option<f64> {
        if self.measured.len() == 2 {
            self.measured.clear();
        }
        self.measured.extend(self.point_under(view, pixel).map(|point| point.to_array()));
        let &[a, b] = &self.measured[..] else { return None };
        let placement = &self.spectrum.volume().placement;
        let [a, b] = [a, b].map(|p| DVec3::from(placement.around_origin(p.map(|x| x as f32))));
        Some(a.distance(b))
    }

    /// Shows all components again.
    pub(super) fn show_all(&mut self, view: &mut View) -> Result<()> {
        self.picks = PickedComponents::default();
        view.keep = Keep::default();
        self.update_picks(view)
    }
}

/// The unit of a volume's world as a suffix of a number; empty for the unknown unit.
fn unit(volume: &VolumeInfo) -> String {
    match volume.placement.unit {
        Unit::Unknown => String::new(),
        unit => format!(" {unit}"),
    }
}

/// Draws the measured points and the line between them.
fn draw_measurement(ui: &Ui, scene: &Scene, view: &View, picture: Rect, scale: f32) {
    let projection =
        view.camera.projection(scene.spectrum.volume(), view.look_at, view.width, view.height);
    let screen_position = |p: &[f64; 3]| {
        let clip = projection.clip_from_voxel.project_point3(DVec3::from_array(*p));
        let size = DVec2::new(f64::from(view.width), f64::from(view.height));
        let pixel = DVec2::new(0.5 + 0.5 * clip.x, 0.5 - 0.5 * clip.y) * size;
        picture.min + vec2(pixel.x as f32, pixel.y as f32) / scale
    };
    let points: Vec<Pos2> = scene.measured.iter().map(screen_position).collect();
    let (painter, color) = (ui.painter().with_clip_rect(picture), ui.visuals().text_color());
    points.iter().for_each(|&point| _ = painter.circle_filled(point, 3.5, color));
    if let &[a, b] = &points[..] {
        painter.line_segment([a, b], Stroke::new(2.0, color));
    }
}
