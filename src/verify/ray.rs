//! The distance from a point to the isosurface along a line, exactly.
//!
//! # Theory
//!
//! Along a line the trilinear field is a cubic in each cell. Four values determine the cubic; between the
//! roots of its derivative it is monotone, so the first crossing of the isovalue is found
//! without a step size. This code is independent of the kernels of the sweep and in
//! f64, because it verifies them.

use crate::volume::Volume;

/// Points within this distance of the isosurface, voxels, are on it: the rounding of single precision for coordinates up to a
/// thousand voxels.
const ON_SURFACE: f64 = 1e-4;

/// The result of following a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Hit {
    /// The isosurface, at this distance.
    At(f64),
    /// No isosurface within reach.
    Nothing,
    /// The border of the volume comes before reach and before any isosurface.
    Border,
}

/// The distance from `point` to the isosurface of `isovalue` along `direction`, on the nearer side.
///
/// `point` (inside the volume), the unit vector `direction`, and `reach` are in the voxel frame.
/// If neither side has a crossing, the result is [`Hit::Border`] if a side ended at the border of the volume. A point
/// within [`ON_SURFACE`] of the isosurface, to first order, need not have a crossing on the line: at the border the
/// rounding of a position may put the crossing outside the volume.
pub(super) fn distance_along(
    volume: &Volume,
    isovalue: f64,
    point: [f64; 3],
    direction: [f64; 3],
    reach: f64,
) -> Hit {
    if let Some(distance) = first_order_distance(volume, isovalue, point)
        && distance < ON_SURFACE
    {
        return Hit::At(distance);
    }
    let ahead = first_crossing(volume, isovalue, point, direction, reach);
    // The other side matters only up to the first hit.
    let reach_back = if let Hit::At(t) = ahead { t } else { reach };
    let back = first_crossing(volume, isovalue, point, direction.map(|d| -d), reach_back);
    match (ahead, back) {
        (Hit::At(a), Hit::At(b)) => Hit::At(a.min(b)),
        (Hit::At(t), _) | (_, Hit::At(t)) => Hit::At(t),
        (Hit::Border, _) | (_, Hit::Border) => Hit::Border,
        (Hit::Nothing, Hit::Nothing) => Hit::Nothing,
    }
}

/// The shortest of the distances from `point` to the isosurface along `normal`, along the field's gradient, along the gradient projected
/// onto the faces of the volume on which the point is, and to the point found by descent; see
/// [`distance_along`].
///
/// The distance to any point of the isosurface is an upper bound. One line is not enough: near the border, and
/// for slivers, the normal of a point next to the isosurface may miss it, leaving the volume on one
/// side and meeting another sheet on the other.
pub(super) fn distance_near(
    volume: &Volume,
    isovalue: f64,
    point: [f64; 3],
    normal: Option<[f64; 3]>,
    reach: f64,
) -> Hit {
    let found = descent(volume, isovalue, point).filter(|&t| t < reach);
    if let Some(t) = found
        && t < ON_SURFACE
    {
        return Hit::At(t);
    }
    let gradient = gradient_at(volume, point);
    // Away from the border the third line would be the second.
    let border = gradient.map(|g| along_border(volume, point, g)).filter(|g| Some(*g) != gradient);
    let lines = [normal, gradient, border];
    let mut best = found.map_or(Hit::Border, Hit::At);
    for line in lines.into_iter().flatten() {
        let norm = line[0].hypot(line[1]).hypot(line[2]);
        let direction = line.map(|x| x / norm);
        if !direction.iter().all(|x| x.is_finite()) {
            continue;
        }
        let shorter = if let Hit::At(t) = best { t } else { reach };
        best = match (distance_along(volume, isovalue, point, direction, shorter), best) {
            (Hit::At(t), _) => Hit::At(t.min(shorter)),
            (_, Hit::At(t)) => Hit::At(t),
            (Hit::Nothing, _) | (_, Hit::Nothing) => Hit::Nothing,
            _ => Hit::Border,
        };
    }
    best
}

/// The distance from `point` to the point of the isosurface that descent along the gradient finds without leaving the volume (Newton's method,
/// projected onto the box of the volume); `None` if it does not converge.
fn descent(volume: &Volume, isovalue: f64, point: [f64; 3]) -> Option<f64> {
    const MAX_STEPS: usize = 32;
    // Voxels; limits steps where the field is flat.
    const MAX_STEP: f64 = 0.5;
    // Voxels.
    const CONVERGED: f64 = 1e-6;
    let size = volume.voxel_size();
    let ends: [f64; 3] = std::array::from_fn(|a| (volume.dims()[a] - 1) as f64 * size[a]);
    let mut at: [f64; 3] = std::array::from_fn(|a| point[a].clamp(0.0, ends[a]));
    for _ in 0..MAX_STEPS {
        let index: [f64; 3] = std::array::from_fn(|a| at[a] / size[a]);
        let (value, gradient) = Cell::containing(volume, index)?.value_and_gradient(index, size);
        let difference = value - isovalue;
        // Components that would lead out of the volume are zero.
        let direction: [f64; 3] = std::array::from_fn(|a| {
            let step = -difference * gradient[a];
            let leaves = (at[a] <= 0.0 && step < 0.0) || (at[a] >= ends[a] && step > 0.0);
            if leaves { 0.0 } else { gradient[a] }
        });
        let squared: f64 = direction.iter().map(|x| x * x).sum();
        let length = difference.abs() / squared.sqrt();
        if length < CONVERGED {
            let off: [f64; 3] = std::array::from_fn(|a| at[a] - point[a]);
            return Some(off[0].hypot(off[1]).hypot(off[2]) + length);
        }
        if !length.is_finite() {
            return None;
        }
        let step = -difference / squared * (MAX_STEP / length).min(1.0);
        at = std::array::from_fn(|a| (at[a] + step * direction[a]).clamp(0.0, ends[a]));
    }
    None
}

/// A direction without the components normal to the faces of the volume on which a point is.
fn along_border(volume: &Volume, point: [f64; 3], direction: [f64; 3]) -> [f64; 3] {
    const NEAR: f64 = 1e-3;
    let size = volume.voxel_size();
    std::array::from_fn(|a| {
        let x = point[a] / size[a];
        let last = (volume.dims()[a] - 1) as f64;
        if x < NEAR || x > last - NEAR { 0.0 } else { direction[a] }
    })
}

/// The gradient of the field in the cell of a point, voxel frame.
fn gradient_at(volume: &Volume, point: [f64; 3]) -> Option<[f64; 3]> {
    let size = volume.voxel_size();
    let p: [f64; 3] = std::array::from_fn(|a| point[a] / size[a]);
    Some(Cell::containing(volume, p)?.value_and_gradient(p, size).1)
}

/// The distance of a point from the isosurface to first order, voxel frame.
fn first_order_distance(volume: &Volume, isovalue: f64, point: [f64; 3]) -> Option<f64> {
    let size = volume.voxel_size();
    let p: [f64; 3] = std::array::from_fn(|a| point[a] / size[a]);
    let (value, gradient) = Cell::containing(volume, p)?.value_and_gradient(p, size);
    let norm = gradient[0].hypot(gradient[1]).hypot(gradient[2]);
    (norm > 0.0).then(|| (value - isovalue).abs() / norm)
}

fn first_crossing(
    volume: &Volume,
    isovalue: f64,
    point: [f64; 3],
    direction: [f64; 3],
    reach: f64,
) -> Hit {
    let size = volume.voxel_size();
    let start: [f64; 3] = std::array::from_fn(|a| point[a] / size[a]);
    let step: [f64; 3] = std::array::from_fn(|a| direction[a] / size[a]);
    let mut inside = None;
    let mut t = 0.0;
    while t < reach {
        let end = next_face(start, step, t).min(reach);
        let middle: [f64; 3] = std::array::from_fn(|a| start[a] + 0.5 * (t + end) * step[a]);
        let Some(cell) = Cell::containing(volume, middle) else { return Hit::Border };
        let at = |t: f64| cell.value(std::array::from_fn(|a| start[a] + t * step[a])) - isovalue;
        let cubic = Cubic::through(std::array::from_fn(|i| at(t + (end - t) * i as f64 / 3.0)));
        if cubic.value(0.0) == 0.0 {
            return Hit::At(t);
        }
        let was_inside = *inside.get_or_insert(cubic.value(0.0) > 0.0);
        if let Some(s) = cubic.first_change(was_inside) {
            return Hit::At(t + s * (end - t));
        }
        t = end;
    }
    Hit::Nothing
}

/// Parameter of the next cell face after `t`, index frame. At least `MARGIN` beyond `t`, so
/// that the iteration always ends.
fn next_face(start: [f64; 3], step: [f64; 3], t: f64) -> f64 {
    const MARGIN: f64 = 1e-9;
    let mut next = f64::INFINITY;
    for a in 0..3 {
        if step[a] == 0.0 {
            continue;
        }
        let x = start[a] + t * step[a];
        let face = if step[a] > 0.0 { x.floor() + 1.0 } else { x.ceil() - 1.0 };
        let mut candidate = (face - start[a]) / step[a];
        if candidate <= t + MARGIN {
            candidate += 1.0 / step[a].abs();
        }
        next = next.min(candidate);
    }
    next.max(t + MARGIN)
}

/// The samples at the corners of one cell.
struct Cell {
    index: [usize; 3],
    corners: [f64; 8],
}

impl Cell {
    /// The cell that contains a point of the index frame, if the volume does.
    fn containing(volume: &Volume, p: [f64; 3]) -> Option<Self> {
        let dims = volume.dims();
        let mut index = [0; 3];
        for a in 0..3 {
            let last = (dims[a] - 1) as f64;
            // Positions are f32: a point slightly outside is on the border.
            if !(p[a] >= -1e-5 && p[a] <= last + 1e-5) {
                return None;
            }
            index[a] = (p[a].max(0.0) as usize).min(dims[a] - 2);
        }
        let [i, j, k] = index;
        let corners =
            std::array::from_fn(|c| volume.sample(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
        Some(Cell { index, corners })
    }

    fn value(&self, p: [f64; 3]) -> f64 {
        let [u, v, w] = std::array::from_fn(|a| p[a] - self.index[a] as f64);
        let f = &self.corners;
        let along_x = |c: usize| f[c] * (1.0 - u) + f[c + 1] * u;
        let low = along_x(0) * (1.0 - v) + along_x(2) * v;
        let high = along_x(4) * (1.0 - v) + along_x(6) * v;
        low * (1.0 - w) + high * w
    }

    /// The value at a point of the index frame, and the gradient there in the voxel frame, where a cell is `size`.
    fn value_and_gradient(&self, p: [f64; 3], size: [f64; 3]) -> (f64, [f64; 3]) {
        let value = self.value(p);
        // Along an axis the field is linear, so a difference over one cell is the derivative.
        let along = |a: usize| {
            let mut q = p;
            q[a] += 1.0;
            (self.value(q) - value) / size[a]
        };
        (value, std::array::from_fn(along))
    }
}

/// a[0] + a[1] s + a[2] s^2 + a[3] s^3 on [0, 1].
struct Cubic {
    a: [f64; 4],
}

impl Cubic {
    /// The cubic with these values at 0, 1/3, 2/3 and 1.
    fn through(y: [f64; 4]) -> Self {
        Cubic {
            a: [
                y[0],
                0.5 * (-11.0 * y[0] + 18.0 * y[1] - 9.0 * y[2] + 2.0 * y[3]),
                4.5 * (2.0 * y[0] - 5.0 * y[1] + 4.0 * y[2] - y[3]),
                4.5 * (-y[0] + 3.0 * y[1] - 3.0 * y[2] + y[3]),
            ],
        }
    }

    fn value(&self, s: f64) -> f64 {
        self.a[0] + s * (self.a[1] + s * (self.a[2] + s * self.a[3]))
    }

    /// The first s in [0, 1] from which on the sign of the cubic differs from `inside`.
    fn first_change(&self, inside: bool) -> Option<f64> {
        let changed = |s: f64| (self.value(s) > 0.0) != inside;
        let mut from = 0.0;
        if changed(from) {
            return Some(0.0);
        }
        let [first, second] = self.turning_points();
        for to in [first, second, 1.0] {
            if to <= from || to > 1.0 {
                continue;
            }
            if changed(to) {
                let (mut low, mut high) = (from, to);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    *if changed(middle) { &mut high } else { &mut low } = middle;
                }
                return Some(high);
            }
            from = to;
        }
        None
    }

    /// The roots of the derivative, the smaller first; infinite where there are none.
    fn turning_points(&self) -> [f64; 2] {
        let (a, b, c) = (3.0 * self.a[3], self.a[2], self.a[1]);
        let discriminant = b * b - a * c;
        if discriminant < 0.0 {
            return [f64::INFINITY; 2];
        }
        // Both terms have the same sign, so no digits cancel.
        let q = -(b + discriminant.sqrt().copysign(b));
        let (x, y) = (q / a, c / q);
        let finite = |r: f64| if r.is_finite() { r } else { f64::INFINITY };
        let (x, y) = (finite(x), finite(y));
        [x.min(y), x.max(y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Placement, Samples};

    /// Rounding of f64 along a path of a few cells.
    const ROUNDING: f64 = 1e-9;

    fn volume(spacing: [f64; 3], f: impl Fn(f64, f64, f64) -> f64) -> Volume {
        let mut samples = Vec::new();
        for k in 0..5 {
            for j in 0..5 {
                for i in 0..5 {
                    samples.push(f(f64::from(i), f64::from(j), f64::from(k)));
                }
            }
        }
        let placement = Placement { spacing, ..Placement::default() };
        Volume::new("v", [5; 3], Samples::F64(samples), placement).expect("a valid volume")
    }

    #[test]
    fn a_vertex_on_the_border_is_on_the_isosurface_that_rounding_puts_outside() {
        // The isosurface lies a millionth of a voxel above the border, and again at z = 3.
        let v = volume([1.0; 3], |_, _, z| if z < 2.5 { -z - 1e-6 } else { z - 3.0 });
        let hit = distance_along(&v, 0.0, [2.0, 2.0, 0.0], [0.0, 0.0, 1.0], 4.0);
        let Hit::At(t) = hit else { panic!("{hit:?}") };
        assert!((t - 1e-6).abs() < ROUNDING, "{t}");
    }

    #[test]
    fn an_isosurface_that_leaves_the_volume_below_a_point_is_found_along_the_border() {
        // The isosurface is a plane that leaves the volume at x = 0.5, just below the point; there is none above.
        let v = volume([1.0; 3], |x, _, z| z + 0.05 - 0.1 * x);
        let point = [0.3, 2.0, 0.01];
        let up = [0.0, 0.0, 1.0];
        assert_eq!(distance_along(&v, 0.0, point, up, 4.0), Hit::Border);
        let Hit::At(t) = distance_near(&v, 0.0, point, Some(up), 4.0) else {
            panic!("no distance")
        };
        // Descent first follows the plane's normal down to the border.
        assert!((t - 0.2f64.hypot(0.01)).abs() < 1e-3, "{t}");
        // Without an isosurface in the volume there is no distance.
        assert_eq!(distance_near(&v, 99.0, point, Some(up), 4.0), Hit::Border);
    }

    #[test]
    fn a_plane_is_hit_at_its_distance_from_both_sides() {
        let v = volume([1.0; 3], |x, _, _| x);
        for x in [0.25, 3.0] {
            let hit = distance_along(&v, 1.5, [x, 2.0, 2.0], [1.0, 0.0, 0.0], 2.0);
            let Hit::At(t) = hit else { panic!("{hit:?}") };
            assert!((t - (x - 1.5).abs()).abs() < ROUNDING);
        }
    }

    #[test]
    fn distances_are_in_voxels_where_the_spacing_is_anisotropic() {
        let v = volume([1.0, 1.0, 1.25], |_, _, z| z);
        let hit = distance_along(&v, 1.5, [2.0, 2.0, 1.25], [0.0, 0.0, 1.0], 2.0);
        let Hit::At(t) = hit else { panic!("{hit:?}") };
        assert!((t - 0.625).abs() < ROUNDING);
    }

    #[test]
    fn the_nearer_of_two_crossings_in_one_cell_is_found() {
        // Along the diagonal of a cell of xyz + ... the field is a cubic; here (x-1)(y-2) has two
        // crossings of 0.05 close together along (1, -1, 0) / sqrt 2 from (1.5, 1.5).
        let v = volume([1.0; 3], |x, y, _| (x - 1.0) * (2.0 - y));
        let d = 0.5f64.sqrt();
        let hit = distance_along(&v, 0.2, [1.5, 1.5, 2.0], [d, d, 0.0], 2.0);
        // (0.5 + s)(0.5 - s) = 0.2, so s = sqrt(0.05), t = s sqrt 2.
        let Hit::At(t) = hit else { panic!("{hit:?}") };
        assert!((t - (0.05f64 * 2.0).sqrt()).abs() < ROUNDING, "{t}");
    }

    #[test]
    fn a_line_ends_within_reach_or_at_the_border() {
        let v = volume([1.0; 3], |x, _, _| x);
        let along = |x: f64| distance_along(&v, 3.9, [x, 2.0, 2.0], [1.0, 0.0, 0.0], 1.0);
        assert_eq!(along(2.0), Hit::Nothing);
        assert_eq!(distance_along(&v, 9.0, [3.5, 2.0, 2.0], [1.0, 0.0, 0.0], 1.0), Hit::Border);
    }
}
