//! The tracked mesh with its boundary on the seam.
//!
//! # Invariants
//!
//! 1. The mesh is closed: every loop of its boundary is filled by a fan of caps around an extra vertex, the *hub*,
//!    so that the edits of a closed mesh apply. Caps and hubs are never recorded.
//! 2. Every vertex of the boundary is bound to a lattice edge of the seam, the one of the exact extraction's polyline;
//!    it is fixed. Hubs are fixed, and bound to none. No other vertex is fixed.
//! 3. No two bound vertices whose lattice edges share an exact cell are joined by an edge inside the mesh: the exact
//!    extraction might have the same edge.

use std::collections::{BTreeSet, HashMap};

use glam::Vec3;

use super::fans::boundary;
use super::region::{LatticeEdge, Link, PaddedGrid, Region};
use crate::mesh::{Edge, Face, HalfEdge, HalfEdgeMesh, Vertex};
use crate::topology::exact::ExactField;

/// The sample that the seam cannot cross.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stuck(pub(super) u32);

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracked {
    pub(super) mesh: HalfEdgeMesh,
    /// By vertex slot.
    keys: Vec<Option<LatticeEdge>>,
    at: HashMap<LatticeEdge, Vertex>,
}

/// The changes of edits at one isovalue.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    /// Faces that are removed, new, or have other vertices.
    pub(super) faces: BTreeSet<Face>,
    /// New vertices inside the mesh, and the ends of the edges that they have split.
    pub(super) born: Vec<(Vertex, [Vertex; 2])>,
}

impl Tracked {
    /// The lattice edge that a vertex is bound to.
    pub(super) fn key(&self, v: Vertex) -> Option<LatticeEdge> {
        self.keys.get(v.0 as usize).copied().flatten()
    }

    /// The vertex bound to a lattice edge.
    pub(super) fn vertex_at(&self, e: LatticeEdge) -> Option<Vertex> {
        self.at.get(&e).copied()
    }

    /// The bound vertices, ascending.
    pub(super) fn bound(&self) -> impl Iterator<Item = (Vertex, LatticeEdge)> + '_ {
        let slots = self.keys.iter().enumerate();
        slots.filter_map(|(v, key)| key.map(|key| (Vertex(v as u32), key)))
    }

    pub(super) fn bind(&mut self, v: Vertex, e: LatticeEdge) {
        if self.keys.len() <= v.0 as usize {
            self.keys.resize(v.0 as usize + 1, None);
        }
        self.keys[v.0 as usize] = Some(e);
        self.at.insert(e, v);
        self.mesh.set_fixed(v, true);
    }

    fn unbind(&mut self, v: Vertex) {
        if let Some(e) = self.keys.get_mut(v.0 as usize).and_then(Option::take)
            && self.at.get(&e) == Some(&v)
        {
            self.at.remove(&e);
        }
    }

    /// Unbinds vertices.
    pub(super) fn unbind_all(&mut self, vertices: &[Vertex]) {
        vertices.iter().for_each(|&v| self.unbind(v));
    }

    /// The mesh of some triangles, each vertex of whose boundary is bound by `key`. `positions` are by vertex slot.
    pub(super) fn of(
        mut positions: Vec<[f32; 3]>,
        mut triangles: Vec<[u32; 3]>,
        key: impl Fn(u32) -> Option<LatticeEdge>,
    ) -> std::result::Result<Tracked, Vec3> {
        let place = |v: u32| Vec3::from(positions[v as usize]);
        let next = boundary(&triangles).map_err(place)?;
        let n_faces = triangles.len();
        let mut fixed = vec![false; positions.len()];
        let mut seen: BTreeSet<u32> = BTreeSet::new();
        let mut hubs = Vec::new();
        for &first in next.keys() {
            if seen.contains(&first) {
                continue;
            }
            let hub = positions.len() as u32;
            positions.push([0.0; 3]);
            fixed.push(false);
            hubs.push(hub);
            let (mut a, mut sum, mut n) = (first, Vec3::ZERO, 0.0);
            loop {
                let b = next[&a];
                triangles.push([b, a, hub]);
                sum += Vec3::from(positions[a as usize]);
                n += 1.0;
                seen.insert(a);
                a = b;
                if a == first {
                    break;
                }
            }
            positions[hub as usize] = (sum / n).to_array();
        }
        let caps: Vec<bool> = (0..triangles.len()).map(|f| f >= n_faces).collect();
        for &v in seen.iter().chain(&hubs) {
            fixed[v as usize] = true;
        }
        let mesh = HalfEdgeMesh::from_triangles(&positions, &fixed, &triangles, &caps);
        // The error has no position; a vertex of the boundary serves.
        let somewhere = |_| seen.first().map_or(Vec3::ZERO, |&v| positions[v as usize].into());
        let mesh = mesh.map_err(somewhere)?;
        let mut tracked = Tracked { mesh, ..Tracked::default() };
        for v in seen {
            if let Some(e) = key(v) {
                tracked.bind(Vertex(v), e);
            }
        }
        Ok(tracked)
    }

    /// Whether a half-edge is on the boundary, seen from the mesh.
    pub(super) fn is_boundary(&self, h: HalfEdge) -> bool {
        !self.mesh.is_cap(self.mesh.face(h)) && self.mesh.is_cap(self.mesh.face(h.twin()))
    }

    /// The vertex after another one on the boundary, or before it.
    pub(super) fn along(&self, v: Vertex, forward: bool) -> Option<Vertex> {
        let is_it = |h: &HalfEdge| self.is_boundary(if forward { *h } else { h.twin() });
        self.mesh.spokes(v).find(is_it).map(|h| self.mesh.to(h))
    }

    /// Whether an edge has a face of the mesh proper on both sides.
    pub(super) fn is_inner(&self, e: Edge) -> bool {
        let h = e.halfedge();
        !self.mesh.is_cap(self.mesh.face(h)) && !self.mesh.is_cap(self.mesh.face(h.twin()))
    }

    /// Moves the seam across a sample: vertices bound to the sample's lattice edges on one side become bound to those on
    /// the other.
    ///
    /// `place` is the position of the sample, `at` gives those of vertices. New vertices are put at `place`, so that the
    /// surface does not change.
    pub(super) fn cross_sample(
        &mut self,
        region: &Region,
        sample: u32,
        place: Vec3,
        at: &dyn Fn(&HalfEdgeMesh, Vertex) -> Vec3,
        changes: &mut Changes,
    ) -> std::result::Result<(), Stuck> {
        let stuck = Stuck(sample);
        let Link::Cycle(cycle, n) = region.link(sample) else { return Err(stuck) };
        let (cycle, n) = (&cycle[..n as usize], n as usize);
        let grid = region.grid;
        let edges: Vec<LatticeEdge> = cycle.iter().map(|&d| grid.edge(sample, d)).collect();
        let is_old: Vec<bool> = edges.iter().map(|e| self.at.contains_key(e)).collect();
        let starts: Vec<usize> =
            (0..n).filter(|&i| is_old[i] && !is_old[(i + n - 1) % n]).collect();
        let &[start] = &starts[..] else { return Err(stuck) };
        let n_old = is_old.iter().filter(|o| **o).count();
        let old: Vec<usize> = (0..n_old).map(|i| (start + i) % n).collect();
        let mut run: Vec<Vertex> = old.iter().map(|&i| self.at[&edges[i]]).collect();
        // The new edges in the order of the run: against the cycle.
        let new: Vec<LatticeEdge> =
            (0..n - n_old).map(|i| edges[(start + n - 1 - i) % n]).collect();
        let (last, beyond) = (cycle[old[n_old - 1]], cycle[(old[n_old - 1] + 1) % n]);
        let forward = self.runs_forward(&run, grid, sample, [last, beyond]).ok_or(stuck)?;
        let ends = [(run[0], !forward), (run[n_old - 1], forward)]
            .map(|(v, forward)| self.along(v, forward));
        let [Some(before), Some(after)] = ends else { return Err(stuck) };
        let touched: Vec<Vertex> = run.iter().copied().chain([before, after]).collect();
        for v in &touched {
            changes.faces.extend(self.faces_around(*v));
        }
        while run.len() > new.len() {
            let can = |t: &Tracked, i: usize| {
                t.mesh.find_halfedge(run[i], run[i + 1]).is_some_and(|h| t.mesh.is_link_kept(h))
            };
            let i = (0..run.len() - 1).find(|&i| can(self, i)).unwrap_or(0);
            self.contract(run[i], run[i + 1], at, changes).ok_or(stuck)?;
            run.remove(i);
        }
        run.iter().for_each(|&v| self.unbind(v));
        let mut at_end = true;
        while run.len() < new.len() {
            let (a, b) = if at_end { (run[run.len() - 1], after) } else { (run[0], before) };
            let h = self.mesh.find_halfedge(a, b).ok_or(stuck)?;
            let v = self.mesh.split_edge(h.edge(), place).vertex;
            self.mesh.set_fixed(v, true);
            if at_end {
                run.push(v);
            } else {
                run.insert(0, v);
            }
            at_end = !at_end;
        }
        for (&v, &e) in run.iter().zip(&new) {
            self.bind(v, e);
            self.mesh.set_position(v, place);
        }
        for &v in run.iter().chain([&before, &after]) {
            if self.mesh.has_vertex(v) {
                changes.faces.extend(self.faces_around(v));
            }
        }
        self.split_bound_chords(region, &run, at, changes);
        Ok(())
    }

    /// Whether the vertices of a run follow each other forwards on the boundary and continue into the square that two
    /// directions of a sample span (true), or backwards (false); `None` if neither.
    fn runs_forward(
        &self,
        run: &[Vertex],
        grid: PaddedGrid,
        sample: u32,
        [last, beyond]: [u8; 2],
    ) -> Option<bool> {
        let corner = grid.neighbour(grid.neighbour(sample, last), beyond);
        let sides = [grid.edge(corner, last ^ 1), grid.edge(corner, beyond ^ 1)];
        [true, false].into_iter().find(|&forward| {
            let follow = run.windows(2).all(|w| self.along(w[0], forward) == Some(w[1]));
            let end = self.along(run[run.len() - 1], forward).and_then(|v| self.key(v));
            follow && end.is_some_and(|e| sides.contains(&e))
        })
    }

    pub(super) fn faces_around(&self, v: Vertex) -> Vec<Face> {
        self.mesh.spokes(v).map(|h| self.mesh.face(h)).collect()
    }

    /// Merges a vertex of the boundary into the next one, after splitting edges that prevent it.
    pub(super) fn contract(
        &mut self,
        a: Vertex,
        b: Vertex,
        at: &dyn Fn(&HalfEdgeMesh, Vertex) -> Vec3,
        changes: &mut Changes,
    ) -> Option<()> {
        let h = self.mesh.find_halfedge(a, b)?;
        if !self.mesh.is_link_kept(h) {
            let opposite = [h, h.twin()].map(|h| self.mesh.to(self.mesh.next(h)));
            let common: Vec<Vertex> = self
                .mesh
                .one_ring(a)
                .filter(|w| *w != b && !opposite.contains(w))
                .filter(|&w| self.mesh.find_halfedge(b, w).is_some())
                .collect();
            for w in common {
                let inner = [a, b].into_iter().find_map(|v| {
                    self.mesh.find_halfedge(v, w).filter(|h| self.is_inner(h.edge()))
                })?;
                self.split_inner(inner.edge(), at, changes);
            }
        }
        let h = self.mesh.find_halfedge(a, b)?;
        if !self.mesh.is_link_kept(h) {
            return None;
        }
        changes.faces.extend(self.faces_around(a));
        self.unbind(a);
        let collapsed = self.mesh.collapse(h);
        changes.faces.extend(collapsed.faces);
        changes.faces.extend(self.faces_around(b));
        Some(())
    }

    /// Splits an edge inside the mesh in its middle.
    fn split_inner(
        &mut self,
        e: Edge,
        at: &dyn Fn(&HalfEdgeMesh, Vertex) -> Vec3,
        changes: &mut Changes,
    ) -> Vertex {
        let h = e.halfedge();
        let ends = [self.mesh.from(h), self.mesh.to(h)];
        let middle = 0.5 * (at(&self.mesh, ends[0]) + at(&self.mesh, ends[1]));
        let split = self.mesh.split_edge(e, middle);
        changes.faces.extend(self.faces_around(split.vertex));
        changes.born.push((split.vertex, ends));
        split.vertex
    }

    /// Splits the edges inside the mesh between bound vertices, one of them among those given, whose lattice edges
    /// share an exact cell.
    pub(super) fn split_bound_chords(
        &mut self,
        region: &Region,
        vertices: &[Vertex],
        at: &dyn Fn(&HalfEdgeMesh, Vertex) -> Vec3,
        changes: &mut Changes,
    ) {
        for &v in vertices {
            let Some(e) = self.key(v).filter(|_| self.mesh.has_vertex(v)) else { continue };
            let is_chord = |h: &HalfEdge| {
                let other = self.key(self.mesh.to(*h));
                self.is_inner(h.edge()) && other.is_some_and(|o| share_exact_cell(region, e, o))
            };
            let chords: Vec<Edge> =
                self.mesh.spokes(v).filter(is_chord).map(|h| h.edge()).collect();
            for chord in chords {
                self.split_inner(chord, at, changes);
            }
        }
    }
}

/// Whether two lattice edges are sides of one exact cell.
pub(super) fn share_exact_cell(region: &Region, a: LatticeEdge, b: LatticeEdge) -> bool {
    let grid = region.grid;
    let others = grid.cells_around(b);
    grid.cells_around(a).into_iter().any(|c| others.contains(&c) && region.is_exact(c))
}

/// Position of the exact extraction's vertex on a lattice edge, voxel frame.
pub(super) fn place_on(field: &ExactField, e: LatticeEdge, isovalue: f64) -> Vec3 {
    let to = e.from + field.strides()[e.axis as usize];
    let (fa, fb) = (field.sample(e.from), field.sample(to));
    let t = (isovalue - fa) / (fb - fa);
    let t = if t.is_finite() { t.clamp(EDGE_MARGIN, 1.0 - EDGE_MARGIN) } else { 0.5 };
    let mut p = field.position(e.from).map(|x| x as f64);
    p[e.axis as usize] += t;
    let size = field.volume().voxel_size();
    Vec3::from(std::array::from_fn(|a| (p[a] * size[a]) as f32))
}

/// Least distance of a vertex from a sample, as a share of the lattice edge.
pub(super) const EDGE_MARGIN: f64 = 1e-4;

/// Position of a sample, voxel frame.
pub(super) fn place_of(field: &ExactField, v: u32) -> Vec3 {
    let size = field.volume().voxel_size();
    let p = field.position(v);
    Vec3::from(std::array::from_fn(|a| (p[a] as f64 * size[a]) as f32))
}
