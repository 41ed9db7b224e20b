//! The state of the pointer over the picture.

use glam::DVec2;

use crate::render::View;

/// The effect of the next click on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tool {
    /// Keep only the component.
    Keep,
    /// Hide the component.
    Hide,
    /// Measure to this point.
    Measure,
}

/// The state of the pointer over the picture.
#[derive(Debug, Default)]
pub(super) struct Pointer {
    /// The pixel under the pointer, from the top left.
    pub(super) pixel: Option<DVec2>,
    pub(super) rest: Option<Rest>,
    /// Text about the point of the surface under the pointer.
    pub(super) readout: Option<String>,
}

/// A period in which pixel, isovalue and view did not change.
#[derive(Debug)]
pub(super) struct Rest {
    pub(super) state: (DVec2, f64, View),
    /// Its start, seconds; `NEG_INFINITY` once the readout was computed.
    pub(super) since: f64,
}
