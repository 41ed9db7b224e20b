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
use super::region::{LatticeEdge, PaddedGrid, Region, Square};
use super::tracked::{Tracked, place_of};
use crate::disjoint_sets::DisjointSets;
use crate::extract::count::count_parts;
use crate::extract::extract_cell;
use crate::mesh::{Face, Vertex};
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

/// Blocks that change together at an isovalue.
pub(super) struct Change<'a> {
    pub(super) field: &'a ExactField<'a>,
    pub(super) isovalue: f64,
    /// Before and after.
    pub(super) regions: [&'a Region; 2],
    pub(super) blocks: &'a [u32],
}

impl Change<'_> {
    fn grid(&self) -> PaddedGrid {
        self.regions[0].grid
    }

    /// The squares of the cells that change, ascending, and whether each is on the seam before and after.
    fn squares(&self) -> Vec<(Square, [bool; 2])> {
        let cells = self.blocks.iter().flat_map(|&b| self.grid().cells_of(b));
        let mut squares: Vec<Square> =
            cells.flat_map(|c| self.grid().squares_of(c)).map(|s| s.0).collect();
        squares.sort_unstable();
        squares.dedup();
        squares.into_iter().map(|s| (s, self.regions.map(|r| r.is_seam(s)))).collect()
    }

    fn polyline(&self, s: Square) -> Vec<[LatticeEdge; 2]> {
        polyline(self.field, self.grid(), s, self.isovalue)
    }

    /// Adds the exact extraction in the blocks that are exact now (0 before, 1 after) and not at the other time.
    fn add_exact(&self, now: usize, pieces: &mut Surface) {
        let [here, there] = [self.regions[now], self.regions[1 - now]];
        for &block in self.blocks.iter().filter(|b| here.holds(**b) && !there.holds(**b)) {
            for cell in self.grid().cells_of(block) {
                let surface = extract_cell(self.field, cell, self.isovalue);
                let numbers: Vec<u32> = surface
                    .crossings
                    .iter()
                    .map(|c| match c {
                        Some(ends) => pieces.crossing(self.grid().edge_between(*ends)),
                        None => pieces.vertex(),
                    })
                    .collect();
                let faces = surface.faces.iter().map(|f| f.map(|v| numbers[v as usize]));
                pieces.faces.extend(faces);
            }
        }
    }
}

/// The connectivity of a surface.
#[derive(Default)]
struct Surface {
    n_vertices: u32,
    crossings: HashMap<LatticeEdge, u32>,
    faces: Vec<[u32; 3]>,
}

/// Components, and the sum of their Euler characteristics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sum {
    components: usize,
    characteristic: i64,
}

impl Sum {
    /// One more component.
    fn add(&mut self, characteristic: i64) {
        self.join(Sum { components: 1, characteristic });
    }

    fn join(&mut self, other: Sum) {
        self.components += other.components;
        self.characteristic += other.characteristic;
    }
}

/// Identifies vertices of two surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Anchor {
    Crossing(LatticeEdge),
    Rim(Vertex),
}

impl Surface {
    fn vertex(&mut self) -> u32 {
        self.n_vertices += 1;
        self.n_vertices - 1
    }

    fn crossing(&mut self, e: LatticeEdge) -> u32 {
        let next = self.n_vertices;
        let v = *self.crossings.entry(e).or_insert(next);
        self.n_vertices = self.n_vertices.max(v + 1);
        v
    }

    /// Vertices less edges plus faces of each component, by the component's first vertex, and by vertex the component.
    fn characteristics(&self) -> (BTreeMap<u32, i64>, DisjointSets) {
        let mut sets = DisjointSets::new(self.n_vertices as usize);
        let mut edges: Vec<(u32, u32)> = Vec::with_capacity(3 * self.faces.len());
        for t in &self.faces {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                sets.join(a, b);
                edges.push((a.min(b), a.max(b)));
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let mut sum: BTreeMap<u32, i64> = BTreeMap::new();
        let mut vertices: Vec<u32> = self.faces.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.into_iter().for_each(|v| *sum.entry(sets.find(v)).or_default() += 1);
        edges.into_iter().for_each(|e| *sum.entry(sets.find(e.0)).or_default() -= 1);
        self.faces.iter().for_each(|f| *sum.entry(sets.find(f[0])).or_default() += 1);
        (sum, sets)
    }
}

/// Samples near which the boundary of an exchanged part is not the expected polyline: the boundary before, without the
/// squares that are no longer on the seam, with those that are new on it.
pub(super) fn open_part(before: &Tracked, exchanged: &Exchanged, change: &Change) -> Vec<u32> {
    let part = &exchanged.part;
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
    for (s, [was, is]) in change.squares() {
        if was != is {
            for [a, b] in change.polyline(s) {
                add([Some(a), Some(b)], i32::from(is) - i32::from(was), &mut bad);
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

/// Samples of the components whose Euler characteristic an exchange has changed, the exact extraction in the changing cells
/// included: the isovalue is the same, so the isosurface must be.
pub(super) fn changed_topology(
    before: &Tracked,
    exchanged: &Exchanged,
    change: &Change,
) -> Vec<u32> {
    let part = &exchanged.part;
    let mut anchors: Vec<(Anchor, usize, u32)> = Vec::new();
    let mut surfaces = [Surface::default(), Surface::default()];
    let mut add = |now: usize, key: Option<LatticeEdge>, rim: Option<Vertex>| {
        let surface: &mut Surface = &mut surfaces[now];
        let n = match key {
            Some(e) => surface.crossing(e),
            None => surface.vertex(),
        };
        anchors.extend(rim.map(|v| (Anchor::Rim(v), now, n)));
        n
    };
    let at_rim = |v: usize, o: Option<Vertex>| o.filter(|_| part.is_rim.get(v).is_some_and(|r| *r));
    let mut old: Vec<u32> = Vec::with_capacity(part.origin.len());
    for (v, &o) in part.origin.iter().enumerate() {
        old.push(add(0, o.and_then(|o| before.key(o)), at_rim(v, o)));
    }
    let mesh = &exchanged.made.mesh;
    let faces: Vec<[Vertex; 3]> =
        mesh.faces().filter(|&f| !mesh.is_cap(f)).map(|f| mesh.face_vertices(f)).collect();
    let mut new: Vec<Option<u32>> = vec![None; mesh.vertex_slots()];
    for &v in faces.iter().flatten() {
        if new[v.0 as usize].is_none() {
            let origin = exchanged.origin.get(v.0 as usize).copied().flatten();
            let is_rim =
                |o: &Vertex| part.rim.range((*o, Vertex(0))..).next().is_some_and(|r| r.0 == *o);
            new[v.0 as usize] = Some(add(1, exchanged.key(before, v), origin.filter(is_rim)));
        }
    }
    surfaces[0].faces = part.triangles.iter().map(|t| t.map(|v| old[v as usize])).collect();
    let number = |v: Vertex| new[v.0 as usize].expect("numbered");
    surfaces[1].faces = faces.iter().map(|t| t.map(number)).collect();
    for (now, surface) in surfaces.iter_mut().enumerate() {
        change.add_exact(now, surface);
        let mut crossings: Vec<(LatticeEdge, u32)> =
            surface.crossings.iter().map(|(e, v)| (*e, *v)).collect();
        crossings.sort_unstable();
        anchors.extend(crossings.into_iter().map(|(e, v)| (Anchor::Crossing(e), now, v)));
    }
    anchors.sort_unstable();
    let [(old_sums, mut old_sets), (new_sums, mut new_sets)] =
        [surfaces[0].characteristics(), surfaces[1].characteristics()];
    // Components of both that have a vertex in common are one group.
    let n_old = surfaces[0].n_vertices;
    let mut groups = DisjointSets::new((n_old + surfaces[1].n_vertices) as usize);
    let mut place = |now: usize, v: u32| match now {
        0 => old_sets.find(v),
        _ => n_old + new_sets.find(v),
    };
    for same in anchors.chunk_by(|a, b| a.0 == b.0) {
        let first = place(same[0].1, same[0].2);
        for &(_, now, v) in same {
            groups.join(first, place(now, v));
        }
    }
    let mut sums: BTreeMap<u32, [Sum; 2]> = BTreeMap::new();
    old_sums.iter().for_each(|(&v, &n)| sums.entry(groups.find(v)).or_default()[0].add(n));
    new_sums.iter().for_each(|(&v, &n)| sums.entry(groups.find(n_old + v)).or_default()[1].add(n));
    // A closed component that is replaced as a whole has no vertex in common with its replacement: such components
    // are compared in total.
    let is_alone = |s: &[Sum; 2]| s.iter().any(|s| s.components == 0);
    let alone = sums.values().filter(|s| is_alone(s)).fold([Sum::default(); 2], |mut all, s| {
        (0..2).for_each(|now| all[now].join(s[now]));
        all
    });
    let same = alone[0] == alone[1];
    let is_bad = |s: &[Sum; 2]| {
        if is_alone(s) { !same } else { s[0].characteristic != s[1].characteristic }
    };
    let bad: Vec<u32> = sums.iter().filter(|(_, s)| is_bad(s)).map(|(&g, _)| g).collect();
    if bad.is_empty() {
        return Vec::new();
    }
    let mut samples = Vec::new();
    for &(anchor, now, v) in &anchors {
        if let Anchor::Crossing(e) = anchor
            && bad.contains(&groups.find(place(now, v)))
        {
            samples.push(e.from);
        }
    }
    samples.dedup();
    samples
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
