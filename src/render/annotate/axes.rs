//! The directions of the world's axes, in a corner of the picture. Twin: `page/overlay.js`.

use glam::{DMat3, DVec3};

use super::{Align, Canvas};
use crate::render::background::Background;
use crate::render::projection::Projection;
use crate::volume::Placement;

/// Colours of the axes on a light and on a dark background, the same as in `page/page.css`.
const ON_LIGHT: [[u8; 3]; 3] = [[0xb3, 0x26, 0x1e], [0x2e, 0x7d, 0x32], [0x24, 0x53, 0xb3]];
const ON_DARK: [[u8; 3]; 3] = [[0xf2, 0x93, 0x8c], [0x8f, 0xd6, 0x94], [0x9b, 0xb8, 0xf5]];

/// Length of an axis perpendicular to the line of sight, distance of its name from the center, and distance of the center from
/// the right and the top, in font sizes.
const LENGTH: f32 = 1.9;
const NAME_DISTANCE: f32 = 2.6;
const CENTER_DISTANCE: f32 = 4.2;

impl Canvas<'_> {
    /// Draws the axes at the top right, the farthest first.
    pub(super) fn axes(
        &mut self,
        placement: &Placement,
        projection: &Projection,
        background: Background,
    ) {
        let colors = if background == Background::Dark { ON_DARK } else { ON_LIGHT };
        let distance = CENTER_DISTANCE * self.font_size;
        let center = [self.image.width as f32 - distance, distance];
        let world = DMat3::from_cols_array_2d(&placement.axes());
        let eye_from_world = DMat3::from_mat4(projection.eye_from_voxel) * world.inverse();
        let mut axes = [0, 1, 2].map(|i| (i, eye_from_world.col(i).normalize()));
        axes.sort_by(|(_, a), (_, b)| a.z.total_cmp(&b.z));
        let text_color = self.color;
        for (i, axis) in axes {
            self.color = colors[i];
            let at = |length: f32| {
                let DVec3 { x, y, .. } = axis * f64::from(length * self.font_size);
                [center[0] + x as f32, center[1] - y as f32]
            };
            let (end, name) = (at(LENGTH), at(NAME_DISTANCE));
            self.line(center, end, (0.1 * self.font_size).max(1.5));
            let top = [name[0], name[1] - 0.6 * self.font_size];
            self.text(["x", "y", "z"][i], top, Align::Center, 1.0);
        }
        self.color = text_color;
    }

    /// Draws an antialiased line, `width` pixels wide.
    fn line(&mut self, from: [f32; 2], to: [f32; 2], width: f32) {
        let direction = [to[0] - from[0], to[1] - from[1]];
        let squared =
            (direction[0] * direction[0] + direction[1] * direction[1]).max(f32::MIN_POSITIVE);
        let [[left, right], [top, bottom]] = [0, 1].map(|i| {
            let (low, high) = (from[i].min(to[i]) - width, from[i].max(to[i]) + width);
            [low.floor() as i64, high.ceil() as i64]
        });
        for y in top..=bottom {
            for x in left..=right {
                let p = [x as f32 + 0.5 - from[0], y as f32 + 0.5 - from[1]];
                let t = ((p[0] * direction[0] + p[1] * direction[1]) / squared).clamp(0.0, 1.0);
                let distance = (p[0] - t * direction[0]).hypot(p[1] - t * direction[1]);
                self.blend(x, y, self.color, (0.5 * width + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }
}
