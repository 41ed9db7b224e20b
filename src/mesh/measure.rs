//! Measures of triangles and vertices.

use glam::{DVec3, Vec3};
use num_traits::{Float, One as _, Zero as _};

use super::half_edge::{Face, HalfEdgeMesh, Vertex};

/// Area times two along the normal: (b - a) x (c - a).
#[inline]
pub fn normal(t: [Vec3; 3]) -> Vec3 {
    (t[1] - t[0]).cross(t[2] - t[0])
}

/// The lowest and the highest corner of a triangle's bounding box.
#[inline]
pub fn bounds(t: [Vec3; 3]) -> (Vec3, Vec3) {
    (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]))
}

/// Area of a triangle.
#[inline]
pub fn area(t: [Vec3; 3]) -> f32 {
    0.5 * normal(t).length()
}

/// A point in single or double precision.
pub trait Corner: Copy {
    /// Its coordinates.
    type Number: Float;
    /// The distance to another point.
    fn distance_to(self, other: Self) -> Self::Number;
    /// Twice the area of a triangle.
    fn double_area(t: [Self; 3]) -> Self::Number;
}

impl Corner for Vec3 {
    type Number = f32;

    #[inline]
    fn distance_to(self, other: Self) -> f32 {
        self.distance(other)
    }

    #[inline]
    fn double_area(t: [Self; 3]) -> f32 {
        normal(t).length()
    }
}

impl Corner for DVec3 {
    type Number = f64;

    #[inline]
    fn distance_to(self, other: Self) -> f64 {
        self.distance(other)
    }

    #[inline]
    fn double_area(t: [Self; 3]) -> f64 {
        (t[1] - t[0]).cross(t[2] - t[0]).length()
    }
}

/// Radius ratio 2r/R: inradius over circumradius times two; 1 is equilateral (to rounding), 0
/// degenerate.
#[inline]
pub fn radius_ratio<P: Corner>(t: [P; 3]) -> P::Number {
    let zero = P::Number::zero();
    let two = P::Number::one() + P::Number::one();
    let (a, b, c) = (t[1].distance_to(t[2]), t[2].distance_to(t[0]), t[0].distance_to(t[1]));
    let double_area = P::double_area(t);
    let product = (a + b + c) * a * b * c;
    // 2r/R = 16 A^2 / ((a + b + c) a b c), with A = double_area / 2.
    if product > zero { two * two * double_area * double_area / product } else { zero }
}

/// The point of a triangle that is nearest to `p` (Ericson, "Real-Time Collision Detection", 2005, 5.1.5).
pub fn nearest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let [d1, d2] = [ab, ac].map(|side| side.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let [d3, d4] = [ab, ac].map(|side| side.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let [d5, d6] = [ab, ac].map(|side| side.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    a + ab * (vb / sum) + ac * (vc / sum)
}

impl HalfEdgeMesh {
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
        let precise = right.map(Vec3::as_dvec3);
        assert!((radius_ratio(precise) - 0.8).abs() < 1e-15);
        assert_eq!(radius_ratio([DVec3::ZERO, DVec3::ZERO, DVec3::X]), 0.0);
    }

    #[test]
    fn the_nearest_point_of_a_triangle_is_on_its_face_a_side_or_a_corner() {
        let triangle = [DVec3::ZERO, 2.0 * DVec3::X, 2.0 * DVec3::Y];
        for (p, nearest) in [
            ([0.5, 0.5, 3.0], [0.5, 0.5, 0.0]),
            ([-1.0, -1.0, 1.0], [0.0, 0.0, 0.0]),
            ([5.0, 1.0, 0.0], [2.0, 0.0, 0.0]),
            ([-1.0, 9.0, 0.0], [0.0, 2.0, 0.0]),
            ([1.0, -2.0, 1.0], [1.0, 0.0, 0.0]),
            ([-2.0, 1.5, 0.0], [0.0, 1.5, 0.0]),
            ([2.0, 2.0, 7.0], [1.0, 1.0, 0.0]),
        ] {
            assert_eq!(nearest_on_triangle(p.into(), triangle), DVec3::from(nearest), "{p:?}");
        }
    }
}
