//! One mesh against the isosurface it should be: everything verification measures at one isovalue.
//!
//! Geometry is measured inside the volume only. Caps lie outside it by definition, and the
//! triangles that carry them to the border belong to no isosurface of the volume.

use glam::DVec3;
use rayon::prelude::*;

use super::distribution::Distribution;
use super::geometry::{Point, along, area_vector, barycentre, length};
use super::ray::{Hit, distance_near};
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
    /// From used vertices to the isosurface, along lines (see [`distance_near`]), voxels.
    pub vertex_deviation: Distribution,
    /// From barycentres to the isosurface, likewise, voxels.
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
    let mut geometry = of_triangles(volume, isovalue, mesh);
    add_vertices(&mut geometry.vertex_deviation, volume, isovalue, mesh);
    let points = lattice_crossings(volume, isovalue);
    let distances: Vec<f64> = points.par_iter().map(|&p| grid.distance(p, REACH)).collect();
    distances.into_iter().for_each(|d| geometry.surface_deviation.add(d));
    geometry
}

/// Measures the triangles of a mesh that [`is_placed`], and neither its vertices nor what it lacks.
pub(super) fn of_triangles(volume: &Volume, isovalue: f64, mesh: &SurfaceMesh) -> Geometry {
    let mut geometry = Geometry::new();
    let mut judged = Vec::with_capacity(mesh.triangles.len());
    for (triangle, _) in mesh.triangles.iter().zip(&mesh.caps).filter(|(_, cap)| !**cap) {
        let corners = triangle.map(|v| mesh.positions[v as usize].map(f64::from));
        if corners.iter().all(|&p| is_inside(volume, p)) {
            geometry.radius_ratio.add(radius_ratio(corners.map(DVec3::from)));
            judged.push((barycentre(corners), area_vector(corners)));
        }
    }
    geometry.inverted =
        judged.par_iter().filter(|&&(point, normal)| is_inverted(volume, point, normal)).count()
            as u64;
    add_deviations(&mut geometry.barycentre_deviation, volume, isovalue, &judged);
    geometry
}

/// Adds the distances of the vertices of a mesh that are used and inside the volume.
fn add_vertices(into: &mut Distribution, volume: &Volume, isovalue: f64, mesh: &SurfaceMesh) {
    let positions: Vec<Point> = mesh.positions.iter().map(|p| p.map(f64::from)).collect();
    let mut normals = vec![[0.0; 3]; positions.len()];
    for triangle in &mesh.triangles {
        let normal = area_vector(triangle.map(|v| positions[v as usize]));
        for &v in triangle {
            normals[v as usize] = along(normals[v as usize], 1.0, normal);
        }
    }
    let mut used: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let inside = used.iter().map(|&v| v as usize).filter(|&v| is_inside(volume, positions[v]));
    let vertices: Vec<(Point, Point)> = inside.map(|v| (positions[v], normals[v])).collect();
    add_deviations(into, volume, isovalue, &vertices);
}

/// Adds the distances of points with their normals, of any length. Lines that leave the volume
/// first say nothing; where none meets an isosurface within reach that counts as [`REACH`].
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
            let normal = (n >= 1e-12).then(|| normal.map(|x| x / n));
            distance_near(volume, isovalue, point, normal, REACH)
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
