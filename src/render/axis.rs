//! The axes of a volume.

use crate::parse_name::from_name;

/// An axis of a volume, in positive or negative direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// From the first sample of a row to the last.
    X,
    /// From the first row to the last.
    Y,
    /// From the first slice to the last.
    Z,
    /// Opposite to x.
    MinusX,
    /// Opposite to y.
    MinusY,
    /// Opposite to z.
    MinusZ,
}

impl Axis {
    /// Every axis, in the order of the documentation.
    pub const ALL: [Axis; 6] =
        [Axis::X, Axis::Y, Axis::Z, Axis::MinusX, Axis::MinusY, Axis::MinusZ];

    /// The name, as in command-line flags.
    pub fn name(self) -> &'static str {
        match self {
            Axis::X => "x",
            Axis::Y => "y",
            Axis::Z => "z",
            Axis::MinusX => "-x",
            Axis::MinusY => "-y",
            Axis::MinusZ => "-z",
        }
    }

    /// Its index, 0 to 2, and 1 or -1.
    pub(super) fn index_and_sign(self) -> (usize, f64) {
        match self {
            Axis::X => (0, 1.0),
            Axis::Y => (1, 1.0),
            Axis::Z => (2, 1.0),
            Axis::MinusX => (0, -1.0),
            Axis::MinusY => (1, -1.0),
            Axis::MinusZ => (2, -1.0),
        }
    }
}

from_name!(Axis, "axis");
