//! Jumps of the mesh from one isovalue to the next.
//!
//! The isosurface itself may jump: across a region of equal samples, or where a sheet of it vanishes. The
//! promise is therefore about the jump of the mesh *beyond* that: for a point of the mesh on one
//! side, its distance from the mesh on the other side minus its distance from the isosurface there. By the triangle
//! inequality that is at most the distance of the isosurface from the mesh there, so a mesh that is
//! close to the isosurface on both sides does not jump.

use rayon::prelude::*;
use serde::Serialize;

use super::distribution::Distribution;
use super::geometry::{Point, barycentre};
use super::measure::{MAX_DISTANCE, is_placed};
use super::triangle_grid::TriangleGrid;
use crate::extract::extract;
use crate::spectrum::Mesh;
use crate::topology::exact::ExactField;

/// Most triangles of a mesh whose jump is measured: percentiles of four times as many points are accurate.
const MAX_TRIANGLES: usize = 5_000;

/// Motion of the mesh across one isovalue, voxels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Jump {
    /// The isovalue.
    pub isovalue: f64,
    /// Largest distance between the meshes just before and just after, of the triangles measured.
    pub largest: f64,
    /// 99th percentile of the distances.
    pub p99: f64,
    /// 99th percentile of the jumps of the mesh beyond those of the isosurface.
    pub beyond_p99: f64,
}

/// The mesh and the isosurface at one isovalue.
struct Side<'a> {
    mesh: &'a Mesh,
    isosurface: Mesh,
}

impl<'a> Side<'a> {
    fn of(field: &ExactField<'_>, (isovalue, mesh): (f64, &'a Mesh)) -> Self {
        let exact = extract(field, isovalue);
        let isosurface = Mesh {
            positions: exact.positions,
            normals: Vec::new(),
            triangles: exact.faces,
            caps: exact.caps,
        };
        Side { mesh, isosurface }
    }

    /// For vertices and barycentres of triangles that are no caps, the distance from the mesh of the other side, and how much
    /// larger it is than that from the isosurface there. Of a large mesh, evenly distributed triangles are measured.
    fn distances(&self, other: &Side) -> Vec<(f64, f64)> {
        let (grid, exact) = (TriangleGrid::new(other.mesh), TriangleGrid::new(&other.isosurface));
        let distances = |p: Point| {
            let moved = grid.distance(p, MAX_DISTANCE);
            let beyond = if moved > 0.0 { moved - exact.distance(p, moved) } else { 0.0 };
            (moved, beyond.max(0.0))
        };
        let positions: Vec<Point> = self.mesh.positions.iter().map(|p| p.map(f64::from)).collect();
        let proper = self.mesh.triangles.iter().zip(&self.mesh.caps).filter(|(_, cap)| !**cap);
        let every = self.mesh.triangles.len().div_ceil(MAX_TRIANGLES).max(1);
        let triangles: Vec<[u32; 3]> = proper.map(|(t, _)| *t).step_by(every).collect();
        let mut is_used = vec![false; positions.len()];
        triangles.iter().flatten().for_each(|&v| is_used[v as usize] = true);
        // Computed once per vertex; each counts once for each of its triangles.
        let of_vertex = |(&p, &is_used)| if is_used { distances(p) } else { (0.0, 0.0) };
        let of_vertices: Vec<(f64, f64)> =
            positions.par_iter().zip(&is_used).map(of_vertex).collect();
        triangles
            .par_iter()
            .flat_map_iter(|t| {
                let [a, b, c] = t.map(|v| of_vertices[v as usize]);
                [a, b, c, distances(barycentre(t.map(|v| positions[v as usize])))]
            })
            .collect()
    }
}

/// The jump from one mesh to another, each with its isovalue. Jumps beyond the isosurface
/// are also added to `pooled`.
pub(super) fn jump(
    field: &ExactField<'_>,
    before: (f64, &Mesh),
    after: (f64, &Mesh),
    pooled: &mut Distribution,
) -> Jump {
    let isovalue = 0.5 * (before.0 + after.0);
    if [before.1, after.1].iter().any(|mesh| !is_placed(field.volume(), mesh)) {
        // A mesh that cannot be measured counts as the largest jump.
        pooled.add(MAX_DISTANCE);
        return Jump {
            isovalue,
            largest: MAX_DISTANCE,
            p99: MAX_DISTANCE,
            beyond_p99: MAX_DISTANCE,
        };
    }
    let sides = [before, after].map(|side| Side::of(field, side));
    let all = [sides[0].distances(&sides[1]), sides[1].distances(&sides[0])];
    let mut jump = Jump { isovalue, largest: 0.0, p99: 0.0, beyond_p99: 0.0 };
    for distances in all {
        let (mut moved, mut beyond): (Vec<f64>, Vec<f64>) = distances.into_iter().unzip();
        beyond.iter().for_each(|&d| pooled.add(d));
        jump.largest = moved.iter().copied().fold(jump.largest, f64::max);
        jump.p99 = percentile_99(&mut moved).max(jump.p99);
        jump.beyond_p99 = percentile_99(&mut beyond).max(jump.beyond_p99);
    }
    jump
}

/// The 99th percentile; 0 if there are no values. Reorders the values.
fn percentile_99(values: &mut [f64]) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let (_, value, _) = values.select_nth_unstable_by(last * 99 / 100, f64::total_cmp);
    *value
}
