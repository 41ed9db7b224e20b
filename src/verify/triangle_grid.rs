//! A uniform grid of the triangles of a mesh.
//!
//! The grid is sparse, a sorted list of (cell, triangle), so its memory depends on the mesh, not on the
//! volume. It finds triangles that cross each other, and the distance of a point from the mesh.

use rayon::prelude::*;

use super::geometry::{Point, length, point_triangle_distance, segment_crosses_triangle};
use crate::spectrum::Mesh;

/// The triangles of one mesh, by cell.
pub(super) struct TriangleGrid<'a> {
    positions: Vec<Point>,
    triangles: &'a [[u32; 3]],
    cell_size: f64,
    /// (cell, triangle), sorted.
    entries: Vec<([i32; 3], u32)>,
    /// Start in `entries` of each cell that is not empty, and the end.
    cell_starts: Vec<u32>,
}

impl<'a> TriangleGrid<'a> {
    /// Sorts the triangles of a mesh into cells about as large as its edges, one voxel at least.
    pub(super) fn new(mesh: &'a Mesh) -> Self {
        let positions: Vec<Point> = mesh.positions.iter().map(|p| p.map(f64::from)).collect();
        let cell_size = median_edge(&positions, &mesh.triangles).max(1.0);
        let mut entries: Vec<([i32; 3], u32)> = Vec::with_capacity(2 * mesh.triangles.len());
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let (low, high) = bounds(triangle.map(|v| positions[v as usize]));
            let (low, high) = (cell_of(low, cell_size), cell_of(high, cell_size));
            for i in low[0]..=high[0] {
                for j in low[1]..=high[1] {
                    entries.extend((low[2]..=high[2]).map(|k| ([i, j, k], t as u32)));
                }
            }
        }
        entries.par_sort_unstable();
        let mut cell_starts = Vec::new();
        for i in 0..entries.len() {
            if i == 0 || entries[i].0 != entries[i - 1].0 {
                cell_starts.push(i as u32);
            }
        }
        cell_starts.push(entries.len() as u32);
        TriangleGrid { positions, triangles: &mesh.triangles, cell_size, entries, cell_starts }
    }

    fn corners(&self, triangle: u32) -> [Point; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// The triangles that another triangle crosses, each once, by index.
    ///
    /// Neighbours along an edge are not tested, and of neighbours at a vertex only the edges
    /// opposite to that vertex: the others touch.
    pub(super) fn self_intersecting(&self) -> Vec<u32> {
        let cells: Vec<_> = self.cell_starts.windows(2).collect();
        let mut crossing: Vec<u32> = cells
            .par_iter()
            .flat_map_iter(|cell| {
                let inside = &self.entries[cell[0] as usize..cell[1] as usize];
                let mut found = Vec::new();
                for (x, &(_, first)) in inside.iter().enumerate() {
                    for &(_, second) in &inside[x + 1..] {
                        if self.cross(first, second) {
                            found.extend([first, second]);
                        }
                    }
                }
                found
            })
            .collect();
        crossing.par_sort_unstable();
        crossing.dedup();
        crossing
    }

    fn cross(&self, first: u32, second: u32) -> bool {
        let (f, g) = (self.triangles[first as usize], self.triangles[second as usize]);
        let (p, q) = (self.corners(first), self.corners(second));
        let ((f_low, f_high), (g_low, g_high)) = (bounds(p), bounds(q));
        if (0..3).any(|a| f_low[a] > g_high[a] || g_low[a] > f_high[a]) {
            return false;
        }
        if f.iter().filter(|v| g.contains(v)).count() >= 2 {
            return false;
        }
        let edges_cross = |f: [u32; 3], p: [Point; 3], g: [u32; 3], q: [Point; 3]| {
            (0..3).any(|i| {
                let j = (i + 1) % 3;
                let touches = g.contains(&f[i]) || g.contains(&f[j]);
                !touches && segment_crosses_triangle(p[i], p[j], q)
            })
        };
        edges_cross(f, p, g, q) || edges_cross(g, q, f, p)
    }

    /// Distance from a point to the mesh, voxels, at most `reach`.
    pub(super) fn distance(&self, point: Point, reach: f64) -> f64 {
        let home = cell_of(point, self.cell_size);
        let mut nearest = reach;
        let mut ring = 0i32;
        // Cells outside the visited rings are farther than `ring - 1` cells.
        while f64::from(ring - 1) * self.cell_size < nearest {
            for i in -ring..=ring {
                for j in -ring..=ring {
                    // Inner cells belong to earlier rings.
                    let on_shell = i.abs() == ring || j.abs() == ring;
                    let stride = if on_shell { 1 } else { (2 * ring).max(1) };
                    for k in (-ring..=ring).step_by(stride as usize) {
                        let cell = [home[0] + i, home[1] + j, home[2] + k];
                        // Most points are close to the mesh, and neighbouring cells are too far.
                        if self.distance_to_cell(point, cell) >= nearest {
                            continue;
                        }
                        for t in self.in_cell(cell) {
                            nearest = nearest.min(point_triangle_distance(point, self.corners(t)));
                        }
                    }
                }
            }
            ring += 1;
        }
        nearest
    }

    /// Distance from a point to a cell; 0 inside.
    fn distance_to_cell(&self, point: Point, cell: [i32; 3]) -> f64 {
        let along_axis = |a: usize| {
            let low = f64::from(cell[a]) * self.cell_size;
            (low - point[a]).max(point[a] - (low + self.cell_size)).max(0.0)
        };
        length(std::array::from_fn(along_axis))
    }

    fn in_cell(&self, cell: [i32; 3]) -> impl Iterator<Item = u32> {
        let n_cells = self.cell_starts.len() - 1;
        let found = self.cell_starts[..n_cells]
            .binary_search_by(|&start| self.entries[start as usize].0.cmp(&cell));
        let range = match found {
            Ok(i) => self.cell_starts[i] as usize..self.cell_starts[i + 1] as usize,
            Err(_) => 0..0,
        };
        self.entries[range].iter().map(|&(_, t)| t)
    }
}

fn cell_of(p: Point, cell_size: f64) -> [i32; 3] {
    p.map(|x| (x / cell_size).floor() as i32)
}

fn bounds(corners: [Point; 3]) -> (Point, Point) {
    let of = |pick: fn(f64, f64) -> f64| {
        std::array::from_fn(|a| pick(pick(corners[0][a], corners[1][a]), corners[2][a]))
    };
    (of(f64::min), of(f64::max))
}

fn median_edge(positions: &[Point], triangles: &[[u32; 3]]) -> f64 {
    let mut lengths: Vec<f64> = triangles
        .iter()
        .map(|&[a, b, _]| super::geometry::distance(positions[a as usize], positions[b as usize]))
        .collect();
    if lengths.is_empty() {
        return 0.0;
    }
    let middle = lengths.len() / 2;
    *lengths.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            positions: positions.to_vec(),
            normals: vec![[0.0, 0.0, 1.0]; positions.len()],
            triangles: triangles.to_vec(),
            caps: vec![false; triangles.len()],
        }
    }

    #[test]
    fn two_triangles_through_each_other_are_both_found() {
        let m = mesh(
            &[
                [0.0, 0.0, 0.0],
                [4.0, 0.0, 0.0],
                [0.0, 4.0, 0.0],
                [1.0, 1.0, -1.0],
                [1.0, 1.0, 1.0],
                [9.0, 9.0, 0.5],
            ],
            &[[0, 1, 2], [3, 4, 5]],
        );
        assert_eq!(TriangleGrid::new(&m).self_intersecting(), [0, 1]);
    }

    #[test]
    fn neighbours_and_parallel_triangles_do_not_cross() {
        let m = mesh(
            &[
                [0.0, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [0.0, 2.0, 0.0],
                [2.0, 2.0, 1.0],
                [0.0, 0.0, 0.1],
                [2.0, 0.0, 0.1],
                [0.0, 2.0, 0.1],
            ],
            &[[0, 1, 2], [2, 1, 3], [4, 5, 6]],
        );
        assert_eq!(TriangleGrid::new(&m).self_intersecting(), [] as [u32; 0]);
    }

    #[test]
    fn the_distance_is_that_of_an_exhaustive_search() {
        let mut random = crate::random::Random::new(7);
        let mut number = || 16.0 * random.unit();
        let positions: Vec<[f32; 3]> =
            (0..300).map(|_| std::array::from_fn(|_| number() as f32)).collect();
        // Large triangles, and small ones near their first corner.
        let near = |p: [f32; 3]| [p, p.map(|x| x + 0.3), [p[0] - 0.2, p[1] + 0.4, p[2]]];
        let mut all: Vec<[f32; 3]> = positions[..30].to_vec();
        all.extend(positions[30..].iter().flat_map(|&p| near(p)));
        let triangles: Vec<[u32; 3]> =
            (0..all.len() as u32 / 3).map(|t| [0, 1, 2].map(|i| 3 * t + i)).collect();
        let m = mesh(&all, &triangles);
        let grid = TriangleGrid::new(&m);
        for _ in 0..300 {
            let point = std::array::from_fn(|_| number());
            let each = (0..triangles.len())
                .map(|t| point_triangle_distance(point, grid.corners(t as u32)));
            assert_eq!(grid.distance(point, 4.0), each.fold(4.0, f64::min));
        }
    }

    #[test]
    fn the_distance_is_that_of_the_nearest_triangle_or_the_reach() {
        let m = mesh(
            &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 0.0, 3.0]],
            &[[0, 1, 2], [1, 3, 2]],
        );
        let grid = TriangleGrid::new(&m);
        assert_eq!(grid.distance([0.25, 0.25, -2.5], 4.0), 2.5);
        assert_eq!(grid.distance([-3.0, 0.0, 0.0], 4.0), 3.0);
        assert_eq!(grid.distance([-3.0, 0.0, -40.0], 4.0), 4.0);
    }
}
