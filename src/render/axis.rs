//! The axes of a volume.

use crate::parse_name::named_values;

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

named_values! {
    Axis, "axis":
    X = "x",
    Y = "y",
    Z = "z",
    MinusX = "-x",
    MinusY = "-y",
    MinusZ = "-z",
}
