//! The trajectories of vertices, and their 32-bit codes.
//!
//! # Invariants
//!
//! Codes have the order of the trajectories: those along lattice edges, those of tracked vertices, those inside cells.

use super::region::{LatticeEdge, PaddedGrid};
use crate::error::{Error, Result};

/// The trajectory of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Track {
    /// The trajectory along a lattice edge.
    Edge(LatticeEdge),
    /// The own trajectory of a tracked vertex, by number.
    Own(u32),
    /// The trajectory of a vertex inside an exact cell, by number.
    Inner(u32),
}

/// Codes of trajectories.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrackCodes {
    /// Code of the first trajectory of a tracked vertex, and of the first inside a cell.
    first_own: u32,
    first_inner: u32,
}

impl TrackCodes {
    /// The codes on a grid with so many trajectories of tracked vertices.
    ///
    /// # Errors
    ///
    /// As [`TrackCodes::check`].
    pub(super) fn new(grid: PaddedGrid, n_own: usize) -> Result<Self> {
        let first_own = 3 * grid.dims.iter().product::<usize>();
        TrackCodes::check(first_own + n_own)?;
        Ok(TrackCodes { first_own: first_own as u32, first_inner: (first_own + n_own) as u32 })
    }

    /// Checks that so many codes exist.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if there are too many for 32 bits.
    fn check(n: usize) -> Result<()> {
        if u32::try_from(n).is_err() {
            return Err(Error::Usage(format!(
                "{n} lattice edges and vertices, expected fewer than 2^32; bricks have fewer"
            )));
        }
        Ok(())
    }

    /// The number of codes with so many trajectories inside cells.
    ///
    /// # Errors
    ///
    /// As [`TrackCodes::new`].
    pub(super) fn n_codes(self, n_inner: usize) -> Result<usize> {
        let n = self.first_inner as usize + n_inner;
        TrackCodes::check(n)?;
        Ok(n)
    }

    pub(super) fn code(self, track: Track) -> u32 {
        match track {
            Track::Edge(e) => 3 * e.from + u32::from(e.axis),
            Track::Own(n) => self.first_own + n,
            Track::Inner(n) => self.first_inner + n,
        }
    }

    pub(super) fn track(self, code: u32) -> Track {
        match (code.checked_sub(self.first_own), code.checked_sub(self.first_inner)) {
            (None, _) => Track::Edge(LatticeEdge { from: code / 3, axis: (code % 3) as u8 }),
            (Some(n), None) => Track::Own(n),
            (_, Some(n)) => Track::Inner(n),
        }
    }

    /// Whether a code is that of a trajectory along a lattice edge.
    pub(super) fn is_edge(self, code: u32) -> bool {
        code < self.first_own
    }

    /// The code of a trajectory after those inside cells are numbered from `n` on.
    pub(super) fn after_inner(self, code: u32, n: u32) -> u32 {
        if code >= self.first_inner { code + n } else { code }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_have_the_order_of_trajectories() {
        let grid = PaddedGrid { dims: [3, 4, 5], strides: [1, 3, 12] };
        let codes = TrackCodes::new(grid, 7).expect("few");
        let edge = |from, axis| Track::Edge(LatticeEdge { from, axis });
        let tracks = [
            edge(0, 0),
            edge(0, 2),
            edge(1, 1),
            edge(59, 2),
            Track::Own(0),
            Track::Own(6),
            Track::Inner(0),
            Track::Inner(9),
        ];
        assert!(tracks.is_sorted() && tracks.map(|t| codes.code(t)).is_sorted());
        assert_eq!(tracks.map(|t| codes.track(codes.code(t))), tracks);
        assert_eq!(tracks.map(|t| codes.after_inner(codes.code(t), 2))[5..], [186, 189, 198]);
        assert_eq!(codes.n_codes(10).expect("few"), 197);
        let large = PaddedGrid { dims: [1200, 1200, 1200], strides: [1, 1200, 1_440_000] };
        assert!(TrackCodes::new(large, 0).is_err() && codes.n_codes(1 << 32).is_err());
    }
}
