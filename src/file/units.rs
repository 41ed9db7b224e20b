//! The units in which stored positions are counted.

use crate::spectrum::{Knot, quantum};

/// The units in which stored positions are counted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Units {
    /// Units per voxel.
    pub(super) per_voxel: f64,
    /// Coordinates along the surface are multiples of so many units, see [`super::facing`].
    pub(super) along: i64,
    /// Units per 1.0 of a coordinate of a rounded spectrum.
    pub(super) stored: f64,
}

/// [`Units::stored`] of a page: the coordinates of a rounded spectrum are numbers of steps divided by 256, whatever the step.
pub(super) const STORED_OF_PAGE: f64 = 256.0;

impl Units {
    /// The units of a file, given the tolerance of its spectrum in voxels.
    pub(super) fn of_file(tolerance: f64) -> Units {
        let per_voxel = 1.0 / quantum(tolerance);
        Units { per_voxel, along: 1, stored: per_voxel }
    }

    /// Units of `step` voxels, and `along` of them along the surface.
    pub(crate) fn of_page(step: f64, along: i64) -> Units {
        Units { per_voxel: 1.0 / step, along, stored: STORED_OF_PAGE }
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

    /// Whether the axis that a vertex faces is stored.
    pub(super) fn has_facing(self) -> bool {
        self.along > 1
    }

    /// The axis that a vertex with rounded positions faces: the first for which both
    /// other coordinates are multiples of `along` at every knot.
    pub(super) fn facing(self, trajectory: &[[i32; 3]]) -> usize {
        let is_multiple = |x: &[i32; 3], a: usize| i64::from(x[a % 3]) % self.along == 0;
        let faces =
            |&a: &usize| trajectory.iter().all(|x| is_multiple(x, a + 1) && is_multiple(x, a + 2));
        (0..3).find(faces).unwrap_or(0)
    }
}
