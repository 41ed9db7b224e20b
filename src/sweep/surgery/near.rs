//! What lies beside faces of a mesh: it has that already.

use glam::Vec3;

use crate::mesh::{Bins, bounds, normal};

/// Size of the bins that triangles are sorted into, voxels.
const BIN: f32 = 1.0;

/// Triangles by the bins around them, to ask how near one is to a point.
pub(super) struct Near {
    bins: Bins,
    triangles: Vec<[Vec3; 3]>,
    reach: f32,
}

impl Near {
    /// Of these triangles, asked for points within `reach`.
    pub(super) fn of(triangles: Vec<[Vec3; 3]>, reach: f32) -> Near {
        let around = |&t: &[Vec3; 3]| {
            let (low, high) = bounds(t);
            (low - reach, high + reach)
        };
        let boxes: Vec<(Vec3, Vec3)> = triangles.iter().map(around).collect();
        Near { bins: Bins::of(&boxes, BIN), triangles, reach }
    }

    /// Whether a triangle that faces the same way lies within reach of a point with a normal.
    pub(super) fn is_near(&self, p: Vec3, n: Vec3) -> bool {
        self.bins.boxes_at(p).any(|i| {
            let t = self.triangles[i as usize];
            normal(t).dot(n) > 0.0
                && closest_point(p, t).distance_squared(p) < self.reach * self.reach
        })
    }
}

/// The point of a triangle closest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
fn closest_point(p: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_what_lies_within_reach_and_faces_the_same_way() {
        let near = Near::of(vec![[Vec3::ZERO, 3.0 * Vec3::X, 3.0 * Vec3::Y]], 0.5);
        let up = Vec3::Z;
        assert!(near.is_near(Vec3::new(1.0, 1.0, 0.4), up));
        assert!(!near.is_near(Vec3::new(1.0, 1.0, 0.6), up));
        assert!(!near.is_near(Vec3::new(1.0, 1.0, 0.4), -up));
        assert!(near.is_near(Vec3::new(-0.3, -0.3, 0.0), up));
        assert!(!near.is_near(Vec3::new(-0.4, -0.4, 0.0), up));
        assert!(near.is_near(Vec3::new(1.7, 1.7, 0.1), up));
        assert!(!near.is_near(Vec3::new(2.0, 2.0, 0.0), up));
    }
}
