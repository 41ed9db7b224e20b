//! The planes of samples that a block shares with neighbouring blocks.
//!
//! # Theory
//!
//! The layer around a block is exact, so on a shared plane the surface ends at the polyline of the exact extraction,
//! which depends on the samples of the plane only. Without the cells of the layer beyond the plane, two blocks match:
//! they have the same vertices, one for each lattice edge, and the same edges between them at every isovalue.
//!
//! # Invariants
//!
//! 1. The polyline on a shared plane changes only at samples and saddles of the plane; nothing outside the plane affects that,
//!    not even by rounding.
//! 2. Between two vertices of the plane both blocks have the same edge only if it is one of the polyline: other edges,
//!    *chords* over cells that neither block has exact, are split in the lower block (`chords`).

use super::region::{LatticeEdge, PaddedGrid};
use crate::topology::exact::ExactField;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct SharedPlanes {
    grid: PaddedGrid,
    /// Per axis, the indices of the lower and the upper shared plane in the padded grid.
    planes: [[Option<usize>; 2]; 3],
    first: [usize; 3],
    whole: [usize; 3],
}

/// A lattice edge in the padded grid of the whole: its lower end (x fastest), times 3, and its axis.
pub(crate) type WholeEdge = u64;

impl SharedPlanes {
    /// The planes that the volume of a field shares.
    pub(super) fn of(field: &ExactField) -> SharedPlanes {
        let (grid, within) = (PaddedGrid::of(field), field.volume().block_position());
        let planes = std::array::from_fn(|a| {
            let n = grid.dims[a] - 2;
            let (first, end) = (within.first[a], within.first[a] + n);
            [(first > 0).then_some(1), (end < within.whole[a]).then_some(n)]
        });
        SharedPlanes { grid, planes, first: within.first, whole: within.whole }
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.planes.as_flattened().iter().all(Option::is_none)
    }

    /// Whether a cell of the layer is beyond a shared plane, and so belongs to another block.
    pub(super) fn is_beyond(&self, cell: u32) -> bool {
        let p = self.grid.position(cell);
        (0..3).any(|a| {
            let [low, high] = self.planes[a];
            (low.is_some() && p[a] == 0) || high == Some(p[a])
        })
    }

    fn is_plane(&self, axis: usize, at: usize) -> bool {
        self.planes[axis].contains(&Some(at))
    }

    /// Whether a sample is on a shared plane. Then its own value counts, not an event on either side.
    pub(super) fn holds_sample(&self, v: u32) -> bool {
        let p = self.grid.position(v);
        (0..3).any(|a| self.is_plane(a, p[a]))
    }

    /// The number in the whole volume of a lattice edge in a shared plane.
    pub(super) fn whole_edge(&self, e: LatticeEdge) -> Option<WholeEdge> {
        let p = self.grid.position(e.from);
        let is_shared = (0..3).any(|a| a != e.axis as usize && self.is_plane(a, p[a]));
        let [x, y, z] = std::array::from_fn(|a| (p[a] + self.first[a]) as u64);
        let [nx, ny, _] = self.whole.map(|n| n as u64 + 2);
        is_shared.then_some(3 * (x + nx * (y + ny * z)) + u64::from(e.axis))
    }

    /// Whether two lattice edges are in one upper shared plane of the block.
    pub(super) fn is_upper(&self, e: LatticeEdge, f: LatticeEdge) -> bool {
        let [p, q] = [e, f].map(|e| self.grid.position(e.from));
        (0..3u8).any(|a| {
            let at = self.planes[a as usize][1];
            let is_in = |e: LatticeEdge, p: [usize; 3]| e.axis != a && at == Some(p[a as usize]);
            is_in(e, p) && is_in(f, q)
        })
    }
}
