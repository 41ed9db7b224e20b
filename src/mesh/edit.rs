//! The three edits: `can_x` tests whether `x` is legal, `x` does it and returns the changes. Edits never move a vertex.

use glam::Vec3;

use super::half_edge::{Edge, Face, HalfEdge, HalfEdgeMesh, NONE, Vertex};

/// The changes of a collapse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Collapsed {
    /// The removed vertex.
    pub removed: Vertex,
    /// The vertex that it merged into.
    pub target: Vertex,
    /// The two removed faces.
    pub faces: [Face; 2],
}

/// The changes of an edge split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SplitEdge {
    /// The new vertex.
    pub vertex: Vertex,
    /// The halves of the split edge: from the old start to the new vertex, and from there to the old end.
    pub halves: [Edge; 2],
    /// The new edges across the two old faces.
    pub across: [Edge; 2],
    /// The two new faces.
    pub faces: [Face; 2],
}

/// The changes of a flip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flipped {
    /// The edge, now between the two vertices that were opposite to it.
    pub edge: Edge,
    /// The two faces, with new vertices.
    pub faces: [Face; 2],
}

impl HalfEdgeMesh {
    /// Whether the start of `h` may merge into its end.
    ///
    /// The thesis's two constraints (section 3.6): the one-rings share exactly the two vertices
    /// opposite the edge, and no edge of one ring is an edge of the other. Besides, no valence falls below 3, a pinned vertex
    /// is not removed, no edge joins two fixed vertices and no face three.
    pub fn can_collapse(&self, h: HalfEdge) -> bool {
        let (v, w) = (self.from(h), self.to(h));
        if self.is_pinned(v) || !self.is_link_kept(h) {
            return false;
        }
        let joins_fixed = |s: HalfEdge| {
            let (a, b) = (self.to(s), self.to(self.next(s)));
            let is_new = self.find_halfedge(w, a).is_none();
            a != w && self.is_fixed(a) && (is_new || b != w && self.is_fixed(b))
        };
        !self.is_fixed(w) || !self.spokes(v).any(joins_fixed)
    }

    /// Whether the mesh stays a manifold of the same topology if the start of `h` merges into its end (link condition).
    pub(crate) fn is_link_kept(&self, h: HalfEdge) -> bool {
        let (v, w) = (self.from(h), self.to(h));
        let (x, y) = (self.to(self.next(h)), self.to(self.next(h.twin())));
        if x == y || !self.has_neighbours(x, 4) || !self.has_neighbours(y, 4) {
            return false;
        }
        // First constraint.
        let common =
            self.one_ring(v).filter(|&a| a != w && self.find_halfedge(w, a).is_some()).count();
        if common != 2 {
            return false;
        }
        // Second constraint: a shared ring edge joins two common neighbours, which are x and y.
        let ring_edge = |c: Vertex| {
            self.spokes(c).any(|s| {
                let (a, b) = (self.to(s), self.to(self.next(s)));
                (a, b) == (x, y) || (a, b) == (y, x)
            })
        };
        !(ring_edge(v) && ring_edge(w))
    }

    /// Merges the start of `h` into its end: removes one vertex, three edges and two faces.
    ///
    /// ```text
    ///        x                 x
    ///      / | \               |
    ///     /  |  \              |
    ///    v --h-> w     ->      w
    ///     \  |  /              |
    ///      \ | /               |
    ///        y                 y
    /// ```
    pub fn collapse(&mut self, h: HalfEdge) -> Collapsed {
        assert!(self.is_link_kept(h));
        let t = h.twin();
        let (v, w) = (self.from(h), self.to(h));
        let faces = [self.face(h), self.face(t)];
        let incoming: Vec<HalfEdge> = self.spokes(v).map(HalfEdge::twin).collect();
        for i in incoming {
            self.to[i.0 as usize] = w.0;
            self.changed.push(self.face(i));
        }
        let (keep_x, drop_x) = (self.next(h), self.prev(h));
        let (drop_y, keep_y) = (self.next(t), self.prev(t));
        // w -> x takes the place of v -> x, y -> w that of y -> v.
        self.replace(drop_x.twin(), keep_x);
        self.replace(drop_y.twin(), keep_y);
        let (x, y) = (self.to(keep_x), self.from(keep_y));
        self.vertex_halfedge[x.0 as usize] = keep_x.twin().0;
        self.vertex_halfedge[y.0 as usize] = keep_y.0;
        self.vertex_halfedge[w.0 as usize] = keep_x.0;
        for gone in [h, drop_x, drop_y] {
            for s in [gone, gone.twin()] {
                self.to[s.0 as usize] = NONE;
            }
        }
        for f in faces {
            self.face_halfedge[f.0 as usize] = NONE;
        }
        self.vertex_halfedge[v.0 as usize] = NONE;
        self.n_vertices -= 1;
        self.n_faces -= 2;
        Collapsed { removed: v, target: w, faces }
    }

    /// Replaces half-edge `old` by `new` in the face of `old`.
    fn replace(&mut self, old: HalfEdge, new: HalfEdge) {
        let (before, after, face) = (self.prev(old), self.next(old), self.face(old));
        self.next[before.0 as usize] = new.0;
        self.next[new.0 as usize] = after.0;
        self.face[new.0 as usize] = face.0;
        self.face_halfedge[face.0 as usize] = new.0;
    }

    /// Whether the edge may flip: its ends are not both pinned, the two vertices opposite it are not joined by an edge nor both
    /// fixed, and no valence falls below 3.
    pub fn can_flip(&self, e: Edge) -> bool {
        let h = e.halfedge();
        let (a, b) = (self.from(h), self.to(h));
        let (c, d) = (self.to(self.next(h)), self.to(self.next(h.twin())));
        !(self.is_pinned(a) && self.is_pinned(b))
            && c != d
            && self.has_neighbours(a, 4)
            && self.has_neighbours(b, 4)
            && !(self.is_fixed(c) && self.is_fixed(d))
            && self.find_halfedge(c, d).is_none()
    }

    /// Flips an edge.
    ///
    /// ```text
    ///        c                   c
    ///      /   \               / | \
    ///     a --h-> b     ->    a  |  b      h: d -> c
    ///      \   /               \ | /
    ///        d                   d
    /// ```
    pub fn flip(&mut self, e: Edge) -> Flipped {
        assert!(self.can_flip(e));
        let h0 = e.halfedge();
        let t0 = h0.twin();
        let (h1, h2) = (self.next(h0), self.prev(h0));
        let (t1, t2) = (self.next(t0), self.prev(t0));
        let (a, b, c, d) = (self.from(h0), self.to(h0), self.to(h1), self.to(t1));
        let (f, g) = (self.face(h0), self.face(t0));
        self.to[h0.0 as usize] = c.0;
        self.to[t0.0 as usize] = d.0;
        self.link_face(f, [h0, h2, t1]);
        self.link_face(g, [t0, t2, h1]);
        self.vertex_halfedge[a.0 as usize] = t1.0;
        self.vertex_halfedge[b.0 as usize] = h1.0;
        self.changed.extend([f, g]);
        Flipped { edge: e, faces: [f, g] }
    }

    /// Makes three half-edges the sides of a face.
    pub(super) fn link_face(&mut self, f: Face, sides: [HalfEdge; 3]) {
        for i in 0..3 {
            self.next[sides[i].0 as usize] = sides[(i + 1) % 3].0;
            self.face[sides[i].0 as usize] = f.0;
        }
        self.face_halfedge[f.0 as usize] = sides[0].0;
    }

    /// Splits an edge at a point: adds one vertex, three edges and two faces. Always legal.
    ///
    /// ```text
    ///        c                   c
    ///      /   \               / | \
    ///     a --h-> b     ->    a--m--b
    ///      \   /               \ | /
    ///        d                   d
    /// ```
    pub fn split_edge(&mut self, e: Edge, position: Vec3) -> SplitEdge {
        let h0 = e.halfedge();
        let t0 = h0.twin();
        let (h1, h2) = (self.next(h0), self.prev(h0));
        let (t1, t2) = (self.next(t0), self.prev(t0));
        let (b, c, d) = (self.to(h0), self.to(h1), self.to(t1));
        let (f, g) = (self.face(h0), self.face(t0));
        let m = Vertex(self.positions.len() as u32);
        self.positions.push(position);
        self.fixed.push(self.is_cap(f) || self.is_cap(g));
        self.pinned.push(false);
        self.vertex_halfedge.push(NONE);
        let k0 = self.add_edge(m, b);
        let p0 = self.add_edge(m, c);
        let q0 = self.add_edge(m, d);
        let (f2, g2) = (self.add_face(self.is_cap(f)), self.add_face(self.is_cap(g)));
        self.to[h0.0 as usize] = m.0;
        self.link_face(f, [h0, p0, h2]);
        self.link_face(f2, [k0, h1, p0.twin()]);
        self.link_face(g, [t0, t1, q0.twin()]);
        self.link_face(g2, [k0.twin(), q0, t2]);
        self.vertex_halfedge[m.0 as usize] = k0.0;
        self.vertex_halfedge[b.0 as usize] = k0.twin().0;
        self.n_vertices += 1;
        self.n_faces += 2;
        self.changed.extend([f, g, f2, g2]);
        SplitEdge {
            vertex: m,
            halves: [e, k0.edge()],
            across: [p0.edge(), q0.edge()],
            faces: [f2, g2],
        }
    }

    /// A new edge from `a` to `b`, not yet part of a face.
    fn add_edge(&mut self, a: Vertex, b: Vertex) -> HalfEdge {
        let h = HalfEdge(self.to.len() as u32);
        self.to.extend([b.0, a.0]);
        self.next.extend([NONE; 2]);
        self.face.extend([NONE; 2]);
        h
    }

    /// A new face slot.
    fn add_face(&mut self, cap: bool) -> Face {
        self.face_halfedge.push(NONE);
        self.caps.push(cap);
        Face(self.face_halfedge.len() as u32 - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn octahedron() -> HalfEdgeMesh {
        shapes::octahedron(Vec3::ZERO, 1.0)
    }

    /// A torus of n x m quads, each cut in two.
    fn torus(n: u32, m: u32) -> HalfEdgeMesh {
        let mut p = Vec::new();
        let mut t = Vec::new();
        for i in 0..n {
            for j in 0..m {
                let (u, v) = (
                    i as f32 / n as f32 * std::f32::consts::TAU,
                    j as f32 / m as f32 * std::f32::consts::TAU,
                );
                let r = 2.0 + 0.7 * v.cos();
                p.push([r * u.cos(), r * u.sin(), 0.7 * v.sin()]);
                let at = |a: u32, b: u32| (a % n) * m + b % m;
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                t.extend([[a, b, c], [a, c, d]]);
            }
        }
        let (np, nt) = (p.len(), t.len());
        HalfEdgeMesh::from_triangles(&p, &vec![false; np], &t, &vec![false; nt])
            .expect("a torus is closed")
    }

    #[test]
    fn split_adds_one_vertex_three_edges_two_faces() {
        let mut mesh = octahedron();
        for e in mesh.edges().collect::<Vec<_>>() {
            let s = mesh.split_edge(e, Vec3::ZERO);
            mesh.check().expect("a split keeps the invariants");
            assert_eq!(mesh.valence(s.vertex), 4);
        }
        assert_eq!((mesh.n_vertices(), mesh.n_faces(), mesh.euler()), (18, 32, 2));
    }

    #[test]
    fn tetrahedron_cannot_collapse_or_flip() {
        let mut mesh = octahedron();
        let next = |mesh: &HalfEdgeMesh| mesh.edges().find(|e| mesh.can_collapse(e.halfedge()));
        while let Some(e) = next(&mesh) {
            mesh.collapse(e.halfedge());
            mesh.check().expect("a collapse keeps the invariants");
            assert_eq!(mesh.euler(), 2);
        }
        assert_eq!(mesh.n_faces(), 4);
        assert!(mesh.edges().all(|e| !mesh.can_flip(e)));
    }

    #[test]
    fn flip_twice_restores_the_edge() {
        let mut mesh = torus(6, 5);
        let e = Edge(7);
        let ends = |m: &HalfEdgeMesh| {
            let mut x = [m.from(e.halfedge()), m.to(e.halfedge())];
            x.sort_unstable();
            x
        };
        let before = ends(&mesh);
        assert!(mesh.can_flip(e));
        mesh.flip(e);
        mesh.check().expect("a flip keeps the invariants");
        assert_ne!(ends(&mesh), before);
        mesh.flip(e);
        assert_eq!(ends(&mesh), before);
    }

    #[test]
    fn random_edits_keep_every_invariant_and_the_euler_characteristic() {
        let mut state = 88172645463325252u64;
        let mut random = move |n: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % n as u64) as usize
        };
        for (mut mesh, euler) in [(octahedron(), 2), (torus(7, 5), 0), (torus(3, 3), 0)] {
            let mut done = [0; 3];
            for step in 0..3000 {
                let edges: Vec<Edge> = mesh.edges().collect();
                let e = edges[random(edges.len())];
                let choice = if mesh.n_faces() > 400 { 1 } else { random(4).min(2) };
                match choice {
                    0 => {
                        mesh.split_edge(e, Vec3::ZERO);
                        done[0] += 1;
                    }
                    1 if mesh.can_collapse(e.halfedge()) => {
                        mesh.collapse(e.halfedge());
                        done[1] += 1;
                    }
                    2 if mesh.can_flip(e) => {
                        mesh.flip(e);
                        done[2] += 1;
                    }
                    _ => continue,
                }
                if step % 10 == 0 {
                    mesh.check().expect("every edit keeps the invariants");
                }
                assert_eq!(mesh.euler(), euler);
            }
            mesh.check().expect("every edit keeps the invariants");
            assert!(done.iter().all(|&n| n > 100), "each edit was tried: {done:?}");
        }
    }

    #[test]
    fn open_and_doubled_triangles_are_refused() {
        let p = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert!(HalfEdgeMesh::from_triangles(&p, &[false; 3], &[[0, 1, 2]], &[false]).is_err());
        assert!(
            HalfEdgeMesh::from_triangles(&p, &[false; 3], &[[0, 1, 2], [0, 2, 1]], &[false; 2])
                .is_err()
        );
    }
}
