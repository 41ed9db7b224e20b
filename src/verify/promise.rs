//! What is promised of a spectrum, and whether one keeps it.
//!
//! Topology is promised at every isovalue. Geometry is promised as percentiles over all meshes at the random
//! isovalues together, for two reasons: a mesh that follows the isosurface is within the tolerance, but
//! where the exact extraction shows, its triangles are flat inside a cell, however curved the isosurface is there; and
//! beside events a mesh is operated on. How far a flat triangle is off depends on the field alone, so the limits
//! of the last hundredth do not shrink with the tolerance.
//!
//! Not promised: a least radius ratio (the triangles of an exact extraction may be slivers), and that nothing
//! jumps at events.

use serde::Serialize;

use super::{Summary, Totals};

/// Most triangles that cross others, as a share.
const CROSSING: f64 = 0.002;

/// Most triangles that face the wrong side, as a share.
const INVERTED: f64 = 0.05;

/// How far all but one in a hundred points may be off where the tolerance is small, voxels: barycentres from the
/// isosurface; the isosurface from the mesh; what the mesh jumps beyond the isosurface.
const FLAT: f64 = 1.0;
const UNCOVERED: f64 = 0.5;
const JUMP: f64 = 0.5;

/// The same in tolerances, which may grow so much where a mesh is crowded.
const CROWDED: f64 = 2.5;

/// What a spectrum must keep to pass; what is `None` is as promised. That every mesh is a closed oriented
/// manifold with finite positions inside the volume is no matter of degree, so it has no limit here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Limits {
    /// Most isovalues with a wrong number of components or Euler characteristic.
    pub topology_wrong: usize,
    /// Largest 99th percentile of the barycentres' distances from the isosurface, voxels.
    pub deviation: Option<f64>,
    /// Largest share of triangles that cross others.
    pub self_intersecting: Option<f64>,
    /// Smallest mean radius ratio; none is promised.
    pub radius_ratio: Option<f64>,
    /// Largest 99th percentile of what the mesh jumps beyond the isosurface, away from events, voxels.
    pub jump: Option<f64>,
}

/// One promise, and what was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Promise {
    /// What is measured, and how it must be.
    pub what: &'static str,
    /// What was found; `None` where there was nothing to measure.
    pub found: Option<f64>,
    /// The most that it may be, or the least.
    pub limit: f64,
    /// `voxel`, `%`, or empty for counts and ratios.
    pub unit: &'static str,
    /// Whether it is kept.
    pub kept: bool,
}

impl Promise {
    fn at_most(what: &'static str, found: Option<f64>, limit: f64, unit: &'static str) -> Self {
        Promise { what, found, limit, unit, kept: found.is_none_or(|found| found <= limit) }
    }

    fn voxels(what: &'static str, found: Option<f64>, limit: f64) -> Self {
        Promise::at_most(what, found, limit, "voxel")
    }

    fn share(what: &'static str, found: f64, limit: f64) -> Self {
        Promise::at_most(what, Some(100.0 * found), 100.0 * limit, "%")
    }

    fn none_of(what: &'static str, found: usize, limit: usize) -> Self {
        Promise::at_most(what, Some(found as f64), limit as f64, "")
    }
}

/// Everything that is promised, in the order of the README, and what else a limit was given for.
pub(super) fn judged(
    totals: &Totals,
    beyond: &Summary,
    limits: &Limits,
    tolerance: f64,
) -> Vec<Promise> {
    let n = totals.isovalues;
    let last = |least: f64| least.max(CROWDED * tolerance);
    let [vertices, barycentres, isosurface] =
        [&totals.vertex_deviation, &totals.barycentre_deviation, &totals.surface_deviation];
    let mut all = vec![
        Promise::none_of(
            "isovalues with wrong topology",
            n - totals.topology_right,
            limits.topology_wrong,
        ),
        Promise::none_of("isovalues with no closed oriented manifold", n - totals.manifold, 0),
        Promise::none_of(
            "isovalues with positions not finite or not in the volume",
            n - totals.finite,
            0,
        ),
        Promise::share(
            "triangles that cross others",
            totals.self_intersecting_share,
            limits.self_intersecting.unwrap_or(CROSSING),
        ),
        Promise::share("triangles that face the wrong side", totals.inverted_share, INVERTED),
        Promise::voxels("vertices from isosurface, 99 % within", vertices.p99, CROWDED * tolerance),
        Promise::voxels("barycentres from isosurface, 50 % within", barycentres.p50, tolerance),
        Promise::voxels(
            "barycentres from isosurface, 99 % within",
            barycentres.p99,
            limits.deviation.unwrap_or(last(FLAT)),
        ),
        Promise::voxels("isosurface from mesh, 75 % within", isosurface.p75, tolerance),
        Promise::voxels("isosurface from mesh, 99 % within", isosurface.p99, last(UNCOVERED)),
        Promise::voxels(
            "jumps away from events, 99 % within",
            beyond.p99,
            limits.jump.unwrap_or(last(JUMP)),
        ),
    ];
    if let (Some(found), Some(limit)) = (totals.radius_ratio.mean, limits.radius_ratio) {
        let what = "mean radius ratio, at least";
        all.push(Promise { what, found: Some(found), limit, unit: "", kept: found >= limit });
    }
    all
}

/// What is not kept, one sentence each.
pub(super) fn failures(promises: &[Promise]) -> Vec<String> {
    let broken = promises.iter().filter(|promise| !promise.kept);
    broken
        .map(|p| {
            let found = p.found.map_or_else(|| "nothing".to_owned(), |x| format!("{x:.4}"));
            let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
            let found = found.trim_end_matches('0').trim_end_matches('.');
            format!("{}: {found}{unit}, expected {}{unit}", p.what, p.limit)
        })
        .collect()
}
