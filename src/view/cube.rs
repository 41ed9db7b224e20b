//! The orientation cube in the corner of the picture: a click on a side looks from there. Twin: `page/cube.js`.

use eframe::egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use crate::render::Camera;
use crate::spectrum::VolumeInfo;
use crate::volume::Space;

/// Half an edge of the cube, half the side of the widget, which contains all rotated cubes, and its margin, points.
const HALF_EDGE: f32 = 17.0;
const HALF_SIZE: f32 = 32.0;
const MARGIN: f32 = 6.0;

/// Minimum cosine between the normal of a side and the line of sight for a side to be drawn, and to be labelled.
const MIN_VISIBLE: f64 = 0.02;
const MIN_LABELLED: f64 = 0.35;

/// The labels of the sides +x, -x, +y, -y, +z, -z; anatomical directions in a patient's space.
fn labels(space: Space) -> [&'static str; 6] {
    match space {
        Space::Lps => ["L", "R", "P", "A", "S", "I"],
        Space::Ras => ["R", "L", "A", "P", "S", "I"],
        _ => ["x", "-x", "y", "-y", "z", "-z"],
    }
}

/// A visible side.
struct Side {
    index: usize,
    corners: [Pos2; 4],
    center: Pos2,
    is_labelled: bool,
}

/// The visible sides of a cube around a point.
fn visible_sides(camera: &Camera, volume: &VolumeInfo, around: Pos2) -> Vec<Side> {
    let (back, up) = camera.directions(volume);
    let rows = [up.cross(back), up, back];
    let eye_of = |p: DVec3| rows.map(|row| row.dot(p));
    let project = |p: DVec3| {
        let [right, up, _] = eye_of(p);
        around + HALF_EDGE * vec2(right as f32, -up as f32)
    };
    (0..6)
        .filter_map(|index| {
            let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
            let [normal, u, v] = [0, 1, 2].map(|k| {
                let mut axis = DVec3::ZERO;
                axis[(index / 2 + k) % 3] = 1.0;
                axis
            });
            let normal = sign * normal;
            let cosine = eye_of(normal)[2];
            (cosine >= MIN_VISIBLE).then(|| Side {
                index,
                corners: [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)]
                    .map(|(i, j)| project(normal + i * u + j * v)),
                center: project(normal),
                is_labelled: cosine > MIN_LABELLED,
            })
        })
        .collect()
}

/// Whether a point is inside of a convex quadrilateral.
fn is_inside(point: Pos2, corners: &[Pos2; 4]) -> bool {
    let cross = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        let (edge, to) = (b - a, point - a);
        edge.x * to.y - edge.y * to.x
    };
    let crosses = [0, 1, 2, 3].map(cross);
    crosses.iter().all(|&c| c >= 0.0) || crosses.iter().all(|&c| c <= 0.0)
}

/// Shows the cube over a picture; returns the clicked side.
pub(super) fn show(
    ui: &mut Ui,
    picture: Rect,
    camera: &Camera,
    volume: &VolumeInfo,
) -> Option<usize> {
    let size = Vec2::splat(2.0 * HALF_SIZE);
    let rect = Rect::from_min_size(picture.right_top() + vec2(-MARGIN - size.x, MARGIN), size);
    let response = ui.interact(rect, ui.scope_id().with("cube"), Sense::click());
    let sides = visible_sides(camera, volume, rect.center());
    let labels = labels(volume.placement.space);
    let visuals = ui.visuals();
    let axis_colors = match visuals.dark_mode {
        true => [0xf2_938c, 0x8f_d694, 0x9b_b8f5],
        false => [0xb3_261e, 0x2e_7d32, 0x24_53b3],
    };
    let hovered =
        response.hover_pos().and_then(|at| sides.iter().find(|side| is_inside(at, &side.corners)));
    let hovered = hovered.map(|side| side.index);
    let edge = Stroke::new(1.0, Color32::from_gray(if visuals.dark_mode { 0x90 } else { 0x78 }));
    for Side { index, corners, center, is_labelled } in sides {
        let is_hovered = hovered == Some(index);
        let fill = if is_hovered { visuals.code_bg_color } else { visuals.panel_fill };
        let fill = fill.gamma_multiply(0.85);
        ui.painter().add(Shape::convex_polygon(corners.to_vec(), fill, edge));
        if is_labelled {
            let [_, r, g, b] = u32::to_be_bytes(axis_colors[index / 2]);
            let color = Color32::from_rgb(r, g, b);
            let font = FontId::proportional(13.0);
            ui.painter().text(center, Align2::CENTER_CENTER, labels[index], font, color);
        }
    }
    hovered.filter(|_| response.clicked())
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::pos2;

    use crate::volume::{Outside, Placement};

    #[test]
    fn visible_sides_face_the_eye() {
        let volume = VolumeInfo {
            name: "box".into(),
            dims: [20, 30, 40],
            sample_type: "uint8".into(),
            range: (0.0, 1.0),
            placement: Placement::default(),
            outside: Outside::Low,
        };
        let visible = |camera: &Camera| -> Vec<usize> {
            visible_sides(camera, &volume, pos2(0.0, 0.0)).iter().map(|side| side.index).collect()
        };
        assert_eq!(visible(&Camera::default()), [0, 2, 4]);
        for side in 0..6 {
            let camera = Camera::default().from_side(side, &volume);
            assert_eq!(visible(&camera), [side]);
            let only = &visible_sides(&camera, &volume, pos2(100.0, 50.0))[0];
            assert!(only.is_labelled && only.center.distance(pos2(100.0, 50.0)) < 1e-3);
            assert!(is_inside(pos2(115.0, 40.0), &only.corners));
            assert!(!is_inside(pos2(118.0, 40.0), &only.corners));
        }
    }
}
