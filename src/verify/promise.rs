//! The promises that a spectrum must keep.
//!
//! Topology is promised at every isovalue. Geometry is promised as percentiles over the meshes at all random
//! isovalues, for two reasons: tracked meshes are within the tolerance, but
//! triangles of the exact extraction are flat inside a cell, however curved the isosurface is there; and
//! near events the mesh is rebuilt. The deviation of a flat triangle depends on the field alone, so the limits
//! of the 99th percentiles have a lower bound that is independent of the tolerance.
//!
//! Not promised: a least radius ratio (triangles of the exact extraction may be slivers), and that the mesh does not
//! jump at events.

use serde::Serialize;

use super::distribution::Summary;
use super::findings::Totals;

/// Largest share of self-intersecting triangles.
const MAX_CROSSING_SHARE: f64 = 0.002;

/// Largest share of inverted triangles.
const MAX_INVERTED_SHARE: f64 = 0.05;

/// Least limits of 99th percentiles, for small tolerances, voxels: distance of barycentres from the
/// isosurface; of the isosurface from the mesh; jumps of the mesh beyond those of the isosurface.
const MIN_BARYCENTRE_LIMIT: f64 = 1.0;
const MIN_SURFACE_LIMIT: f64 = 0.5;
const MIN_JUMP_LIMIT: f64 = 0.5;

/// Limits of 99th percentiles in tolerances: the sweep relaxes the tolerance by up to this factor where a mesh is crowded.
const MAX_DEVIATION_FACTOR: f64 = 2.5;

/// The limits of a verification; `None` stands for the promised ones. That every mesh is a closed oriented
/// manifold with finite positions inside the volume is always required.
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

/// Number of promises about shares: those of geometry, the last ones of the default limits.
pub(super) const N_SHARES: usize = 8;

/// What the promises of geometry bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    /// Distance of 99 % of the vertices from the isosurface, voxels.
    pub vertex: f64,
    /// Distance of half of the barycentres from the isosurface, and of 75 % of the isosurface from the mesh: the tolerance, voxels.
    pub typical: f64,
    /// Distance of 99 % of the barycentres from the isosurface, voxels.
    pub barycentre: f64,
    /// Distance of 99 % of the isosurface from the mesh, voxels.
    pub surface: f64,
    /// 99 % of the jumps away from events beyond those of the isosurface, voxels.
    pub jump: f64,
    /// For each promise in their order, the share of the values that may be beyond.
    pub shares: [f64; N_SHARES],
}

impl Bounds {
    pub(super) fn new(limits: &Limits, tolerance: f64) -> Bounds {
        let limit = |min: f64| min.max(MAX_DEVIATION_FACTOR * tolerance);
        let crossing = limits.self_intersecting.unwrap_or(MAX_CROSSING_SHARE);
        Bounds {
            vertex: MAX_DEVIATION_FACTOR * tolerance,
            typical: tolerance,
            barycentre: limits.deviation.unwrap_or(limit(MIN_BARYCENTRE_LIMIT)),
            surface: limit(MIN_SURFACE_LIMIT),
            jump: limits.jump.unwrap_or(limit(MIN_JUMP_LIMIT)),
            shares: [crossing, MAX_INVERTED_SHARE, 0.01, 0.5, 0.01, 0.25, 0.01, 0.01],
        }
    }
}

/// One promise and its measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Promise {
    /// What is measured.
    pub what: &'static str,
    /// The measurement; `None` if there was nothing to measure.
    pub found: Option<f64>,
    /// The largest value that keeps the promise, or the least.
    pub limit: f64,
    /// `voxel`, `%`, or empty for counts and ratios.
    pub unit: &'static str,
    /// Whether it is kept; `None` if there was nothing to measure.
    pub kept: Option<bool>,
}

impl Promise {
    fn at_most(what: &'static str, found: Option<f64>, limit: f64, unit: &'static str) -> Self {
        Promise { what, found, limit, unit, kept: found.map(|found| found <= limit) }
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

/// All promises, in the order of the README, and the radius ratio if it has a limit.
pub(super) fn promises(
    totals: &Totals,
    beyond: &Summary,
    limits: &Limits,
    tolerance: f64,
) -> Vec<Promise> {
    let n = totals.isovalues;
    let bounds = Bounds::new(limits, tolerance);
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
            bounds.shares[0],
        ),
        Promise::share(
            "triangles that face the wrong side",
            totals.inverted_share,
            bounds.shares[1],
        ),
        Promise::voxels("vertices from isosurface, 99 % within", vertices.p99, bounds.vertex),
        Promise::voxels(
            "barycentres from isosurface, 50 % within",
            barycentres.p50,
            bounds.typical,
        ),
        Promise::voxels(
            "barycentres from isosurface, 99 % within",
            barycentres.p99,
            bounds.barycentre,
        ),
        Promise::voxels("isosurface from mesh, 75 % within", isosurface.p75, bounds.typical),
        Promise::voxels("isosurface from mesh, 99 % within", isosurface.p99, bounds.surface),
        Promise::voxels("jumps away from events, 99 % within", beyond.p99, bounds.jump),
    ];
    if let Some(limit) = limits.radius_ratio {
        let (what, found) = ("mean radius ratio, at least", totals.radius_ratio.mean);
        let kept = found.map(|found| found >= limit);
        all.push(Promise { what, found, limit, unit: "", kept });
    }
    all
}

/// One sentence for each promise that is not kept.
pub(super) fn failures(promises: &[Promise]) -> Vec<String> {
    promises.iter().filter(|promise| promise.kept == Some(false)).map(sentence).collect()
}

/// What was found and expected.
pub(super) fn sentence(p: &Promise) -> String {
    let found = p.found.map_or_else(|| "nothing".to_owned(), |x| format!("{x:.4}"));
    let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
    let found = found.trim_end_matches('0').trim_end_matches('.');
    format!("{}: {found}{unit}, expected {}{unit}", p.what, p.limit)
}
