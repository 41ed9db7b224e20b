//! How far the surface jumps from one isovalue to the next.
//!
//! An isosurface may jump itself: across a region of equal samples, or where a sheet of it vanishes. What
//! is promised of the mesh is therefore what it jumps *beyond* that: for a point of the mesh on one
//! side, how much farther it is from the mesh than from the isosurface on the other side. By the inequality
//! of the triangle that is at most the distance of the isosurface from the mesh there, so what is
//! close on both sides does not jump.

use rayon::prelude::*;
use serde::Serialize;

use super::distribution::Distribution;
use super::geometry::{Point, barycentre};
use super::measure::{REACH, is_placed};
use super::triangle_grid::TriangleGrid;
use crate::extract::extract;
use crate::spectrum::SurfaceMesh;
use crate::topology::exact::ExactField;

/// How far the surface moves across one isovalue, voxels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Jump {
    /// The isovalue.
    pub isovalue: f64,
    /// Largest distance between the meshes just before and just after.
    pub largest: f64,
    /// 99th percentile of the distances.
    pub p99: f64,
    /// 99th percentile of what the mesh jumps beyond the isosurface.
    pub beyond_p99: f64,
}

/// The mesh and the isosurface at one isovalue.
struct Side<'a> {
    mesh: &'a SurfaceMesh,
    isosurface: SurfaceMesh,
}

impl<'a> Side<'a> {
    fn of(field: &ExactField<'_>, (isovalue, mesh): (f64, &'a SurfaceMesh)) -> Self {
        let exact = extract(field, isovalue);
        let isosurface = SurfaceMesh {
            positions: exact.positions,
            normals: Vec::new(),
            triangles: exact.faces,
            caps: exact.caps,
        };
        Side { mesh, isosurface }
    }

    /// Vertices and barycentres of the mesh without caps: how far each is from the mesh of another side, and how
    /// much farther than from the isosurface there.
    fn distances(&self, other: &Side) -> Vec<(f64, f64)> {
        let (grid, exact) = (TriangleGrid::new(other.mesh), TriangleGrid::new(&other.isosurface));
        let distances = |p: Point| {
            let moved = grid.distance(p, REACH);
            let beyond = if moved > 0.0 { moved - exact.distance(p, REACH) } else { 0.0 };
            (moved, beyond.max(0.0))
        };
        let positions: Vec<Point> = self.mesh.positions.iter().map(|p| p.map(f64::from)).collect();
        // Once each, though they count once for each of their triangles.
        let of_vertices: Vec<(f64, f64)> = positions.par_iter().map(|&p| distances(p)).collect();
        let triangles = self.mesh.triangles.par_iter().zip(&self.mesh.caps);
        triangles
            .filter(|(_, cap)| !**cap)
            .flat_map_iter(|(t, _)| {
                let [a, b, c] = t.map(|v| of_vertices[v as usize]);
                [a, b, c, distances(barycentre(t.map(|v| positions[v as usize])))]
            })
            .collect()
    }
}

/// How far the surface moves from one mesh to another, each with its isovalue; what it jumps beyond the isosurface
/// is counted in `pooled` too.
pub(super) fn jump(
    field: &ExactField<'_>,
    before: (f64, &SurfaceMesh),
    after: (f64, &SurfaceMesh),
    pooled: &mut Distribution,
) -> Jump {
    let isovalue = 0.5 * (before.0 + after.0);
    if [before.1, after.1].iter().any(|mesh| !is_placed(field.volume(), mesh)) {
        // What cannot be measured jumps as far as anything can.
        pooled.add(REACH);
        return Jump { isovalue, largest: REACH, p99: REACH, beyond_p99: REACH };
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

/// The value that one in a hundred exceeds; 0 of none. Leaves the values in another order.
fn percentile_99(values: &mut [f64]) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let (_, value, _) = values.select_nth_unstable_by(last * 99 / 100, f64::total_cmp);
    *value
}
