//! The lattice squares along which the mesh is cut, and the sides of them.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::super::clusters::Cluster;
use super::super::fans::boundary;
use super::super::polyline::sides;
use super::super::region::{LatticeEdge, Link, PaddedGrid, Region, Square};
use super::super::tracked::{Changes, Tracked};
use super::pieces::Pieces;
use super::refused::Refused;
use crate::mesh::{Edge, HalfEdgeMesh, Vertex, bounds};
use crate::topology::exact::ExactField;

/// An edge of the mesh that misses a square by this share of a lattice edge is split all the same.
const CUT_MARGIN: f32 = 1e-3;

/// Largest number of connected samples that the mesh may have on the wrong side.
const MAX_WRONG_GROUP: usize = 8;

/// The squares that the mesh is cut along.
pub(super) struct Cut<'a> {
    pub(super) field: &'a ExactField<'a>,
    pub(super) grid: PaddedGrid,
    pub(super) old: &'a Region,
    pub(super) new: &'a Region,
    pub(super) squares: BTreeSet<Square>,
    /// The blocks that are no longer exact.
    pub(super) released: Vec<u32>,
    pub(super) size: Vec3,
}

impl<'a> Cut<'a> {
    /// The squares between what becomes exact and what stays tracked.
    pub(super) fn new(
        cluster: &Cluster,
        [old, new]: [&'a Region; 2],
        field: &'a ExactField<'a>,
    ) -> Self {
        let grid = new.grid;
        let mut squares = BTreeSet::new();
        for &block in cluster.blocks.iter().filter(|b| new.holds(**b) && !old.holds(**b)) {
            for cell in grid.cells_of(block) {
                for (square, other) in grid.squares_of(cell) {
                    if !new.is_exact(other) && !old.is_exact(other) {
                        squares.insert(square);
                    }
                }
            }
        }
        let is_released = |b: &u32| old.holds(*b) && !new.holds(*b);
        let released = cluster.blocks.iter().copied().filter(is_released).collect();
        let size = Vec3::from(field.volume().voxel_size().map(|x| x as f32));
        Cut { field, grid, old, new, squares, released, size }
    }

    pub(super) fn is_cut(&self, s: Square) -> bool {
        self.squares.contains(&s)
    }

    /// A lattice plane, voxel frame.
    pub(super) fn plane(&self, axis: usize, index: i64) -> f32 {
        (index as f64 * self.field.volume().voxel_size()[axis]) as f32
    }

    /// The index of the lattice plane across an axis that contains a coordinate exactly.
    pub(super) fn plane_of(&self, axis: usize, x: f32) -> Option<i64> {
        let index = (x / self.size[axis]).round() as i64;
        (self.plane(axis, index) == x).then_some(index)
    }

    /// Whether a box meets a cut square in a lattice plane across an axis, or nearly.
    pub(super) fn meets(&self, axis: usize, index: i64, [low, high]: [Vec3; 2]) -> bool {
        let [b, c] = [1, 2].map(|n| (axis + n) % 3);
        let (x, y) = (low / self.size - CUT_MARGIN, high / self.size + CUT_MARGIN);
        let along = |a: usize| {
            let most = self.grid.dims[a] as i64 - 4;
            (x[a].floor() as i64).max(0)..=(y[a].floor() as i64).min(most)
        };
        if index < 0 || index + 3 > self.grid.dims[axis] as i64 {
            return false;
        }
        along(b).any(|i| {
            along(c).any(|j| {
                let mut q = [0; 3];
                (q[axis], q[b], q[c]) = (index, i, j);
                let corner = self.grid.vertex(q.map(|q: i64| q as usize + 1));
                self.is_cut(Square { corner, axis: axis as u8 })
            })
        })
    }

    /// Splits edges until no face near a cut square passes through its plane, and then no edge in a cut square
    /// through a plane across its sides.
    ///
    /// Each stage works on one family of parallel planes. Later stages only subdivide faces, so they undo nothing, and
    /// the process ends.
    pub(super) fn split(&self, mesh: &mut HalfEdgeMesh) {
        if self.squares.is_empty() {
            return;
        }
        for axis in 0..3 {
            let with_squares = self.planes_with_squares(axis);
            let may_be = |_: [Vec3; 2], index: i64| with_squares.binary_search(&index).is_ok();
            self.split_stage(mesh, axis, may_be, |cut, mesh, e, index| {
                let h = e.halfedge();
                [h, h.twin()].map(|h| mesh.face(h)).into_iter().any(|f| {
                    let (low, high) = bounds(mesh.corners(f));
                    !mesh.is_cap(f) && cut.meets(axis, index, [low, high])
                })
            });
        }
        for axis in 0..3 {
            let is_in_plane = |[p, q]: [Vec3; 2], _| (0..3).any(|a| a != axis && p[a] == q[a]);
            self.split_stage(mesh, axis, is_in_plane, |cut, mesh, e, _| {
                let h = e.halfedge();
                let [p, q] = [mesh.from(h), mesh.to(h)].map(|v| mesh.position(v));
                (0..3).filter(|&a| a != axis && p[a] == q[a]).any(|a| {
                    let plane = cut.plane_of(a, p[a]);
                    plane.is_some_and(|i| cut.meets(a, i, [p.min(q), p.max(q)]))
                })
            });
        }
    }

    /// The indices of the lattice planes across an axis that contain a square, ascending.
    fn planes_with_squares(&self, axis: usize) -> Vec<i64> {
        let across = self.squares.iter().filter(|s| usize::from(s.axis) == axis);
        let mut planes: Vec<i64> =
            across.map(|s| self.grid.position(s.corner)[axis] as i64 - 1).collect();
        planes.sort_unstable();
        planes.dedup();
        planes
    }

    /// Splits the edges that pass through a lattice plane across an axis, if `is_wanted` holds; it does not unless `may_be`, which has the ends of
    /// the edge and the index of the plane, does.
    pub(super) fn split_stage(
        &self,
        mesh: &mut HalfEdgeMesh,
        axis: usize,
        may_be: impl Fn([Vec3; 2], i64) -> bool,
        is_wanted: impl Fn(&Cut, &HalfEdgeMesh, Edge, i64) -> bool,
    ) {
        let planes = |mesh: &HalfEdgeMesh, e: Edge| {
            let h = e.halfedge();
            let ends = [mesh.from(h), mesh.to(h)].map(|v| mesh.position(v));
            let [p, q] = ends.map(|p| p[axis]);
            let (low, high) = (p.min(q), p.max(q));
            let first = (low / self.size[axis]).floor() as i64;
            let last = (high / self.size[axis]).ceil() as i64;
            let is_between = move |i: i64| low < self.plane(axis, i) && self.plane(axis, i) < high;
            let may_be = &may_be;
            (first..=last).filter(move |&i| is_between(i) && may_be(ends, i))
        };
        // Plane by plane: edges that result from a split do not cross the same plane again.
        let mut edges: Vec<Vec<Edge>> = Vec::new();
        let least = mesh.vertices().map(|v| mesh.position(v)[axis]).fold(f32::INFINITY, f32::min);
        let first = (least / self.size[axis]).floor() as i64;
        let put = |edges: &mut Vec<Vec<Edge>>, i: i64, e: Edge| {
            let at = (i - first) as usize;
            edges.resize_with(edges.len().max(at + 1), Vec::new);
            edges[at].push(e);
        };
        for e in mesh.edges() {
            planes(mesh, e).for_each(|i| put(&mut edges, i, e));
        }
        let mut index = first - 1;
        while let Some(crossing) = edges.get_mut((index + 1 - first) as usize) {
            let crossing = std::mem::take(crossing);
            index += 1;
            for e in crossing {
                let h = e.halfedge();
                let is_cap = [h, h.twin()].iter().any(|&h| mesh.is_cap(mesh.face(h)));
                let passes = !is_cap && planes(mesh, e).any(|i| i == index);
                if !passes || !is_wanted(self, mesh, e, index) {
                    continue;
                }
                let [p, q] = [mesh.from(h), mesh.to(h)].map(|v| mesh.position(v));
                let plane = self.plane(axis, index);
                let x = p.lerp(q, (plane - p[axis]) / (q[axis] - p[axis]));
                let mut x = x.clamp(p.min(q), p.max(q));
                x[axis] = plane;
                let s = mesh.split_edge(e, x);
                for e in s.halves.into_iter().chain(s.across) {
                    let above = planes(mesh, e).filter(|&i| i > index);
                    above.for_each(|i| put(&mut edges, i, e));
                }
            }
        }
    }

    /// The cell of a point, if it is inside the volume.
    pub(super) fn cell(&self, p: Vec3) -> Option<u32> {
        let x = p / self.size;
        let index: [i64; 3] = std::array::from_fn(|a| x[a].floor() as i64);
        let inside = (0..3).all(|a| index[a] >= 0 && index[a] + 3 < self.grid.dims[a] as i64);
        inside.then(|| self.grid.vertex(index.map(|i| i as usize + 1)))
    }

    /// Per face slot, whether it is removed: if its cell becomes exact. Connected faces that extend into cells that were
    /// exact before are removed if that is so for most of their boundary with other faces.
    pub(super) fn removed(&self, tracked: &Tracked, is_rim: &[bool]) -> Vec<bool> {
        let mesh = &tracked.mesh;
        let mut removed = vec![false; mesh.face_slots()];
        let mut strays = Vec::new();
        for f in mesh.faces().filter(|&f| !mesh.is_cap(f)) {
            let cell = self.cell(mesh.corners(f).iter().sum::<Vec3>() / 3.0);
            match cell.filter(|&c| !self.old.is_exact(c)) {
                Some(cell) => removed[f.0 as usize] = self.new.is_exact(cell),
                None => strays.push(f),
            }
        }
        let mut is_stray = vec![false; mesh.face_slots()];
        strays.iter().for_each(|f| is_stray[f.0 as usize] = true);
        for &first in &strays {
            if !is_stray[first.0 as usize] {
                continue;
            }
            is_stray[first.0 as usize] = false;
            let (mut part, mut balance, mut i) = (vec![first], 0.0, 0);
            let (mut at_rim, mut is_alone) = (false, true);
            while i < part.len() {
                let at = |v: Vertex| is_rim.get(v.0 as usize).copied().unwrap_or(false);
                at_rim |= mesh.face_vertices(part[i]).into_iter().any(at);
                for h in mesh.face_halfedges(part[i]) {
                    let g = mesh.face(h.twin());
                    if is_stray[g.0 as usize] {
                        is_stray[g.0 as usize] = false;
                        part.push(g);
                    } else if !mesh.is_cap(g) && !part.contains(&g) {
                        let length = mesh.length(h.edge());
                        is_alone = false;
                        balance += if removed[g.0 as usize] { length } else { -length };
                    }
                }
                i += 1;
            }
            let is_removed = balance > 0.0 || is_alone && !at_rim;
            part.iter().for_each(|f| removed[f.0 as usize] = is_removed);
        }
        removed
    }

    /// The vertices in which a boundary crosses lattice edges. If it crosses one several times, back and forth, crossings
    /// cancel in pairs, and one or none is left; the others are only bends of the polyline.
    pub(super) fn nodes(
        &self,
        pieces: &Pieces,
        tracked: &Tracked,
        regions: &[&Region],
    ) -> Result<BTreeMap<LatticeEdge, u32>, Refused> {
        let next = boundary(&pieces.triangles).map_err(|v| {
            Refused::at("no manifold", self.cell(pieces.positions[v as usize].into()))
        })?;
        let mut nodes: BTreeMap<LatticeEdge, Vec<(bool, u32)>> = BTreeMap::new();
        let mut failed = Vec::new();
        let mut at_rim: BTreeSet<Vertex> = BTreeSet::new();
        for &v in next.keys() {
            let bound = pieces.bound_by(tracked, v);
            // A vertex of the rim may be there once for each of its fans.
            let mut is_first = |o: Option<Vertex>| o.is_none_or(|o| at_rim.insert(o));
            if pieces.is_rim(v) && (bound.is_none() || !is_first(pieces.origin[v as usize])) {
                continue;
            }
            let e = match bound {
                Some(e) => Some(e),
                None => match self.lattice_edge(pieces.positions[v as usize].into()) {
                    Ok(e) => e,
                    Err(sample) => {
                        failed.push(sample);
                        continue;
                    }
                },
            };
            if let Some(e) = e.filter(|&e| regions.iter().any(|r| r.is_on_seam(e))) {
                nodes.entry(e).or_default().push((bound.is_none(), v));
            }
        }
        if !failed.is_empty() {
            return Err(Refused::at("through a sample", failed));
        }
        let left = nodes.into_iter().filter(|(_, all)| all.len() % 2 == 1);
        // Those that were bound come first.
        Ok(left
            .map(|(e, mut all)| {
                all.sort_unstable();
                (e, all[0].1)
            })
            .collect())
    }

    /// The lattice edge that contains a position exactly, if any.
    ///
    /// # Errors
    ///
    /// The sample, if the position is exactly that of a sample.
    pub(super) fn lattice_edge(&self, p: Vec3) -> Result<Option<LatticeEdge>, u32> {
        let planes: [Option<i64>; 3] = std::array::from_fn(|a| self.plane_of(a, p[a]));
        if planes.iter().flatten().count() < 2 {
            return Ok(None);
        }
        let x = p / self.size;
        let index: [i64; 3] = std::array::from_fn(|a| planes[a].unwrap_or(x[a].floor() as i64) + 1);
        if (0..3).any(|a| index[a] < 1 || index[a] + 2 > self.grid.dims[a] as i64) {
            return Ok(None);
        }
        let from = self.grid.vertex(index.map(|i| i as usize));
        let axis = planes.iter().position(Option::is_none).ok_or(from)?;
        Ok(Some(LatticeEdge { from, axis: axis as u8 }))
    }

    /// The lattice edges of the cut at a sample, and whether all of the seam around it is cut.
    pub(super) fn cut_edges(&self, v: u32) -> (Vec<LatticeEdge>, bool) {
        let Link::Cycle(cycle, n) = self.new.link(v) else { return (Vec::new(), false) };
        let cycle = &cycle[..n as usize];
        let (mut edges, mut all) = (BTreeSet::new(), true);
        for i in 0..cycle.len() {
            let [d, e] = [cycle[i], cycle[(i + 1) % cycle.len()]];
            let mut corner = v;
            for x in [d, e] {
                if x % 2 == 0 {
                    corner = self.grid.neighbour(corner, x);
                }
            }
            if self.is_cut(Square { corner, axis: 3 - d / 2 - e / 2 }) {
                edges.extend([self.grid.edge(v, d), self.grid.edge(v, e)]);
            } else {
                all = false;
            }
        }
        (edges.into_iter().collect(), all)
    }

    /// The samples that the mesh has on the wrong side, ordered by the distance of their value from the isovalue; and samples at
    /// which the side is undecided.
    pub(super) fn wrong(
        &self,
        nodes: &BTreeMap<LatticeEdge, u32>,
        isovalue: f64,
    ) -> (Vec<u32>, Vec<u32>) {
        let level = self.field.isovalue_level(isovalue);
        let is_above = |v: u32| self.field.level(v) > level;
        let differs = |e: LatticeEdge| {
            let [a, b] = self.grid.ends(e);
            nodes.contains_key(&e) != (is_above(a) != is_above(b))
        };
        let mut different: BTreeSet<LatticeEdge> = BTreeSet::new();
        for s in &self.squares {
            different.extend(sides(self.grid, *s).into_iter().filter(|&e| differs(e)));
        }
        // Samples joined by edges that agree with the mesh are all on the right side or all on the wrong one.
        let mut wrong: BTreeSet<u32> = BTreeSet::new();
        let mut right: BTreeSet<u32> = BTreeSet::new();
        for &e in &different {
            for v in self.grid.ends(e) {
                if wrong.contains(&v) || right.contains(&v) {
                    continue;
                }
                let (mut group, mut anchored, mut i) = (vec![v], false, 0);
                while i < group.len() && group.len() <= MAX_WRONG_GROUP {
                    let (edges, is_all_cut) = self.cut_edges(group[i]);
                    anchored |= !is_all_cut;
                    for e in edges.into_iter().filter(|e| !different.contains(e)) {
                        for w in self.grid.ends(e) {
                            if !group.contains(&w) {
                                group.push(w);
                            }
                        }
                    }
                    i += 1;
                }
                let side = if anchored || i < group.len() { &mut right } else { &mut wrong };
                side.extend(group);
            }
        }
        let failed: Vec<u32> = different
            .iter()
            .map(|&e| self.grid.ends(e))
            .filter(|ends| wrong.contains(&ends[0]) == wrong.contains(&ends[1]))
            .flatten()
            .collect();
        let mut wrong: Vec<u32> = wrong.into_iter().collect();
        // Ordering by distance from the mesh would need distances; the values serve as well.
        let distance = |v: &u32| (self.field.sample(*v) - isovalue).abs();
        wrong.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        (wrong, failed)
    }

    /// Merges the boundary's vertices inside squares into those on lattice edges. Returns the cells in which that is impossible.
    pub(super) fn straighten(
        &self,
        made: &mut Tracked,
        rim: &[bool],
        changes: &mut Changes,
    ) -> Vec<u32> {
        let is_rim = |v: &Vertex| rim.get(v.0 as usize).copied().unwrap_or(false);
        let at = |mesh: &HalfEdgeMesh, v: Vertex| mesh.position(v);
        let mut bends: Vec<Vertex> = made
            .mesh
            .vertices()
            .filter(|&v| made.mesh.is_fixed(v) && made.key(v).is_none())
            .filter(|&v| made.along(v, true).is_some() && !is_rim(&v))
            .collect();
        while !bends.is_empty() {
            let before = bends.len();
            let mut left = Vec::new();
            for &v in &bends {
                let ends = [true, false].map(|forward| made.along(v, forward));
                let mut next = ends.into_iter().flatten().filter(|&w| {
                    let h = made.mesh.find_halfedge(v, w);
                    h.is_some_and(|h| made.mesh.is_link_kept(h))
                });
                let target = next.next().or(ends[0]);
                drop(next);
                let done = target.and_then(|w| made.contract(v, w, &at, changes));
                if done.is_none() {
                    left.push(v);
                }
            }
            if left.len() == before {
                let places = left.iter().filter_map(|&v| self.cell(made.mesh.position(v)));
                return places.collect();
            }
            bends = left;
        }
        Vec::new()
    }
}
