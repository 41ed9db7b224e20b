//! Events: the isovalues at which the topology of the isosurface changes.

use serde::{Deserialize, Serialize};

/// What happens to the topology at an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// A component appears (minimum; seen upwards).
    Emerge,
    /// Two components become one (1-saddle).
    Merge,
    /// A handle appears (1-saddle).
    HandleOpen,
    /// One component becomes two (2-saddle).
    Split,
    /// A handle disappears (2-saddle).
    HandleClose,
    /// A component disappears (maximum).
    Vanish,
}

/// An isovalue at which the topology of the isosurface changes, with its place and what changes, upwards in the
/// isovalue.
///
/// This is the one meaning of the word. Several events may share an isovalue. On a plateau, samples that are
/// equal, the exact topology finds more *critical points* than events, as it tells equal samples apart by a ramp that
/// is not seen: those that undo each other at one isovalue change nothing, and are no events.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// The isovalue.
    pub isovalue: f64,
    /// The critical point, voxel frame.
    pub position: [f64; 3],
    /// What changes.
    pub kind: EventKind,
}
