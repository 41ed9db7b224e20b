//! Checks the invariants of [`HalfEdgeMesh`].

use super::half_edge::{Face, HalfEdge, HalfEdgeMesh, NONE};
use crate::error::{Error, Result};

impl HalfEdgeMesh {
    /// Checks every invariant listed in the module of [`HalfEdgeMesh`].
    ///
    /// # Errors
    ///
    /// [`Error::Input`] that names the first violation.
    pub fn check(&self) -> Result<()> {
        let fail = |what: String| Err(Error::input(what));
        let mut n_spokes = 0;
        let mut ring = Vec::new();
        for v in self.vertices() {
            let mut valence = 0;
            for h in self.spokes(v) {
                valence += 1;
                if valence > self.to.len() || self.from(h) != v {
                    return fail(format!("the faces around vertex {} do not form a cycle", v.0));
                }
            }
            if valence < 3 {
                return fail(format!("vertex {} has valence {valence}, expected at least 3", v.0));
            }
            n_spokes += valence;
            ring.clear();
            ring.extend(self.one_ring(v));
            ring.sort_unstable();
            if ring.windows(2).any(|w| w[0] == w[1]) {
                return fail(format!("vertex {} is joined twice to the same vertex", v.0));
            }
        }
        let mut n_live = 0;
        for h in (0..self.to.len() as u32).map(HalfEdge) {
            if self.to[h.0 as usize] == NONE {
                continue;
            }
            n_live += 1;
            if self.to[h.twin().0 as usize] == NONE || !self.has_vertex(self.to(h)) {
                return fail(format!("half-edge {} lacks its twin or its vertex", h.0));
            }
            let n = self.next(h);
            if self.next(self.next(n)) != h
                || self.from(n) != self.to(h)
                || self.face(n) != self.face(h)
            {
                return fail(format!("half-edge {} does not close its face", h.0));
            }
            if !self.has_face(self.face(h)) || self.face(h) == self.face(h.twin()) {
                return fail(format!("edge {} does not join two faces", h.edge().0));
            }
            if self.is_cap(self.face(h)) && !self.is_fixed(self.to(h)) {
                return fail(format!("vertex {} of a cap is not fixed", self.to(h).0));
            }
        }
        // A vertex with two fans of faces has half-edges that its one cycle does not reach.
        if n_spokes != n_live {
            return fail(format!(
                "{n_live} half-edges but {n_spokes} around vertices: a vertex has two fans"
            ));
        }
        if n_live != 3 * self.n_faces
            || self.faces().any(|f: Face| self.face_halfedges(f).map(|h| self.face(h)) != [f; 3])
        {
            return fail("faces and half-edges do not match".into());
        }
        if self.vertices().count() != self.n_vertices || self.faces().count() != self.n_faces {
            return fail("counts of vertices or faces are wrong".into());
        }
        Ok(())
    }
}
