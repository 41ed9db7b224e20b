//! One sampling step that is tried: every vertex moved to the next isovalue and relaxed there, and the
//! checks that the mesh must pass.

use super::border::{Leaving, leaving, overrun};
use super::caps::{inner_slopes, is_of_cap, smooth_caps};
use super::criteria::Criteria;
use super::missed::{Passage, missed};
use super::opening::{Opening, openings};
use super::track::Tracking;
use super::{Counts, Parameters};
use crate::error::Result;
use crate::kernels::field::Field;
use crate::kernels::{Kernels, PINNED, Status};
use crate::mesh::{Compacted, Face, Mesh, Vertex, intersecting, normal};
use glam::Vec3;

/// How far most vertices move in one projection, voxels.
const SUB_STEP_LENGTH: f32 = 0.4;

/// Share of faces that may leave the tolerance half-way between two sampling isovalues.
const MIDWAY_SHARE: f32 = 0.01;

/// Beside those, so many times as many faces may be off half-way as are where the mesh is.
const OFF_GROWTH: f32 = 1.2;

/// Share of faces that may look away from their vertices' normals: sharp creases turn them.
const FOLDED_SHARE: f32 = 0.001;

/// So many vertices are asked how far they will move.
const MOTION_VERTICES: usize = 500;

/// How many times as far as across the isosurface vertices are said to move. Where it is flat and its faces are large,
/// relaxation moves them along it by a voxel, however short the step, and steps that such a motion shortened came to
/// nothing.
const MOST_ALONG: f32 = 10.0;

/// How many faces are looked at half-way.
const MIDWAY_FACES: usize = 1500;

/// Where a vertex and its normal are at the next sampling isovalue.
pub(super) struct Advanced {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// 95th percentile of how far vertices moved, voxels: see `motion_of_most`.
    pub(super) moved: f32,
    /// How many faces pass through others.
    pub(super) n_crossing: usize,
}

/// From which isovalues on the samples that are passed count.
#[derive(Clone, Copy)]
pub(super) struct Since {
    /// Those under caps.
    pub(super) dents: f64,
    /// Those that the mesh goes by.
    pub(super) bumps: f64,
}

/// A sampling step that is tried.
#[derive(Clone, Copy)]
pub(super) struct Step {
    /// The isovalue of the mesh.
    pub(super) at: f64,
    /// The isovalue to go to.
    pub(super) next: f64,
    /// From where on the mesh was tracked: what was wrong there is not looked at.
    pub(super) since: Since,
    /// Whether few folded or off faces are no reason to refuse it.
    pub(super) tolerant: bool,
    /// Whether vertices in the way of the border curve are a reason to refuse it.
    pub(super) may_retreat: bool,
}

/// Why a step was refused, as far as that says what to do about it.
#[derive(Default)]
pub(super) struct Refusal {
    /// Corners of faces that pass through others, as numbers among the compacted vertices.
    pub(super) crossing: Vec<u32>,
    /// Vertices that leave the volume, or that the border curve runs over.
    pub(super) left: Vec<Leaving>,
    /// Dents that open in caps, or bumps.
    pub(super) opened: Vec<Opening>,
    /// Whether these are bumps that the mesh goes by.
    pub(super) missed: bool,
    /// Where it was refused, voxel frame.
    pub(super) points: Vec<Vec3>,
}

impl Refusal {
    /// For dents, or for bumps that the mesh has `missed`.
    fn opened(opened: Vec<Opening>, missed: bool) -> Refusal {
        let points = opened.iter().map(|o| o.place).collect();
        Refusal { opened, points, missed, ..Refusal::default() }
    }
}

/// Moves every vertex to the isosurface of `next` and relaxes there, unless a check fails.
pub(super) fn advance(
    mesh: &Mesh,
    compacted: &Compacted,
    kernels: &mut dyn Kernels,
    tracking: &Tracking,
    step: Step,
    counts: &mut Counts,
) -> Result<std::result::Result<Advanced, Refusal>> {
    let &Tracking { field, parameters, way, .. } = tracking;
    let Step { at, next, since, tolerant, may_retreat } = step;
    kernels.load(&compacted.connectivity, &compacted.positions)?;
    let expected = expected_motion(mesh, field, at, next);
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
        left.extend(overrun(mesh, (field, next), compacted, &positions, &lost));
    }
    if !left.is_empty() {
        counts.refused.left_volume += 1;
        let points = left.iter().map(|l| mesh.position(l.vertex)).collect();
        return Ok(Err(Refusal { left, points, ..Refusal::default() }));
    }
    let opened =
        openings(mesh, field, compacted, &positions, [since.dents, next], parameters.error as f32);
    if !opened.is_empty() {
        counts.refused.left_volume += 1;
        return Ok(Err(Refusal::opened(opened, false)));
    }
    let passage =
        Passage { since: since.bumps, next, sign: way.direction.sign(), error: parameters.error };
    let opened = missed(mesh, field, compacted, &positions, passage);
    if !opened.is_empty() {
        counts.refused.missed += 1;
        return Ok(Err(Refusal::opened(opened, true)));
    }
    let middle = |f: Face| mesh.corners(f).iter().sum::<Vec3>() / 3.0;
    let folded = folds(mesh, compacted, &positions, &normals);
    if folded.len() as f32 > 1.0 + FOLDED_SHARE * compacted.faces.len() as f32 && !tolerant {
        counts.refused.folded += 1;
        let points = folded.into_iter().map(middle).collect();
        return Ok(Err(Refusal { points, ..Refusal::default() }));
    }
    let midway = midway(compacted, &positions);
    // Told steps are refined too, but not where a whole arc is one of them.
    let is_whole = way.fixed.is_some_and(|(_, step)| (way.last - at).abs() <= step);
    if !tolerant
        && !is_whole
        && !follows_midway(mesh, compacted, field, parameters, &midway, at, next)
    {
        counts.refused.off_midway += 1;
        return Ok(Err(Refusal::default()));
    }
    let mut crossing = intersecting(&positions, &compacted.connectivity.faces);
    let crossing_allowed = compacted.faces.len() / if tolerant { 5_000 } else { 15_000 };
    let n_crossing = crossing.len();
    if n_crossing <= crossing_allowed {
        crossing = intersecting(&midway, &compacted.connectivity.faces);
    }
    if crossing.len() > crossing_allowed {
        counts.refused.intersecting += 1;
        let points = crossing.iter().map(|&f| middle(compacted.faces[f as usize])).collect();
        let corners = crossing.iter().flat_map(|&f| compacted.connectivity.faces[f as usize]);
        return Ok(Err(Refusal { crossing: corners.collect(), points, ..Refusal::default() }));
    }
    let failed_allowed = positions.len() / if tolerant { 500 } else { 2_000 };
    if lost.len() > failed_allowed {
        counts.refused.not_reached += 1;
        let points = lost.iter().map(|&v| mesh.position(v)).collect();
        return Ok(Err(Refusal { points, ..Refusal::default() }));
    }
    let moved = motion_of_most(mesh, compacted, &positions, &normals);
    Ok(Ok(Advanced { positions, normals, moved, n_crossing }))
}

/// Where the vertices are half-way between two sampling isovalues.
fn midway(compacted: &Compacted, positions: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let both = compacted.positions.iter().zip(positions);
    both.map(|(&p, &q)| (0.5 * (Vec3::from(p) + Vec3::from(q))).to_array()).collect()
}

/// How far most vertices that are not of caps have moved, voxels, at most [`MOST_ALONG`] times as far as across the
/// isosurface.
fn motion_of_most(
    mesh: &Mesh,
    compacted: &Compacted,
    positions: &[[f32; 3]],
    normals: &[[f32; 3]],
) -> f32 {
    let both = compacted.vertices.iter().zip(positions.iter().zip(&compacted.positions));
    let moving = both.zip(normals).filter(|&((&v, _), _)| !is_of_cap(mesh, v));
    let (mut all, mut across): (Vec<f32>, Vec<f32>) = moving
        .map(|((_, (&p, &q)), &n)| {
            let way = Vec3::from(p) - Vec3::from(q);
            (way.length(), way.dot(Vec3::from(n)).abs())
        })
        .unzip();
    if all.is_empty() {
        return 0.0;
    }
    let i = all.len() * 95 / 100;
    let [all, across] =
        [&mut all, &mut across].map(|m| *m.select_nth_unstable_by(i, f32::total_cmp).1);
    all.min(MOST_ALONG * across)
}

/// How far most vertices that are not of caps will move, from the field's gradient, voxels.
pub(super) fn expected_motion(mesh: &Mesh, field: &Field, at: f64, next: f64) -> f32 {
    let change = (field.isovalue(next) - field.isovalue(at)).abs();
    let slopes = inner_slopes(mesh, field, MOTION_VERTICES);
    let mut motion: Vec<f32> = slopes.into_iter().map(|s| change / s.max(1e-12)).collect();
    if motion.is_empty() {
        return 0.0;
    }
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

/// Whether the mesh half-way between two sampling isovalues follows its isosurface nearly as well as it does where
/// it is: faces that are off there are off however short the step.
fn follows_midway(
    mesh: &Mesh,
    compacted: &Compacted,
    field: &Field,
    parameters: &Parameters,
    midway: &[[f32; 3]],
    at: f64,
    next: f64,
) -> bool {
    let faces = &compacted.connectivity.faces;
    let stride = faces.len() / MIDWAY_FACES + 1;
    let sampled = compacted.faces.iter().zip(faces).step_by(stride);
    let looked_at: Vec<[u32; 3]> =
        sampled.filter(|&(&f, _)| !mesh.is_cap(f)).map(|(_, &t)| t).collect();
    let n_off = |isovalue: f64, positions: &[[f32; 3]]| {
        let place = |v: u32| Vec3::from(positions[v as usize]);
        let criteria = Criteria::new(field, isovalue, parameters);
        let is_off = |t: &&[u32; 3]| criteria.deviation(t.map(place)) > parameters.error as f32;
        looked_at.iter().filter(is_off).count()
    };
    let most = 1.0 + MIDWAY_SHARE * looked_at.len() as f32;
    let off = n_off(0.5 * (at + next), midway);
    off as f32 <= most || off as f32 - OFF_GROWTH * n_off(at, &compacted.positions) as f32 <= most
}
