//! The exact extraction on a square of the lattice.

use super::region::{LatticeEdge, PaddedGrid, Square};
use crate::topology::exact::ExactField;

/// The four sides of a square, in cyclic order.
pub(super) fn sides(grid: PaddedGrid, s: Square) -> [LatticeEdge; 4] {
    let [u, v] = [1, 2].map(|n| (s.axis + n) % 3);
    let [a, b, _, d] = grid.corners(s);
    [(a, u), (b, v), (d, u), (a, v)].map(|(from, axis)| LatticeEdge { from, axis })
}

/// The exact extraction's polyline on a square at an isovalue: the ends of each of its edges.
pub(super) fn polyline(
    field: &ExactField,
    grid: PaddedGrid,
    s: Square,
    isovalue: f64,
) -> Vec<[LatticeEdge; 2]> {
    let level = field.isovalue_level(isovalue);
    let above = grid.corners(s).map(|v| field.level(v) > level);
    if above == [above[0]; 4] {
        return Vec::new();
    }
    let sides = sides(grid, s);
    let crossed: Vec<usize> = (0..4).filter(|&i| above[i] != above[(i + 1) % 4]).collect();
    match crossed[..] {
        [a, b] => vec![[sides[a], sides[b]]],
        _ => {
            let saddle = field.face_saddle(s.corner, s.axis as usize);
            let key = field.isovalue_key(isovalue);
            let saddle_above = saddle.is_some_and(|s| s.is_above(key));
            // The corners on the other side than the saddle are cut off.
            let cut = (0..4).filter(|&i| above[i] != saddle_above);
            cut.map(|i| [sides[(i + 3) % 4], sides[i]]).collect()
        }
    }
}
