//! Tracking: one component of the isosurface from one isovalue to another, its topology constant.

use super::border::{Cleared, Leaving, clear, leaving, overrun};
use super::caps::{is_of_cap, smooth_caps, split_chamfers};
use super::criteria::{Criteria, extend_sizing, sizing};
use super::flips::flip_edges;
use super::recorder::Direction;
use super::refine::{refine, split_long};
use super::remesh::SIZING_GOAL;
use super::simplify::simplify;
use super::surgery::Front;
use super::{Counts, Parameters};
use crate::error::Result;
use crate::kernels::field::Field;
use crate::kernels::{Kernels, PINNED, Status};
use crate::mesh::{Compacted, Face, Mesh, Vertex, area, intersecting, normal};
use glam::Vec3;

/// How far most vertices may move in one sampling step, voxels.
const STEP_LENGTH: f32 = 0.7;

/// A sampling step in which most vertices would move farther, in voxels, is taken shorter.
const MOST_MOTION: f32 = 2.0;

/// How far most vertices move in one projection, voxels.
const SUB_STEP_LENGTH: f32 = 0.4;

/// Share of faces that may leave the tolerance half-way between two sampling isovalues.
const MIDWAY_SHARE: f32 = 0.02;

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

/// Share of faces that may look away from their vertices' normals: sharp creases turn them.
const FOLDED_SHARE: f32 = 0.001;

/// How many faces are looked at half-way.
const MIDWAY_FACES: usize = 1500;

/// More faces per square voxel than this are too many: an exact marching cubes has about 2.2.
const FACES_PER_AREA: f32 = 2.6;

/// Smaller meshes may have as many faces as they need.
const DENSE_FROM: usize = 5_000;

/// Where a vertex and its normal are at the next sampling isovalue.
struct Advanced {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// 95th percentile of how far vertices moved, voxels.
    moved: f32,
}

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

/// A sampling step that is tried.
#[derive(Clone, Copy)]
struct Step {
    /// The isovalue of the mesh.
    at: f64,
    /// The isovalue to go to.
    next: f64,
    /// Whether few folded or off faces are no reason to refuse it.
    tolerant: bool,
    /// Whether vertices in the way of the border curve are a reason to refuse it.
    may_retreat: bool,
}

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
    let (mut steps, mut repairs) = (0, 0);
    let (mut retreats, mut limit) = (0, f64::INFINITY);
    while (way.last - front.at) * sign > 0.0 {
        cancelled()?;
        let at = front.at;
        let may_retreat = retreats < MOST_RETREATS;
        let (mesh, step_from) = (&front.mesh, (at, step.min(limit), limit));
        let tried =
            longest_step(mesh, &mut compacted, kernels, tracking, step_from, may_retreat, counts)?;
        let Some((next, halved, advanced)) = tried.advanced else {
            if !tried.left.is_empty() {
                let half = 0.5 * (tried.failed_at - at).abs();
                let far = expected_motion(&front.mesh, &compacted, field, at, tried.failed_at);
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
            if (way.last - at).abs() <= way.window {
                return Ok(End::Arrived);
            }
            repairs += 1;
            let most = (MOST_REPAIRED_FACES / front.mesh.n_faces().max(1))
                .clamp(MOST_REPAIRS.0, MOST_REPAIRS.1)
                .min(REPAIRS_AHEAD + steps / STEPS_PER_REPAIR);
            if repairs > most || !repair(front, (tried.failed_at, &tried.points), kernels, counts)? {
                return Ok(End::Stuck);
            }
            compacted = front.mesh.compacted();
            step = (front.at - at).abs();
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
        (retreats, limit) = (0, f64::INFINITY);
        front.at = next;
        if (way.last - next) * sign <= 0.0 {
            break;
        }
        let collapsed = edit(&mut front.mesh, field, parameters, next);
        recorder.edits(&front.mesh, &collapsed, next, way.direction);
        if is_too_dense(&front.mesh) {
            log::debug!("{} faces at {next} are too many", front.mesh.n_faces());
            return Ok(End::TooDense);
        }
        compacted = front.mesh.compacted();
        let growth = (STEP_LENGTH / advanced.moved.max(1e-6))
            .clamp(0.5, if halved == 0 { 1.6 } else { 1.0 });
        step = (next - at).abs() * f64::from(growth);
    }
    Ok(End::Arrived)
}

/// Whether the mesh takes more faces than the exact extraction: where the isosurface hugs the
/// lattice, as it does beside a plateau, finer triangles do not follow it any better.
fn is_too_dense(mesh: &Mesh) -> bool {
    let area = || mesh.faces().map(|f| area(mesh.corners(f))).sum::<f32>();
    mesh.n_faces() > DENSE_FROM && mesh.n_faces() as f32 > FACES_PER_AREA * area()
}

/// What came of trying to step.
struct Tried {
    /// The isovalue reached, how often the step was halved, and the vertices there.
    advanced: Option<(f64, u32, Advanced)>,
    /// The last isovalue that was not reached.
    failed_at: f64,
    /// The vertices that would leave the volume there.
    left: Vec<Leaving>,
    /// Where the last step was refused, voxel frame.
    points: Vec<Vec3>,
}

/// Why a step was refused, as far as that says what to do about it.
#[derive(Default)]
struct Refusal {
    /// Corners of faces that pass through others, as numbers among the compacted vertices.
    crossing: Vec<u32>,
    /// Vertices that leave the volume, or that the border curve runs over.
    left: Vec<Leaving>,
    /// Where it was refused, voxel frame.
    points: Vec<Vec3>,
}

/// Takes the longest step, halved as often as it takes, that passes the checks. If vertices `may_retreat`,
/// a step on which some leave the volume is not halved but given back with them.
fn longest_step(
    mesh: &Mesh,
    compacted: &mut Compacted,
    kernels: &mut dyn Kernels,
    tracking: &Tracking,
    (at, step, limit): (f64, f64, f64),
    may_retreat: bool,
    counts: &mut Counts,
) -> Result<Tried> {
    let &Tracking { field, way, .. } = tracking;
    let mut next = next_isovalue(way, at, step);
    if (next - at).abs() > limit {
        next = at + way.direction.sign() * limit;
    }
    let far = expected_motion(mesh, compacted, field, at, next) / MOST_MOTION;
    if far > 1.0 {
        next = at + (next - at) / f64::from(far.min(8.0));
    }
    let (mut halved, mut broken, mut pinned) = (0u32, 0u32, 0);
    loop {
        let tolerant = halved >= TOLERANT_FROM;
        let step = Step { at, next, tolerant, may_retreat };
        let before = counts.refused;
        let refusal = match advance(mesh, compacted, kernels, tracking, step, counts)? {
            Ok(a) if way.fixed.is_some() || a.moved <= 2.0 * STEP_LENGTH || tolerant => {
                let advanced = Some((next, halved, a));
                return Ok(Tried { advanced, failed_at: next, left: vec![], points: vec![] });
            }
            Ok(_) => Refusal::default(),
            Err(refusal) => refusal,
        };
        if may_retreat && !refusal.left.is_empty() {
            let Refusal { left, points, .. } = refusal;
            return Ok(Tried { advanced: None, failed_at: next, left, points });
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
            return Ok(Tried { advanced: None, failed_at, left: vec![], points: refusal.points });
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
    let mut slopes: Vec<f32> =
        mesh.vertices().map(|v| field.gradient(mesh.position(v)).length()).collect();
    let i = slopes.len() / 10;
    let (_, slope, _) = slopes.select_nth_unstable_by(i, f32::total_cmp);
    let unit = f64::from(field.isovalue(at + 1.0) - field.isovalue(at)).max(1e-12);
    let guess = f64::from(0.5 * STEP_LENGTH * *slope) / unit;
    guess.clamp(4.0 * way.min_step, (way.last - at).abs().max(4.0 * way.min_step))
}

/// Moves every vertex to the isosurface of `next` and relaxes there, unless a check fails.
fn advance(
    mesh: &Mesh,
    compacted: &Compacted,
    kernels: &mut dyn Kernels,
    tracking: &Tracking,
    step: Step,
    counts: &mut Counts,
) -> Result<std::result::Result<Advanced, Refusal>> {
    let &Tracking { field, parameters, way, .. } = tracking;
    let Step { at, next, tolerant, may_retreat } = step;
    kernels.load(&compacted.connectivity, &compacted.positions)?;
    let expected = expected_motion(mesh, compacted, field, at, next);
    let n = (expected / SUB_STEP_LENGTH).ceil().clamp(1.0, 8.0) as usize;
    let mut failed = 0;
    for i in 1..=n {
        failed = kernels.project(at + (next - at) * i as f64 / n as f64, 3.0)?;
    }
    kernels.relax(
        next,
        parameters.relax_strength as f32,
        parameters.relax_force as f32,
        parameters.relax_iterations,
    )?;
    let mut positions = kernels.positions()?;
    smooth_caps(mesh, field, next, &compacted.vertices, &mut positions);
    let normals = kernels.normals()?;
    let mut lost: Vec<Vertex> = Vec::new();
    if failed > 0 {
        // Caps are put where they belong by other means.
        let status = kernels.status()?;
        let is_lost = |(v, s): &(&Vertex, &Status)| **s == Status::Failed && !is_of_cap(mesh, **v);
        let vertices = compacted.vertices.iter().zip(&status).filter(is_lost);
        lost.extend(vertices.map(|(v, _)| *v));
    }
    let mut left = leaving(mesh, field, compacted, &positions);
    if may_retreat {
        left.extend(overrun(mesh, compacted, &positions, &lost));
    }
    if !left.is_empty() {
        counts.refused.left_volume += 1;
        let points = left.iter().map(|l| mesh.position(l.vertex)).collect();
        return Ok(Err(Refusal { left, points, crossing: Vec::new() }));
    }
    let middle = |f: Face| mesh.corners(f).iter().sum::<Vec3>() / 3.0;
    let folded = folds(mesh, compacted, &positions, &normals);
    if folded.len() as f32 > 1.0 + FOLDED_SHARE * compacted.faces.len() as f32 && !tolerant {
        counts.refused.folded += 1;
        let points = folded.into_iter().map(middle).collect();
        return Ok(Err(Refusal { points, ..Refusal::default() }));
    }
    // Told steps are refined too, but not where a whole arc is one of them.
    let is_whole = way.fixed.is_some_and(|(_, step)| (way.last - at).abs() <= step);
    if !tolerant && !is_whole && !follows_midway(mesh, compacted, field, parameters, &positions, at, next) {
        counts.refused.off_midway += 1;
        return Ok(Err(Refusal::default()));
    }
    let crossing = intersecting(&positions, &compacted.connectivity.faces);
    let crossing_allowed = compacted.faces.len() / if tolerant { 5_000 } else { 15_000 };
    if crossing.len() > crossing_allowed {
        counts.refused.intersecting += 1;
        let points = crossing.iter().map(|&f| middle(compacted.faces[f as usize])).collect();
        let corners = crossing.iter().flat_map(|&f| compacted.connectivity.faces[f as usize]);
        return Ok(Err(Refusal { crossing: corners.collect(), left: Vec::new(), points }));
    }
    let failed_allowed = positions.len() / if tolerant { 500 } else { 2_000 };
    if lost.len() > failed_allowed {
        counts.refused.not_reached += 1;
        let points = lost.iter().map(|&v| mesh.position(v)).collect();
        return Ok(Err(Refusal { points, ..Refusal::default() }));
    }
    let mut moved: Vec<f32> = positions
        .iter()
        .zip(&compacted.positions)
        .map(|(&p, &q)| Vec3::from(p).distance(Vec3::from(q)))
        .collect();
    let i = moved.len() * 95 / 100;
    let (_, &mut moved, _) = moved.select_nth_unstable_by(i, f32::total_cmp);
    Ok(Ok(Advanced { positions, normals, moved }))
}

/// How far most vertices will move, from the field's gradient.
fn expected_motion(mesh: &Mesh, compacted: &Compacted, field: &Field, at: f64, next: f64) -> f32 {
    let change = (field.isovalue(next) - field.isovalue(at)).abs();
    let stride = compacted.vertices.len() / 500 + 1;
    let mut motion: Vec<f32> = compacted
        .vertices
        .iter()
        .step_by(stride)
        .map(|&v| change / field.gradient(mesh.position(v)).length().max(1e-12))
        .collect();
    let i = motion.len() * 9 / 10;
    *motion.select_nth_unstable_by(i, f32::total_cmp).1
}

/// The faces of the isosurface proper that look away from the mean normal of their vertices.
fn folds(
    mesh: &Mesh,
    compacted: &Compacted,
    positions: &[[f32; 3]],
    normals: &[[f32; 3]],
) -> Vec<Face> {
    let turned = |(face, t): &(&Face, &[u32; 3])| {
        let n = normal(t.map(|v| positions[v as usize].into()));
        // At the border the normals are also those of the caps.
        let inner =
            t.iter().filter(|&&v| compacted.connectivity.borders[v as usize] & !PINNED == 0);
        let mean: Vec3 = inner.map(|&v| Vec3::from(normals[v as usize])).sum();
        !mesh.is_cap(**face) && n.dot(mean) < 0.0
    };
    compacted.faces.iter().zip(&compacted.connectivity.faces).filter(turned).map(|x| *x.0).collect()
}

/// Whether the mesh half-way between two sampling isovalues follows its isosurface.
fn follows_midway(
    mesh: &Mesh,
    compacted: &Compacted,
    field: &Field,
    parameters: &Parameters,
    positions: &[[f32; 3]],
    at: f64,
    next: f64,
) -> bool {
    let criteria = Criteria::new(field, 0.5 * (at + next), parameters);
    let faces = &compacted.connectivity.faces;
    let stride = faces.len() / MIDWAY_FACES + 1;
    let (mut seen, mut off) = (0usize, 0usize);
    for (i, t) in faces.iter().enumerate().step_by(stride) {
        if mesh.is_cap(compacted.faces[i]) {
            continue;
        }
        let middle = t.map(|v| {
            0.5 * (Vec3::from(compacted.positions[v as usize]) + Vec3::from(positions[v as usize]))
        });
        seen += 1;
        off += usize::from(criteria.deviation(middle) > parameters.error as f32);
    }
    off as f32 <= 1.0 + MIDWAY_SHARE * seen as f32
}

/// Simplifies, refines and flips at a sampling isovalue. Returns the collapses.
fn edit(mesh: &mut Mesh, field: &Field, parameters: &Parameters, at: f64) -> Vec<(Vertex, Vertex)> {
    split_chamfers(mesh, field);
    let criteria = Criteria::new(field, at, parameters).for_size_of(mesh);
    let deviations = criteria.deviations(mesh);
    let mut length = sizing(mesh, &criteria, &deviations, SIZING_GOAL * criteria.error);
    refine(mesh, &criteria, &deviations);
    extend_sizing(mesh, &mut length);
    split_long(mesh, &criteria, &length, 2.0);
    extend_sizing(mesh, &mut length);
    let collapsed = simplify(mesh, &criteria, &length, 0.5);
    flip_edges(mesh, &criteria, 2);
    collapsed
}
