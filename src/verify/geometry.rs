//! Geometry of points, segments and triangles in f64.

/// A point or vector, voxel frame.
pub(super) type Point = [f64; 3];

pub(super) fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

/// a + t b.
pub(super) fn along(a: Point, t: f64, b: Point) -> Point {
    std::array::from_fn(|i| a[i] + t * b[i])
}

pub(super) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn length(a: Point) -> f64 {
    dot(a, a).sqrt()
}

pub(super) fn distance(a: Point, b: Point) -> f64 {
    length(minus(a, b))
}

/// The normal of a triangle, as long as twice its area, on the side from which it is
/// counter-clockwise.
pub(super) fn area_vector([a, b, c]: [Point; 3]) -> Point {
    cross(minus(b, a), minus(c, a))
}

pub(super) fn barycentre([a, b, c]: [Point; 3]) -> Point {
    std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0)
}

/// Whether the open segment from `p` to `q` intersects the interior of a triangle.
///
/// Contacts within 1e-9 of an edge or an end, and segments in the plane of the triangle, do not
/// count: positions are f32, so only clear intersections are.
pub(super) fn segment_crosses_triangle(p: Point, q: Point, [a, b, c]: [Point; 3]) -> bool {
    const MARGIN: f64 = 1e-9;
    let open = |x: f64| x > MARGIN && x < 1.0 - MARGIN;
    let (d, e1, e2) = (minus(q, p), minus(b, a), minus(c, a));
    let h = cross(d, e2);
    let determinant = dot(e1, h);
    if determinant.abs() < 1e-14 {
        return false;
    }
    let s = minus(p, a);
    let u = dot(s, h) / determinant;
    let k = cross(s, e1);
    let v = dot(d, k) / determinant;
    let t = dot(e2, k) / determinant;
    open(u) && v > MARGIN && u + v < 1.0 - MARGIN && open(t)
}

/// Distance from a point to a triangle.
pub(super) fn point_triangle_distance(p: Point, corners: [Point; 3]) -> f64 {
    let normal = area_vector(corners);
    let square = dot(normal, normal);
    let above = |i: usize| {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        dot(cross(minus(to, from), minus(p, from)), normal) >= 0.0
    };
    if square > 0.0 && above(0) && above(1) && above(2) {
        return dot(minus(p, corners[0]), normal).abs() / square.sqrt();
    }
    let to_edge = |i: usize| point_segment_distance(p, corners[i], corners[(i + 1) % 3]);
    to_edge(0).min(to_edge(1)).min(to_edge(2))
}

fn point_segment_distance(p: Point, a: Point, b: Point) -> f64 {
    let edge = minus(b, a);
    let square = dot(edge, edge);
    let t = if square > 0.0 { (dot(minus(p, a), edge) / square).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, along(a, t, edge))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: [Point; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn a_segment_crosses_only_the_inside() {
        let through = |x: f64, y: f64| segment_crosses_triangle([x, y, -1.0], [x, y, 1.0], RIGHT);
        assert!(through(0.25, 0.25));
        assert!(!through(0.75, 0.75));
        assert!(!through(0.5, 0.5));
        assert!(!segment_crosses_triangle([0.25, 0.25, 0.5], [0.25, 0.25, 1.0], RIGHT));
    }

    #[test]
    fn distance_to_a_triangle_is_to_its_face_an_edge_or_a_corner() {
        assert_eq!(point_triangle_distance([0.25, 0.25, 2.0], RIGHT), 2.0);
        assert_eq!(point_triangle_distance([0.5, -3.0, 0.0], RIGHT), 3.0);
        assert_eq!(point_triangle_distance([4.0, -4.0, 0.0], RIGHT), 5.0);
        assert_eq!(point_triangle_distance([1.0, 0.0, 1.0], [[0.0; 3]; 3]), 2f64.sqrt());
    }
}
