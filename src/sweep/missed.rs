//! Samples that a mesh has on the wrong side: bumps and needles that it goes by.
//!
//! # Theory
//!
//! On a lattice edge the field is linear: an edge whose ends lie on the same side of the isovalue is not
//! crossed by the isosurface. Where a face crosses it all the same, the end that the face has on the
//! wrong side lies in a bump that the mesh cuts off, by as much as that end is away. The tip of a bump
//! follows lattice edges from sample to sample: where two neighbours have nearly the same value and all
//! others are far from it, it grows by a whole cell within a trace of the isovalue, as a needle, and no
//! vertex of the mesh is there to follow it.

use std::collections::BTreeMap;

use glam::{IVec3, Vec3};

use super::opening::{Opening, sample_at};
use crate::kernels::field::Field;
use crate::mesh::{Compacted, Mesh, normal};
use crate::volume::Volume;

/// A bump counts if a mesh cuts off more than so many tolerances.
const LEAST_MISSED: f64 = 5.0;

/// How thick it must be beside its sample, tolerances per cell: thinner ones can't be brought in.
const LEAST_DEPTH: f64 = 0.5;

/// A way of the isovalue on which it passes samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    /// From where on samples count, not included.
    pub(super) since: f64,
    /// The isovalue of the mesh.
    pub(super) next: f64,
    /// 1 upwards, -1 downwards.
    pub(super) sign: f64,
    /// The tolerance, voxels.
    pub(super) error: f64,
}

impl Passage {
    fn has_passed(&self, isovalue: f64) -> bool {
        (isovalue - self.since) * self.sign > 0.0 && (self.next - isovalue) * self.sign >= 0.0
    }
}

/// The samples that the isovalue has passed on its way to a mesh with its vertices at `positions` (voxel frame, in
/// the order of the compacted mesh), and that the mesh has on their old side all the same. In the order of the grid.
pub(super) fn missed(
    mesh: &Mesh,
    field: &Field,
    compacted: &Compacted,
    positions: &[[f32; 3]],
    passage: Passage,
) -> Vec<Opening> {
    let volume = field.volume();
    let mut found: BTreeMap<[i32; 3], Opening> = BTreeMap::new();
    for_each_wrong(mesh, field, compacted, positions, passage.next, |s, off| {
        let value = sample_at(volume, s);
        let isovalue = value + LEAST_DEPTH * passage.error * rise(volume, s, passage.next);
        let counts = f64::from(off) > LEAST_MISSED * passage.error;
        if counts && passage.has_passed(value) && passage.has_passed(isovalue) {
            let place = s.as_vec3() * field.cell_size();
            found.insert([s.z, s.y, s.x], Opening { place, isovalue });
        }
    });
    found.into_values().collect()
}

/// Calls `visit` for every sample that is on the wrong side of a face, and its distance from the face, voxels.
fn for_each_wrong(
    mesh: &Mesh,
    field: &Field,
    compacted: &Compacted,
    positions: &[[f32; 3]],
    isovalue: f64,
    mut visit: impl FnMut(IVec3, f32),
) {
    let volume = field.volume();
    for (&f, t) in compacted.faces.iter().zip(&compacted.connectivity.faces) {
        if mesh.is_cap(f) {
            continue;
        }
        let points = t.map(|v| Vec3::from(positions[v as usize]));
        let normal = normal(points).normalize_or_zero();
        let corners = points.map(|p| p * field.inverse_cell_size());
        for_each_crossing(corners, |axis, line, place| {
            let Some(ends) = edge(volume, axis, line, place) else { return };
            let looks_up = normal[axis] > 0.0;
            let Some(wrong) = wrong_end(volume, ends, looks_up, isovalue) else { return };
            let off = (wrong[axis] as f32 - place) * field.cell_size()[axis] * normal[axis];
            visit(wrong, off.abs());
        });
    }
}

/// Which end of a lattice edge a face has on the wrong side that crosses it and looks up or down it; none where
/// the isosurface crosses it, too. A face looks to lower values: the mesh has its inside behind it.
fn wrong_end(volume: &Volume, ends: [IVec3; 2], looks_up: bool, isovalue: f64) -> Option<IVec3> {
    let [low, high] = ends.map(|s| sample_at(volume, s) > isovalue);
    (low == high).then(|| if looks_up == low { ends[1] } else { ends[0] })
}

/// How far it is from the value of a sample to the nearest of its neighbours' values on the other side of the
/// isovalue; zero where all are on its own.
fn rise(volume: &Volume, s: IVec3, isovalue: f64) -> f64 {
    let value = sample_at(volume, s);
    let last = IVec3::from(volume.dims().map(|d| d as i32 - 1));
    let beside = (0..3).flat_map(|a| [IVec3::AXES[a], -IVec3::AXES[a]]).map(|d| s + d);
    let steps = beside
        .filter(|n| n.cmpge(IVec3::ZERO).all() && n.cmple(last).all())
        .map(|n| sample_at(volume, n))
        .filter(|n| (*n > isovalue) != (value > isovalue))
        .map(|n| n - value);
    steps.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
}

/// The ends of the lattice edge at `place` along a line, the lower one first; none outside the volume.
fn edge(volume: &Volume, axis: usize, line: [i32; 2], place: f32) -> Option<[IVec3; 2]> {
    let last = IVec3::from(volume.dims().map(|d| d as i32 - 1));
    let mut low = IVec3::ZERO;
    (low[axis], low[(axis + 1) % 3], low[(axis + 2) % 3]) =
        (place.floor() as i32, line[0], line[1]);
    let high = low + IVec3::AXES[axis];
    (low.cmpge(IVec3::ZERO).all() && high.cmple(last).all()).then_some([low, high])
}

/// Calls `visit` for every crossing of a triangle (in cells) with a line of the lattice: the axis of the line, where
/// it lies along the next two axes, and the place of the crossing along it.
fn for_each_crossing(t: [Vec3; 3], mut visit: impl FnMut(usize, [i32; 2], f32)) {
    for axis in 0..3 {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let c = t.map(|p| [p[u], p[v]]);
        let range = |n: usize| {
            let [a, b, d] = c.map(|p| p[n]);
            a.min(b).min(d).ceil() as i32..=a.max(b).max(d).floor() as i32
        };
        let whole = turn(c[0], c[1], c[2]);
        if whole == 0.0 {
            continue;
        }
        for j in range(1) {
            for i in range(0) {
                let p = [i as f32, j as f32];
                let shares = [turn(c[1], c[2], p), turn(c[2], c[0], p), turn(c[0], c[1], p)]
                    .map(|s| s / whole);
                if shares.iter().all(|&s| s >= 0.0) {
                    let place = (0..3).map(|k| shares[k] * t[k][axis]).sum();
                    visit(axis, [i, j], place);
                }
            }
        }
    }
}

/// Twice the area of a triangle of the plane, negative where it turns clockwise.
fn turn(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::shapes::octahedron;
    use crate::volume::{Placement, Samples};

    const N: usize = 8;
    const ERROR: f64 = 0.08;

    /// A high sample, and a lower one beside it along `axis`; all others are zero.
    fn needle(axis: usize, [high, low]: [f32; 2]) -> Field {
        let mut samples = vec![0.0; N.pow(3)];
        let [at, step] = [3 * (1 + N + N * N), N.pow(axis as u32)];
        (samples[at], samples[at + step]) = (high, low);
        let placement = Placement { spacing: [0.5, 1.0, 0.75], ..Placement::default() };
        let volume = Volume::new("needle", [N; 3], Samples::F32(samples), placement);
        Field::new(Arc::new(volume.expect("a valid volume")))
    }

    /// What an octahedron around the first sample misses.
    fn missed_by(field: &Field, since: f64, next: f64) -> Vec<Opening> {
        octahedron_misses(0.2, field, since, next)
    }

    fn octahedron_misses(radius: f32, field: &Field, since: f64, next: f64) -> Vec<Opening> {
        let mesh = octahedron(Vec3::splat(3.0) * field.cell_size(), radius);
        let compacted = mesh.compacted();
        let passage = Passage { since, next, sign: (next - since).signum(), error: ERROR };
        missed(&mesh, field, &compacted, &compacted.positions, passage)
    }

    #[test]
    fn a_needle_is_missed_once_it_is_thick_enough() {
        for axis in 0..3 {
            let field = needle(axis, [10.0, 5.0]);
            let place = (Vec3::splat(3.0) + Vec3::AXES[axis]) * field.cell_size();
            let opening = Opening { place, isovalue: 5.0 - 5.0 * LEAST_DEPTH * ERROR };
            assert_eq!(missed_by(&field, 6.0, 4.0), [opening]);
            // Not passed yet, passed long ago, as thin as a thread.
            for (since, next) in [(9.0, 5.5), (4.5, 4.0), (6.0, 4.9)] {
                assert_eq!(missed_by(&field, since, next), [], "{since} {next}");
            }
        }
    }

    #[test]
    fn a_sample_on_its_own_side_is_not_missed() {
        for axis in 0..3 {
            assert_eq!(missed_by(&needle(axis, [10.0, 0.0]), 6.0, 4.0), []);
            assert_eq!(missed_by(&needle(axis, [10.0, 5.0]), 8.0, 6.0), []);
        }
    }

    #[test]
    fn an_inside_that_is_none_any_more_is_missed() {
        for axis in 0..3 {
            let field = needle(axis, [3.0, 5.0]);
            let isovalue = 3.0 + 2.0 * LEAST_DEPTH * ERROR;
            let place = Vec3::splat(3.0) * field.cell_size();
            let found = octahedron_misses(0.9, &field, 2.0, 4.0);
            assert_eq!(found, [Opening { place, isovalue }]);
            // What has been let be once is not asked for again.
            assert_eq!(octahedron_misses(0.9, &field, 3.0, 4.0), []);
            assert_eq!(octahedron_misses(0.9, &field, 4.0, 4.5), []);
        }
    }

    #[test]
    fn crossings_with_lines_are_found_along_every_axis() {
        for turned in 0..3 {
            // Coordinates along the axes (turned + 1, turned + 2, turned) modulo 3.
            let corners = [[0.5, 0.6, 0.2], [2.5, 0.7, 0.2], [0.6, 2.5, 0.7]].map(|c: [f32; 3]| {
                let mut p = Vec3::ZERO;
                (p[(turned + 1) % 3], p[(turned + 2) % 3], p[turned]) = (c[0], c[1], c[2]);
                p
            });
            let mut found = Vec::new();
            for_each_crossing(corners, |axis, line, place| found.push((axis, line, place)));
            let lines: Vec<_> = found.iter().map(|&(axis, line, _)| (axis, line)).collect();
            assert_eq!(lines, [[1, 1], [2, 1], [1, 2]].map(|line| (turned, line)));
            let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            for (axis, line, place) in found {
                let mut p = Vec3::ZERO;
                let [u, v] = line.map(|i| i as f32);
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (place, u, v);
                assert!(n.dot(p - corners[0]).abs() < 1e-5, "{p}");
            }
        }
    }
}
