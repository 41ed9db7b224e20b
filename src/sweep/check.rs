//! Checks at an isovalue that the tracked mesh is watertight with the exact cells, and that it has the isosurface's topology.
//!
//! # Theory
//!
//! The mesh's boundary must be the seam's polyline edge by edge. Then every component of the mesh has the boundary of a
//! component of the isosurface in the same cells, and the two are homeomorphic if their Euler characteristics are equal:
//! boundary and Euler characteristic classify orientable surfaces. Between two isovalues at which this holds the topology
//! does not change, as the cells of the mesh contain no critical point.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;
use rayon::prelude::*;

use super::exchanged::Exchanged;
use super::polyline::polyline;
use super::region::{LatticeEdge, Region, Square};
use super::tracked::{Tracked, place_of};
use crate::disjoint_sets::DisjointSets;
use crate::extract::count::count_parts;
use crate::mesh::Face;
use crate::topology::exact::ExactField;

/// All squares between exact cells and others.
fn seam(region: &Region) -> Vec<Square> {
    let grid = region.grid;
    let blocks: Vec<u32> = region.blocks().iter().copied().collect();
    let of_block = |block: u32| {
        let sides = grid.cells_of(block).flat_map(move |cell| grid.squares_of(cell));
        sides.filter(|s| !region.is_exact(s.1)).map(|s| s.0)
    };
    let mut squares: Vec<Square> =
        blocks.into_par_iter().with_min_len(64).flat_map_iter(of_block).collect();
    for axis in 0..3usize {
        let [b, c] = [1, 2].map(|n| (axis + n) % 3);
        for plane in [1, grid.dims[axis] - 2] {
            let rows = (1..grid.dims[b] - 2).into_par_iter().flat_map_iter(|j| {
                (1..grid.dims[c] - 2).map(move |k| {
                    let mut p = [0; 3];
                    (p[axis], p[b], p[c]) = (plane, j, k);
                    Square { corner: grid.vertex(p), axis: axis as u8 }
                })
            });
            squares.par_extend(rows.filter(|&s| region.is_seam(s)));
        }
    }
    squares
}

/// Samples near which the boundary of a part, exchanged as some blocks change at an isovalue, is not the expected polyline: the
/// boundary before, without the squares that are no longer on the seam, with those that are new on it.
pub(super) fn open_part(
    before: &Tracked,
    exchanged: &Exchanged,
    blocks: &[u32],
    regions: [&Region; 2],
    (field, isovalue): (&ExactField, f64),
) -> Vec<u32> {
    let (part, grid) = (&exchanged.part, regions[0].grid);
    let mut left: HashMap<[LatticeEdge; 2], i32> = HashMap::new();
    let mut bad = Vec::new();
    let mut add = |keys: [Option<LatticeEdge>; 2], n: i32, bad: &mut Vec<u32>| match keys {
        [Some(a), Some(b)] => *left.entry([a.min(b), a.max(b)]).or_default() += n,
        keys => bad.extend(keys.into_iter().flatten().map(|e| e.from)),
    };
    for &f in &part.faces {
        for h in before.mesh.face_halfedges(f).into_iter().filter(|&h| before.is_boundary(h)) {
            add([before.mesh.from(h), before.mesh.to(h)].map(|v| before.key(v)), 1, &mut bad);
        }
    }
    let cells = blocks.iter().flat_map(|&b| grid.cells_of(b));
    let mut squares: Vec<Square> = cells.flat_map(|c| grid.squares_of(c)).map(|s| s.0).collect();
    squares.sort_unstable();
    squares.dedup();
    for s in squares {
        let [was, is] = regions.map(|r| i32::from(r.is_seam(s)));
        if was != is {
            for edge in polyline(field, grid, s, isovalue) {
                add(edge.map(Some), is - was, &mut bad);
            }
        }
    }
    let made = &exchanged.made;
    for f in made.mesh.faces().filter(|&f| !made.mesh.is_cap(f)) {
        for h in made.mesh.face_halfedges(f).into_iter().filter(|&h| made.is_boundary(h)) {
            let ends = [made.mesh.from(h), made.mesh.to(h)];
            if !exchanged.is_rim(ends) {
                add(ends.map(|v| exchanged.key(before, v)), -1, &mut bad);
            }
        }
    }
    bad.extend(left.into_iter().filter(|(_, n)| *n != 0).map(|([a, _], _)| a.from));
    bad.sort_unstable();
    bad
}

/// Samples near which the mesh's boundary is not the exact extraction's polyline on the seam, ascending.
pub(super) fn open_seam(
    tracked: &Tracked,
    region: &Region,
    field: &ExactField,
    isovalue: f64,
) -> Vec<u32> {
    let mesh = &tracked.mesh;
    let sorted = |[a, b]: [LatticeEdge; 2]| [a.min(b), a.max(b)];
    let caps = (0..mesh.face_slots() as u32).into_par_iter().map(Face).with_min_len(1024);
    let caps = caps.filter(|&f| mesh.has_face(f) && mesh.is_cap(f));
    let keys = caps.flat_map_iter(|f| {
        let sides = mesh.face_halfedges(f).into_iter();
        let sides = sides.filter(|h| !mesh.is_cap(mesh.face(h.twin())));
        sides.map(|h| [mesh.from(h), mesh.to(h)].map(|v| tracked.key(v)))
    });
    let keys: Vec<[Option<LatticeEdge>; 2]> = keys.collect();
    let mut bad = Vec::new();
    let mut found = Vec::with_capacity(keys.len());
    for keys in keys {
        match keys {
            [Some(a), Some(b)] => found.push(sorted([a, b])),
            keys => bad.extend(keys.into_iter().flatten().map(|e| e.from)),
        }
    }
    let wanted = seam(region).into_par_iter().with_min_len(256);
    let wanted = wanted.flat_map_iter(|s| polyline(field, region.grid, s, isovalue)).map(sorted);
    let mut wanted: Vec<[LatticeEdge; 2]> = wanted.collect();
    found.par_sort_unstable();
    wanted.par_sort_unstable();
    // The edges that are in one of the two only.
    let (mut i, mut j) = (0, 0);
    while i < found.len() || j < wanted.len() {
        match (found.get(i), wanted.get(j)) {
            (Some(f), Some(w)) if f == w => (i, j) = (i + 1, j + 1),
            (Some(f), w) if w.is_none_or(|w| f < w) => {
                bad.push(f[0].from);
                i += 1;
            }
            (_, w) => {
                bad.extend(w.map(|w| w[0].from));
                j += 1;
            }
        }
    }
    bad.sort_unstable();
    bad.dedup();
    bad
}

/// Positions in components of the mesh whose topology is not that of the isosurface in the same cells. The boundaries must be
/// equal.
pub(super) fn mismatched_parts(
    tracked: &Tracked,
    region: &Region,
    field: &ExactField,
    isovalue: f64,
) -> Vec<Vec3> {
    let mesh = &tracked.mesh;
    let ((mut sets, components), exact) = rayon::join(
        || components(tracked),
        || count_parts(field, isovalue, |cell| !region.is_exact(cell)),
    );
    let mut own: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    let mut others: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); exact.doubled.len()];
    for (crossing, &part) in exact.crossings.iter().zip(&exact.part_of) {
        let e = region.grid.edge_between((crossing.low, crossing.high));
        if region.is_on_seam(e)
            && let Some(v) = tracked.vertex_at(e)
        {
            let set = sets.find(v.0);
            own.entry(set).or_default().insert(part);
            others[part as usize].insert(set);
        }
    }
    let is_like = |set: u32, doubled: i64| {
        own.get(&set).is_some_and(|parts| {
            let part = *parts.first().expect("not empty") as usize;
            parts.len() == 1 && others[part].len() == 1 && doubled == exact.doubled[part]
        })
    };
    // Components without a boundary are compared in total.
    let closed = |set: &u32| !own.contains_key(set);
    let sum = |all: &mut dyn Iterator<Item = i64>| all.fold((0, 0), |s, d| (s.0 + 1, s.1 + d));
    let closed_here = sum(&mut components.iter().filter(|c| closed(&c.0)).map(|c| c.1));
    let is_whole = |part: &usize| others[*part].is_empty();
    let whole: Vec<usize> = (0..exact.doubled.len()).filter(is_whole).collect();
    let closed_there = sum(&mut whole.iter().map(|&p| exact.doubled[p]));
    // The numbers of points differ, the characteristics are the same: as they have no boundary, both are whole.
    let same = closed_here == closed_there;
    let is_wrong = |&(set, doubled): &(u32, i64)| {
        if closed(&set) { !same } else { !is_like(set, doubled) }
    };
    let wrong: Vec<u32> = components.into_iter().filter(is_wrong).map(|c| c.0).collect();
    let mut places: Vec<Vec3> = Vec::new();
    if !wrong.is_empty() {
        let wrong = mesh.vertices().filter(|v| wrong.binary_search(&sets.find(v.0)).is_ok());
        places.extend(wrong.map(|v| mesh.position(v)));
    }
    let lost = |part: usize| others[part].is_empty() && !same;
    for (crossing, &part) in exact.crossings.iter().zip(&exact.part_of) {
        if lost(part as usize) {
            places.push(place_of(field, crossing.low));
        }
    }
    places
}

/// The components of the mesh without its caps, as sets of vertices; and of each, ascending, its first vertex and twice its number of
/// vertices less its number of faces.
fn components(tracked: &Tracked) -> (DisjointSets, Vec<(u32, i64)>) {
    let mesh = &tracked.mesh;
    let mut sets = DisjointSets::new(mesh.vertex_slots());
    let faces = || mesh.faces().filter(|&f| !mesh.is_cap(f)).map(|f| mesh.face_vertices(f));
    for [a, b, c] in faces() {
        sets.join(a.0, b.0);
        sets.join(a.0, c.0);
    }
    // By vertex slot, nothing at those that no face has: empty ones and hubs.
    let mut doubled: Vec<Option<i64>> = vec![None; mesh.vertex_slots()];
    for v in faces().flatten() {
        doubled[v.0 as usize] = Some(0);
    }
    for v in
        (0..doubled.len() as u32).filter(|&v| doubled[v as usize].is_some()).collect::<Vec<u32>>()
    {
        *doubled[sets.find(v) as usize].get_or_insert(0) += 2;
    }
    for [a, ..] in faces() {
        *doubled[sets.find(a.0) as usize].get_or_insert(0) -= 1;
    }
    let is_first = |v: &u32| sets.find(*v) == *v;
    let firsts: Vec<u32> = (0..doubled.len() as u32).filter(is_first).collect();
    let of_each = firsts.into_iter().filter_map(|v| Some((v, doubled[v as usize]?)));
    let of_each = of_each.collect();
    (sets, of_each)
}
