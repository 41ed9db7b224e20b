//! The slider for the isovalue, with the curves of the contour spectrum, a histogram and the events.

use std::fmt::Write as _;

use eframe::egui::{Color32, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, pos2};

use super::curves::Point;
use super::numbers::{format_number, format_short};
use super::scene::Scene;
use crate::spectrum::Measures;

/// Maximum height of the slider, points, and as a fraction of the height of the window.
const MAX_HEIGHT: f32 = 96.0;
const MAX_HEIGHT_FRACTION: f32 = 0.14;

/// Size of the colour sample of a curve in the legend, points.
const SAMPLE_SIZE: Vec2 = Vec2::new(12.0, 6.0);

/// Distance within which a click snaps to an event, points.
const SNAP_DISTANCE: f32 = 5.0;

/// One curve.
struct Curve {
    name: &'static str,
    color: Color32,
    value: fn(&Measures) -> f64,
    /// Whether it is a count, which is drawn as a step function.
    is_count: bool,
}

/// The hues are those of the page, between its colours on light and on dark.
const CURVES: [Curve; 4] = [
    Curve {
        name: "components",
        color: Color32::from_rgb(0xd9, 0x7d, 0x2e),
        value: |m| f64::from(m.components),
        is_count: true,
    },
    Curve {
        name: "Euler characteristic",
        color: Color32::from_rgb(0x6f, 0xa3, 0x55),
        value: |m| m.euler as f64,
        is_count: true,
    },
    Curve {
        name: "area without caps",
        color: Color32::from_rgb(0x4b, 0x8c, 0xc9),
        value: |m| m.area,
        is_count: false,
    },
    Curve {
        name: "enclosed volume",
        color: Color32::from_rgb(0xc0, 0x6a, 0x9b),
        value: |m| m.volume,
        is_count: false,
    },
];

/// Which curves are drawn.
pub(super) type VisibleCurves = [bool; CURVES.len()];

/// Shows the slider; returns the isovalue that was chosen on it.
pub(super) fn show(ui: &mut Ui, scene: &mut Scene, visible: &mut VisibleCurves) -> Option<f64> {
    let points = scene.curves.points();
    ui.horizontal_wrapped(|ui| {
        legend(ui, scene.measures(), visible);
        curves_button(ui, scene);
    });
    let height = MAX_HEIGHT.min(MAX_HEIGHT_FRACTION * ui.ctx().content_rect().height());
    let size = Vec2::new(ui.available_width(), height);
    let (response, painter) = ui.allocate_painter(size, Sense::click_and_drag());
    let rect = response.rect.shrink2(Vec2::new(6.0, 2.0));
    let axis = Axis { rect, range: scene.spectrum.range() };
    let visuals = ui.visuals();
    painter.rect_filled(response.rect, 3.0, visuals.extreme_bg_color);

    painter.extend(histogram(scene, &axis, visuals.weak_text_color().gamma_multiply(0.35)));
    for (curve, _) in CURVES.iter().zip(*visible).filter(|(_, visible)| *visible) {
        painter.add(Shape::line(polyline(curve, &points, &axis), Stroke::new(1.5, curve.color)));
    }
    for x in event_ticks(scene, &axis) {
        painter.vline(
            x,
            rect.bottom() - 9.0..=rect.bottom(),
            Stroke::new(1.0, visuals.text_color()),
        );
    }
    for (isovalue, _) in &scene.marks {
        let stroke = Stroke::new(1.0, visuals.weak_text_color());
        painter.add(Shape::dashed_line(&axis.vertical_line(*isovalue), stroke, 3.0, 3.0));
    }
    let pinned = scene.pinned.iter().map(|surface| (surface.isovalue, 1.0));
    for (isovalue, width) in pinned.chain([(scene.isovalue, 2.0)]) {
        let x = axis.x_of(isovalue);
        let stroke = Stroke::new(width, visuals.selection.stroke.color);
        painter.vline(x, rect.y_range(), stroke);
        painter.circle_filled(pos2(x, rect.top() + 3.0), 2.0 + 1.5 * width, stroke.color);
    }

    let hover = response.hover_pos().map(|p| axis.isovalue_at(p.x));
    if let Some(isovalue) = hover {
        let event = nearest_event(scene, &axis, isovalue);
        let mut text = readout(&points, &axis, event.unwrap_or(isovalue));
        if let Some(words) = event.and_then(|isovalue| scene.event_in_words(isovalue)) {
            let _ = write!(text, "   {words}");
        }
        let text = painter.layout_no_wrap(text, FontId::proportional(12.0), visuals.text_color());
        let background = Rect::from_min_size(rect.left_top(), text.size());
        painter.rect_filled(background, 2.0, visuals.extreme_bg_color.gamma_multiply(0.85));
        painter.galley(rect.left_top(), text, visuals.text_color());
    }
    let pointer = response.interact_pointer_pos()?;
    let isovalue = axis.isovalue_at(pointer.x);
    if response.clicked() {
        return Some(nearest_event(scene, &axis, isovalue).unwrap_or(isovalue));
    }
    response.dragged().then_some(isovalue)
}

/// An isovalue, and the values of the curves there if they are known.
fn readout(points: &[Point], axis: &Axis, isovalue: f64) -> String {
    let mut text = format_number(isovalue);
    let distance = |point: &Point| (axis.x_of(point.isovalue) - axis.x_of(isovalue)).abs();
    let nearest = points.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    if let Some(point) = nearest.filter(|&point| distance(point) <= 2.0 * SNAP_DISTANCE) {
        for curve in &CURVES {
            let value = format_short((curve.value)(&point.measures));
            let _ = write!(text, "   {} {value}", curve.name);
        }
    }
    text
}

/// The axis of isovalues, from left to right.
struct Axis {
    rect: Rect,
    range: (f64, f64),
}

impl Axis {
    fn x_of(&self, isovalue: f64) -> f32 {
        let (low, high) = self.range;
        // Halved first, so that the widest range does not overflow.
        let t = (0.5 * isovalue - 0.5 * low) / (0.5 * high - 0.5 * low);
        // Not finite in a range of one isovalue.
        let t = if t.is_finite() { t } else { 0.5 };
        self.rect.left() + self.rect.width() * t as f32
    }

    /// The vertical line at an isovalue.
    fn vertical_line(&self, isovalue: f64) -> [Pos2; 2] {
        let x = self.x_of(isovalue);
        [pos2(x, self.rect.top()), pos2(x, self.rect.bottom())]
    }

    fn isovalue_at(&self, x: f32) -> f64 {
        let (low, high) = self.range;
        let t = f64::from((x - self.rect.left()) / self.rect.width()).clamp(0.0, 1.0);
        low * (1.0 - t) + high * t
    }
}

/// Checkboxes for the curves, with the values of the drawn mesh.
fn legend(ui: &mut Ui, measures: Option<Measures>, visible: &mut VisibleCurves) {
    for (curve, visible) in CURVES.iter().zip(visible) {
        let value = measures.map(|m| format!(" {}", format_number((curve.value)(&m))));
        // A sample next to the text, because text in these colours would lack contrast.
        let (sample, _) = ui.allocate_exact_size(SAMPLE_SIZE, Sense::hover());
        ui.painter().rect_filled(sample, 2.0, curve.color);
        ui.checkbox(visible, format!("{}{}", curve.name, value.unwrap_or_default()));
    }
}

/// The button that computes the curves of a large file, which reads all of it.
fn curves_button(ui: &mut Ui, scene: &mut Scene) {
    let Some(file) = scene.file().filter(|_| !scene.curves.is_started()) else { return };
    let megabytes = file.n_bytes() as f64 / 1e6;
    if ui.button(format!("compute curves (reads {megabytes:.1} MB)")).clicked() {
        scene.start_curves(ui.ctx());
    }
}

/// A curve, scaled to its own range, which includes 0.
fn polyline(curve: &Curve, points: &[Point], axis: &Axis) -> Vec<Pos2> {
    let values = points.iter().map(|p| (curve.value)(&p.measures));
    let (low, high) = values.clone().fold((0.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    let range = if high > low { high - low } else { 1.0 };
    let y_of = |v: f64| axis.rect.bottom() - axis.rect.height() * ((v - low) / range) as f32;
    let line = points.iter().zip(values).map(|(p, v)| pos2(axis.x_of(p.isovalue), y_of(v)));
    if curve.is_count { step_function(line.collect()) } else { line.collect() }
}

/// A step function through points, with vertical steps half-way between them.
fn step_function(points: Vec<Pos2>) -> Vec<Pos2> {
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

/// The histogram of the samples, with logarithmic heights.
fn histogram(scene: &Scene, axis: &Axis, color: Color32) -> Vec<Shape> {
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

/// The x of the events, without duplicates per point.
fn event_ticks(scene: &Scene, axis: &Axis) -> Vec<f32> {
    let mut ticks: Vec<f32> = scene.events.iter().map(|&c| axis.x_of(c).round()).collect();
    ticks.dedup();
    ticks
}

/// The nearest event to an isovalue within the snap distance.
fn nearest_event(scene: &Scene, axis: &Axis, isovalue: f64) -> Option<f64> {
    let next = scene.events.partition_point(|&c| c < isovalue);
    let neighbours = [next.checked_sub(1), Some(next)].into_iter().flatten();
    let distance = |c: f64| (axis.x_of(c) - axis.x_of(isovalue)).abs();
    neighbours
        .filter_map(|i| scene.events.get(i).copied())
        .filter(|&c| distance(c) <= SNAP_DISTANCE)
        .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_drawn_as_step_functions() {
        let line = step_function([(0.0, 3.0), (2.0, 3.0), (4.0, 1.0)].map(Pos2::from).to_vec());
        let expected = [(0.0, 3.0), (2.0, 3.0), (3.0, 3.0), (3.0, 1.0), (4.0, 1.0)].map(Pos2::from);
        assert_eq!(line, expected);
        assert!(line.windows(2).all(|w| w[0].x == w[1].x || w[0].y == w[1].y));
    }
}
