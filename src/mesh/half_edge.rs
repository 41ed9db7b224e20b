//! The half-edge mesh: connectivity and vertex positions, read access, construction from triangles.
//!
//! ```text
//!            to(h)
//!           /  ^  \            h and twin(h) = h ^ 1 are the two half-edges of edge h / 2;
//!          / h |   \           next(h) turns counter-clockwise inside face(h).
//!         /    |    \
//!        x     |twin x
//!         \    v    /
//!          \  from /
//!           \  |  /
//!            from(h)
//! ```
//!
//! # Invariants
//!
//! Kept by every edit and checked by [`HalfEdgeMesh::check`]:
//!
//! 1. `twin(twin(h)) == h`, `from(h) == to(twin(h))`, `next(next(next(h))) == h`.
//! 2. Every live half-edge has a live face; every edge has two different faces (closed).
//! 3. The faces around a vertex form one cycle (vertex-manifold); a live vertex has valence >= 3.
//! 4. No two edges join the same two vertices, so no two faces have the same three vertices.
//! 5. The vertices of caps are fixed.
//!
//! Slots of removed vertices, edges and faces stay empty until a replacement of faces reuses them, so a handle
//! keeps its meaning while a mesh is tracked.

use glam::Vec3;
use rayon::prelude::*;

use super::connectivity::Connectivity;
use crate::error::{Error, Result};
use crate::grouped::grouped;

/// Content of an empty slot.
pub(super) const NONE: u32 = u32::MAX;

/// If fewer than one of this many vertices are free, their faces are found one by one, else all faces are asked.
const FEW: usize = 16;

/// Slots per task at least, where all of them are visited.
const MIN_TASK: usize = 1024;

/// Handle of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Vertex(pub u32);

/// Handle of a half-edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HalfEdge(pub u32);

/// Handle of an edge: half-edges 2e and 2e + 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Edge(pub u32);

/// Handle of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Face(pub u32);

impl HalfEdge {
    /// The half-edge in the opposite direction.
    pub fn twin(self) -> HalfEdge {
        HalfEdge(self.0 ^ 1)
    }

    /// The edge it belongs to.
    pub fn edge(self) -> Edge {
        Edge(self.0 >> 1)
    }
}

impl Edge {
    /// One of its half-edges; the other is its twin.
    pub fn halfedge(self) -> HalfEdge {
        HalfEdge(self.0 << 1)
    }
}

/// A closed oriented triangle mesh with half-edge connectivity.
#[derive(Clone, Debug, Default)]
pub struct HalfEdgeMesh {
    /// Per half-edge: the vertex it points to; `NONE` where the slot is empty.
    pub(super) to: Vec<u32>,
    /// Per half-edge: the next one inside its face.
    pub(super) next: Vec<u32>,
    /// Per half-edge: its face.
    pub(super) face: Vec<u32>,
    /// Per vertex: one half-edge that leaves it; `NONE` where the slot is empty.
    pub(super) vertex_halfedge: Vec<u32>,
    /// Per face: one of its half-edges; `NONE` where the slot is empty.
    pub(super) face_halfedge: Vec<u32>,
    pub(super) positions: Vec<Vec3>,
    pub(super) fixed: Vec<bool>,
    pub(super) pinned: Vec<bool>,
    pub(super) caps: Vec<bool>,
    pub(super) n_vertices: usize,
    pub(super) n_faces: usize,
    /// The faces that edits have changed, in their order.
    pub(super) changed: Vec<Face>,
}

/// A mesh, or a part of one, as arrays without empty slots, for kernels.
#[derive(Clone, Debug, Default)]
pub struct Compacted {
    /// Faces, one-rings, and which vertices are constrained.
    pub connectivity: Connectivity,
    /// Positions in the order of `vertices`, voxel frame.
    pub positions: Vec<[f32; 3]>,
    /// The live vertices, ascending.
    pub vertices: Vec<Vertex>,
    /// The live faces, ascending; the order of `connectivity.faces`.
    pub faces: Vec<Face>,
}

impl HalfEdgeMesh {
    /// A mesh from triangles, counter-clockwise seen from lower values.
    ///
    /// `fixed` is by vertex, `caps` by triangle.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the triangles do not form a closed oriented manifold.
    pub fn from_triangles(
        positions: &[[f32; 3]],
        fixed: &[bool],
        triangles: &[[u32; 3]],
        caps: &[bool],
    ) -> Result<HalfEdgeMesh> {
        let mut mesh = HalfEdgeMesh {
            positions: positions.iter().map(|&p| Vec3::from(p)).collect(),
            fixed: fixed.to_vec(),
            pinned: vec![false; positions.len()],
            vertex_halfedge: vec![NONE; positions.len()],
            ..HalfEdgeMesh::default()
        };
        for (f, &[a, b, c]) in triangles.iter().enumerate() {
            let is_one = |v: u32| (v as usize) < positions.len();
            if a == b || b == c || c == a || ![a, b, c].into_iter().all(is_one) {
                return Err(Error::input(format!(
                    "triangle {f} is {:?}, expected three vertices of the mesh",
                    [a, b, c]
                )));
            }
        }
        // The directed edges by their lower end: higher end, direction, corner.
        let sides = triangles.iter().enumerate().flat_map(|(f, t)| {
            (0..3).map(move |i| {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                (a.min(b), (a.max(b), a > b, (3 * f + i) as u32))
            })
        });
        let (starts, mut sides) = grouped(positions.len(), sides);
        let mut corner_halfedge = vec![NONE; sides.len()];
        for (low, ends) in (0..).zip(starts.windows(2)) {
            let of_vertex = &mut sides[ends[0] as usize..ends[1] as usize];
            of_vertex.sort_unstable();
            for pair in of_vertex.chunks(2) {
                let high = pair[0].0;
                let is_good =
                    pair.len() == 2 && pair[1].0 == high && (pair[0].1, pair[1].1) == (false, true);
                if !is_good {
                    return Err(Error::input(format!(
                        "edge {low} to {high} is open, non-manifold or misoriented, expected two triangles of opposite direction"
                    )));
                }
                let h = mesh.to.len() as u32;
                mesh.to.extend([high, low]);
                corner_halfedge[pair[0].2 as usize] = h;
                corner_halfedge[pair[1].2 as usize] = h + 1;
            }
        }
        mesh.next = vec![NONE; mesh.to.len()];
        mesh.face = vec![NONE; mesh.to.len()];
        for (f, t) in triangles.iter().enumerate() {
            for i in 0..3 {
                let h = corner_halfedge[3 * f + i];
                mesh.next[h as usize] = corner_halfedge[3 * f + (i + 1) % 3];
                mesh.face[h as usize] = f as u32;
                mesh.vertex_halfedge[t[i] as usize] = h;
            }
            mesh.face_halfedge.push(corner_halfedge[3 * f]);
        }
        mesh.caps = caps.to_vec();
        mesh.n_faces = triangles.len();
        mesh.n_vertices = mesh.vertex_halfedge.iter().filter(|&&h| h != NONE).count();
        mesh.check()?;
        Ok(mesh)
    }

    /// The faces that collapses, flips and splits have changed, added or removed since the last call, ascending.
    pub(crate) fn take_changed(&mut self) -> Vec<Face> {
        let mut changed = std::mem::take(&mut self.changed);
        changed.sort_unstable();
        changed.dedup();
        changed
    }

    /// Number of live vertices.
    pub fn n_vertices(&self) -> usize {
        self.n_vertices
    }

    /// Number of live faces.
    pub fn n_faces(&self) -> usize {
        self.n_faces
    }

    /// Number of live edges; three for every two faces, as the mesh is closed.
    pub fn n_edges(&self) -> usize {
        self.n_faces / 2 * 3
    }

    /// V - E + F.
    pub fn euler(&self) -> i64 {
        self.n_vertices as i64 - self.n_edges() as i64 + self.n_faces as i64
    }

    /// Number of vertex slots, empty ones included: every handle is below it.
    pub fn vertex_slots(&self) -> usize {
        self.vertex_halfedge.len()
    }

    /// Number of edge slots, empty ones included.
    pub fn edge_slots(&self) -> usize {
        self.to.len() / 2
    }

    /// Number of face slots, empty ones included.
    pub fn face_slots(&self) -> usize {
        self.face_halfedge.len()
    }

    /// Whether the vertex exists; one past all slots does not.
    pub fn has_vertex(&self, v: Vertex) -> bool {
        self.vertex_halfedge.get(v.0 as usize).is_some_and(|&h| h != NONE)
    }

    /// Whether the edge exists.
    pub fn has_edge(&self, e: Edge) -> bool {
        self.to[2 * e.0 as usize] != NONE
    }

    /// Whether the face exists.
    pub fn has_face(&self, f: Face) -> bool {
        self.face_halfedge[f.0 as usize] != NONE
    }

    /// The live vertices, ascending.
    pub fn vertices(&self) -> impl Iterator<Item = Vertex> + '_ {
        (0..self.vertex_slots() as u32).map(Vertex).filter(|&v| self.has_vertex(v))
    }

    /// The live edges, ascending.
    pub fn edges(&self) -> impl Iterator<Item = Edge> + '_ {
        (0..self.edge_slots() as u32).map(Edge).filter(|&e| self.has_edge(e))
    }

    /// The live faces, ascending.
    pub fn faces(&self) -> impl Iterator<Item = Face> + '_ {
        (0..self.face_slots() as u32).map(Face).filter(|&f| self.has_face(f))
    }

    /// The live edges, ascending, on all threads.
    pub(crate) fn par_edges(&self) -> impl ParallelIterator<Item = Edge> + '_ {
        let slots = (0..self.edge_slots() as u32).into_par_iter().with_min_len(MIN_TASK);
        slots.map(Edge).filter(|&e| self.has_edge(e))
    }

    /// The live faces, ascending, on all threads.
    pub(crate) fn par_faces(&self) -> impl ParallelIterator<Item = Face> + '_ {
        let slots = (0..self.face_slots() as u32).into_par_iter().with_min_len(MIN_TASK);
        slots.map(Face).filter(|&f| self.has_face(f))
    }

    /// The vertex a half-edge points to.
    #[inline]
    pub fn to(&self, h: HalfEdge) -> Vertex {
        Vertex(self.to[h.0 as usize])
    }

    /// The vertex a half-edge leaves.
    #[inline]
    pub fn from(&self, h: HalfEdge) -> Vertex {
        Vertex(self.to[(h.0 ^ 1) as usize])
    }

    /// The next half-edge inside the face.
    #[inline]
    pub fn next(&self, h: HalfEdge) -> HalfEdge {
        HalfEdge(self.next[h.0 as usize])
    }

    /// The previous half-edge inside the face.
    #[inline]
    pub fn prev(&self, h: HalfEdge) -> HalfEdge {
        self.next(self.next(h))
    }

    /// The face on the left of a half-edge.
    #[inline]
    pub fn face(&self, h: HalfEdge) -> Face {
        Face(self.face[h.0 as usize])
    }

    /// One half-edge that leaves the vertex.
    #[inline]
    pub fn outgoing(&self, v: Vertex) -> HalfEdge {
        HalfEdge(self.vertex_halfedge[v.0 as usize])
    }

    /// Position of a vertex, voxel frame.
    #[inline]
    pub fn position(&self, v: Vertex) -> Vec3 {
        self.positions[v.0 as usize]
    }

    /// Moves a vertex.
    pub fn set_position(&mut self, v: Vertex, p: Vec3) {
        self.positions[v.0 as usize] = p;
    }

    /// Whether a vertex is pinned, as every fixed one is: edits do not remove it, kernels do not move it.
    #[inline]
    pub fn is_pinned(&self, v: Vertex) -> bool {
        self.fixed[v.0 as usize] || self.pinned[v.0 as usize]
    }

    /// Pins or unpins a vertex.
    pub fn set_pinned(&mut self, v: Vertex, pinned: bool) {
        self.pinned[v.0 as usize] = pinned;
    }

    /// Whether a vertex is fixed: it is pinned, and no edit joins it to another fixed one by an edge.
    #[inline]
    pub fn is_fixed(&self, v: Vertex) -> bool {
        self.fixed[v.0 as usize]
    }

    /// Fixes or releases a vertex; unpins it in either case.
    pub(crate) fn set_fixed(&mut self, v: Vertex, fixed: bool) {
        self.fixed[v.0 as usize] = fixed;
        self.pinned[v.0 as usize] = false;
    }

    /// Whether the face is a cap: it only closes the mesh.
    #[inline]
    pub fn is_cap(&self, f: Face) -> bool {
        self.caps[f.0 as usize]
    }

    /// The half-edges that leave a vertex, counter-clockwise.
    pub fn spokes(&self, v: Vertex) -> Spokes<'_> {
        let first = self.outgoing(v);
        Spokes { mesh: self, first, at: Some(first) }
    }

    /// The neighbours of a vertex, counter-clockwise.
    pub fn one_ring(&self, v: Vertex) -> impl Iterator<Item = Vertex> + '_ {
        self.spokes(v).map(|h| self.to(h))
    }

    /// Number of neighbours of a vertex.
    pub fn valence(&self, v: Vertex) -> usize {
        self.spokes(v).count()
    }

    /// Whether a vertex has at least `n` neighbours; it stops counting there, as some vertices have thousands.
    pub fn has_neighbours(&self, v: Vertex, n: usize) -> bool {
        self.spokes(v).take(n).count() == n
    }

    /// The half-edge from `a` to `b`, if they are joined.
    pub fn find_halfedge(&self, a: Vertex, b: Vertex) -> Option<HalfEdge> {
        self.spokes(a).find(|&h| self.to(h) == b)
    }

    /// The three vertices of a face, counter-clockwise.
    #[inline]
    pub fn face_vertices(&self, f: Face) -> [Vertex; 3] {
        let h = HalfEdge(self.face_halfedge[f.0 as usize]);
        [self.from(h), self.to(h), self.to(self.next(h))]
    }

    /// The three half-edges of a face.
    pub fn face_halfedges(&self, f: Face) -> [HalfEdge; 3] {
        let h = HalfEdge(self.face_halfedge[f.0 as usize]);
        [h, self.next(h), self.prev(h)]
    }

    /// The corners of a face, voxel frame.
    #[inline]
    pub fn corners(&self, f: Face) -> [Vec3; 3] {
        self.face_vertices(f).map(|v| self.position(v))
    }

    /// Length of an edge, voxels.
    pub fn length(&self, e: Edge) -> f32 {
        let h = e.halfedge();
        self.position(self.from(h)).distance(self.position(self.to(h)))
    }

    /// The mesh without empty slots.
    pub fn compacted(&self) -> Compacted {
        self.compacted_of(self.vertices().collect(), self.faces().collect(), |_| true)
    }

    /// The free vertices and their neighbours, with the faces between them; the neighbours are constrained and have empty one-rings.
    pub fn compacted_where(&self, is_free: impl Fn(Vertex) -> bool + Sync) -> Compacted {
        let free: Vec<Vertex> = self.vertices().filter(|&v| is_free(v)).collect();
        let faces = if free.len() < self.n_vertices / FEW {
            let around = free.iter().flat_map(|&v| self.spokes(v)).map(|h| self.face(h));
            let mut faces: Vec<Face> = around.collect();
            faces.sort_unstable();
            faces.dedup();
            faces
        } else {
            let is_near = |f: &Face| self.face_vertices(*f).into_iter().any(&is_free);
            self.par_faces().filter(is_near).collect()
        };
        let mut is_in = vec![false; self.vertex_slots()];
        let vertices = faces.iter().flat_map(|&f| self.face_vertices(f));
        vertices.for_each(|v| is_in[v.0 as usize] = true);
        let slots = (0..).map(Vertex).zip(is_in);
        let vertices = slots.filter(|v| v.1).map(|v| v.0).collect();
        self.compacted_of(vertices, faces, is_free)
    }

    fn compacted_of(
        &self,
        vertices: Vec<Vertex>,
        faces: Vec<Face>,
        has_ring: impl Fn(Vertex) -> bool + Sync,
    ) -> Compacted {
        let mut index = vec![NONE; self.vertex_slots()];
        for (i, v) in vertices.iter().enumerate() {
            index[v.0 as usize] = i as u32;
        }
        let index = |v: Vertex| index[v.0 as usize];
        let valence = |v: Vertex| if has_ring(v) { self.valence(v) as u32 } else { 0 };
        let ring = |v: Vertex| {
            let spokes = has_ring(v).then(|| self.spokes(v));
            spokes.into_iter().flatten().map(|h| index(self.to(h)))
        };
        let each = vertices.par_iter().copied().with_min_len(MIN_TASK);
        let mut ring_offsets = vec![0];
        ring_offsets.par_extend(each.clone().map(valence));
        (1..ring_offsets.len()).for_each(|i| ring_offsets[i] += ring_offsets[i - 1]);
        let connectivity = Connectivity {
            faces: faces.iter().map(|&f| self.face_vertices(f).map(index)).collect(),
            ring_offsets,
            ring: each.flat_map_iter(ring).collect(),
            constrained: vertices
                .iter()
                .map(|&v| u8::from(self.is_pinned(v) || !has_ring(v)))
                .collect(),
        };
        let positions = vertices.iter().map(|&v| self.position(v).to_array()).collect();
        Compacted { connectivity, positions, vertices, faces }
    }
}

/// Iterator over the half-edges that leave a vertex.
#[derive(Clone, Debug)]
pub struct Spokes<'a> {
    mesh: &'a HalfEdgeMesh,
    first: HalfEdge,
    at: Option<HalfEdge>,
}

impl Iterator for Spokes<'_> {
    type Item = HalfEdge;

    fn next(&mut self) -> Option<HalfEdge> {
        let h = self.at?;
        // The previous half-edge of h points to the vertex; its twin leaves it, counter-clockwise.
        let following = self.mesh.prev(h).twin();
        self.at = (following != self.first).then_some(following);
        Some(h)
    }
}
