//! How near to events meshes are tracked, and how fast the field typically rises.

use glam::Vec3;

use super::caps::inner_slopes;
use super::graph::Node;
use super::{Piece, Sweep};
use crate::mesh::Mesh;

/// Share of an arc, at an event, over which surgery leads at most and at least.
pub(super) const WINDOW_SHARE: (f64, f64) = (0.001, 0.2);

/// How far a mesh may move from before an event to it, voxels.
const WINDOW_MOTION: f64 = 0.15;

/// Distance from an event, voxels, at which the field tells how far sheets are apart.
const WINDOW_RADIUS: f32 = 0.35;

/// So many vertices are asked how far the mesh moves.
const WINDOW_VERTICES: usize = 500;

/// How many cells are asked how fast the field rises.
const SLOPE_CELLS: usize = 20_000;

/// How far from a node, in isovalues, an arc's mesh is given up or begun: where the sheets that
/// meet there are apart again, but no farther than most of `mesh` may move at once.
pub(super) fn window(sweep: &Sweep, node: &Node, piece: &Piece, mesh: &Mesh) -> f64 {
    let field = &sweep.field;
    let unit = f64::from(field.isovalue(node.isovalue + 1.0) - field.isovalue(node.isovalue));
    let here = field.isovalue(node.isovalue);
    let change_around = |&e: &u32| {
        let position = sweep.topology.events[e as usize].position;
        let p = Vec3::from(position.map(|x| x as f32));
        let around = Vec3::AXES.iter().flat_map(|&a| [a, -a]);
        let changes = around.map(|a| (field.value(p + WINDOW_RADIUS * a) - here).abs());
        f64::from(changes.fold(0.0, f32::max)) / unit.max(1e-300)
    };
    let mut changes: Vec<f64> = node.events.iter().map(change_around).collect();
    changes.sort_by(f64::total_cmp);
    let apart = changes.get(changes.len() / 2).copied().unwrap_or(0.0);
    let mut slopes = inner_slopes(mesh, field, WINDOW_VERTICES);
    let i = slopes.len() / 4;
    let slope = if slopes.is_empty() {
        f64::INFINITY
    } else {
        f64::from(*slopes.select_nth_unstable_by(i, f32::total_cmp).1)
    };
    let length = piece.high - piece.low;
    apart
        .min(WINDOW_MOTION * slope / unit.max(1e-300))
        .clamp(WINDOW_SHARE.0 * length, WINDOW_SHARE.1 * length)
}

/// So many isovalues of the range are asked how fast the field rises there.
const SLOPE_ISOVALUES: usize = 64;

/// How fast the field typically rises, in isovalues per voxel.
pub(super) struct Slopes {
    /// Median over all cells that are not constant.
    pub(super) typical: f64,
    /// Median over the cells that the isosurface crosses, at isovalues spread evenly over the range.
    by_isovalue: Vec<f64>,
    range: (f64, f64),
}

impl Slopes {
    /// From some of the cells of the volume.
    pub(super) fn new(sweep: &Sweep) -> Slopes {
        let range = sweep.range;
        let cells = some_cells(sweep);
        let by_isovalue = (0..SLOPE_ISOVALUES).map(|i| {
            let share = (i as f64 + 0.5) / SLOPE_ISOVALUES as f64;
            let isovalue = range.0 + share * (range.1 - range.0);
            let crossed = cells.iter().filter(|c| c.low <= isovalue && isovalue < c.high);
            median(crossed.map(|c| c.slope).collect())
        });
        let by_isovalue = by_isovalue.collect();
        Slopes { typical: median(cells.iter().map(|c| c.slope).collect()), by_isovalue, range }
    }

    /// How far the isosurface typically moves from one isovalue to another, voxels.
    pub(super) fn motion(&self, low: f64, high: f64) -> f64 {
        let share = (0.5 * (low + high) - self.range.0) / (self.range.1 - self.range.0);
        let i = (share * SLOPE_ISOVALUES as f64).clamp(0.0, SLOPE_ISOVALUES as f64 - 1.0) as usize;
        let slope = if self.by_isovalue[i] > 0.0 { self.by_isovalue[i] } else { self.typical };
        (high - low) / slope.max(1e-300)
    }
}

/// What a cell says of the field.
struct CellSlope {
    low: f64,
    high: f64,
    /// Isovalues per voxel.
    slope: f64,
}

/// Some of the cells that are not constant.
fn some_cells(sweep: &Sweep) -> Vec<CellSlope> {
    let volume = sweep.exact.volume();
    let [nx, ny, nz] = volume.dims();
    let n = (nx - 1) * (ny - 1) * (nz - 1);
    let cell = |i: usize| {
        let [x, y, z] = [i % (nx - 1), i / (nx - 1) % (ny - 1), i / (nx - 1) / (ny - 1)];
        let here = volume.sample(x, y, z);
        let beside =
            [volume.sample(x + 1, y, z), volume.sample(x, y + 1, z), volume.sample(x, y, z + 1)];
        let slope = beside.iter().map(|b| (b - here).powi(2)).sum::<f64>().sqrt();
        let low = beside.iter().copied().fold(here, f64::min);
        let high = beside.iter().copied().fold(here, f64::max);
        (slope > 0.0).then_some(CellSlope { low, high, slope })
    };
    (0..n).step_by(n / SLOPE_CELLS + 1).filter_map(cell).collect()
}

/// The median; 0 of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
