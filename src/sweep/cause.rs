//! What ends the lifetimes of tracked triangles.
//!
//! # Theory
//!
//! The size of a spectrum is proportional to the number of its lifetimes, so it matters which edits end them. An edit within a
//! remeshing may be undone by a later one. So faces are compared before and after each stage of the remeshing, and the first stage
//! that changes a face is the cause; a face that is the same in the end has not ended.

use super::counts::Counts;
use crate::mesh::{Face, HalfEdgeMesh, Vertex};

/// What ends the lifetime of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// The exchange with exact cells, and the improvement of its new triangles.
    Exchange,
    /// The seam crosses a sample.
    Seam,
    Flip,
    Split,
    Collapse,
    /// The repair of a face that is turned over, off the isosurface or crosses others.
    Repair,
}

/// The numbers of lifetimes that ended, by cause.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ended([u64; 6]);

impl Ended {
    pub(super) fn add(&mut self, cause: Cause) {
        self.0[cause as usize] += 1;
    }

    /// Writes the numbers into the counts of a march.
    pub(super) fn insert_into(self, counts: &mut Counts) {
        let [exchanges, seam, flips, splits, collapses, repairs] = self.0;
        counts.ended_by_exchanges = exchanges;
        counts.ended_by_seam = seam;
        counts.ended_by_flips = flips;
        counts.ended_by_splits = splits;
        counts.ended_by_collapses = collapses;
        counts.ended_by_repairs = repairs;
    }
}

/// The first stage of a remeshing that changed each face, by face slot.
pub(super) struct FirstCauses {
    before: Vec<Option<[Vertex; 3]>>,
    causes: Vec<Option<Cause>>,
}

impl FirstCauses {
    /// Before the first stage.
    pub(super) fn new(mesh: &HalfEdgeMesh) -> FirstCauses {
        let slots = (0..mesh.face_slots() as u32).map(Face);
        let before: Vec<Option<[Vertex; 3]>> = slots.map(|f| corners(mesh, f)).collect();
        FirstCauses { causes: vec![None; before.len()], before }
    }

    /// After a stage: `cause` is that of all faces that have changed only now.
    pub(super) fn attribute(&mut self, mesh: &HalfEdgeMesh, cause: Cause) {
        for (slot, (before, first)) in self.before.iter().zip(&mut self.causes).enumerate() {
            if first.is_none() && *before != corners(mesh, Face(slot as u32)) {
                *first = Some(cause);
            }
        }
    }

    /// The cause of a face that has changed. A face whose vertices have the same numbers as before has lost one that was removed,
    /// and whose slot a new vertex has.
    pub(super) fn of(&self, slot: usize) -> Cause {
        self.causes.get(slot).copied().flatten().unwrap_or(Cause::Collapse)
    }
}

/// The vertices of a face, if its slot has one.
fn corners(mesh: &HalfEdgeMesh, f: Face) -> Option<[Vertex; 3]> {
    mesh.has_face(f).then(|| mesh.face_vertices(f))
}
