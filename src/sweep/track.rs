//! Tracking: one component of the isosurface from one isovalue to another, its topology constant.

use super::advance::{Advanced, Refusal, Step, advance, expected_motion};
use super::border::Leaving;
use super::caps::inner_slopes;
use super::course::Course;
use super::opening::Opening;
use super::recorder::Direction;
use super::surgery::Front;
use super::{Counts, Parameters};
use crate::error::Result;
use crate::kernels::field::Field;
use crate::kernels::{Kernels, PINNED};
use crate::mesh::{Compacted, Mesh};
use glam::Vec3;

/// How far most vertices may move in one sampling step, in voxels.
pub(super) const STEP_LENGTH: f32 = 0.7;

/// A sampling step in which most vertices would move farther, in voxels, is taken shorter.
const MOST_MOTION: f32 = 2.0;

/// A step after which faces pass through each other is tried so many times with their vertices not
/// relaxed before it is taken shorter.
const PIN_ROUNDS: usize = 1;

/// A step is halved at most so many times.
const MOST_HALVINGS: u32 = 4;

/// A step that breaks the mesh is halved at most so many times before the mesh is repaired.
const MOST_BROKEN: u32 = 2;

/// From so many halvings on, a step is not refused for few folded or off faces any more.
const TOLERANT_FROM: u32 = 2;

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
    /// Isovalues nearer to each other than this are hardly told apart: no step is shorter.
    pub(crate) resolution: f64,
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
    let &Tracking { field, way, cancelled, .. } = tracking;
    let step = first_step(&front.mesh, field, way, front.at);
    let mut course = Course::new(front.at, step);
    let mut compacted = front.mesh.compacted();
    while (way.last - front.at) * way.direction.sign() > 0.0 {
        cancelled()?;
        let mut tried = longest_step(front, &mut compacted, kernels, tracking, &course, counts)?;
        let end = match tried.advanced.take() {
            Some(advanced) => course.go_on(front, &mut compacted, advanced, tracking, counts),
            None => course.mend(front, &mut compacted, tried, kernels, tracking, counts)?,
        };
        if let Some(end) = end {
            return Ok(end);
        }
    }
    Ok(End::Arrived)
}

/// What came of trying to step.
pub(super) struct Tried {
    /// The isovalue reached, how often the step was halved, and the vertices there.
    pub(super) advanced: Option<(f64, u32, Advanced)>,
    /// The last isovalue that was not reached.
    pub(super) failed_at: f64,
    /// The vertices that would leave the volume there.
    pub(super) left: Vec<Leaving>,
    /// The dents that open in caps up to there, or the samples that the mesh has on the wrong side.
    pub(super) opened: Vec<Opening>,
    /// Whether these are samples that the mesh goes by.
    pub(super) missed: bool,
    /// Where the last step was refused, voxel frame.
    pub(super) points: Vec<Vec3>,
}

impl Tried {
    /// A step to an isovalue that was refused.
    fn refused(failed_at: f64, refusal: Refusal) -> Tried {
        let Refusal { left, opened, points, missed, .. } = refusal;
        Tried { advanced: None, failed_at, left, opened, points, missed }
    }
}

/// Takes the longest step, halved as often as it takes, that passes the checks. If vertices may retreat,
/// a step on which some leave the volume is not halved but given back with them.
fn longest_step(
    Front { mesh, at, .. }: &Front,
    compacted: &mut Compacted,
    kernels: &mut dyn Kernels,
    tracking: &Tracking,
    course: &Course,
    counts: &mut Counts,
) -> Result<Tried> {
    let &Tracking { field, way, .. } = tracking;
    let (at, since, may_retreat) = (*at, course.since, course.may_retreat());
    let mut next = next_isovalue(way, at, course.step.min(course.limit));
    if (next - at).abs() > course.limit {
        next = at + way.direction.sign() * course.limit;
    }
    let far = expected_motion(mesh, field, at, next) / MOST_MOTION;
    if far > 1.0 {
        next = at + (next - at) / f64::from(far.min(8.0));
    }
    if (next - at).abs() < way.resolution {
        let least = way.resolution.min((way.last - at).abs());
        next = at + way.direction.sign() * least;
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
        // What is left but for rounding is no step.
        return if (way.last - next) * sign <= 1e-9 * fixed { way.last } else { next };
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
