//! What ends the lifetimes of tracked triangles.
//!
//! # Theory
//!
//! The size of a spectrum is proportional to the number of its lifetimes, so it matters which edits end them. An edit within a
//! remeshing may be undone by a later one. So faces are compared before and after each stage of the remeshing, and the first stage
//! that changes a face is the cause; a face that is the same in the end has not ended.

use rayon::prelude::*;

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
    /// The faces of all edits.
    changed: Vec<Face>,
}

impl FirstCauses {
    /// Before the first stage.
    pub(super) fn new(mesh: &mut HalfEdgeMesh) -> FirstCauses {
        mesh.take_changed();
        let slots = (0..mesh.face_slots() as u32).into_par_iter().with_min_len(1024).map(Face);
        let before: Vec<Option<[Vertex; 3]>> = slots.map(|f| corners(mesh, f)).collect();
        FirstCauses { causes: vec![None; before.len()], before, changed: Vec::new() }
    }

    /// After a stage: `cause` is that of all faces that have changed only now. Returns the faces that it has edited.
    pub(super) fn attribute(&mut self, mesh: &mut HalfEdgeMesh, cause: Cause) -> Vec<Face> {
        let edited = mesh.take_changed();
        for &f in &edited {
            let slot = f.0 as usize;
            if let Some(before) = self.before.get(slot)
                && self.causes[slot].is_none()
                && *before != corners(mesh, f)
            {
                self.causes[slot] = Some(cause);
            }
        }
        self.changed.extend(&edited);
        edited
    }

    /// The faces of all edits.
    pub(super) fn changed(&self) -> impl Iterator<Item = Face> + '_ {
        self.changed.iter().copied()
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
