//! Where the border curve opens in a cap: dents.
//!
//! On the border the field is bilinear, so a curve opens in a cap at a sample: where the isovalue passes it,
//! a dent goes inwards from there. No vertex need be near, and nothing of the mesh would notice; but the
//! sample lies on the outer side of the isosurface then, and a cap over it is wrong.

use std::collections::BTreeMap;

use glam::{IVec3, Vec3};

use super::caps::{inner_slope, planes};
use crate::kernels::field::Field;
use crate::mesh::{Compacted, Mesh};
use crate::volume::Volume;

/// Where no curve opens, a sample lies under a cap wrongly if the isosurface is so far from it, in tolerances:
/// the polygon that the border curve is cuts off less.
const LEAST_DEPTH: f32 = 2.0;

/// How far beyond a triangle's sides, as a share of its size, a sample still lies under it.
const BESIDE: f32 = 1e-4;

/// A sample that a mesh has on the wrong side: one of the border over which there is a cap, though it lies on the
/// outer side, or one in a bump that the mesh goes by ([`super::missed`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Opening {
    /// Where it is, voxel frame.
    pub(super) place: Vec3,
    /// The isovalue at which the dent opens, which is its value, or at which the bump counts.
    pub(super) isovalue: f64,
}

/// The samples of the border that the isovalue has passed on its way from `since` to `next`, where the mesh has
/// its vertices at `positions` (voxel frame, in the order of the compacted mesh), and that lie under its caps all
/// the same. In the order of the grid; none where caps grow. `error` is the tolerance, voxels.
pub(super) fn openings(
    mesh: &Mesh,
    field: &Field,
    compacted: &Compacted,
    positions: &[[f32; 3]],
    [since, next]: [f64; 2],
    error: f32,
) -> Vec<Opening> {
    let isovalue = field.isovalue(next);
    let volume = field.volume();
    let outwards = (field.outside() - isovalue).signum();
    if f64::from(outwards) * (next - since) >= 0.0 {
        return Vec::new();
    }
    let mut found: BTreeMap<[i32; 3], Opening> = BTreeMap::new();
    for (&f, t) in compacted.faces.iter().zip(&compacted.connectivity.faces) {
        if !mesh.is_cap(f) {
            continue;
        }
        for_each_sample_under(field, t.map(|v| positions[v as usize].into()), |sample, axis| {
            let place = sample.as_vec3() * field.cell_size();
            let value = field.value(place);
            let depth = (value - isovalue) * outwards / inner_slope(field, place).max(1e-12);
            let least = if is_outermost(volume, sample, axis, outwards) {
                0.0
            } else {
                LEAST_DEPTH * error
            };
            let opened = sample_at(volume, sample);
            if depth > least && (opened - since) * (next - since) >= 0.0 {
                found.insert([sample.z, sample.y, sample.x], Opening { place, isovalue: opened });
            }
        });
    }
    found.into_values().collect()
}

/// The sample with an index inside the volume.
pub(super) fn sample_at(volume: &Volume, sample: IVec3) -> f64 {
    let [x, y, z] = sample.to_array().map(|i| i as usize);
    volume.sample(x, y, z)
}

/// Whether the value of a sample on the border plane across an axis is farther `outwards` than those of all its
/// neighbours on the plane, of equal ones that of the first: there a curve opens.
fn is_outermost(volume: &Volume, sample: IVec3, axis: usize, outwards: f32) -> bool {
    let last = IVec3::from(volume.dims().map(|d| d as i32 - 1));
    let key = |s: IVec3| (f64::from(outwards) * sample_at(volume, s), [-s.z, -s.y, -s.x]);
    let in_plane = (0..3).filter(|&a| a != axis).flat_map(|a| [IVec3::AXES[a], -IVec3::AXES[a]]);
    let beside = in_plane.map(|d| sample + d);
    beside
        .filter(|s| s.cmpge(IVec3::ZERO).all() && s.cmple(last).all())
        .all(|s| key(s) < key(sample))
}

/// Calls `visit` with the index of every sample of a border plane that lies under a cap's triangle
/// (voxel frame), and the axis across the plane.
fn for_each_sample_under(field: &Field, t: [Vec3; 3], mut visit: impl FnMut(IVec3, usize)) {
    let common = t.map(|p| planes(field, p)).into_iter().fold(u8::MAX, |a, b| a & b);
    let last = field.dims() - 1;
    let inverse = field.inverse_cell_size();
    for axis in (0..3).filter(|a| common & 1 << a != 0) {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let c = t.map(|p| [p[u] * inverse[u], p[v] * inverse[v]]);
        let side =
            if t[0][axis] * inverse[axis] < 0.5 * last[axis] as f32 { 0 } else { last[axis] };
        let low = [0, 1].map(|n| c[0][n].min(c[1][n]).min(c[2][n]));
        let high = [0, 1].map(|n| c[0][n].max(c[1][n]).max(c[2][n]));
        let samples = |n: usize, axis: usize| {
            low[n].ceil().max(0.0) as i32..=(high[n].floor() as i32).min(last[axis])
        };
        for j in samples(1, v) {
            for i in samples(0, u) {
                if is_under(c, [i as f32, j as f32]) {
                    let mut sample = IVec3::ZERO;
                    (sample[axis], sample[u], sample[v]) = (side, i, j);
                    visit(sample, axis);
                }
            }
        }
    }
}

/// Whether a point lies in a triangle of the plane or on its sides, whichever way it turns.
fn is_under([a, b, c]: [[f32; 2]; 3], p: [f32; 2]) -> bool {
    let turn = |a: [f32; 2], b: [f32; 2], c: [f32; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let whole = turn(a, b, c);
    let beside = -BESIDE * whole.abs();
    let sides = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
    whole != 0.0 && sides.iter().all(|s| s * whole.signum() >= beside)
}
