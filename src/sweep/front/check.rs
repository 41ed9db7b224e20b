//! What must hold of the front at an isovalue, looked at in full: that the mesh is watertight with the exact cells, and
//! that it has the isosurface's topology.
//!
//! # Theory
//!
//! The mesh's boundary is the seam's polyline edge by edge. Then every part of the mesh has the boundary of a part of
//! the isosurface in its cells, and the two are alike if their Euler characteristics are: surfaces are told apart by their
//! boundaries and that number. Between two isovalues at which this holds nothing changes: the cells of the mesh hold no
//! critical point.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;

use super::exchange::polyline;
use super::region::{LatticeEdge, Region, Square};
use super::tracked::{Tracked, place_of};
use crate::disjoint_sets::DisjointSets;
use crate::extract::count::count_parts;
use crate::mesh::Vertex;
use crate::topology::exact::ExactField;

/// All squares between exact cells and others, ascending.
fn seam(region: &Region) -> Vec<Square> {
    let grid = region.grid;
    let mut squares = Vec::new();
    for &block in region.blocks() {
        for cell in grid.cells_of(block) {
            for axis in 0..3u8 {
                let stride = grid.strides[axis as usize];
                for (corner, other) in [(cell, cell - stride), (cell + stride, cell + stride)] {
                    if !region.is_exact(other) {
                        squares.push(Square { corner, axis });
                    }
                }
            }
        }
    }
    let [nx, ny, nz] = grid.dims;
    for axis in 0..3usize {
        let [b, c] = [1, 2].map(|n| (axis + n) % 3);
        let dims = [nx, ny, nz];
        for j in 1..dims[b] - 2 {
            for k in 1..dims[c] - 2 {
                for plane in [1, dims[axis] - 2] {
                    let mut p = [0; 3];
                    (p[axis], p[b], p[c]) = (plane, j, k);
                    let s = Square { corner: grid.vertex(p), axis: axis as u8 };
                    if region.is_seam(s) {
                        squares.push(s);
                    }
                }
            }
        }
    }
    squares.sort_unstable();
    squares
}

/// Samples near which the mesh's boundary is not the exact extraction's polyline on the seam.
pub(super) fn open_seam(
    tracked: &Tracked,
    region: &Region,
    field: &ExactField,
    isovalue: f64,
) -> BTreeSet<u32> {
    let mesh = &tracked.mesh;
    let mut bad = BTreeSet::new();
    let mut left: HashMap<[LatticeEdge; 2], usize> = HashMap::new();
    for f in mesh.faces().filter(|&f| !mesh.is_cap(f)) {
        for h in mesh.face_halfedges(f).into_iter().filter(|&h| tracked.is_boundary(h)) {
            match [mesh.from(h), mesh.to(h)].map(|v| tracked.key(v)) {
                [Some(a), Some(b)] => *left.entry([a.min(b), a.max(b)]).or_default() += 1,
                keys => bad.extend(keys.into_iter().flatten().map(|e| e.from)),
            }
        }
    }
    for s in seam(region) {
        for [a, b] in polyline(field, region.grid, s, isovalue) {
            match left.get_mut(&[a.min(b), a.max(b)]) {
                Some(n) if *n > 0 => *n -= 1,
                _ => {
                    bad.insert(s.corner);
                }
            }
        }
    }
    bad.extend(left.into_iter().filter(|(_, n)| *n > 0).map(|([a, _], _)| a.from));
    bad
}

/// Places of the parts of the mesh that are not like the isosurface in their cells, whose boundary is the seam's.
pub(super) fn unlike_parts(
    tracked: &Tracked,
    region: &Region,
    field: &ExactField,
    isovalue: f64,
) -> Vec<Vec3> {
    let mesh = &tracked.mesh;
    let mut sets = DisjointSets::new(mesh.vertex_slots());
    let faces: Vec<[Vertex; 3]> =
        mesh.faces().filter(|&f| !mesh.is_cap(f)).map(|f| mesh.face_vertices(f)).collect();
    for [a, b, c] in &faces {
        sets.join(a.0, b.0);
        sets.join(a.0, c.0);
    }
    let mut doubled: BTreeMap<u32, i64> = BTreeMap::new();
    let mut vertices: Vec<u32> = faces.iter().flatten().map(|v| v.0).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.iter().for_each(|&v| *doubled.entry(sets.find(v)).or_default() += 2);
    faces.iter().for_each(|f| *doubled.entry(sets.find(f[0].0)).or_default() -= 1);
    let exact = count_parts(field, isovalue, |cell| !region.is_exact(cell));
    let mut own: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    let mut others: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); exact.doubled.len()];
    let strides = field.strides();
    for (crossing, &part) in exact.crossings.iter().zip(&exact.part_of) {
        let from = crossing.low.min(crossing.high);
        let axis = strides.iter().position(|&s| s == crossing.low.max(crossing.high) - from);
        let e = LatticeEdge { from, axis: axis.expect("a lattice edge") as u8 };
        if let Some(v) = tracked.vertex_at(e) {
            let set = sets.find(v.0);
            own.entry(set).or_default().insert(part);
            others[part as usize].insert(set);
        }
    }
    let is_like = |set: u32| {
        own.get(&set).is_some_and(|parts| {
            let part = *parts.first().expect("not empty") as usize;
            parts.len() == 1 && others[part].len() == 1 && doubled[&set] == exact.doubled[part]
        })
    };
    // What has no boundary is compared as a whole.
    let closed = |set: &u32| !own.contains_key(set);
    let sum = |all: &mut dyn Iterator<Item = i64>| all.fold((0, 0), |s, d| (s.0 + 1, s.1 + d));
    let closed_here = sum(&mut doubled.iter().filter(|d| closed(d.0)).map(|d| *d.1));
    let is_whole = |part: &usize| others[*part].is_empty();
    let whole: Vec<usize> = (0..exact.doubled.len()).filter(is_whole).collect();
    let closed_there = sum(&mut whole.iter().map(|&p| exact.doubled[p]));
    // The numbers of points differ, the characteristics are the same: as they have no boundary, both are whole.
    let same = closed_here == closed_there;
    let is_wrong = |set: u32| if closed(&set) { !same } else { !is_like(set) };
    let wrong: Vec<u32> = vertices.into_iter().filter(|&v| is_wrong(sets.find(v))).collect();
    let mut places: Vec<Vec3> = wrong.into_iter().map(|v| mesh.position(Vertex(v))).collect();
    let lost = |part: usize| others[part].is_empty() && !same;
    for (crossing, &part) in exact.crossings.iter().zip(&exact.part_of) {
        if lost(part as usize) {
            places.push(place_of(field, crossing.low));
        }
    }
    places
}
