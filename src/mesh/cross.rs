//! A vertex passes the border of the volume: from the isosurface proper to a cap, or back.

use glam::Vec3;

use super::{HalfEdge, Mesh, Vertex};

/// What the passage of a vertex changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Crossed {
    /// The vertices inserted where the border now cuts the edges around the vertex.
    pub inserted: Vec<Vertex>,
    /// The vertices around it that do not lie in the border any more.
    pub freed: Vec<Vertex>,
}

impl Mesh {
    /// Whether a vertex may pass the border plane `plane` (one bit of [`Mesh::border`]): it is not
    /// pinned and does not lie in it, and no face that is left between a cut edge and its neighbour lies
    /// flat in it.
    pub fn can_cross(&self, v: Vertex, plane: u8) -> bool {
        let cap = self.is_taken_out(v);
        let is_flat = |h: HalfEdge| {
            let beside = self.prev(h).twin();
            let lies = |h: HalfEdge| self.border(self.to(h)) & plane != 0;
            let is_cut = |h: HalfEdge| self.is_cut(h, plane, cap);
            lies(h) && lies(beside) && (is_cut(h) || is_cut(beside))
        };
        plane.count_ones() == 1
            && !self.is_pinned(v)
            && self.border(v) & plane == 0
            && !self.spokes(v).any(is_flat)
    }

    /// Whether a passage takes a vertex out of the volume.
    fn is_taken_out(&self, v: Vertex) -> bool {
        self.spokes(v).any(|h| !self.is_cap(self.face(h)))
    }

    /// Takes a vertex through a border plane: out of the volume if a face around it belongs to the
    /// isosurface proper, else into it. The edges around it are cut where `cut` (end at the vertex, other
    /// end) says, except where they end in the plane already, and all faces around the vertex change
    /// their kind.
    ///
    /// ```text
    ///        a                a
    ///      / | \            / | \
    ///     /  |  \          / .m. \
    ///    b---v---c   ->   b-m-v-m-c     inside the ring of m: caps
    ///     \  |  /          \ 'm' /
    ///      \ | /            \ | /
    ///        d                d
    /// ```
    pub fn cross(&mut self, v: Vertex, plane: u8, cut: impl Fn(Vec3, Vec3) -> Vec3) -> Crossed {
        debug_assert!(self.can_cross(v, plane));
        let cap = self.is_taken_out(v);
        let spokes: Vec<HalfEdge> =
            self.spokes(v).filter(|&h| self.is_cut(h, plane, cap)).collect();
        let mut crossed = Crossed::default();
        for h in spokes {
            let (a, e) = (self.to(h), h.edge());
            let common = if self.is_crease(e) { self.border(v) & self.border(a) } else { 0 };
            let m = self.split_edge(e, cut(self.position(v), self.position(a))).vertex;
            self.borders[m.0 as usize] = common | plane;
            crossed.inserted.push(m);
        }
        for f in self.spokes(v).map(|h| self.face(h)).collect::<Vec<_>>() {
            self.caps[f.0 as usize] = cap;
        }
        self.borders[v.0 as usize] = 0;
        for w in self.one_ring(v).collect::<Vec<_>>() {
            if self.border(w) != 0 && !self.spokes(w).any(|h| self.is_crease(h.edge())) {
                self.borders[w.0 as usize] &= super::PINNED;
                crossed.freed.push(w);
            }
        }
        crossed
    }

    /// Whether the edge to a neighbour is cut by a vertex's passage: a face beside it changes its kind, and
    /// the neighbour does not lie in the plane beside that face.
    fn is_cut(&self, h: HalfEdge, plane: u8, cap: bool) -> bool {
        let t = h.twin();
        let beside = [(self.face(h), self.next(h)), (self.face(t), self.prev(t))];
        let changes = beside.iter().any(|&(f, _)| self.is_cap(f) != cap);
        let meets = beside.iter().any(|&(_, across)| self.is_crease(across.edge()));
        changes && (self.border(self.to(h)) & plane == 0 || !meets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    /// Crosses and checks the mesh and the faces around the vertex.
    fn cross(mesh: &mut Mesh, v: Vertex, cap: bool) -> Crossed {
        assert!(mesh.can_cross(v, 4));
        let euler = mesh.euler();
        let crossed = mesh.cross(v, 4, |p, q| 0.7 * p + 0.3 * q);
        mesh.check().expect("a mesh");
        assert_eq!((mesh.euler(), mesh.border(v)), (euler, 0));
        assert!(mesh.spokes(v).all(|h| mesh.is_cap(mesh.face(h)) == cap));
        let on_crease = |w: Vertex| mesh.spokes(w).filter(|h| mesh.is_crease(h.edge())).count();
        for w in mesh.vertices() {
            assert_eq!(mesh.border(w) != 0, on_crease(w) != 0, "{w:?}");
            assert!(on_crease(w) % 2 == 0 && on_crease(w) <= 2, "{w:?} is pinched");
        }
        crossed
    }

    #[test]
    fn the_first_vertex_outside_opens_a_cap() {
        let mut mesh = shapes::octahedron(Vec3::ZERO, 1.0);
        let top = Vertex(4);
        let crossed = cross(&mut mesh, top, true);
        assert_eq!((crossed.inserted.len(), mesh.n_faces()), (4, 16));
        assert_eq!(mesh.faces().filter(|&f| mesh.is_cap(f)).count(), 4);
        assert!(crossed.inserted.iter().all(|&m| mesh.border(m) == 4 && mesh.valence(m) >= 4));
    }

    #[test]
    fn the_next_vertex_joins_the_cap_and_the_way_back_closes_it() {
        let mut mesh = shapes::octahedron(Vec3::ZERO, 1.0);
        cross(&mut mesh, Vertex(4), true);
        let caps = |mesh: &Mesh| mesh.faces().filter(|&f| mesh.is_cap(f)).count();
        let before = caps(&mesh);
        let crossed = cross(&mut mesh, Vertex(0), true);
        assert!(!crossed.inserted.is_empty() && caps(&mesh) > before);
        // One by one the caps' own vertices come back, until no cap is left.
        for _ in 0..100 {
            let own =
                |w: &Vertex| mesh.border(*w) == 0 && mesh.is_cap(mesh.face(mesh.outgoing(*w)));
            let Some(w) = mesh.vertices().filter(own).find(|&w| mesh.can_cross(w, 4)) else {
                break;
            };
            cross(&mut mesh, w, false);
        }
        assert_eq!(caps(&mesh), 0);
        assert!(mesh.vertices().all(|v| mesh.border(v) == 0));
    }

    #[test]
    fn a_vertex_in_the_plane_or_pinned_stays() {
        let mut mesh = shapes::octahedron(Vec3::ZERO, 1.0);
        let crossed = cross(&mut mesh, Vertex(4), true);
        assert!(!mesh.can_cross(crossed.inserted[0], 4));
        assert!(mesh.can_cross(crossed.inserted[0], 1));
        mesh.set_pinned(Vertex(0), true);
        assert!(!mesh.can_cross(Vertex(0), 4));
    }
}
