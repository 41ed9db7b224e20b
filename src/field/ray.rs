//! A ray through the field: the cells it visits, the cubic in each, and where it first reaches an
//! isovalue. Twin: `shaders/ray.wgsl`.
//!
//! # Theory
//!
//! The traversal is that of Amanatides and Woo (1987) in units of cells, relative to the cell of the
//! start; the distance to a face is always computed from the start, so errors do not accumulate.
//!
//! Along a segment the trilinear field is a cubic (thesis section 3.4). Its Bernstein coefficients
//! are the field's blossom: with A and B the ends of the segment inside the cell they are
//! f(A, A, A), the means of f with one and with two coordinates taken from B, and f(B, B, B) - sums
//! of interpolated values, so they round no worse than one interpolation. They bound the cubic:
//! if none reaches the isovalue, the cubic does not. Else the cubic is divided into monotone pieces
//! at the roots of its derivative, and in a piece whose ends are on different sides the root is found by Newton
//! steps inside a shrinking bracket. The closed form of the cubic is not used: in f32 it
//! loses half its digits near double roots.
//!
//! All values here are `sign * (f - isovalue)`, `sign` chosen so that the start is negative: "first
//! reached" is "first zero", and "left the slab" is "below `lowest`".

use super::grid::{Field, floor, mix};
use glam::{IVec3, Vec3};

/// Number of cells that a ray visits at most: bounds the loop in kernels, far above what a mesh's step needs.
pub const MAX_CELLS: u32 = 512;

/// Number of Newton steps and bisections in one monotone piece at most; 24 bisections alone give every bit of f32.
pub const MAX_NEWTON: u32 = 24;

/// A direction with a smaller component (in cells) counts as parallel to the faces of that axis.
pub const PARALLEL: f32 = 1e-12;

/// The value that a ray searches, and the values that it may pass before.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    /// The value to reach.
    pub isovalue: f32,
    /// 1 if the start is below the isovalue, -1 if it is above.
    pub sign: f32,
    /// Smallest `sign * (f - isovalue)` allowed before the isovalue is reached.
    pub lowest: f32,
}

/// How a ray ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Walk {
    /// It reached the isovalue after this distance, in voxels.
    Reached(f32),
    /// It left the slab, or the field, before.
    Left,
    /// It went the whole distance inside the slab without reaching the isovalue.
    Ended,
}

/// Walks from `from` along the unit vector `direction` for at most `reach` voxels.
pub fn walk(field: &Field, from: Vec3, direction: Vec3, slab: Slab, reach: f32) -> Walk {
    walk_knowing(field, from, direction, slab, reach, None)
}

/// A cell, and its corner values less the isovalue.
pub type Known<'a> = Option<(IVec3, &'a [f32; 8])>;

/// As [`walk`], with the values of a cell that the caller has found already: most rays end in the first one.
pub fn walk_knowing(
    field: &Field,
    from: Vec3,
    direction: Vec3,
    slab: Slab,
    reach: f32,
    known: Known,
) -> Walk {
    let dims = field.dims();
    let d = direction * field.inverse_cell_size();
    let x = from * field.inverse_cell_size();
    let mut start = floor(x);
    let mut local = x - start.as_vec3();
    let step = steps(d);
    for a in 0..3 {
        // On a face the ray enters the lower cell if it goes down, and a ray within the upper
        // border plane of the volume uses the cell inside.
        if local[a] == 0.0 && (step[a] < 0 || step[a] == 0 && start[a] >= dims[a] - 1) {
            start[a] -= 1;
            local[a] = 1.0;
        }
    }
    let mut moved = IVec3::ZERO;
    let mut a_local = local;
    let mut t0 = 0.0f32;
    for _ in 0..MAX_CELLS {
        let cell = start + moved;
        if cell.cmplt(IVec3::NEG_ONE).any() || cell.cmpge(dims).any() {
            return Walk::Left;
        }
        let (axis, exit) = exit_of(local, d, step, moved);
        let t1 = exit.max(t0).min(reach);
        let ends = exit >= reach;
        let mut b_local = (local + d * t1 - moved.as_vec3()).clamp(Vec3::ZERO, Vec3::ONE);
        if exit <= reach {
            b_local[axis] = if step[axis] > 0 { 1.0 } else { 0.0 };
        }
        let values = match known {
            Some((at, values)) if at == cell => *values,
            _ => field.corners(cell).map(|v| v - slab.isovalue),
        };
        let values = values.map(|v| slab.sign * v);
        match crossing(&values, a_local, b_local, slab.lowest) {
            Crossing::At(s) => return Walk::Reached(mix(t0, t1, s)),
            Crossing::Leaves => return Walk::Left,
            Crossing::None => {}
        }
        if ends {
            return Walk::Ended;
        }
        moved[axis] += step[axis];
        a_local = b_local;
        a_local[axis] = if step[axis] > 0 { 0.0 } else { 1.0 };
        t0 = t1;
    }
    Walk::Left
}

/// Per axis, 1 or -1 as a direction (in cells) crosses faces upwards or downwards; 0 if it crosses none.
#[inline]
pub(crate) fn steps(d: Vec3) -> IVec3 {
    let step = |x: f32| (x > PARALLEL) as i32 - (x < -PARALLEL) as i32;
    IVec3::new(step(d.x), step(d.y), step(d.z))
}

/// The axis of the face through which the ray leaves the cell, and the distance to it from the start, voxels.
#[inline]
pub(crate) fn exit_of(local: Vec3, d: Vec3, step: IVec3, moved: IVec3) -> (usize, f32) {
    let mut axis = 0;
    let mut exit = f32::MAX;
    for a in 0..3 {
        if step[a] != 0 {
            let plane = (moved[a] + (step[a] > 0) as i32) as f32;
            let t = (plane - local[a]) / d[a];
            if t < exit {
                axis = a;
                exit = t;
            }
        }
    }
    (axis, exit)
}

/// The first event of the cubic between the ends of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crossing {
    /// It first reaches zero here, 0 to 1 along the segment.
    At(f32),
    /// It falls below the lowest value allowed before it reaches zero.
    Leaves,
    /// Neither.
    None,
}

/// The first crossing of a segment from `a` to `b` inside a cell with the given corner values.
#[inline]
fn crossing(values: &[f32; 8], a: Vec3, b: Vec3, lowest: f32) -> Crossing {
    let low = values.iter().copied().fold(f32::MAX, f32::min);
    let high = values.iter().copied().fold(f32::MIN, f32::max);
    if high < 0.0 && low >= lowest {
        return Crossing::None;
    }
    first_crossing(bernstein(values, a, b), lowest)
}

/// Bernstein coefficients of the field along the segment from `a` to `b` inside a cell.
#[inline]
pub fn bernstein(values: &[f32; 8], a: Vec3, b: Vec3) -> [f32; 4] {
    // Names spell the ends that x, y and z are taken from.
    let along_x =
        |x: f32| -> [f32; 4] { std::array::from_fn(|i| mix(values[2 * i], values[2 * i + 1], x)) };
    let along_y = |v: [f32; 4], y: f32| (mix(v[0], v[1], y), mix(v[2], v[3], y));
    let (xa, xb) = (along_x(a.x), along_x(b.x));
    let (aa, ab) = (along_y(xa, a.y), along_y(xa, b.y));
    let (ba, bb) = (along_y(xb, a.y), along_y(xb, b.y));
    let aaa = mix(aa.0, aa.1, a.z);
    let aab = mix(aa.0, aa.1, b.z);
    let aba = mix(ab.0, ab.1, a.z);
    let abb = mix(ab.0, ab.1, b.z);
    let baa = mix(ba.0, ba.1, a.z);
    let bab = mix(ba.0, ba.1, b.z);
    let bba = mix(bb.0, bb.1, a.z);
    let bbb = mix(bb.0, bb.1, b.z);
    [aaa, (aab + aba + baa) / 3.0, (abb + bab + bba) / 3.0, bbb]
}

/// The first place in 0..1 where the cubic with these Bernstein coefficients reaches zero from
/// below, unless it falls below `lowest` before.
pub fn first_crossing(b: [f32; 4], lowest: f32) -> Crossing {
    if b[0] >= 0.0 {
        return Crossing::At(0.0);
    }
    if b[1].max(b[2]).max(b[3]) < 0.0 && b[1].min(b[2]).min(b[3]) >= lowest {
        return Crossing::None;
    }
    let (first, second) = turning_points(b);
    let mut from = 0.0;
    for to in [first, second, 1.0] {
        if to > from {
            let value = cubic(b, to);
            if value >= 0.0 {
                return Crossing::At(root_between(b, from, to));
            }
            if value < lowest {
                return Crossing::Leaves;
            }
            from = to;
        }
    }
    Crossing::None
}

/// The parameters in 0..1 at which the cubic turns, ascending; 0 in place of those that do not exist.
fn turning_points(b: [f32; 4]) -> (f32, f32) {
    let (e0, e1, e2) = (b[1] - b[0], b[2] - b[1], b[3] - b[2]);
    let discriminant = e1 * e1 - e0 * e2;
    if discriminant <= 0.0 {
        return (0.0, 0.0);
    }
    // Both roots without cancellation: one from the sum of equal signs, one from their product.
    let half = e1 - e0;
    let root = discriminant.sqrt();
    let q = if half < 0.0 { root - half } else { -root - half };
    let (s, t) = (fraction(q, e0 - 2.0 * e1 + e2), fraction(e0, q));
    (s.min(t), s.max(t))
}

/// n / d if it is between 0 and 1, else 0.
#[inline]
fn fraction(n: f32, d: f32) -> f32 {
    if n != 0.0 && n.abs() < d.abs() && (n > 0.0) == (d > 0.0) { n / d } else { 0.0 }
}

/// The cubic with Bernstein coefficients `b` at `s`, by de Casteljau's steps.
#[inline]
pub fn cubic(b: [f32; 4], s: f32) -> f32 {
    let (p, q, r) = (mix(b[0], b[1], s), mix(b[1], b[2], s), mix(b[2], b[3], s));
    mix(mix(p, q, s), mix(q, r, s), s)
}

/// The root of a piece that rises monotonically from below zero at `low` to above it at `high`.
fn root_between(b: [f32; 4], mut low: f32, mut high: f32) -> f32 {
    let mut s = 0.5 * (low + high);
    for _ in 0..MAX_NEWTON {
        let (p, q, r) = (mix(b[0], b[1], s), mix(b[1], b[2], s), mix(b[2], b[3], s));
        let (u, v) = (mix(p, q, s), mix(q, r, s));
        let value = mix(u, v, s);
        if value >= 0.0 {
            high = s;
        } else {
            low = s;
        }
        let rise = 3.0 * (v - u);
        let mut next = 0.5 * (low + high);
        if rise > 0.0 {
            let newton = s - value / rise;
            if newton > low && newton < high {
                next = newton;
            } else if newton == s {
                return s;
            }
        }
        if (next - s).abs() <= f32::EPSILON * 0.5 * s {
            return next;
        }
        s = next;
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::volume::{Placement, Samples, Volume};
    use std::sync::Arc;

    /// Uniform numbers in -1..1.
    fn random(state: &mut Random) -> f32 {
        (2.0 * state.unit() - 1.0) as f32
    }

    #[test]
    fn the_first_crossing_is_the_first_that_dense_sampling_sees() {
        let mut state = Random::new(1);
        let mut counts = [0; 3];
        for _ in 0..20_000 {
            let mut b: [f32; 4] = std::array::from_fn(|_| random(&mut state));
            b[0] = -b[0].abs() - 0.01;
            let lowest = b[0] - 0.2 * random(&mut state).abs();
            let at = |s: f64| {
                let b = b.map(f64::from);
                let r = 1.0 - s;
                b[0] * r * r * r + 3.0 * s * r * (b[1] * r + b[2] * s) + b[3] * s * s * s
            };
            let samples = (0..=1000).map(|i| f64::from(i) / 1000.0);
            // What lies within this of a bound may be on either side: between samples a cubic
            // with these coefficients rises above its samples by at most |f''| / 8e6 < 1e-5.
            let slack = 1e-5;
            let surely = |s: f64| at(s) >= slack || at(s) < f64::from(lowest) - slack;
            let seen = samples.clone().find(|&s| surely(s));
            match first_crossing(b, lowest) {
                Crossing::At(s) => {
                    counts[0] += 1;
                    assert!(at(f64::from(s)).abs() < 2e-6, "a root of {b:?}, not {s}");
                    assert!(!samples.take_while(|&t| t < f64::from(s)).any(surely), "{b:?}");
                }
                Crossing::Leaves => {
                    counts[1] += 1;
                    assert!(seen.is_none_or(|s| at(s) < 0.0), "{b:?} reaches zero first");
                    assert!(samples.clone().any(|s| at(s) < f64::from(lowest) + slack));
                }
                Crossing::None => {
                    counts[2] += 1;
                    assert!(seen.is_none(), "{b:?} crosses at {seen:?}");
                }
            }
        }
        assert!(counts.iter().all(|&n| n > 1000), "{counts:?}");
    }

    #[test]
    fn a_double_root_is_found_or_missed_but_never_elsewhere() {
        // (s - 1/2)^2 (s - 2) = 0 touches zero from below at 1/2.
        let b = [-0.5, 0.25, 0.0, -0.25];
        let at = |s: f32| (s - 0.5) * (s - 0.5) * (s - 2.0);
        assert!((cubic(b, 0.25) - at(0.25)).abs() < 1e-6);
        match first_crossing(b, -1.0) {
            Crossing::At(s) => assert!((s - 0.5).abs() < 1e-3, "{s}"),
            other => assert_eq!(other, Crossing::None),
        }
    }

    fn noise(dims: [usize; 3], spacing: [f64; 3]) -> Field {
        let mut state = Random::new(9);
        let samples = (0..dims.iter().product()).map(|_| random(&mut state)).collect();
        let placement = Placement { spacing, ..Placement::default() };
        let volume = Volume::new("noise", dims, Samples::F32(samples), placement);
        Field::new(Arc::new(volume.expect("a valid volume")))
    }

    /// The first place where dense sampling sees the isovalue, or None.
    fn marched(field: &Field, p: Vec3, d: Vec3, isovalue: f32, reach: f32) -> Option<f32> {
        let value = |t: f32| field.value(p + d * t) - isovalue;
        let n = 4000;
        let at = |i: i32| reach * i as f32 / n as f32;
        let start = value(0.0);
        (1..=n).map(at).find(|&t| value(t) * start <= 0.0)
    }

    #[test]
    fn a_ray_from_faces_edges_and_lattice_points_finds_what_marching_finds() {
        let field = noise([7, 6, 8], [1.0, 1.5, 1.25]);
        let size = field.cell_size();
        let mut state = Random::new(77);
        let mut counts = [0; 2];
        for i in 0..2000 {
            // Integer coordinates along any subset of axes, directions along any subset too.
            let mut x = Vec3::ZERO;
            let mut d = Vec3::ZERO;
            for a in 0..3 {
                let inner = 1.0 + (random(&mut state) + 1.0) * 1.5;
                x[a] = if i >> a & 1 == 1 { inner.floor() } else { inner };
                d[a] = if i >> (3 + a) & 1 == 1 { random(&mut state) } else { 0.0 };
            }
            if d == Vec3::ZERO {
                continue;
            }
            let (p, d) = (x * size, d.normalize());
            let isovalue = 0.3 * random(&mut state);
            let reach = 2.0;
            let sign = if field.value(p) < isovalue { 1.0 } else { -1.0 };
            let slab = Slab { isovalue, sign, lowest: f32::MIN };
            // Marching in steps of 1/2000 voxel may step over a pair of roots; those are few.
            let expected = marched(&field, p, d, isovalue, reach);
            match (walk(&field, p, d, slab, reach), expected) {
                (Walk::Reached(t), Some(m)) => {
                    counts[0] += 1;
                    assert!(t <= m + 1e-4, "ray {i}: {t} after {m}");
                    let there = field.value(p + d * t);
                    assert!((there - isovalue).abs() < 1e-5, "ray {i}: {there} at {t}");
                }
                (Walk::Reached(t), None) => {
                    let there = field.value(p + d * t);
                    assert!((there - isovalue).abs() < 1e-5, "ray {i}: {there} at {t}");
                }
                (walk, None) => {
                    counts[1] += 1;
                    assert_eq!(walk, Walk::Ended, "ray {i}");
                }
                (walk, Some(m)) => panic!("ray {i}: {walk:?}, expected a hit near {m}"),
            }
        }
        assert!(counts[0] > 500 && counts[1] > 200, "{counts:?}");
    }

    #[test]
    fn a_ray_that_leaves_the_layer_around_the_volume_ends_there() {
        let field = noise([4, 4, 4], [1.0; 3]);
        let slab = Slab { isovalue: 100.0, sign: 1.0, lowest: f32::MIN };
        for d in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            assert_eq!(walk(&field, Vec3::splat(1.5), d, slab, 100.0), Walk::Left);
        }
    }

    #[test]
    fn a_ray_within_a_border_plane_uses_the_cells_inside() {
        let field = noise([5, 5, 5], [1.0; 3]);
        let slab = Slab { isovalue: 5.0, sign: 1.0, lowest: -8.0 };
        for plane in [0.0, 4.0] {
            let p = Vec3::new(plane, 0.5, 2.5);
            // In the layer outside values fall to -21, below `lowest`; inside all is above -1.
            assert_eq!(walk(&field, p, Vec3::Y, slab, 3.0), Walk::Ended);
        }
    }
}
