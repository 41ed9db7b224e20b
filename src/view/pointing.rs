//! What lies under the pointer: where that is, components that are picked there, distances between points.

use eframe::egui::{FontId, Pos2, Rect, Response, Stroke, Ui, vec2};
use glam::{DVec2, DVec3};

use super::history::REST;
use super::scene::Scene;
use super::typed;
use super::window::Window;
use crate::error::Result;
use crate::render::View;
use crate::spectrum::VolumeInfo;
use crate::volume::Unit;

/// What the next click on the surface does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tool {
    /// Keep the component alone.
    Keep,
    /// Hide the component.
    Hide,
    /// Measure to this point.
    Measure,
}

/// Where the pointer is on the picture.
#[derive(Debug, Default)]
pub(super) struct Pointing {
    /// The pixel under it, from the top left.
    pixel: Option<DVec2>,
    /// Since when that, the isovalue and the view are the same, seconds; what is told of it.
    rested: Option<((DVec2, f64, View), f64)>,
    told: Option<String>,
}

impl Window {
    /// Follows the pointer over the picture, which lies at `picture` with so many pixels for a point.
    pub(super) fn point(&mut self, ui: &Ui, response: &Response, picture: Rect, scale: f32) {
        let pixel_of = |at: Pos2| {
            let pixel = (at - picture.min) * scale;
            DVec2::new(f64::from(pixel.x), f64::from(pixel.y))
        };
        self.pointing.pixel = response.hover_pos().map(pixel_of);
        if response.clicked()
            && let (Some(tool), Some(at)) = (self.tool, response.interact_pointer_pos())
        {
            self.use_tool(tool, pixel_of(at), ui);
        }
        self.tell_place(ui);
        let Some(scene) = &self.scene else { return };
        draw_measured(ui, scene, &self.view, picture, scale);
        if let Some(told) = &self.pointing.told {
            let (visuals, font) = (ui.visuals(), FontId::proportional(13.0));
            let text = ui.painter().layout_no_wrap(told.clone(), font, visuals.text_color());
            let at = picture.left_top() + vec2(8.0, 6.0);
            let ground = Rect::from_min_size(at, text.size()).expand(3.0);
            ui.painter().rect_filled(ground, 3.0, visuals.panel_fill.gamma_multiply(0.85));
            ui.painter().galley(at, text, visuals.text_color());
        }
    }

    /// Keeps or hides the component under the pointer.
    pub(super) fn pick(&mut self, is_hiding: bool, ui: &eframe::egui::Context) {
        if let Some(pixel) = self.pointing.pixel {
            self.pick_at(pixel, is_hiding, ui);
        }
    }

    /// Whether there is one.
    fn pick_at(&mut self, pixel: DVec2, is_hiding: bool, ui: &eframe::egui::Context) -> bool {
        let Some(scene) = &mut self.scene else { return false };
        scene.pick(&self.view, pixel, is_hiding).unwrap_or_else(|error| {
            self.say(ui, error.to_string());
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
                    self.say(ui.ctx(), format!("distance {}{unit}", typed::short(distance)));
                }
            }
        }
    }

    /// Tells where on the surface the pointer is, once it rests: finding that looks at all triangles.
    fn tell_place(&mut self, ui: &Ui) {
        let (Some(pixel), Some(scene)) = (self.pointing.pixel, &self.scene) else {
            (self.pointing.rested, self.pointing.told) = (None, None);
            return;
        };
        let now = ui.input(|input| input.time);
        let at = (pixel, scene.isovalue, self.view.clone());
        let Pointing { rested, told, .. } = &mut self.pointing;
        if rested.as_ref().is_none_or(|(before, _)| *before != at) {
            (*rested, *told) = (Some((at, now)), None);
        }
        let since = rested.as_ref().map_or(now, |rested| rested.1);
        if now - since < REST {
            ui.ctx().request_repaint_after_secs(REST as f32);
        } else if told.is_none() && since.is_finite() {
            *told = scene.point_under(&self.view, pixel).map(|point| {
                let volume = scene.spectrum.volume();
                let place = volume.placement.world_of_voxel(point.as_vec3().to_array());
                let place = place.map(typed::short).join(", ");
                let value = typed::shown(scene.isovalue);
                format!("x, y, z: {place}{}; value {value}", unit(volume))
            });
            // Beside the surface nothing is told, and nothing looked for again.
            if let Some(rested) = rested {
                rested.1 = f64::NEG_INFINITY;
            }
        }
    }
}

impl Scene {
    /// Measures from point to point of the surface: the distance in the world once there are two.
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
        self.picks = super::picks::Picks::default();
        view.keep = crate::spectrum::Keep::default();
        self.follow(view)
    }
}

/// The unit of a volume's world behind a number; nothing where it is not known.
fn unit(volume: &VolumeInfo) -> String {
    match volume.placement.unit {
        Unit::Unknown => String::new(),
        unit => format!(" {unit}"),
    }
}

/// The points between which the distance is told, and the line between them.
fn draw_measured(ui: &Ui, scene: &Scene, view: &View, picture: Rect, scale: f32) {
    let projection =
        view.camera.projection(scene.spectrum.volume(), view.look_at, view.width, view.height);
    let place = |p: &[f64; 3]| {
        let seen = projection.clip_from_voxel.project_point3(DVec3::from_array(*p));
        let size = DVec2::new(f64::from(view.width), f64::from(view.height));
        let pixel = DVec2::new(0.5 + 0.5 * seen.x, 0.5 - 0.5 * seen.y) * size;
        picture.min + vec2(pixel.x as f32, pixel.y as f32) / scale
    };
    let points: Vec<Pos2> = scene.measured.iter().map(place).collect();
    let (painter, ink) = (ui.painter().with_clip_rect(picture), ui.visuals().text_color());
    points.iter().for_each(|&point| _ = painter.circle_filled(point, 3.5, ink));
    if let &[a, b] = &points[..] {
        painter.line_segment([a, b], Stroke::new(2.0, ink));
    }
}
