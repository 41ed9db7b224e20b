//! One mesh against the isosurface it should be: everything verification measures at one isovalue.
//!
//! Geometry is measured inside the volume only. Caps lie outside it by definition, and the
//! triangles that carry them to the border belong to no isosurface of the volume.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::distribution::Distribution;
use super::geometry::{Point, along, area_vector, barycentre, length};
use super::ray::{Hit, distance_along};
use super::triangle_grid::TriangleGrid;
use crate::mesh::radius_ratio;
use crate::spectrum::SurfaceMesh;
use crate::volume::Volume;

/// Farthest that a distance is measured, voxels.
pub(super) const REACH: f64 = 4.0;

/// Most points of the isosurface whose distance to the mesh is measured at one isovalue.
const MOST_POINTS: usize = 20_000;

/// Distances and shapes of one mesh, or of all meshes pooled.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    /// From used vertices to the isosurface, along their area-weighted normals, voxels.
    pub vertex_deviation: Distribution,
    /// From barycentres to the isosurface, along the triangles' normals, voxels.
    pub barycentre_deviation: Distribution,
    /// From points of the isosurface on lattice edges to the mesh, voxels.
    pub surface_deviation: Distribution,
    /// 2r/R of triangles.
    pub radius_ratio: Distribution,
    /// Triangles whose normal points to higher values.
    pub inverted: u64,
}

impl Geometry {
    /// Nothing measured yet.
    pub(super) fn new() -> Self {
        Geometry {
            vertex_deviation: Distribution::new(REACH),
            barycentre_deviation: Distribution::new(REACH),
            surface_deviation: Distribution::new(REACH),
            radius_ratio: Distribution::new(1.0),
            inverted: 0,
        }
    }

    /// Pools the measurements of another isovalue into these.
    pub(super) fn merge(&mut self, other: &Geometry) {
        self.vertex_deviation.merge(&other.vertex_deviation);
        self.barycentre_deviation.merge(&other.barycentre_deviation);
        self.surface_deviation.merge(&other.surface_deviation);
        self.radius_ratio.merge(&other.radius_ratio);
        self.inverted += other.inverted;
    }
}

/// Whether every position is finite and inside the volume with the layer around it; no other mesh
/// can be measured.
pub(super) fn is_placed(volume: &Volume, mesh: &SurfaceMesh) -> bool {
    let size = volume.voxel_size();
    mesh.positions.iter().all(|p| {
        (0..3).all(|a| {
            let x = f64::from(p[a]) / size[a];
            // The layer is one cell thick; a hair more is rounding of f32.
            x >= -1.001 && x <= volume.dims()[a] as f64 + 0.001
        })
    })
}

/// Measures a mesh that [`is_placed`].
pub(super) fn measure(
    volume: &Volume,
    isovalue: f64,
    mesh: &SurfaceMesh,
    grid: &TriangleGrid<'_>,
) -> Geometry {
    let mut geometry = Geometry::new();
    let positions: Vec<Point> = mesh.positions.iter().map(|p| p.map(f64::from)).collect();
    let inside: Vec<bool> = positions.iter().map(|&p| is_inside(volume, p)).collect();
    let mut vertex_normals = vec![[0.0; 3]; positions.len()];
    let mut judged = Vec::with_capacity(mesh.triangles.len());
    for (triangle, &cap) in mesh.triangles.iter().zip(&mesh.caps) {
        let corners = triangle.map(|v| positions[v as usize]);
        let normal = area_vector(corners);
        for &v in triangle {
            vertex_normals[v as usize] = along(vertex_normals[v as usize], 1.0, normal);
        }
        if !cap && triangle.iter().all(|&v| inside[v as usize]) {
            geometry.radius_ratio.add(radius_ratio(corners.map(DVec3::from)));
            judged.push((barycentre(corners), normal));
        }
    }
    geometry.inverted =
        judged.par_iter().filter(|&&(point, normal)| is_inverted(volume, point, normal)).count()
            as u64;
    add_deviations(&mut geometry.barycentre_deviation, volume, isovalue, &judged);

    let mut used: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let vertices: Vec<(Point, Point)> = used
        .iter()
        .map(|&v| v as usize)
        .filter(|&v| inside[v])
        .map(|v| (positions[v], vertex_normals[v]))
        .collect();
    add_deviations(&mut geometry.vertex_deviation, volume, isovalue, &vertices);

    let points = lattice_crossings(volume, isovalue);
    let distances: Vec<f64> = points.par_iter().map(|&p| grid.distance(p, REACH)).collect();
    distances.into_iter().for_each(|d| geometry.surface_deviation.add(d));
    geometry
}

/// Adds the distances of points along their normals, of any length. A line that leaves the volume
/// first says nothing; one that meets no isosurface within reach counts as [`REACH`].
fn add_deviations(
    into: &mut Distribution,
    volume: &Volume,
    isovalue: f64,
    points: &[(Point, Point)],
) {
    let distances: Vec<Hit> = points
        .par_iter()
        .map(|&(point, normal)| {
            let n = length(normal);
            // A triangle of no area has no normal; its shape is told by its radius ratio.
            if n < 1e-12 {
                return Hit::Border;
            }
            distance_along(volume, isovalue, point, normal.map(|x| x / n), REACH)
        })
        .collect();
    for hit in distances {
        match hit {
            Hit::At(t) => into.add(t),
            Hit::Nothing => into.add(REACH),
            Hit::Border => {}
        }
    }
}

fn is_inside(volume: &Volume, p: Point) -> bool {
    let size = volume.voxel_size();
    (0..3).all(|a| p[a] >= -1e-6 && p[a] <= (volume.dims()[a] - 1) as f64 * size[a] + 1e-6)
}

/// Whether the field rises along a triangle's normal, from one side of it to the other.
fn is_inverted(volume: &Volume, point: Point, normal: Point) -> bool {
    const STEP: f64 = 0.05;
    let n = length(normal);
    let (out, back) = (along(point, STEP / n, normal), along(point, -STEP / n, normal));
    n > 1e-12
        && is_inside(volume, out)
        && is_inside(volume, back)
        && volume.value_at(out) > volume.value_at(back)
}

/// Points where the isosurface crosses lattice edges, voxel frame; where there are more than
/// [`MOST_POINTS`], every so many.
pub(super) fn lattice_crossings(volume: &Volume, isovalue: f64) -> Vec<Point> {
    let [nx, ny, nz] = volume.dims();
    let size = volume.voxel_size();
    let in_slice = |k: usize| {
        let mut points = Vec::new();
        for j in 0..ny {
            for i in 0..nx {
                let here = volume.sample(i, j, k);
                for axis in 0..3 {
                    let mut next = [i, j, k];
                    next[axis] += 1;
                    if next[axis] == [nx, ny, nz][axis] {
                        continue;
                    }
                    let there = volume.sample(next[0], next[1], next[2]);
                    if (here > isovalue) != (there > isovalue) {
                        let mut p = [i as f64, j as f64, k as f64];
                        p[axis] += (isovalue - here) / (there - here);
                        points.push(std::array::from_fn(|a| p[a] * size[a]));
                    }
                }
            }
        }
        points
    };
    let points: Vec<Point> = (0..nz).into_par_iter().flat_map_iter(in_slice).collect();
    let stride = points.len().div_ceil(MOST_POINTS).max(1);
    points.into_iter().step_by(stride).collect()
}

/// How far the surface moves from one mesh to another: distances of vertices and barycentres of
/// either from the other, voxels, at most [`REACH`].
pub(super) fn jump(isovalue: f64, before: &SurfaceMesh, after: &SurfaceMesh) -> Jump {
    let one_sided = |from: &SurfaceMesh, to: &SurfaceMesh| -> Vec<f64> {
        let grid = TriangleGrid::new(to);
        let corners = from.triangles.par_iter().zip(&from.caps).filter(|(_, cap)| !**cap);
        corners
            .map(|(t, _)| t.map(|v| from.positions[v as usize].map(f64::from)))
            .flat_map_iter(|c| [c[0], c[1], c[2], barycentre(c)].map(|p| grid.distance(p, REACH)))
            .collect()
    };
    let [mut one, mut other] = [one_sided(before, after), one_sided(after, before)];
    let p99 = percentile_99(&mut one).max(percentile_99(&mut other));
    let largest = one.into_iter().chain(other).fold(0.0, f64::max);
    Jump { isovalue, largest, p99 }
}

/// How far the surface moves across one isovalue, voxels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Jump {
    /// The isovalue.
    pub isovalue: f64,
    /// Largest distance between the surfaces just before and just after.
    pub largest: f64,
    /// 99th percentile of the distances.
    pub p99: f64,
}

impl Jump {
    /// That of a mesh that cannot be measured.
    pub(super) fn out_of_reach(isovalue: f64) -> Self {
        Jump { isovalue, largest: REACH, p99: REACH }
    }
}

/// The value that one in a hundred exceeds; 0 of none. Leaves the values in another order.
fn percentile_99(values: &mut [f64]) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let (_, value, _) = values.select_nth_unstable_by(last * 99 / 100, f64::total_cmp);
    *value
}
