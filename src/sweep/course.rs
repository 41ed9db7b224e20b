//! A mesh on its way through an arc: the step that it takes, the edits there, and what is done where no step
//! passes the checks.

use glam::Vec3;

use super::advance::{Advanced, Since, expected_motion};
use super::border::{Cleared, clear};
use super::caps::split_chamfers;
use super::criteria::{Criteria, extend_sizing, sizing};
use super::crowd::{coarseness, is_too_dense};
use super::flips::{Flips, flip_edges};
use super::glide::{Edits, glides};
use super::opening::Opening;
use super::refine::{refine, split_curve, split_long};
use super::remesh::SIZING_GOAL;
use super::simplify::{Bounds, simplify};
use super::surgery::{Front, REPAIRED_FROM};
use super::track::{End, STEP_LENGTH, Tracking, Tried, Way};
use super::{Counts, Parameters};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::kernels::field::Field;
use crate::mesh::{Compacted, Mesh, intersecting};

/// So many times per step vertices get out of the way of the border curve.
const MOST_RETREATS: u32 = 4;

/// So many of them are taken out of its way singly, where all at once would make the mesh pass through itself.
const MOST_SINGLY: usize = 16;

/// How far most vertices may move, in voxels, in a step on which some are in the way of the border curve.
const BORDER_MOTION: f32 = 0.3;

/// How far most vertices may move, in voxels, where a dent opens in a cap.
const OPENING_MOTION: f32 = 0.15;

/// A repair takes most vertices at least so far, in voxels: what is in the way here is so a little farther on, too.
const REPAIR_MOTION: f32 = 0.1;

/// A mesh is repaired at most so many times on its way through one arc: as many times as make up this
/// many faces, within bounds.
const MOST_REPAIRED_FACES: usize = 200_000;
const MOST_REPAIRS: (usize, usize) = (8, 40);

/// A mesh that is repaired more often than once in so many steps, but for the first repairs, is given
/// up.
const STEPS_PER_REPAIR: usize = 2;
const REPAIRS_AHEAD: usize = 6;

/// A flip may move the surface by so many tolerances.
const FLIP_SHARE: f32 = 1.0;

/// Edges so many times as long as wanted are split at a sampling isovalue.
const LONG: f32 = 1.5;

/// What is collapsed at a sampling isovalue: less than refinement would split again soon.
const COLLAPSES: Bounds = Bounds { short: 0.7, share: 0.3 };

/// A mesh on its way: how far it may step, and what has been done to it so that it comes on.
pub(super) struct Course {
    /// The next step, and the longest that it may be.
    pub(super) step: f64,
    pub(super) limit: f64,
    /// How often vertices have got out of the way of the border curve since the last step.
    retreats: u32,
    /// From where on passed samples count.
    pub(super) since: Since,
    /// Steps taken, and repairs: for bumps and for all else.
    steps: usize,
    repairs: usize,
    bumps: usize,
}

impl Course {
    /// From an isovalue on, with a first guess of the step.
    pub(super) fn new(at: f64, step: f64) -> Course {
        let since = Since { dents: at, bumps: at };
        let (limit, retreats) = (f64::INFINITY, 0);
        Course { step, limit, retreats, since, steps: 0, repairs: 0, bumps: 0 }
    }

    /// Whether vertices may get out of the way of the border curve.
    pub(super) fn may_retreat(&self) -> bool {
        self.retreats < MOST_RETREATS
    }

    /// Takes a step that passes the checks, and edits the mesh there.
    pub(super) fn go_on(
        &mut self,
        front: &mut Front,
        compacted: &mut Compacted,
        (next, halved, advanced): (f64, u32, Advanced),
        &Tracking { field, parameters, way, .. }: &Tracking,
        counts: &mut Counts,
    ) -> Option<End> {
        for (&v, &p) in compacted.vertices.iter().zip(&advanced.positions) {
            front.mesh.set_position(v, p.into());
        }
        let recorder = &mut front.recorder;
        recorder.knots(&compacted.vertices, &advanced.positions, &advanced.normals, next);
        counts.steps += 1;
        self.steps += 1;
        front.toil.add_step(advanced.moved);
        (self.retreats, self.limit) = (0, f64::INFINITY);
        let at = std::mem::replace(&mut front.at, next);
        if (way.last - next) * way.direction.sign() <= 0.0 {
            return Some(End::Arrived);
        }
        compacted.positions = advanced.positions;
        let unedited = front.mesh.clone();
        let edits = edit(&mut front.mesh, field, parameters, next);
        let edited = front.mesh.compacted();
        if n_crossing(&edited) > advanced.n_crossing {
            // The next step would be refused, however short. What the last one pinned is free again.
            *compacted = unedited.compacted();
            front.mesh = unedited;
        } else {
            recorder.glide(&front.mesh, &glides(compacted, &edits), next);
            recorder.edits(&front.mesh, &edits.collapsed, next, way.direction);
            *compacted = edited;
        }
        if is_too_dense(&front.mesh) {
            log::debug!("{} faces at {next} are too many", front.mesh.n_faces());
            return Some(End::TooDense);
        }
        let growth = (STEP_LENGTH / advanced.moved.max(1e-6))
            .clamp(0.5, if halved == 0 { 1.6 } else { 1.0 });
        self.step = (next - at).abs() * f64::from(growth);
        None
    }

    /// Does what lets a mesh come on where no step passes the checks: shorter steps, vertices out of the way,
    /// or a repair.
    pub(super) fn mend(
        &mut self,
        front: &mut Front,
        compacted: &mut Compacted,
        tried: Tried,
        kernels: &mut dyn Kernels,
        tracking: &Tracking,
        counts: &mut Counts,
    ) -> Result<Option<End>> {
        let way = tracking.way;
        if !tried.left.is_empty() {
            self.clear_border(front, compacted, &tried, tracking);
            return Ok(None);
        }
        if let Some(gap) = gap_to_opening(&tried.opened, front.at, way) {
            self.limit = gap;
            return Ok(None);
        }
        let left = (way.last - front.at).abs();
        if left <= 0.25 * way.window {
            return Ok(Some(End::Arrived));
        }
        let end = self.repair(front, compacted, tried, kernels, tracking, counts)?;
        Ok(match end {
            Some(End::Stuck) if left <= way.window => Some(End::Arrived),
            e => e,
        })
    }

    /// Where vertices would leave the volume: goes on to just before that, then moves them away.
    fn clear_border(
        &mut self,
        front: &mut Front,
        compacted: &mut Compacted,
        tried: &Tried,
        &Tracking { field, way, .. }: &Tracking,
    ) {
        let at = front.at;
        let half = 0.5 * (tried.failed_at - at).abs();
        let far = expected_motion(&front.mesh, field, at, tried.failed_at);
        let crowd = tried.left.len() > 2 + compacted.vertices.len() / 300;
        let most = if crowd { 0.2 * BORDER_MOTION } else { BORDER_MOTION };
        if far > most && half > way.min_step {
            self.limit = half;
            return;
        }
        let mut mesh = front.mesh.clone();
        let mut cleared = clear(&mut mesh, field, &tried.left, tried.failed_at);
        let is_early = cleared.is_early;
        let crossing = n_crossing(compacted);
        let mut after = mesh.compacted();
        if n_crossing(&after) > crossing {
            mesh.clone_from(&front.mesh);
            cleared = clear_singly(&mut mesh, field, tried, crossing);
            after = mesh.compacted();
        }
        if !cleared.is_nothing() {
            front.recorder.renew(&cleared.passed);
            front.recorder.edits(&mesh, &cleared.collapsed, at, way.direction);
            (front.mesh, *compacted) = (mesh, after);
            self.retreats += 1;
        } else if is_early && half > way.min_step {
            self.limit = half;
        } else {
            self.retreats = MOST_RETREATS;
        }
    }

    /// Asks for a repair, unless there have been too many.
    fn repair(
        &mut self,
        front: &mut Front,
        compacted: &mut Compacted,
        tried: Tried,
        kernels: &mut dyn Kernels,
        tracking: &Tracking,
        counts: &mut Counts,
    ) -> Result<Option<End>> {
        let &Tracking { field, way, repair, .. } = tracking;
        let n = if tried.missed { &mut self.bumps } else { &mut self.repairs };
        *n += 1;
        let most = (MOST_REPAIRED_FACES / front.mesh.n_faces().max(1))
            .clamp(MOST_REPAIRS.0, MOST_REPAIRS.1)
            .min(REPAIRS_AHEAD + self.steps / STEPS_PER_REPAIR);
        let is_over = *n > most || front.toil.is_too_much();
        let (at, missed, failed_at) = (front.at, tried.missed, tried.failed_at);
        let (to, points) = target_of_repair(front, field, tried, way);
        if is_over || !repair(front, (to, &points), kernels, counts)? {
            // A large mesh that goes by a bump is better than none.
            if !missed || front.mesh.n_faces() < REPAIRED_FROM {
                return Ok(Some(End::Stuck));
            }
            self.since.bumps = if is_over { way.last } else { failed_at };
            return Ok(None);
        }
        *compacted = front.mesh.compacted();
        self.step = (front.at - at).abs();
        self.limit = f64::INFINITY;
        self.since = Since { dents: front.at, bumps: front.at };
        Ok(is_too_dense(&front.mesh).then_some(End::TooDense))
    }
}

/// Takes vertices out of the way of the border curve one after the other, each only if no more than `crossing`
/// faces pass through others then.
fn clear_singly(mesh: &mut Mesh, field: &Field, tried: &Tried, crossing: usize) -> Cleared {
    let mut cleared = Cleared::default();
    for &l in tried.left.iter().take(MOST_SINGLY) {
        let mut without = mesh.clone();
        let one = clear(&mut without, field, &[l], tried.failed_at);
        if !one.is_nothing() && n_crossing(&without.compacted()) <= crossing {
            *mesh = without;
            cleared.collapsed.extend(one.collapsed);
            cleared.passed.extend(one.passed);
        }
    }
    cleared
}

/// How many faces pass through others.
fn n_crossing(mesh: &Compacted) -> usize {
    intersecting(&mesh.positions, &mesh.connectivity.faces).len()
}

/// How far it is to just before the first dent or bump opens; `None` if that is here.
fn gap_to_opening(opened: &[Opening], at: f64, way: &Way) -> Option<f64> {
    let gaps = opened.iter().map(|o| (o.isovalue - at) * way.direction.sign());
    let gap = gaps.min_by(f64::total_cmp)?;
    (gap > 2.0 * way.min_step).then_some(gap - way.min_step)
}

/// To which isovalue a mesh is repaired, and at which points: where the step failed, or farther on where that moves
/// most of the mesh by less than [`REPAIR_MOTION`]; but where dents or bumps open, it is not as far as most of it may
/// move at once, and they are those that have opened there.
fn target_of_repair(front: &Front, field: &Field, tried: Tried, way: &Way) -> (f64, Vec<Vec3>) {
    let sign = way.direction.sign();
    let far = expected_motion(&front.mesh, field, front.at, tried.failed_at).max(1e-6);
    let times = |share: f32| front.at + (tried.failed_at - front.at) * f64::from(share);
    if tried.opened.is_empty() {
        let to = times((REPAIR_MOTION / far).max(1.0));
        return (if (way.last - to) * sign < 0.0 { way.last } else { to }, tried.points);
    }
    let to = times((OPENING_MOTION / far).min(1.0));
    let has_opened = |o: &&Opening| (o.isovalue - to) * sign <= 0.0;
    (to, tried.opened.iter().filter(has_opened).map(|o| o.place).collect())
}

/// Simplifies, refines and flips at a sampling isovalue.
fn edit(mesh: &mut Mesh, field: &Field, parameters: &Parameters, at: f64) -> Edits {
    split_chamfers(mesh, field);
    let criteria = Criteria::new(field, at, parameters).for_size_of(mesh);
    // What a flip can mend needs no refinement.
    flip_edges(mesh, &criteria, 2, Flips::within(FLIP_SHARE * criteria.error));
    let deviations = criteria.deviations(mesh);
    let criteria = criteria.coarser(coarseness(mesh, &deviations, criteria.error));
    let mut born = Vec::new();
    let mut length = sizing(mesh, &criteria, &deviations, SIZING_GOAL * criteria.error);
    refine(mesh, &criteria, &deviations, &mut born);
    split_curve(mesh, &criteria, &mut born);
    extend_sizing(mesh, &mut length);
    split_long(mesh, &criteria, &length, LONG, &mut born);
    extend_sizing(mesh, &mut length);
    let collapsed = simplify(mesh, &criteria, &length, COLLAPSES);
    flip_edges(mesh, &criteria, 2, Flips::within(FLIP_SHARE * criteria.error));
    Edits { born, collapsed }
}
