//! The point of a mesh that is nearest to a point: its triangles in the cells of a grid.
//!
//! Cells are searched in shells around the point until no cell further out can hold anything nearer.

use glam::DVec3;

use crate::mesh::nearest_on_triangle;
use crate::spectrum::SurfaceMesh;

/// Most cells along an axis.
const MOST_CELLS: f64 = 128.0;

/// Where the triangles of a mesh are.
pub(super) struct Nearest<'a> {
    mesh: &'a SurfaceMesh,
    low: DVec3,
    /// Side of a cell.
    side: f64,
    /// Cells along each axis.
    size: [usize; 3],
    /// Start of each cell's triangles in `triangles`, and the end.
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl<'a> Nearest<'a> {
    /// None of a mesh without triangles.
    pub(super) fn of(mesh: &'a SurfaceMesh) -> Option<Self> {
        let [low, high] = mesh.bounds().filter(|_| !mesh.triangles.is_empty())?;
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let longest = (high - low).max_element();
        // A cell holds a few triangles of a surface that goes through it.
        let cells = (mesh.triangles.len() as f64).sqrt().clamp(1.0, MOST_CELLS);
        let side = (longest / cells).max(f64::MIN_POSITIVE);
        let size = (high - low).to_array().map(|length| (length / side) as usize + 1);
        let n_cells: usize = size.iter().product();
        let mut nearest =
            Nearest { mesh, low, side, size, first: vec![0; n_cells + 1], triangles: Vec::new() };
        let mut entries = Vec::new();
        for t in 0..mesh.triangles.len() as u32 {
            let corners = nearest.corners(t);
            let least = corners.iter().copied().reduce(DVec3::min).unwrap_or_default();
            let most = corners.iter().copied().reduce(DVec3::max).unwrap_or_default();
            let [from, to] = [least, most].map(|p| nearest.cell(p));
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    entries.extend((from[0]..=to[0]).map(|x| (nearest.number([x, y, z]), t)));
                }
            }
        }
        entries.sort_unstable();
        entries.iter().for_each(|&(cell, _)| nearest.first[cell + 1] += 1);
        for cell in 0..n_cells {
            nearest.first[cell + 1] += nearest.first[cell];
        }
        nearest.triangles = entries.into_iter().map(|(_, t)| t).collect();
        Some(nearest)
    }

    fn corners(&self, t: u32) -> [DVec3; 3] {
        let corner = |v: u32| DVec3::from(self.mesh.positions[v as usize].map(f64::from));
        self.mesh.triangles[t as usize].map(corner)
    }

    /// The cell that a point is in, or the nearest one.
    fn cell(&self, p: DVec3) -> [usize; 3] {
        let at = ((p - self.low) / self.side).to_array();
        std::array::from_fn(|i| (at[i].max(0.0) as usize).min(self.size[i] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.size[0] * (y + self.size[1] * z)
    }

    /// The nearest point, of those whose side faces where `normal` does, where there is one that is told; none where no triangle
    /// does.
    pub(super) fn to(&self, p: DVec3, normal: Option<DVec3>) -> Option<DVec3> {
        let middle = self.cell(p);
        let mut best: Option<(f64, DVec3)> = None;
        let farthest = self.size.iter().copied().max().unwrap_or_default();
        for shell in 0..=farthest {
            self.visit_shell(middle, shell, |t| {
                let corners = self.corners(t);
                let [a, b, c] = corners;
                let faces = (b - a).cross(c - a);
                if normal.is_some_and(|normal| faces.dot(normal) <= 0.0) {
                    return;
                }
                let found = nearest_on_triangle(p, corners);
                let distance = found.distance_squared(p);
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, found));
                }
            });
            // What is in further shells is at least that deep from where the box is nearest; the way there and on turns by a right
            // angle at least.
            let top = self.low + self.side * DVec3::from(self.size.map(|n| n as f64));
            let deep = shell as f64 * self.side;
            let reach = deep * deep + p.clamp(self.low, top).distance_squared(p);
            if best.is_some_and(|(least, _)| least <= reach) {
                break;
            }
        }
        best.map(|(_, found)| found)
    }

    /// Visits the triangles of the cells that are so many cells away.
    fn visit_shell(&self, middle: [usize; 3], shell: usize, mut visit: impl FnMut(u32)) {
        let from: [usize; 3] = middle.map(|i| i.saturating_sub(shell));
        let to: [usize; 3] = std::array::from_fn(|i| (middle[i] + shell).min(self.size[i] - 1));
        for z in from[2]..=to[2] {
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    let away = [x, y, z].iter().zip(middle).map(|(&i, m)| i.abs_diff(m)).max();
                    if away != Some(shell) {
                        continue;
                    }
                    let cell = self.number([x, y, z]);
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
    fn what_is_found_is_as_near_as_what_looking_at_all_triangles_finds() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let mut point = |scale: f64| DVec3::new(random(), random(), random()) * scale;
        let positions: Vec<[f32; 3]> =
            (0..90).map(|_| point(10.0).to_array().map(|x| x as f32)).collect();
        let triangles: Vec<[u32; 3]> = (0..30).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = SurfaceMesh { positions, triangles, ..SurfaceMesh::default() };
        let nearest = Nearest::of(&mesh).expect("triangles");
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
