//! The units in which stored positions are counted.

use crate::spectrum::{ALONG, Knot, quantum};

/// The units in which stored positions are counted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Units {
    /// Units per voxel.
    pub(super) per_voxel: f64,
    /// Units per 1.0 of a coordinate of a rounded spectrum.
    pub(super) stored: f64,
}

/// [`Units::stored`] of a page: the coordinates of a rounded spectrum are numbers of steps divided by 256, whatever the step.
pub(super) const STORED_OF_PAGE: f64 = 256.0;

impl Units {
    /// The units of a file, given the tolerance of its spectrum in voxels.
    pub(super) fn of_file(tolerance: f64) -> Units {
        let per_voxel = 1.0 / quantum(tolerance);
        Units { per_voxel, stored: per_voxel }
    }

    /// Units of `step` voxels.
    pub(crate) fn of_page(step: f64) -> Units {
        Units { per_voxel: 1.0 / step, stored: STORED_OF_PAGE }
    }

    /// The position of a knot of a spectrum that is rounded to these units.
    pub(super) fn of(self, knot: &Knot) -> [i32; 3] {
        knot.position.map(|x| self.of_coordinate(x))
    }

    /// A coordinate in units.
    pub(super) fn of_coordinate(self, x: f32) -> i32 {
        (f64::from(x) * self.stored).round() as i32
    }

    /// The coordinate of so many units.
    pub(super) fn coordinate(self, x: i32) -> f32 {
        (f64::from(x) / self.stored) as f32
    }
}

/// Of a vertex that faces no axis, as its coordinates are no multiples of [`ALONG`].
const NO_AXIS: usize = 3;

/// In which units the coordinates of a vertex are counted.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Facing {
    axis: usize,
}

impl Facing {
    /// The largest number in a file: that of a vertex that faces no axis.
    pub(super) const MAX_CODE: u64 = NO_AXIS as u64;

    /// The axis that a vertex with these positions faces: the first for which both other coordinates are multiples of [`ALONG`] at
    /// every knot.
    pub(super) fn of(trajectory: &[[i32; 3]]) -> Facing {
        let is_multiple = |x: &[i32; 3], a: usize| i64::from(x[a % 3]) % ALONG == 0;
        let faces =
            |&a: &usize| trajectory.iter().all(|x| is_multiple(x, a + 1) && is_multiple(x, a + 2));
        Facing { axis: (0..3).find(faces).unwrap_or(NO_AXIS) }
    }

    /// The number in the file.
    pub(super) fn code(self) -> u64 {
        self.axis as u64
    }

    /// What [`Facing::code`] returned.
    pub(super) fn from_code(code: u64) -> Option<Facing> {
        (code <= Self::MAX_CODE).then_some(Facing { axis: code as usize })
    }

    /// The axes, and the units in which coordinates along them are counted; the axis that the vertex faces is the first, the next ones
    /// follow in the order x, y, z, x.
    pub(super) fn units(self) -> [(usize, i64); 3] {
        let along = if self.axis == NO_AXIS { 1 } else { ALONG };
        [0, 1, 2].map(|k| ((self.axis + k) % 3, if k == 0 { 1 } else { along }))
    }
}
