//! Positions of vertices between the knots of their trajectories.

use super::data::Spectrum;
use crate::error::{Error, Result};

impl Spectrum {
    /// Checks that `isovalue` is in the range.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] outside the closed [`Spectrum::range`], and for NaN.
    pub fn check_isovalue(&self, isovalue: f64) -> Result<()> {
        let (low, high) = self.range();
        if low <= isovalue && isovalue <= high {
            return Ok(());
        }
        Err(Error::Range { isovalue, low, high })
    }

    /// The largest rank whose isovalue is at most `isovalue`; none below the first.
    pub fn rank_at(&self, isovalue: f64) -> Option<u32> {
        let n = self.isovalues().partition_point(|&c| c <= isovalue);
        n.checked_sub(1).map(|rank| rank as u32)
    }

    /// Position (voxel frame) of vertex `v` at `isovalue`, whose rank is `rank`:
    /// linear between the knots on either side, exact at a knot, and that of the first or last knot
    /// beyond these.
    ///
    /// # Panics
    ///
    /// If the vertex has no knots.
    pub fn vertex_at(&self, v: u32, rank: u32, isovalue: f64) -> [f32; 3] {
        let ([before, after], t) = self.bracketing_knots(v, rank, isovalue);
        let [before, after] = [before, after].map(|i| &self.knots()[i]);
        if t == 0.0 { before.position } else { between(before.position, after.position, t) }
    }

    /// The indices of the knots of vertex `v` on either side of `isovalue`, whose rank is `rank`, and the fraction
    /// of the isovalue between them: 0 at the first, or if there is a knot on one side only.
    pub(crate) fn bracketing_knots(&self, v: u32, rank: u32, isovalue: f64) -> ([usize; 2], f64) {
        let around = self.knots_around(v, rank);
        let [low, high] = around.map(|i| self.isovalues()[self.knots()[i].rank as usize]);
        (around, if low < high { fraction(isovalue, low, high) } else { 0.0 })
    }

    /// The indices of the last knot of vertex `v` not above `rank` and of the first one above;
    /// equal before the first knot and from the last one on.
    pub(super) fn knots_around(&self, v: u32, rank: u32) -> [usize; 2] {
        let trajectory = self.trajectory(v);
        let next = trajectory.partition_point(|knot| knot.rank <= rank);
        let first = self.first_knot()[v as usize] as usize;
        [first + next.saturating_sub(1), first + next.min(trajectory.len() - 1)]
    }
}

/// The fraction of `isovalue` between `low` and `high`, in [0, 1]; 0 if these are equal. The numbers are halved first, so that even the
/// widest range does not overflow.
pub(super) fn fraction(isovalue: f64, low: f64, high: f64) -> f64 {
    let share = (0.5 * isovalue - 0.5 * low) / (0.5 * high - 0.5 * low);
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

/// The position at the fraction `t` between two knots.
#[inline]
pub(super) fn between(p: [f32; 3], q: [f32; 3], t: f64) -> [f32; 3] {
    // In double precision: coordinates of a large volume need all bits of single precision.
    std::array::from_fn(|i| ((1.0 - t) * f64::from(p[i]) + t * f64::from(q[i])) as f32)
}
