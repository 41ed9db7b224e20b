//! The head of a part's file, and the vertices that parts share.

use serde::{Deserialize, Serialize};

use super::critical;
use crate::sweep::Counts;

/// The head of a part's file: what the part was computed from, and the sizes of its columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct PartHead {
    /// Hash of its plan ([`Plan::hash`](super::Plan::hash)).
    pub plan: String,
    /// Number of its brick in the plan.
    pub number: usize,
    /// Name of the backend that computed it.
    pub backend: String,
    /// Statistics of its sweep.
    pub counts: Counts,
    /// Areas of tracked and of other triangles at isovalues evenly spread over the range.
    pub areas: Vec<[f64; 2]>,
    pub(super) isovalues: u32,
    pub(super) vertices: u32,
    pub(super) knots: u32,
    pub(super) triangles: u32,
    pub(super) shared: u32,
    pub(super) critical: u32,
    pub(super) entries: u32,
    /// Bytes of the compressed border and of the compressed body.
    pub(super) packed: [u64; 2],
    /// CRC-32 of the compressed border and of the compressed body.
    pub(super) crc32: [u32; 2],
}

impl PartHead {
    /// Numbers of trajectories, knots and triangles of the part.
    pub fn size(&self) -> [u64; 3] {
        [self.vertices, self.knots, self.triangles].map(u64::from)
    }

    /// Bytes of the border's columns, uncompressed.
    pub(super) fn border_bytes(&self) -> u64 {
        let n = |count: u32, bytes: u64| u64::from(count) * bytes;
        n(self.shared, 12 + 2 * 20)
            + n(self.critical, 4 * critical::WORDS as u64)
            + n(self.entries, 12)
    }

    /// Bytes of the body's columns, uncompressed.
    pub(super) fn body_bytes(&self) -> u64 {
        let n = |count: u32, bytes: u64| u64::from(count) * bytes;
        n(self.isovalues, 8) + 4 + n(self.vertices, 4) + n(self.knots, 16) + n(self.triangles, 21)
    }
}

/// A vertex on a plane of samples that bricks share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SharedVertex {
    /// Its index in the part.
    pub(super) vertex: u32,
    /// Index of its lattice edge in the whole volume.
    pub(super) edge: u64,
    /// Its two knots: isovalues and positions.
    pub(super) knots: [(f64, [f32; 3]); 2],
}
