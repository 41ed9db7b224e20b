//! A uniform grid of the triangles of a mesh.
//!
//! The grid is sparse, a sorted list of (cell, triangle), so its memory depends on the mesh, not on the
//! volume. It finds triangles that cross each other, and the distance of a point from the mesh.

use rayon::prelude::*;

use super::geometry::{
    Point, area_vector, dot, length, minus, point_triangle_distance, segment_crosses_triangle,
};
use crate::spectrum::Mesh;

/// The triangles of one mesh, by cell.
pub(super) struct TriangleGrid<'a> {
    positions: Vec<Point>,
    triangles: &'a [[u32; 3]],
    cell_size: f64,
    /// The triangles of all cells that are not empty, by cell.
    entries: Vec<u32>,
    cells: Vec<Cell>,
    rows: Rows,
}

/// A cell that is not empty: its index along z, and its range in `entries`.
#[derive(Clone, Copy)]
struct Cell {
    k: i32,
    first: u32,
    end: u32,
}

/// The cells by row along z: the range of row (i, j) begins at `starts[i' + n[0] * j']`, counted from the lowest row.
struct Rows {
    lowest: [i32; 2],
    n: [i32; 2],
    starts: Vec<u32>,
}

impl Rows {
    /// The number of a row; `None` outside.
    fn number(&self, i: i32, j: i32) -> Option<usize> {
        let [i, j] = [i - self.lowest[0], j - self.lowest[1]];
        let is_inside = (0..self.n[0]).contains(&i) && (0..self.n[1]).contains(&j);
        is_inside.then(|| (i + self.n[0] * j) as usize)
    }

    /// The rows of cells that are sorted by j, i and k.
    fn of(cells: &[[i32; 3]]) -> Rows {
        let low = |a: usize| cells.iter().map(|c| c[a]).min().unwrap_or(0);
        let high = |a: usize| cells.iter().map(|c| c[a]).max().unwrap_or(-1);
        let lowest = [low(0), low(1)];
        let n = [high(0) - lowest[0] + 1, high(1) - lowest[1] + 1];
        let mut rows = Rows { lowest, n, starts: vec![0; (n[0] * n[1]) as usize + 1] };
        for c in cells {
            let row = rows.number(c[0], c[1]).expect("inside");
            rows.starts[row + 1] += 1;
        }
        for row in 1..rows.starts.len() {
            rows.starts[row] += rows.starts[row - 1];
        }
        rows
    }
}

/// Numbers of the cells of a box: by j, then i, then k.
struct CellNumbers {
    lowest: [i32; 3],
    n: [u64; 3],
}

impl CellNumbers {
    /// Of the cells with some positions, and those between.
    fn of(positions: &[Point], cell_size: f64) -> Self {
        let nothing = ([i32::MAX; 3], [i32::MIN; 3]);
        let (lowest, highest) = positions.iter().fold(nothing, |(low, high), &p| {
            let cell = cell_of(p, cell_size);
            let each =
                |of: fn(i32, i32) -> i32, a: [i32; 3]| std::array::from_fn(|x| of(a[x], cell[x]));
            (each(i32::min, low), each(i32::max, high))
        });
        let n = |a: usize| (i64::from(highest[a]) - i64::from(lowest[a]) + 1).max(0) as u64;
        CellNumbers { lowest, n: [0, 1, 2].map(n) }
    }

    fn n_cells(&self) -> u128 {
        self.n.iter().map(|&n| u128::from(n)).product()
    }

    fn of_cell(&self, cell: [i32; 3]) -> u64 {
        let [i, j, k] = [0, 1, 2].map(|a| i64::from(cell[a]) - i64::from(self.lowest[a]));
        (j as u64 * self.n[0] + i as u64) * self.n[2] + k as u64
    }

    fn cell(&self, number: u64) -> [i32; 3] {
        let (row, k) = (number / self.n[2], number % self.n[2]);
        let offsets = [row % self.n[0], row / self.n[0], k];
        std::array::from_fn(|a| self.lowest[a] + offsets[a] as i32)
    }
}

impl<'a> TriangleGrid<'a> {
    /// Sorts the triangles of a mesh into cells about as large as its edges, one voxel at least.
    pub(super) fn new(mesh: &'a Mesh) -> Self {
        let positions: Vec<Point> = mesh.positions.iter().map(|p| p.map(f64::from)).collect();
        let mut cell_size = median_edge(&positions, &mesh.triangles).max(1.0);
        let mut numbers = CellNumbers::of(&positions, cell_size);
        while numbers.n_cells() > 1 << 32 {
            cell_size *= 2.0;
            numbers = CellNumbers::of(&positions, cell_size);
        }
        // The numbers of cell and triangle as one number, which is sorted faster.
        let mut all: Vec<u64> = Vec::with_capacity(2 * mesh.triangles.len());
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let (low, high) = bounds(triangle.map(|v| positions[v as usize]));
            let (low, high) = (cell_of(low, cell_size), cell_of(high, cell_size));
            for i in low[0]..=high[0] {
                for j in low[1]..=high[1] {
                    let cells = (low[2]..=high[2]).map(|k| numbers.of_cell([i, j, k]));
                    all.extend(cells.map(|cell| cell << 32 | t as u64));
                }
            }
        }
        all.par_sort_unstable();
        let (mut places, mut cells) = (Vec::new(), Vec::new());
        let mut first = 0;
        for group in all.chunk_by(|a, b| a >> 32 == b >> 32) {
            let place = numbers.cell(group[0] >> 32);
            let end = first + group.len() as u32;
            places.push(place);
            cells.push(Cell { k: place[2], first, end });
            first = end;
        }
        let entries = all.into_iter().map(|entry| entry as u32).collect();
        let (triangles, rows) = (&mesh.triangles[..], Rows::of(&places));
        TriangleGrid { positions, triangles, cell_size, entries, cells, rows }
    }

    fn corners(&self, triangle: u32) -> [Point; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// The triangles that another triangle crosses, each once, by index.
    ///
    /// Neighbours along an edge are not tested, and of neighbours at a vertex only the edges
    /// opposite to that vertex: the others touch.
    pub(super) fn self_intersecting(&self) -> Vec<u32> {
        let mut crossing: Vec<u32> = self
            .cells
            .par_iter()
            .with_min_len(64)
            .flat_map_iter(|&cell| {
                let inside = self.inside(cell).iter();
                let boxes: Vec<(u32, Box)> =
                    inside.map(|&t| (t, Box::of(self.corners(t)))).collect();
                let mut found = Vec::new();
                for (x, (first, a)) in boxes.iter().enumerate() {
                    for (second, b) in &boxes[x + 1..] {
                        if a.meets(b) && self.cross(*first, *second) {
                            found.extend([*first, *second]);
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

    /// Whether two triangles whose bounding boxes meet cross each other.
    fn cross(&self, first: u32, second: u32) -> bool {
        let (f, g) = (self.triangles[first as usize], self.triangles[second as usize]);
        if f.iter().filter(|v| g.contains(v)).count() >= 2 {
            return false;
        }
        let (p, q) = (self.corners(first), self.corners(second));
        if is_on_one_side(f, p, g, q) || is_on_one_side(g, q, f, p) {
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
                    let on_shell = i.abs().max(j.abs()) == ring;
                    let (i, j) = (home[0] + i, home[1] + j);
                    for &cell in self.near(i, j, home[2], ring) {
                        if !on_shell && cell.k.abs_diff(home[2]) != ring.unsigned_abs() {
                            continue;
                        }
                        // Most points are close to the mesh, and neighbouring cells are too far.
                        if self.distance_to_cell(point, [i, j, cell.k]) >= nearest {
                            continue;
                        }
                        for &t in self.inside(cell) {
                            nearest = nearest.min(point_triangle_distance(point, self.corners(t)));
                        }
                    }
                }
            }
            ring += 1;
        }
        nearest
    }

    /// The cells of a row along z that are not empty, up to `ring` cells from the cell `k`.
    fn near(&self, i: i32, j: i32, k: i32, ring: i32) -> &[Cell] {
        let Some(row) = self.rows.number(i, j) else { return &[] };
        let row = &self.cells[self.rows.starts[row] as usize..self.rows.starts[row + 1] as usize];
        let first = row.partition_point(|cell| cell.k < k - ring);
        let n = row[first..].partition_point(|cell| cell.k <= k + ring);
        &row[first..first + n]
    }

    /// The triangles in a cell.
    fn inside(&self, cell: Cell) -> &[u32] {
        &self.entries[cell.first as usize..cell.end as usize]
    }

    /// Distance from a point to a cell; 0 inside.
    fn distance_to_cell(&self, point: Point, cell: [i32; 3]) -> f64 {
        let along_axis = |a: usize| {
            let low = f64::from(cell[a]) * self.cell_size;
            (low - point[a]).max(point[a] - (low + self.cell_size)).max(0.0)
        };
        length(std::array::from_fn(along_axis))
    }
}

/// A bounding box.
struct Box {
    low: Point,
    high: Point,
}

impl Box {
    fn of(corners: [Point; 3]) -> Box {
        let (low, high) = bounds(corners);
        Box { low, high }
    }

    fn meets(&self, other: &Box) -> bool {
        (0..3).all(|a| self.low[a] <= other.high[a] && other.low[a] <= self.high[a])
    }
}

/// Whether the corners `p` of triangle `f` that are not corners of `g` are strictly on one side of the plane of `g`, whose corners
/// are `q`.
fn is_on_one_side(f: [u32; 3], p: [Point; 3], g: [u32; 3], q: [Point; 3]) -> bool {
    let normal = area_vector(q);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for i in (0..3).filter(|&i| !g.contains(&f[i])) {
        let height = dot(minus(p[i], q[0]), normal);
        (low, high) = (low.min(height), high.max(height));
    }
    low > 0.0 || high < 0.0
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
