//! Measures of triangles and vertices.

use glam::Vec3;

use super::{Face, Mesh, Vertex};

/// Area times two along the normal: (b - a) x (c - a).
#[inline]
pub fn normal(t: [Vec3; 3]) -> Vec3 {
    (t[1] - t[0]).cross(t[2] - t[0])
}

/// Area of a triangle.
#[inline]
pub fn area(t: [Vec3; 3]) -> f32 {
    0.5 * normal(t).length()
}

/// Radius ratio 2r/R: inradius over circumradius times two; 1 is equilateral, 0 degenerate.
#[inline]
pub fn radius_ratio(t: [Vec3; 3]) -> f32 {
    let (a, b, c) = (t[1].distance(t[2]), t[2].distance(t[0]), t[0].distance(t[1]));
    let double_area = normal(t).length();
    let product = (a + b + c) * a * b * c;
    // 2r/R = 16 A^2 / ((a + b + c) a b c), with A = double_area / 2.
    if product > 0.0 { 4.0 * double_area * double_area / product } else { 0.0 }
}

impl Mesh {
    /// Area-weighted unit normal of a vertex, towards lower values; zero where it cancels out.
    pub fn vertex_normal(&self, v: Vertex) -> Vec3 {
        self.spokes(v).map(|h| normal(self.corners(self.face(h)))).sum::<Vec3>().normalize_or_zero()
    }

    /// Unit normal of a face, towards lower values.
    pub fn face_normal(&self, f: Face) -> Vec3 {
        normal(self.corners(f)).normalize_or_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_ratio_is_one_for_equilateral_and_zero_for_flat_triangles() {
        let equilateral = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 0.75f32.sqrt(), 0.0)];
        assert!((radius_ratio(equilateral) - 1.0).abs() < 1e-6);
        assert_eq!(radius_ratio([Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]), 0.0);
        assert!((area(equilateral) - 0.75f32.sqrt() / 2.0).abs() < 1e-6);
        // 3-4-5: r = 1, R = 2.5.
        let right = [Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];
        assert!((radius_ratio(right) - 0.8).abs() < 1e-6);
    }
}
