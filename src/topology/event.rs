//! Events: the isovalues at which the topology of the isosurface changes.

use serde::{Deserialize, Serialize};

use super::critical::GridElement;
use crate::volume::Outside;

/// The change of topology at an event, for ascending isovalues.
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

impl EventKind {
    /// All kinds in the order of their codes, in files and in the page (`page/plot.js`).
    pub const ALL: [EventKind; 6] = [
        EventKind::Emerge,
        EventKind::Merge,
        EventKind::HandleOpen,
        EventKind::Split,
        EventKind::HandleClose,
        EventKind::Vanish,
    ];

    /// Its index in [`EventKind::ALL`].
    pub(crate) fn code(self) -> u8 {
        EventKind::ALL.iter().position(|&kind| kind == self).expect("every kind has a code") as u8
    }

    /// The change in words, of a surface whose outer side is that of lower or of higher values.
    pub fn in_words(self, outside: Outside) -> &'static str {
        match (self, outside) {
            (EventKind::Emerge, Outside::Low) => "a cavity opens",
            (EventKind::Emerge, Outside::High) => "a part appears",
            (EventKind::Merge, _) => "two surfaces merge",
            (EventKind::HandleOpen, _) => "a handle opens",
            (EventKind::Split, _) => "a surface splits",
            (EventKind::HandleClose, _) => "a handle closes",
            (EventKind::Vanish, Outside::Low) => "a part vanishes",
            (EventKind::Vanish, Outside::High) => "a cavity closes",
        }
    }
}

/// A change of topology of the isosurface: isovalue, position and kind.
///
/// Several events may share an isovalue. On a plateau of equal samples the exact topology finds more *critical points*
/// than events, because it orders equal samples by an invisible ramp. Critical points that cancel at one isovalue are not
/// events.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// The isovalue.
    pub isovalue: f64,
    /// The critical point, voxel frame.
    pub position: [f64; 3],
    /// The change.
    pub kind: EventKind,
    /// The isovalues for which what begins here lasts, or has lasted what ends here, units of the volume: for components, the persistence of
    /// the extremum of {f <= c} or {f > c} that begins or ends here (emerge and merge; split and vanish). `None` for handles, and for
    /// components that reach to the end of the volume's range.
    #[serde(default)]
    pub persistence: Option<f64>,
}

/// A critical point of the generic field, with the change of topology at it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopologyEvent {
    /// Position in the order of the generic field; comparable with `ExactField::isovalue_key`.
    pub key: i128,
    /// The isovalue in units of the volume, without the ramp.
    pub isovalue: f64,
    /// The critical point, voxel frame.
    pub position: [f64; 3],
    /// Number of falling directions: 0 minimum, 1 and 2 saddles, 3 maximum.
    pub index: u8,
    /// The change.
    pub kind: EventKind,
    /// The sample, lattice face or cell that contains the critical point.
    pub element: GridElement,
    /// Samples below it, one in each of the regions that meet there (equal if there is one region).
    pub low: [u32; 2],
    /// Samples above it, in the same way.
    pub high: [u32; 2],
}
