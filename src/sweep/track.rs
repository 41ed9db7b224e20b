//! Tracking: one component of the isosurface from one isovalue to another, its topology constant.

use super::advance::{Advanced, Refusal, Since, Step, advance, expected_motion};
use super::border::{Cleared, Leaving, clear};
use super::caps::{inner_slopes, split_chamfers};
use super::criteria::{Criteria, extend_sizing, sizing};
use super::flips::flip_edges;
use super::glide::{Edits, glides};
use super::opening::Opening;
use super::recorder::Direction;
use super::refine::{refine, split_long};
use super::remesh::SIZING_GOAL;
use super::simplify::{Bounds, simplify};
use super::surgery::{Front, REPAIRED_FROM};
use super::{Counts, Parameters};
use crate::error::Result;
use crate::kernels::field::Field;
use crate::kernels::{Kernels, PINNED};
use crate::mesh::{Compacted, Mesh, area, intersecting};
use glam::Vec3;

/// How far most vertices may move in one sampling step, voxels.
const STEP_LENGTH: f32 = 0.7;

/// A sampling step in which most vertices would move farther, in voxels, is taken shorter.
const MOST_MOTION: f32 = 2.0;

/// A step after which faces pass through each other is tried so many times with their vertices not
/// relaxed before it is taken shorter.
const PIN_ROUNDS: usize = 1;

/// A step is halved at most so many times.
const MOST_HALVINGS: u32 = 4;

/// A step that breaks the mesh is halved at most so many times before the mesh is repaired.
const MOST_BROKEN: u32 = 2;

/// So many times per step vertices get out of the way of the border curve.
const MOST_RETREATS: u32 = 4;

/// How far most vertices may move, in voxels, in a step on which some are in the way of the border curve.
const BORDER_MOTION: f32 = 0.3;

/// How far most vertices may move, in voxels, where a dent opens in a cap.
const OPENING_MOTION: f32 = 0.15;

/// A mesh is repaired at most so many times on its way through one arc: as many times as make up this
/// many faces, within bounds.
const MOST_REPAIRED_FACES: usize = 200_000;
const MOST_REPAIRS: (usize, usize) = (8, 40);

/// A mesh that is repaired more often than once in so many steps, but for the first repairs, is given
/// up.
const STEPS_PER_REPAIR: usize = 2;
const REPAIRS_AHEAD: usize = 6;

/// From so many halvings on, a step is not refused for few folded or off faces any more.
const TOLERANT_FROM: u32 = 2;

/// More faces per square voxel than this are too many: an exact marching cubes has about 2.2. A mesh that is
/// begun with nearly as many has too many after a step.
const FACES_PER_AREA: f32 = 2.6;
const FACES_PER_AREA_AT_FIRST: f32 = 2.3;

/// A flip may move the surface by so many tolerances.
const FLIP_SHARE: f32 = 1.0;

/// What is collapsed at a sampling isovalue: less than refinement would split again soon.
const COLLAPSES: Bounds = Bounds { short: 0.7, share: 0.3 };

/// Smaller meshes may have as many faces as they need.
const DENSE_FROM: usize = 5_000;

/// One way of tracking: where it goes and how it samples.
pub(crate) struct Way {
    /// The direction of the isovalue.
    pub(crate) direction: Direction,
    /// The isovalue to go to.
    pub(crate) last: f64,
    /// Within this distance from it, a mesh that cannot go on has arrived.
    pub(crate) window: f64,
    /// Distance of sampling isovalues, if fixed: they are its multiples above the range's low end.
    pub(crate) fixed: Option<(f64, f64)>,
    /// The shortest step worth taking.
    pub(crate) min_step: f64,
}

/// What stays the same while a component is tracked one way.
pub(crate) struct Tracking<'a> {
    /// The field, voxel frame.
    pub(crate) field: &'a Field,
    /// What the sweep was told.
    pub(crate) parameters: &'a Parameters,
    /// Where to, and how it samples.
    pub(crate) way: &'a Way,
    /// Fails once the caller wants the sweep to stop.
    pub(crate) cancelled: &'a dyn Fn() -> Result<()>,
    /// Brings a mesh to the given isovalue by replacing what does not follow, and what lies at the
    /// given points; false if it cannot.
    pub(crate) repair: &'a Repair<'a>,
}

/// See [`Tracking::repair`].
pub(crate) type Repair<'a> =
    dyn Fn(&mut Front, (f64, &[Vec3]), &mut dyn Kernels, &mut Counts) -> Result<bool> + 'a;

/// How tracking ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// At the last isovalue, or near enough.
    Arrived,
    /// No step passes the checks, nor does a repair help.
    Stuck,
    /// The mesh takes more faces than the exact extraction.
    TooDense,
}

/// Tracks a mesh as far as it goes, at most to `way.last`. What is reached is in `front.at`. Where a
/// step fails a check however short it is, `repair` is asked.
pub(crate) fn track(
    front: &mut Front,
    kernels: &mut dyn Kernels,
    tracking: &Tracking,
    counts: &mut Counts,
) -> Result<End> {
    let &Tracking { field, parameters, way, cancelled, repair } = tracking;
    let sign = way.direction.sign();
    let mut step = first_step(&front.mesh, field, way, front.at);
    let mut compacted = front.mesh.compacted();
    let (mut steps, mut repairs, mut bumps) = (0, 0, 0);
    let (mut retreats, mut limit) = (0, f64::INFINITY);
    let mut since = Since { dents: front.at, bumps: front.at };
    while (way.last - front.at) * sign > 0.0 {
        cancelled()?;
        let at = front.at;
        let may_retreat = retreats < MOST_RETREATS;
        let (mesh, step_from) = (&front.mesh, ([at, step.min(limit), limit], since));
        let tried =
            longest_step(mesh, &mut compacted, kernels, tracking, step_from, may_retreat, counts)?;
        let Some((next, halved, advanced)) = tried.advanced else {
            if !tried.left.is_empty() {
                let half = 0.5 * (tried.failed_at - at).abs();
                let far = expected_motion(&front.mesh, field, at, tried.failed_at);
                let crowd = tried.left.len() > 2 + compacted.vertices.len() / 300;
                let most = if crowd { 0.2 * BORDER_MOTION } else { BORDER_MOTION };
                if far > most && half > way.min_step {
                    limit = half;
                    continue;
                }
                let (mesh, recorder) = (&mut front.mesh, &mut front.recorder);
                match clear(mesh, recorder, field, &tried.left, at, way.direction) {
                    Cleared::Some => retreats += 1,
                    Cleared::TooEarly if half > way.min_step => limit = half,
                    _ => retreats = MOST_RETREATS,
                }
                compacted = front.mesh.compacted();
                continue;
            }
            if let Some(gap) = gap_to_opening(&tried.opened, at, way) {
                limit = gap;
                continue;
            }
            if (way.last - at).abs() <= way.window {
                return Ok(End::Arrived);
            }
            let n = if tried.missed { &mut bumps } else { &mut repairs };
            *n += 1;
            let most = (MOST_REPAIRED_FACES / front.mesh.n_faces().max(1))
                .clamp(MOST_REPAIRS.0, MOST_REPAIRS.1)
                .min(REPAIRS_AHEAD + steps / STEPS_PER_REPAIR);
            let is_over = *n > most || front.toil.is_too_much();
            let (missed, failed_at) = (tried.missed, tried.failed_at);
            let (to, points) = target_of_repair(front, field, tried, way);
            if is_over || !repair(front, (to, &points), kernels, counts)? {
                // A large mesh that goes by a bump is better than none.
                if !missed || front.mesh.n_faces() < REPAIRED_FROM {
                    return Ok(End::Stuck);
                }
                since.bumps = if is_over { way.last } else { failed_at };
                continue;
            }
            compacted = front.mesh.compacted();
            step = (front.at - at).abs();
            limit = f64::INFINITY;
            since = Since { dents: front.at, bumps: front.at };
            if is_too_dense(&front.mesh) {
                return Ok(End::TooDense);
            }
            continue;
        };
        for (&v, &p) in compacted.vertices.iter().zip(&advanced.positions) {
            front.mesh.set_position(v, p.into());
        }
        let recorder = &mut front.recorder;
        recorder.knots(&compacted.vertices, &advanced.positions, &advanced.normals, next);
        counts.steps += 1;
        steps += 1;
        front.toil.add_step(advanced.moved);
        (retreats, limit) = (0, f64::INFINITY);
        front.at = next;
        if (way.last - next) * sign <= 0.0 {
            break;
        }
        compacted.positions = advanced.positions;
        let unedited = front.mesh.clone();
        let edits = edit(&mut front.mesh, field, parameters, next);
        let edited = front.mesh.compacted();
        if intersecting(&edited.positions, &edited.connectivity.faces).len() > advanced.n_crossing {
            // The next step would be refused, however short. What the last one pinned is free again.
            compacted = unedited.compacted();
            front.mesh = unedited;
        } else {
            recorder.glide(&front.mesh, &glides(&compacted, &edits), next);
            recorder.edits(&front.mesh, &edits.collapsed, next, way.direction);
            compacted = edited;
        }
        if is_too_dense(&front.mesh) {
            log::debug!("{} faces at {next} are too many", front.mesh.n_faces());
            return Ok(End::TooDense);
        }
        let growth = (STEP_LENGTH / advanced.moved.max(1e-6))
            .clamp(0.5, if halved == 0 { 1.6 } else { 1.0 });
        step = (next - at).abs() * f64::from(growth);
    }
    Ok(End::Arrived)
}

/// Whether the mesh takes more faces than the exact extraction: where the isosurface hugs the
/// lattice, as it does beside a plateau, finer triangles do not follow it any better.
fn is_too_dense(mesh: &Mesh) -> bool {
    has_more_faces(mesh, FACES_PER_AREA)
}

/// Whether a mesh has so many faces from the beginning that it will not come far.
pub(super) fn begins_too_dense(mesh: &Mesh) -> bool {
    has_more_faces(mesh, FACES_PER_AREA_AT_FIRST)
}

/// Whether a mesh, if it is not small, has more faces per square voxel.
fn has_more_faces(mesh: &Mesh, per_area: f32) -> bool {
    let area = || mesh.faces().map(|f| area(mesh.corners(f))).sum::<f32>();
    mesh.n_faces() > DENSE_FROM && mesh.n_faces() as f32 > per_area * area()
}

/// What came of trying to step.
struct Tried {
    /// The isovalue reached, how often the step was halved, and the vertices there.
    advanced: Option<(f64, u32, Advanced)>,
    /// The last isovalue that was not reached.
    failed_at: f64,
    /// The vertices that would leave the volume there.
    left: Vec<Leaving>,
    /// The dents that open in caps up to there, or the samples that the mesh has on the wrong side.
    opened: Vec<Opening>,
    /// Whether these are samples that the mesh goes by.
    missed: bool,
    /// Where the last step was refused, voxel frame.
    points: Vec<Vec3>,
}

impl Tried {
    /// A step to an isovalue that was refused.
    fn refused(failed_at: f64, refusal: Refusal) -> Tried {
        let Refusal { left, opened, points, missed, .. } = refusal;
        Tried { advanced: None, failed_at, left, opened, points, missed }
    }
}

/// How far it is to just before the first dent or bump opens; `None` if that is here.
fn gap_to_opening(opened: &[Opening], at: f64, way: &Way) -> Option<f64> {
    let gaps = opened.iter().map(|o| (o.isovalue - at) * way.direction.sign());
    let gap = gaps.min_by(f64::total_cmp)?;
    (gap > 2.0 * way.min_step).then_some(gap - way.min_step)
}

/// To which isovalue a mesh is repaired, and at which points: where the step failed; but where dents or
/// bumps open, it is not as far as most of the mesh may move at once, and they are those that have opened there.
fn target_of_repair(front: &Front, field: &Field, tried: Tried, way: &Way) -> (f64, Vec<Vec3>) {
    if tried.opened.is_empty() {
        return (tried.failed_at, tried.points);
    }
    let far = expected_motion(&front.mesh, field, front.at, tried.failed_at);
    let to = front.at + (tried.failed_at - front.at) * f64::from((OPENING_MOTION / far).min(1.0));
    let has_opened = |o: &&Opening| (o.isovalue - to) * way.direction.sign() <= 0.0;
    (to, tried.opened.iter().filter(has_opened).map(|o| o.place).collect())
}

/// Takes the longest step, halved as often as it takes, that passes the checks. If vertices `may_retreat`,
/// a step on which some leave the volume is not halved but given back with them.
fn longest_step(
    mesh: &Mesh,
    compacted: &mut Compacted,
    kernels: &mut dyn Kernels,
    tracking: &Tracking,
    ([at, step, limit], since): ([f64; 3], Since),
    may_retreat: bool,
    counts: &mut Counts,
) -> Result<Tried> {
    let &Tracking { field, way, .. } = tracking;
    let mut next = next_isovalue(way, at, step);
    if (next - at).abs() > limit {
        next = at + way.direction.sign() * limit;
    }
    let far = expected_motion(mesh, field, at, next) / MOST_MOTION;
    if far > 1.0 {
        next = at + (next - at) / f64::from(far.min(8.0));
    }
    let (mut halved, mut broken, mut pinned) = (0u32, 0u32, 0);
    loop {
        let tolerant = halved >= TOLERANT_FROM;
        let step = Step { at, next, since, tolerant, may_retreat };
        let before = counts.refused;
        let refusal = match advance(mesh, compacted, kernels, tracking, step, counts)? {
            Ok(a) if way.fixed.is_some() || a.moved <= 2.0 * STEP_LENGTH || tolerant => {
                let advanced = Some((next, halved, a));
                let refused = Tried::refused(next, Refusal::default());
                return Ok(Tried { advanced, ..refused });
            }
            Ok(_) => Refusal::default(),
            Err(refusal) => refusal,
        };
        if may_retreat && !refusal.left.is_empty() || !refusal.opened.is_empty() {
            return Ok(Tried::refused(next, refusal));
        }
        let is_broken = counts.refused.off_midway == before.off_midway && counts.refused != before;
        if !refusal.crossing.is_empty() && pinned < PIN_ROUNDS {
            pinned += 1;
            for v in refusal.crossing {
                compacted.connectivity.borders[v as usize] |= PINNED;
            }
            continue;
        }
        let failed_at = next;
        halved += 1;
        broken += u32::from(is_broken);
        next = at + 0.5 * (next - at);
        if broken > MOST_BROKEN || halved > MOST_HALVINGS || (next - at).abs() < way.min_step {
            return Ok(Tried::refused(failed_at, Refusal { left: vec![], ..refusal }));
        }
    }
}

/// The sampling isovalue after `at`.
fn next_isovalue(way: &Way, at: f64, step: f64) -> f64 {
    let sign = way.direction.sign();
    let left = (way.last - at) * sign;
    if let Some((low, fixed)) = way.fixed {
        let n = (at - low) / fixed;
        let k = if sign > 0.0 { (n + 1e-9).floor() + 1.0 } else { (n - 1e-9).ceil() - 1.0 };
        let next = low + k * fixed;
        return if (way.last - next) * sign <= 0.0 { way.last } else { next };
    }
    if step >= 0.7 * left { way.last } else { at + sign * step }
}

/// A first guess of the step: what moves most vertices by half of what they may move.
fn first_step(mesh: &Mesh, field: &Field, way: &Way, at: f64) -> f64 {
    let mut slopes = inner_slopes(mesh, field, usize::MAX);
    if slopes.is_empty() {
        return (way.last - at).abs();
    }
    let i = slopes.len() / 10;
    let (_, slope, _) = slopes.select_nth_unstable_by(i, f32::total_cmp);
    let unit = f64::from(field.isovalue(at + 1.0) - field.isovalue(at)).max(1e-12);
    let guess = f64::from(0.5 * STEP_LENGTH * *slope) / unit;
    guess.clamp(4.0 * way.min_step, (way.last - at).abs().max(4.0 * way.min_step))
}

/// Simplifies, refines and flips at a sampling isovalue.
fn edit(mesh: &mut Mesh, field: &Field, parameters: &Parameters, at: f64) -> Edits {
    split_chamfers(mesh, field);
    let criteria = Criteria::new(field, at, parameters).for_size_of(mesh);
    // What a flip can mend needs no refinement.
    flip_edges(mesh, &criteria, 2, FLIP_SHARE * criteria.error);
    let deviations = criteria.deviations(mesh);
    let mut born = Vec::new();
    let mut length = sizing(mesh, &criteria, &deviations, SIZING_GOAL * criteria.error);
    refine(mesh, &criteria, &deviations, &mut born);
    extend_sizing(mesh, &mut length);
    split_long(mesh, &criteria, &length, 2.0, &mut born);
    extend_sizing(mesh, &mut length);
    let collapsed = simplify(mesh, &criteria, &length, COLLAPSES);
    flip_edges(mesh, &criteria, 2, FLIP_SHARE * criteria.error);
    Edits { born, collapsed }
}
