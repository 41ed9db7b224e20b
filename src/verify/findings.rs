//! Measurements of a verification at each isovalue, and totals over all isovalues.

use serde::Serialize;

use super::coherence::Coherence;
use super::distribution::Summary;
use super::jump::Jump;
use super::manifold::MeshTopology;
use super::measure::Geometry;

/// Measurements at one isovalue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Row {
    /// The isovalue.
    pub isovalue: f64,
    /// Whether it is just before or after an event, or a birth or death of triangles.
    pub at_event: bool,
    /// Whether it is the value of a sample or an event or a number next to it, where only topology is measured.
    pub is_neighbour: bool,
    /// Triangles of the mesh.
    pub n_triangles: usize,
    /// Components of the isosurface, counted from the samples.
    pub expected_components: usize,
    /// Euler characteristic of the isosurface, counted from the samples.
    pub expected_euler: i64,
    /// Topology of the mesh.
    pub topology: MeshTopology,
    /// Whether all positions are finite and inside the volume with the layer around it.
    pub finite: bool,
    /// Triangles that cross others.
    pub self_intersecting: usize,
    /// From barycentres to the isosurface, voxels.
    pub barycentre_deviation: Summary,
    /// 2r/R of the triangles.
    pub radius_ratio: Summary,
}

impl Row {
    /// Whether components and Euler characteristic are those of the isosurface.
    pub fn topology_right(&self) -> bool {
        self.topology.components == self.expected_components
            && self.topology.euler == self.expected_euler
    }
}

/// How continuous the mesh is in the isovalue.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Continuity {
    /// Jumps across some events.
    pub at_events: Vec<Jump>,
    /// Jumps of the mesh beyond those of the isosurface at these events, over all their points.
    pub beyond_at_events: Summary,
    /// Jumps across the isovalues, away from events, at which most triangles are born or die.
    pub elsewhere: Vec<Jump>,
    /// Jumps of the mesh beyond those of the isosurface at these isovalues.
    pub beyond_elsewhere: Summary,
    /// Triangles that survive events.
    pub coherence: Coherence,
    /// Share of vertices that are still in the mesh after a 256th of the range.
    pub tracked_share: Option<f64>,
}

/// Totals over all isovalues; geometry only over the random ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Totals {
    /// Number of isovalues.
    pub isovalues: usize,
    /// Isovalues with the right number of components and Euler characteristic.
    pub topology_right: usize,
    /// Isovalues whose mesh is a closed oriented manifold.
    pub manifold: usize,
    /// Isovalues whose positions are all finite and inside.
    pub finite: usize,
    /// Mean number of triangles.
    pub n_triangles: f64,
    /// Share of all triangles that cross others.
    pub self_intersecting_share: f64,
    /// Share of triangles whose normal points to the inner side.
    pub inverted_share: f64,
    /// From vertices to the isosurface, voxels.
    pub vertex_deviation: Summary,
    /// From barycentres to the isosurface, voxels.
    pub barycentre_deviation: Summary,
    /// From the isosurface to the mesh, voxels.
    pub surface_deviation: Summary,
    /// 2r/R of the triangles.
    pub radius_ratio: Summary,
    /// Largest jump across an event, voxels.
    pub largest_jump: Option<f64>,
    /// Largest of the 99th percentiles of the jumps across events, voxels.
    pub largest_jump_p99: Option<f64>,
    /// Largest jump where triangles are born or die away from events, voxels.
    pub largest_jump_elsewhere: Option<f64>,
    /// Largest of the 99th percentiles of these, voxels.
    pub largest_jump_elsewhere_p99: Option<f64>,
    /// Of the triangles alive just before an event, the share alive just after.
    pub survived_share: Option<f64>,
    /// Share of vertices that are still in the mesh after a 256th of the range.
    pub tracked_share: Option<f64>,
}

impl Totals {
    pub(super) fn of(rows: &[Row], pooled: &Geometry, continuity: &Continuity) -> Totals {
        let largest = |jumps: &[Jump], of: fn(&Jump) -> f64| jumps.iter().map(of).reduce(f64::max);
        let Continuity { at_events, elsewhere, .. } = continuity;
        let n_where = |holds: fn(&Row) -> bool| rows.iter().filter(|row| holds(row)).count();
        let compared: Vec<&Row> = rows.iter().filter(|row| !row.is_neighbour).collect();
        let n_triangles: usize = compared.iter().map(|row| row.n_triangles).sum();
        let crossing: usize = rows.iter().map(|row| row.self_intersecting).sum();
        let radius_ratio = pooled.radius_ratio.summary();
        Totals {
            isovalues: rows.len(),
            topology_right: n_where(Row::topology_right),
            manifold: n_where(|row| row.topology.is_closed_manifold()),
            finite: n_where(|row| row.finite),
            n_triangles: n_triangles as f64 / compared.len().max(1) as f64,
            self_intersecting_share: crossing as f64 / n_triangles.max(1) as f64,
            inverted_share: pooled.inverted as f64 / radius_ratio.n.max(1) as f64,
            vertex_deviation: pooled.vertex_deviation.summary(),
            barycentre_deviation: pooled.barycentre_deviation.summary(),
            surface_deviation: pooled.surface_deviation.summary(),
            radius_ratio,
            largest_jump: largest(at_events, |j| j.largest),
            largest_jump_p99: largest(at_events, |j| j.p99),
            largest_jump_elsewhere: largest(elsewhere, |j| j.largest),
            largest_jump_elsewhere_p99: largest(elsewhere, |j| j.p99),
            survived_share: continuity.coherence.survived_share,
            tracked_share: continuity.tracked_share,
        }
    }
}
