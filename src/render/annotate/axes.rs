//! The directions of the world's axes, in a corner of the picture; as in the page (`page/overlay.js`).

use glam::{DMat3, DVec3};

use super::{Sheet, Stand};
use crate::render::Background;
use crate::render::projection::Projection;
use crate::volume::Placement;

/// Colours of the axes on light and on dark; those of `page/page.css`.
const ON_LIGHT: [[u8; 3]; 3] = [[0xb3, 0x26, 0x1e], [0x2e, 0x7d, 0x32], [0x24, 0x53, 0xb3]];
const ON_DARK: [[u8; 3]; 3] = [[0xf2, 0x93, 0x8c], [0x8f, 0xd6, 0x94], [0x9b, 0xb8, 0xf5]];

/// Length of an axis that is seen from its side, distance of its name from the middle, and of the middle from the right
/// and from the top, in heights of letters.
const LENGTH: f32 = 1.9;
const NAME: f32 = 2.6;
const CORNER: f32 = 4.2;

impl Sheet<'_> {
    /// Draws the axes at the top on the right, the farthest first.
    pub(super) fn axes(
        &mut self,
        placement: &Placement,
        projection: &Projection,
        background: Background,
    ) {
        let colors = if background == Background::Dark { ON_DARK } else { ON_LIGHT };
        let middle = [self.image.width as f32 - CORNER * self.letters, CORNER * self.letters];
        let world = DMat3::from_cols_array_2d(&placement.direction);
        let eye_from_world = DMat3::from_mat4(projection.eye_from_voxel) * world.inverse();
        let mut axes = [0, 1, 2].map(|i| (i, eye_from_world.col(i).normalize()));
        axes.sort_by(|(_, a), (_, b)| a.z.total_cmp(&b.z));
        let ink = self.ink;
        for (i, way) in axes {
            self.ink = colors[i];
            let at = |length: f32| {
                let DVec3 { x, y, .. } = way * f64::from(length * self.letters);
                [middle[0] + x as f32, middle[1] - y as f32]
            };
            let (end, name) = (at(LENGTH), at(NAME));
            self.line(middle, end, (0.1 * self.letters).max(1.5));
            let top = [name[0], name[1] - 0.6 * self.letters];
            self.words(["x", "y", "z"][i], top, Stand::Middle, 1.0);
        }
        self.ink = ink;
    }

    /// A line between two points, pixels wide.
    fn line(&mut self, from: [f32; 2], to: [f32; 2], width: f32) {
        let way = [to[0] - from[0], to[1] - from[1]];
        let squared = (way[0] * way[0] + way[1] * way[1]).max(f32::MIN_POSITIVE);
        let [[left, right], [top, bottom]] = [0, 1].map(|i| {
            let (low, high) = (from[i].min(to[i]) - width, from[i].max(to[i]) + width);
            [low.floor() as i64, high.ceil() as i64]
        });
        for y in top..=bottom {
            for x in left..=right {
                let p = [x as f32 + 0.5 - from[0], y as f32 + 0.5 - from[1]];
                let along = ((p[0] * way[0] + p[1] * way[1]) / squared).clamp(0.0, 1.0);
                let off = (p[0] - along * way[0]).hypot(p[1] - along * way[1]);
                self.put(x, y, self.ink, (0.5 * width + 0.5 - off).clamp(0.0, 1.0));
            }
        }
    }
}
