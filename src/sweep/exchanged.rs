//! The result of an exchange: a part of the mesh before and after.

use super::part::MeshPart;
use super::region::LatticeEdge;
use super::tracked::Tracked;
use crate::mesh::{Face, Vertex};

/// A part of the mesh after an exchange.
pub(super) struct Exchanged {
    pub(super) part: MeshPart,
    pub(super) made: Tracked,
    /// Per vertex slot (missing at the end): the vertex of the whole that it is.
    pub(super) origin: Vec<Option<Vertex>>,
    /// Per face slot: the face of the whole that it was, if it is not new.
    pub(super) was: Vec<Option<Face>>,
}

impl Exchanged {
    /// The lattice edge that a vertex is bound to, here or in the mesh before: of several fans at a vertex of the rim only one is
    /// bound here.
    pub(super) fn key(&self, before: &Tracked, v: Vertex) -> Option<LatticeEdge> {
        let origin = || self.origin.get(v.0 as usize).copied().flatten();
        self.made.key(v).or_else(|| before.key(origin()?))
    }

    /// Whether an edge of the boundary is one of the part's rim.
    pub(super) fn is_rim(&self, ends: [Vertex; 2]) -> bool {
        let origin = |v: Vertex| self.origin.get(v.0 as usize).copied().flatten();
        matches!(ends.map(origin), [Some(a), Some(b)] if self.part.rim.contains(&(a, b)))
    }

    /// Whether the rim is complete: it is not if the part was too small for the faces that had to be removed.
    pub(super) fn has_rim(&self) -> bool {
        let mesh = &self.made.mesh;
        let boundary = mesh.faces().filter(|&f| !mesh.is_cap(f)).flat_map(|f| {
            let own = mesh.face_halfedges(f).into_iter();
            own.filter(|&h| self.made.is_boundary(h)).map(|h| [mesh.from(h), mesh.to(h)])
        });
        boundary.filter(|&ends| self.is_rim(ends)).count() == self.part.rim.len()
    }
}
