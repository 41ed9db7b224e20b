//! What the chunks from the root to a chunk contain: the path to it.
//!
//! # Invariants
//!
//! Vertices of a path are numbered from the root on, so a vertex has the same number on every path through its chunk.

use super::trajectories::Ranks;
use crate::spectrum::Triangle;

/// The contents of the chunks on a path.
#[derive(Clone, Debug, Default)]
pub(super) struct Path {
    pub(super) ranks: Ranks,
    /// Of the knots, units.
    pub(super) positions: Vec<[i32; 3]>,
    /// With vertices in numbers of the path.
    pub(super) triangles: Vec<Triangle>,
    /// By vertex of the path, its number in the spectrum.
    pub(super) numbers: Vec<u32>,
}

/// The length of a path.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PathEnd {
    pub(super) vertices: usize,
    pub(super) knots: usize,
    pub(super) triangles: usize,
}

impl Path {
    pub(super) fn n_vertices(&self) -> u32 {
        self.ranks.n_vertices()
    }

    pub(super) fn end(&self) -> PathEnd {
        PathEnd {
            vertices: self.ranks.n_vertices() as usize,
            knots: self.positions.len(),
            triangles: self.triangles.len(),
        }
    }

    /// Removes what was appended after an end.
    pub(super) fn truncate(&mut self, end: PathEnd) {
        self.ranks.truncate(end.vertices, end.knots);
        self.positions.truncate(end.knots);
        self.triangles.truncate(end.triangles);
        self.numbers.truncate(end.vertices);
    }
}
