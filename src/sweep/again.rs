//! Beginning again: where a mesh neither follows nor can be repaired, its component is extracted and
//! remeshed afresh, there or a little farther on.

use super::recorder::{Direction, Log};
use super::start::{FRESH_MOTION, extraction_of_arcs, fresh_mesh, motion};
use super::surgery::Front;
use super::toil::FAR;
use super::track::End;
use super::{Counts, Piece, SMALLEST_FACES, Sweep};
use crate::error::Result;
use crate::kernels::Kernels;

/// On its way through one arc a mesh begins again at most so many times, and only while the faces
/// of all these meshes are fewer than this.
const MOST: u32 = 4;
const MOST_FACES: usize = 400_000;

/// A mesh that has come this far, as a share of what is left of its arc, begins again where it is; else
/// farther on by this share, and twice as far each time.
const PROGRESS: f64 = 0.03;

/// A mesh that was worth making, by how far it has moved, begins again even if the isosurface moves no more
/// than this over what is left of the arc, in voxels: it will go on beyond.
const LEAST_MOTION: f64 = 0.08;

/// How one mesh begins again on its way through an arc.
pub(super) struct Again<'a> {
    sweep: &'a Sweep<'a>,
    arc: usize,
    direction: Direction,
    last: f64,
    /// Where the mesh has begun again, if it has.
    begun: Option<f64>,
    /// How far on the next mesh begins, if this one has not come far.
    gap: f64,
    times: u32,
    faces: usize,
    /// How far the mesh had moved when it began again.
    moved: f32,
}

/// What the mesh before has left.
pub(super) struct Before {
    pub(super) log: Log,
    /// The stretch that neither of the two meshes shows.
    pub(super) untracked: Option<Piece>,
}

impl<'a> Again<'a> {
    /// For a mesh that is tracked through an arc to the isovalue `last`.
    pub(super) fn new(
        sweep: &'a Sweep<'a>,
        arc: usize,
        direction: Direction,
        last: f64,
    ) -> Again<'a> {
        let (begun, gap, times, faces, moved) = (None, 0.0, 0, 0, 0.0);
        Again { sweep, arc, direction, last, begun, gap, times, faces, moved }
    }

    /// Puts a fresh mesh in the place of one whose tracking has come to an `end` before its arc has; `None` if
    /// there is none.
    pub(super) fn begin(
        &mut self,
        front: &mut Front,
        end: End,
        kernels: &mut dyn Kernels,
        counts: &mut Counts,
    ) -> Result<Option<Before>> {
        if front.mesh.n_faces() < SMALLEST_FACES {
            return Ok(None);
        }
        let from = front.at;
        let left = (self.last - from).abs();
        let has_come = self.begun.is_none_or(|begun| (from - begun).abs() > PROGRESS * left);
        self.gap = if has_come { 0.0 } else { self.next_gap(left) };
        if front.toil.is_too_much() {
            return Ok(None);
        }
        let is_far = front.toil.moved() - self.moved >= FAR;
        let least = match end {
            // Only large meshes are too dense.
            End::TooDense => f64::from(FAR),
            _ if is_far => LEAST_MOTION,
            _ => FRESH_MOTION,
        };
        while self.times < MOST && self.faces < MOST_FACES && self.gap < 0.5 * left {
            self.times += 1;
            let at = from + self.direction.sign() * self.gap;
            let found = extraction_of_arcs(self.sweep, at, &[self.arc])?;
            let Some((extraction, _)) = found else { return Ok(None) };
            self.faces += extraction.faces.len();
            if motion(self.sweep, &extraction, (self.last - at).abs()) < least {
                return Ok(None);
            }
            let mesh = fresh_mesh(self.sweep, at, &extraction, kernels)?;
            let Some(mesh) = mesh else {
                self.gap = self.next_gap(left);
                continue;
            };
            log::debug!("arc {} begins again at {at}, {} faces", self.arc, mesh.n_faces());
            counts.extracted_afresh += 1;
            let mut recorder = front.recorder.begin_again();
            recorder.edits(&mesh, &[], at, self.direction);
            let mut toil = front.toil;
            toil.add_operation();
            let before = std::mem::replace(front, Front { mesh, recorder, at, toil });
            self.begun = Some(at);
            self.moved = front.toil.moved();
            return Ok(Some(Before {
                log: before.recorder.finish(from),
                untracked: (self.gap > 0.0).then(|| Piece {
                    arc: self.arc,
                    low: at.min(from),
                    high: at.max(from),
                }),
            }));
        }
        Ok(None)
    }

    fn next_gap(&self, left: f64) -> f64 {
        (2.0 * self.gap).max(PROGRESS * left)
    }
}
