//! Compares a mesh with the isosurface: all geometric measurements at one isovalue.
//!
//! Geometry is measured inside the volume only. Caps are outside by definition, and the
//! triangles that connect them to the border belong to no isosurface of the volume.

use glam::DVec3;
use rayon::prelude::*;

use super::distribution::Distribution;
use super::geometry::{Point, along, area_vector, barycentre, length};
use super::ray::{Hit, distance_near};
use super::triangle_grid::TriangleGrid;
use crate::mesh::radius_ratio;
use crate::spectrum::Mesh;
use crate::volume::{Outside, Volume};

/// Largest distance that is measured, voxels.
pub(super) const MAX_DISTANCE: f64 = 4.0;

/// Most points of the isosurface whose distance to the mesh is measured at one isovalue, and most triangles of a spot check.
const MAX_POINTS: usize = 20_000;

/// Distances and shapes of one mesh, or of several.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    /// From used vertices to the isosurface, along lines (see [`distance_near`]), voxels.
    pub vertex_deviation: Distribution,
    /// From barycentres to the isosurface, along lines, voxels.
    pub barycentre_deviation: Distribution,
    /// From points of the isosurface on lattice edges to the mesh, voxels.
    pub surface_deviation: Distribution,
    /// 2r/R of triangles.
    pub radius_ratio: Distribution,
    /// Triangles whose normal points to the inner side.
    pub inverted: u64,
}

impl Geometry {
    /// Without measurements.
    pub(super) fn new() -> Self {
        Geometry {
            vertex_deviation: Distribution::new(MAX_DISTANCE),
            barycentre_deviation: Distribution::new(MAX_DISTANCE),
            surface_deviation: Distribution::new(MAX_DISTANCE),
            radius_ratio: Distribution::new(1.0),
            inverted: 0,
        }
    }

    /// Adds the measurements of another isovalue.
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
pub(super) fn is_placed(volume: &Volume, mesh: &Mesh) -> bool {
    let size = volume.voxel_size();
    mesh.positions.iter().all(|p| {
        (0..3).all(|a| {
            let x = f64::from(p[a]) / size[a];
            // The layer is one cell thick; the margin is for rounding of f32.
            x >= -1.001 && x <= volume.dims()[a] as f64 + 0.001
        })
    })
}

/// Measures a mesh that [`is_placed`]: at most about `most` of its triangles and of its vertices, evenly distributed, each of which stands
/// for as many.
pub(super) fn measure(
    volume: &Volume,
    isovalue: f64,
    mesh: &Mesh,
    grid: &TriangleGrid<'_>,
    most: usize,
) -> Geometry {
    let mut geometry = of_triangles(volume, isovalue, mesh, stride(mesh.triangles.len(), most));
    add_vertices(&mut geometry.vertex_deviation, volume, isovalue, mesh, most);
    let points = lattice_crossings(volume, isovalue);
    let distances: Vec<f64> = points.par_iter().map(|&p| grid.distance(p, MAX_DISTANCE)).collect();
    distances.into_iter().for_each(|d| geometry.surface_deviation.add(d));
    geometry
}

/// Measures a subset of the triangles of a mesh that [`is_placed`], evenly distributed.
pub(super) fn spot_check(volume: &Volume, isovalue: f64, mesh: &Mesh) -> Geometry {
    of_triangles(volume, isovalue, mesh, stride(mesh.triangles.len(), MAX_POINTS))
}

/// The distance in a list of `n` to the next one of at most `most`.
fn stride(n: usize, most: usize) -> usize {
    n.div_ceil(most).max(1)
}

/// Measures one in `every` triangles of a mesh, without its vertices and the coverage of the isosurface.
fn of_triangles(volume: &Volume, isovalue: f64, mesh: &Mesh, every: usize) -> Geometry {
    let mut geometry = Geometry::new();
    let corners = |triangle: [u32; 3]| triangle.map(|v| mesh.positions[v as usize].map(f64::from));
    let mut measured = Vec::with_capacity(mesh.triangles.len() / every);
    let proper = mesh.triangles.iter().zip(&mesh.caps).filter(|(_, cap)| !**cap);
    for (triangle, _) in proper.step_by(every) {
        let places = corners(*triangle);
        if places.iter().all(|&p| is_inside(volume, p)) {
            geometry.radius_ratio.add_weighted(radius_ratio(places.map(DVec3::from)), every as u64);
            measured.push(*triangle);
        }
    }
    geometry.inverted = measured
        .par_iter()
        .map(|&triangle| corners(triangle))
        .filter(|&c| is_inverted(volume, barycentre(c), area_vector(c)))
        .count() as u64
        * every as u64;
    let distances = measured.par_iter().map(|&t| barycentre_distance(volume, isovalue, corners(t)));
    add_all(&mut geometry.barycentre_deviation, distances.collect(), every);
    geometry
}

/// The distance from a triangle's barycentre to the isosurface: by [`distance`], or to a point found from a corner, if
/// that is nearer. In a flat field, lines and descent from the barycentre of a triangle whose corners are on the
/// isosurface may lead to another sheet, voxels away.
fn barycentre_distance(volume: &Volume, isovalue: f64, corners: [Point; 3]) -> Hit {
    let (point, normal) = (barycentre(corners), area_vector(corners));
    let found = distance(volume, isovalue, (point, normal));
    let mut nearest = match found {
        Hit::At(t) => t,
        Hit::Nothing => MAX_DISTANCE,
        Hit::Border => return found,
    };
    for corner in corners {
        let apart = length(along(point, -1.0, corner));
        if apart < nearest
            && let Hit::At(t) = distance(volume, isovalue, (corner, normal))
        {
            nearest = nearest.min(apart + t);
        }
    }
    if nearest < MAX_DISTANCE { Hit::At(nearest) } else { found }
}

/// Adds the distances of the vertices of a mesh that are inside the volume and have a triangle that is not a cap:
/// vertices of caps alone are on the border, wherever the isosurface is.
fn add_vertices(into: &mut Distribution, volume: &Volume, isovalue: f64, mesh: &Mesh, most: usize) {
    let positions: Vec<Point> = mesh.positions.iter().map(|p| p.map(f64::from)).collect();
    let mut normals = vec![[0.0; 3]; positions.len()];
    let triangles = || mesh.triangles.iter().zip(&mesh.caps).filter(|(_, cap)| !**cap).map(|t| t.0);
    for triangle in triangles() {
        let normal = area_vector(triangle.map(|v| positions[v as usize]));
        for &v in triangle {
            normals[v as usize] = along(normals[v as usize], 1.0, normal);
        }
    }
    let mut is_used = vec![false; positions.len()];
    triangles().flatten().for_each(|&v| is_used[v as usize] = true);
    let used: Vec<u32> = (0..).zip(is_used).filter(|v| v.1).map(|v| v.0).collect();
    let every = stride(used.len(), most);
    let measured = used.iter().step_by(every).map(|&v| v as usize);
    let inside = measured.filter(|&v| is_inside(volume, positions[v]));
    let vertices: Vec<(Point, Point)> = inside.map(|v| (positions[v], normals[v])).collect();
    let distances = vertices.par_iter().map(|&vertex| distance(volume, isovalue, vertex));
    add_all(into, distances.collect(), every);
}

/// The distance of a point with a normal of any length to the isosurface.
fn distance(volume: &Volume, isovalue: f64, (point, normal): (Point, Point)) -> Hit {
    let n = length(normal);
    // A triangle without area has no normal; the radius ratio measures its shape.
    let normal = (n >= 1e-12).then(|| normal.map(|x| x / n));
    distance_near(volume, isovalue, point, normal, MAX_DISTANCE)
}

/// Adds distances. Lines that leave the volume first do not count; points without an isosurface within reach
/// count as [`MAX_DISTANCE`]. Each stands for `every`.
fn add_all(into: &mut Distribution, distances: Vec<Hit>, every: usize) {
    for hit in distances {
        match hit {
            Hit::At(t) => into.add_weighted(t, every as u64),
            Hit::Nothing => into.add_weighted(MAX_DISTANCE, every as u64),
            Hit::Border => {}
        }
    }
}

fn is_inside(volume: &Volume, p: Point) -> bool {
    let size = volume.voxel_size();
    (0..3).all(|a| p[a] >= -1e-6 && p[a] <= (volume.dims()[a] - 1) as f64 * size[a] + 1e-6)
}

/// Whether a triangle's normal points away from the side of the layer around the volume.
fn is_inverted(volume: &Volume, point: Point, normal: Point) -> bool {
    const STEP: f64 = 0.05;
    let n = length(normal);
    let (out, back) = (along(point, STEP / n, normal), along(point, -STEP / n, normal));
    if n <= 1e-12 || !is_inside(volume, out) || !is_inside(volume, back) {
        return false;
    }
    let (out, back) = (volume.value_at(out), volume.value_at(back));
    match volume.outside() {
        Outside::Low => out > back,
        Outside::High => out < back,
    }
}

/// Points where the isosurface crosses lattice edges, voxel frame; a regular subset if there are more than
/// [`MAX_POINTS`].
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
    let every = stride(points.len(), MAX_POINTS);
    points.into_iter().step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::extract;
    use crate::topology::exact::ExactField;
    use crate::volume::{Placement, Samples};

    #[test]
    fn vertices_of_caps_alone_are_not_measured() {
        // A plane. The surface is closed at the border, up to 2.5 voxels from the plane.
        let samples = (0..125u8).map(|i| 4 - i % 5).collect();
        let volume = Volume::new("v", [5; 3], Samples::U8(samples), Placement::default());
        let volume = volume.expect("a valid volume");
        let isovalue = 1.5;
        let exact = extract(&ExactField::new(&volume).expect("a field"), isovalue);
        assert!(exact.caps.contains(&true) && exact.caps.contains(&false));
        let mesh = Mesh {
            positions: exact.positions,
            normals: Vec::new(),
            triangles: exact.faces,
            caps: exact.caps,
        };
        let mut deviation = Distribution::new(MAX_DISTANCE);
        add_vertices(&mut deviation, &volume, isovalue, &mesh, usize::MAX);
        // Rounding of positions.
        assert!(deviation.summary().max.is_some_and(|largest| largest < 1e-5));
    }

    #[test]
    fn the_distance_of_a_barycentre_is_at_most_that_via_a_corner() {
        // Three bumps in a field that is flat between them: no line from the barycentre meets any.
        let bumps = [[3, 5, 5], [7, 5, 5], [5, 8, 5]];
        let at = |i: usize| [i % 11, i / 11 % 11, i / 121];
        let samples = (0..1331).map(|i| u8::from(bumps.contains(&at(i)))).collect();
        let volume = Volume::new("v", [11; 3], Samples::U8(samples), Placement::default());
        let volume = volume.expect("a valid volume");
        let corners = [[3.98, 5.0, 5.0], [6.02, 5.0, 5.0], [5.0, 7.02, 5.0]];
        let middle = barycentre(corners);
        assert_eq!(distance(&volume, 0.02, (middle, area_vector(corners))), Hit::Nothing);
        let Hit::At(t) = barycentre_distance(&volume, 0.02, corners) else { panic!("not found") };
        let apart = length(along(middle, -1.0, corners[0]));
        assert!((t - apart).abs() < 1e-6, "{t}, {apart} to a corner");
    }
}
