//! The slider: the isovalue under the curves of the contour spectrum, with the events to click.

use std::fmt::Write as _;

use eframe::egui::{Color32, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, pos2};

use super::curves::Point;
use super::scene::Scene;
use super::typed;
use crate::spectrum::Measures;

/// Height of the curves, points, and as a share of the window's where that is less.
const HEIGHT: f32 = 96.0;
const SHARE: f32 = 0.14;

/// Size of the mark that tells a curve's colour, points.
const MARK: Vec2 = Vec2::new(12.0, 6.0);

/// How near to an event a click goes to it, points.
const SNAP: f32 = 5.0;

/// One curve.
struct Curve {
    name: &'static str,
    color: Color32,
    of: fn(&Measures) -> f64,
    /// Whether it is a count, which is drawn as steps: there is nothing between two of its values.
    is_count: bool,
}

/// Colours are told apart with any colour vision (Okabe and Ito 2008).
const CURVES: [Curve; 4] = [
    Curve {
        name: "components",
        color: Color32::from_rgb(0xE6, 0x9F, 0x00),
        of: |m| f64::from(m.components),
        is_count: true,
    },
    Curve {
        name: "Euler characteristic",
        color: Color32::from_rgb(0x56, 0xB4, 0xE9),
        of: |m| m.euler as f64,
        is_count: true,
    },
    Curve {
        name: "area without caps",
        color: Color32::from_rgb(0x00, 0x9E, 0x73),
        of: |m| m.area,
        is_count: false,
    },
    Curve {
        name: "enclosed volume",
        color: Color32::from_rgb(0xCC, 0x79, 0xA7),
        of: |m| m.volume,
        is_count: false,
    },
];

/// Which curves are drawn.
pub(super) type Shown = [bool; CURVES.len()];

/// Draws the slider; the isovalue that was chosen on it.
pub(super) fn show(ui: &mut Ui, scene: &mut Scene, shown: &mut Shown) -> Option<f64> {
    let points = scene.curves.points();
    ui.horizontal_wrapped(|ui| {
        legend(ui, scene.measures(), shown);
        ask_for_curves(ui, scene);
    });
    let size =
        Vec2::new(ui.available_width(), HEIGHT.min(SHARE * ui.ctx().content_rect().height()));
    let (response, painter) = ui.allocate_painter(size, Sense::click_and_drag());
    let rect = response.rect.shrink2(Vec2::new(6.0, 2.0));
    let axis = Axis { rect, range: scene.spectrum.range() };
    let visuals = ui.visuals();
    painter.rect_filled(response.rect, 3.0, visuals.extreme_bg_color);

    painter.extend(bars(scene, &axis, visuals.weak_text_color().gamma_multiply(0.35)));
    for (curve, _) in CURVES.iter().zip(*shown).filter(|(_, shown)| *shown) {
        painter.add(Shape::line(line(curve, &points, &axis), Stroke::new(1.5, curve.color)));
    }
    for x in marks(scene, &axis) {
        painter.vline(
            x,
            rect.bottom() - 9.0..=rect.bottom(),
            Stroke::new(1.0, visuals.text_color()),
        );
    }
    for (isovalue, _) in &scene.marks {
        let stroke = Stroke::new(1.0, visuals.weak_text_color());
        painter.add(Shape::dashed_line(&axis.upright(*isovalue), stroke, 3.0, 3.0));
    }
    let layers = scene.layers.iter().map(|layer| (layer.isovalue, 1.0));
    for (isovalue, width) in layers.chain([(scene.isovalue, 2.0)]) {
        let x = axis.x_of(isovalue);
        let stroke = Stroke::new(width, visuals.selection.stroke.color);
        painter.vline(x, rect.y_range(), stroke);
        painter.circle_filled(pos2(x, rect.top() + 3.0), 2.0 + 1.5 * width, stroke.color);
    }

    let hover = response.hover_pos().map(|p| axis.isovalue_at(p.x));
    if let Some(isovalue) = hover {
        let isovalue = nearest_event(scene, &axis, isovalue).unwrap_or(isovalue);
        let text = told(&points, &axis, isovalue);
        let text = painter.layout_no_wrap(text, FontId::proportional(12.0), visuals.text_color());
        let ground = Rect::from_min_size(rect.left_top(), text.size());
        painter.rect_filled(ground, 2.0, visuals.extreme_bg_color.gamma_multiply(0.85));
        painter.galley(rect.left_top(), text, visuals.text_color());
    }
    let pointer = response.interact_pointer_pos()?;
    let isovalue = axis.isovalue_at(pointer.x);
    if response.clicked() {
        return Some(nearest_event(scene, &axis, isovalue).unwrap_or(isovalue));
    }
    response.dragged().then_some(isovalue)
}

/// An isovalue, and what the curves say there as far as they are known.
fn told(points: &[Point], axis: &Axis, isovalue: f64) -> String {
    let mut text = typed::shown(isovalue);
    let away = |point: &Point| (axis.x_of(point.isovalue) - axis.x_of(isovalue)).abs();
    let nearest = points.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    // What lies further than a few pixels says nothing of this place.
    if let Some(point) = nearest.filter(|&point| away(point) <= 2.0 * SNAP) {
        for curve in &CURVES {
            let _ = write!(text, "   {} {}", curve.name, typed::short((curve.of)(&point.measures)));
        }
    }
    text
}

/// Isovalues from left to right.
struct Axis {
    rect: Rect,
    range: (f64, f64),
}

impl Axis {
    fn x_of(&self, isovalue: f64) -> f32 {
        let (low, high) = self.range;
        // Halved first, so that the widest range does not overflow.
        let share = (0.5 * isovalue - 0.5 * low) / (0.5 * high - 0.5 * low);
        // A range of one isovalue has no length.
        let share = if share.is_finite() { share } else { 0.5 };
        self.rect.left() + self.rect.width() * share as f32
    }

    /// From the top to the bottom at an isovalue.
    fn upright(&self, isovalue: f64) -> [Pos2; 2] {
        let x = self.x_of(isovalue);
        [pos2(x, self.rect.top()), pos2(x, self.rect.bottom())]
    }

    fn isovalue_at(&self, x: f32) -> f64 {
        let (low, high) = self.range;
        let share = f64::from((x - self.rect.left()) / self.rect.width()).clamp(0.0, 1.0);
        low * (1.0 - share) + high * share
    }
}

/// The names of the curves, to be switched on and off, with the numbers of the mesh that is drawn.
fn legend(ui: &mut Ui, here: Option<Measures>, shown: &mut Shown) {
    for (curve, shown) in CURVES.iter().zip(shown) {
        let value = here.map_or_else(String::new, |m| format!(" {}", typed::shown((curve.of)(&m))));
        // Colours that are told apart on a curve are not all read as words.
        let (mark, _) = ui.allocate_exact_size(MARK, Sense::hover());
        ui.painter().rect_filled(mark, 2.0, curve.color);
        ui.checkbox(shown, format!("{}{value}", curve.name));
    }
}

/// Of a folder the curves are computed when they are asked for, as all of it is read for them.
fn ask_for_curves(ui: &mut Ui, scene: &mut Scene) {
    let Some(folder) = scene.folder().filter(|_| !scene.curves.is_started()) else { return };
    let megabytes = folder.n_bytes() as f64 / 1e6;
    if ui.button(format!("compute curves (reads {megabytes:.1} MB)")).clicked()
        && let Err(error) = scene.start_curves(ui.ctx())
    {
        log::warn!("{error}");
    }
}

/// A curve over its own range, which always has 0 in it.
fn line(curve: &Curve, points: &[Point], axis: &Axis) -> Vec<Pos2> {
    let values = points.iter().map(|p| (curve.of)(&p.measures));
    let (low, high) = values.clone().fold((0.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    let length = if high > low { high - low } else { 1.0 };
    let height = |v: f64| axis.rect.bottom() - axis.rect.height() * ((v - low) / length) as f32;
    let line = points.iter().zip(values).map(|(p, v)| pos2(axis.x_of(p.isovalue), height(v)));
    if curve.is_count { steps(line.collect()) } else { line.collect() }
}

/// Level half-way to the next point, then up or down at once.
fn steps(points: Vec<Pos2>) -> Vec<Pos2> {
    let mut line = Vec::with_capacity(3 * points.len());
    for (i, &point) in points.iter().enumerate() {
        line.push(point);
        if let Some(next) = points.get(i + 1).filter(|next| next.y != point.y) {
            let x = 0.5 * (point.x + next.x);
            line.extend([pos2(x, point.y), pos2(x, next.y)]);
        }
    }
    line
}

/// The histogram of the samples, its heights by their logarithms.
fn bars(scene: &Scene, axis: &Axis, color: Color32) -> Vec<Shape> {
    let Some(samples) = &scene.samples else { return Vec::new() };
    let width = 3.0;
    let parts = samples.parts((axis.rect.width() / width) as usize, axis.range);
    let height = |count: u64| (1.0 + count as f32).ln();
    let largest = parts.iter().copied().map(height).fold(1.0, f32::max);
    (parts.iter().enumerate())
        .filter(|&(_, &count)| count > 0)
        .map(|(i, &count)| {
            let left = axis.rect.left() + i as f32 * width;
            let top = axis.rect.bottom() - axis.rect.height() * height(count) / largest;
            let bar = Rect::from_min_max(pos2(left, top), pos2(left + width, axis.rect.bottom()));
            Shape::rect_filled(bar, 0.0, color)
        })
        .collect()
}

/// Where the events are, one mark for each pixel that has any.
fn marks(scene: &Scene, axis: &Axis) -> Vec<f32> {
    let mut marks: Vec<f32> = scene.events.iter().map(|&c| axis.x_of(c).round()).collect();
    marks.dedup();
    marks
}

/// The event within reach of an isovalue.
fn nearest_event(scene: &Scene, axis: &Axis, isovalue: f64) -> Option<f64> {
    let next = scene.events.partition_point(|&c| c < isovalue);
    let beside = [next.checked_sub(1), Some(next)].into_iter().flatten();
    let away = |c: f64| (axis.x_of(c) - axis.x_of(isovalue)).abs();
    beside
        .filter_map(|i| scene.events.get(i).copied())
        .filter(|&c| away(c) <= SNAP)
        .min_by(|a, b| away(*a).total_cmp(&away(*b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_drawn_level_and_upright() {
        let line = steps([(0.0, 3.0), (2.0, 3.0), (4.0, 1.0)].map(Pos2::from).to_vec());
        let wanted = [(0.0, 3.0), (2.0, 3.0), (3.0, 3.0), (3.0, 1.0), (4.0, 1.0)].map(Pos2::from);
        assert_eq!(line, wanted);
        assert!(line.windows(2).all(|w| w[0].x == w[1].x || w[0].y == w[1].y));
    }
}
