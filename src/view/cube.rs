//! The cube in the corner of the picture: how the world lies; a click on a side looks from there. The twin of `page/cube.js`.

use eframe::egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use crate::render::Camera;
use crate::spectrum::VolumeInfo;
use crate::volume::Space;

/// Half an edge, points; half the side of the drawing, where the cube's corners never reach; its distance from the edge.
const HALF_EDGE: f32 = 17.0;
const REACH: f32 = 32.0;
const MARGIN: f32 = 6.0;

/// How much of a side is seen at least, as the cosine of its slant, to be drawn, and to have room for its name.
const LEAST_SEEN: f64 = 0.02;
const LEAST_NAMED: f64 = 0.35;

/// The six sides' names, towards +x, -x, +y and so on: in a patient by where they lie.
fn names(space: Space) -> [&'static str; 6] {
    match space {
        Space::Lps => ["L", "R", "P", "A", "S", "I"],
        Space::Ras => ["R", "L", "A", "P", "S", "I"],
        _ => ["x", "-x", "y", "-y", "z", "-z"],
    }
}

/// A side that is seen: which, its corners, its middle, whether its name has room.
struct Side {
    number: usize,
    corners: [Pos2; 4],
    middle: Pos2,
    is_named: bool,
}

/// The sides that are seen by a camera, around a point.
fn sides(camera: &Camera, volume: &VolumeInfo, around: Pos2) -> Vec<Side> {
    let (back, up) = camera.directions(volume);
    let rows = [up.cross(back), up, back];
    let seen_of = |p: DVec3| rows.map(|row| row.dot(p));
    let at = |p: DVec3| {
        let [right, up, _] = seen_of(p);
        around + HALF_EDGE * vec2(right as f32, -up as f32)
    };
    (0..6)
        .filter_map(|number| {
            let sign = if number % 2 == 0 { 1.0 } else { -1.0 };
            let [out, u, v] = [0, 1, 2].map(|k| {
                let mut axis = DVec3::ZERO;
                axis[(number / 2 + k) % 3] = 1.0;
                axis
            });
            let out = sign * out;
            let towards_eye = seen_of(out)[2];
            let corner = |i: f64, j: f64| at(out + i * u + j * v);
            (towards_eye >= LEAST_SEEN).then(|| Side {
                number,
                corners: [
                    corner(1.0, 1.0),
                    corner(1.0, -1.0),
                    corner(-1.0, -1.0),
                    corner(-1.0, 1.0),
                ],
                middle: at(out),
                is_named: towards_eye > LEAST_NAMED,
            })
        })
        .collect()
}

/// Whether a point lies in a convex polygon.
fn is_inside(point: Pos2, corners: &[Pos2; 4]) -> bool {
    let turn = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        let (along, to) = (b - a, point - a);
        along.x * to.y - along.y * to.x
    };
    let turns = [0, 1, 2, 3].map(turn);
    turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
}

/// Where the cube lies in a picture.
fn place(picture: Rect) -> Rect {
    let size = Vec2::splat(2.0 * REACH);
    Rect::from_min_size(picture.right_top() + vec2(-MARGIN - size.x, MARGIN), size)
}

/// Draws the cube over a picture; the side that was clicked on.
pub(super) fn show(
    ui: &mut Ui,
    picture: Rect,
    camera: &Camera,
    volume: &VolumeInfo,
) -> Option<usize> {
    let place = place(picture);
    let response = ui.interact(place, ui.scope_id().with("cube"), Sense::click());
    let sides = sides(camera, volume, place.center());
    let names = names(volume.placement.space);
    let visuals = ui.visuals();
    let axes = match visuals.dark_mode {
        true => [0xf2_938c, 0x8f_d694, 0x9b_b8f5],
        false => [0xb3_261e, 0x2e_7d32, 0x24_53b3],
    };
    let pointed =
        response.hover_pos().and_then(|at| sides.iter().find(|side| is_inside(at, &side.corners)));
    let pointed = pointed.map(|side| side.number);
    let edge = Stroke::new(1.0, Color32::from_gray(if visuals.dark_mode { 0x90 } else { 0x78 }));
    for side in &sides {
        let paper =
            if pointed == Some(side.number) { visuals.code_bg_color } else { visuals.panel_fill };
        ui.painter().add(Shape::convex_polygon(
            side.corners.to_vec(),
            paper.gamma_multiply(0.85),
            edge,
        ));
        if side.is_named {
            let [_, r, g, b] = u32::to_be_bytes(axes[side.number / 2]);
            let color = Color32::from_rgb(r, g, b);
            let font = FontId::proportional(13.0);
            ui.painter().text(side.middle, Align2::CENTER_CENTER, names[side.number], font, color);
        }
    }
    pointed.filter(|_| response.clicked())
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::pos2;

    use crate::volume::{Outside, Placement};

    #[test]
    fn the_sides_that_are_seen_are_those_towards_the_eye() {
        let volume = VolumeInfo {
            name: "box".into(),
            dims: [20, 30, 40],
            sample_type: "uint8".into(),
            range: (0.0, 1.0),
            placement: Placement::default(),
            outside: Outside::Low,
        };
        let seen = |camera: &Camera| -> Vec<usize> {
            sides(camera, &volume, pos2(0.0, 0.0)).iter().map(|side| side.number).collect()
        };
        assert_eq!(seen(&Camera::default()), [0, 2, 4]);
        for side in 0..6 {
            let camera = Camera::default().from_side(side, &volume);
            assert_eq!(seen(&camera), [side]);
            let only = &sides(&camera, &volume, pos2(100.0, 50.0))[0];
            assert!(only.is_named && only.middle.distance(pos2(100.0, 50.0)) < 1e-3);
            assert!(is_inside(pos2(115.0, 40.0), &only.corners));
            assert!(!is_inside(pos2(118.0, 40.0), &only.corners));
        }
    }
}
