//! Nearest-point queries on a mesh, by a uniform grid of its triangles.
//!
//! A query searches the cells in shells around the point until no cell further out can contain a nearer triangle.

use glam::DVec3;

use crate::mesh::nearest_on_triangle;
use crate::spectrum::Mesh;

/// Largest number of cells along an axis.
const MAX_CELLS: f64 = 128.0;

/// A uniform grid over the triangles of a mesh.
pub(super) struct NearestPoint<'a> {
    mesh: &'a Mesh,
    low: DVec3,
    /// Side of a cell.
    side: f64,
    /// Cells along each axis.
    size: [usize; 3],
    /// Start of each cell's triangles in `triangles`, and the end.
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl<'a> NearestPoint<'a> {
    /// Builds the grid; `None` for a mesh without triangles.
    pub(super) fn new(mesh: &'a Mesh) -> Option<Self> {
        let [low, high] = mesh.bounds().filter(|_| !mesh.triangles.is_empty())?;
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let longest = (high - low).max_element();
        // About a few triangles per cell that the surface intersects.
        let cells = (mesh.triangles.len() as f64).sqrt().clamp(1.0, MAX_CELLS);
        let side = (longest / cells).max(f64::MIN_POSITIVE);
        let size = (high - low).to_array().map(|length| (length / side) as usize + 1);
        let n_cells: usize = size.iter().product();
        let (first, triangles) = (vec![0; n_cells + 1], Vec::new());
        let mut grid = NearestPoint { mesh, low, side, size, first, triangles };
        let mut entries = Vec::new();
        for t in 0..mesh.triangles.len() as u32 {
            let corners = grid.corners(t);
            let min = corners.iter().copied().reduce(DVec3::min).unwrap_or_default();
            let max = corners.iter().copied().reduce(DVec3::max).unwrap_or_default();
            let [from, to] = [min, max].map(|p| grid.cell(p));
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    entries.extend((from[0]..=to[0]).map(|x| (grid.index([x, y, z]), t)));
                }
            }
        }
        entries.sort_unstable();
        entries.iter().for_each(|&(cell, _)| grid.first[cell + 1] += 1);
        for cell in 0..n_cells {
            grid.first[cell + 1] += grid.first[cell];
        }
        grid.triangles = entries.into_iter().map(|(_, t)| t).collect();
        Some(grid)
    }

    fn corners(&self, t: u32) -> [DVec3; 3] {
        let corner = |v: u32| DVec3::from(self.mesh.positions[v as usize].map(f64::from));
        self.mesh.triangles[t as usize].map(corner)
    }

    /// The cell of a point, clamped to the grid.
    fn cell(&self, p: DVec3) -> [usize; 3] {
        let at = ((p - self.low) / self.side).to_array();
        std::array::from_fn(|i| (at[i].max(0.0) as usize).min(self.size[i] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.size[0] * (y + self.size[1] * z)
    }

    /// The point of the mesh nearest to `p`. With a `normal` only triangles that face in its direction count; `None` if there
    /// is none.
    pub(super) fn to(&self, p: DVec3, normal: Option<DVec3>) -> Option<DVec3> {
        let center = self.cell(p);
        let mut best: Option<(f64, DVec3)> = None;
        let n_shells = self.size.iter().copied().max().unwrap_or_default();
        for shell in 0..=n_shells {
            self.visit_shell(center, shell, |t| {
                let corners = self.corners(t);
                let [a, b, c] = corners;
                let face_normal = (b - a).cross(c - a);
                if normal.is_some_and(|normal| face_normal.dot(normal) <= 0.0) {
                    return;
                }
                let point = nearest_on_triangle(p, corners);
                let distance = point.distance_squared(p);
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, point));
                }
            });
            // A triangle in a later shell is at least `depth` away from the point of the grid nearest to p, and the angle there
            // is at least a right one, so the squares add.
            let high = self.low + self.side * DVec3::from(self.size.map(|n| n as f64));
            let depth = shell as f64 * self.side;
            let bound = depth * depth + p.clamp(self.low, high).distance_squared(p);
            if best.is_some_and(|(least, _)| least <= bound) {
                break;
            }
        }
        best.map(|(_, point)| point)
    }

    /// Visits the triangles of the cells at a Chebyshev distance of `shell` cells.
    fn visit_shell(&self, center: [usize; 3], shell: usize, mut visit: impl FnMut(u32)) {
        let from: [usize; 3] = center.map(|i| i.saturating_sub(shell));
        let to: [usize; 3] = std::array::from_fn(|i| (center[i] + shell).min(self.size[i] - 1));
        for z in from[2]..=to[2] {
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    let distance = [x, y, z].iter().zip(center).map(|(&i, c)| i.abs_diff(c)).max();
                    if distance != Some(shell) {
                        continue;
                    }
                    let cell = self.index([x, y, z]);
                    let range = self.first[cell] as usize..self.first[cell + 1] as usize;
                    self.triangles[range].iter().for_each(|&t| visit(t));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_finds_points_as_near_as_brute_force() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let mut point = |scale: f64| DVec3::new(random(), random(), random()) * scale;
        let positions: Vec<[f32; 3]> =
            (0..90).map(|_| point(10.0).to_array().map(|x| x as f32)).collect();
        let triangles: Vec<[u32; 3]> = (0..30).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        let nearest = NearestPoint::new(&mesh).expect("triangles");
        for _ in 0..200 {
            // Outside of the grid, too.
            let p = point(20.0) - DVec3::splat(5.0);
            let all = (0..30).map(|t| nearest_on_triangle(p, nearest.corners(t)).distance(p));
            let least = all.fold(f64::INFINITY, f64::min);
            let found = nearest.to(p, None).expect("a point").distance(p);
            assert!((found - least).abs() < 1e-12, "{found}, expected {least}");
        }
    }
}
