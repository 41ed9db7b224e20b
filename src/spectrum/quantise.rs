//! The precision of stored positions.
//!
//! A file stores positions as multiples of a [`quantum`]. [`Spectrum::quantised`] rounds to exactly the positions that are read
//! from a file, so that the stored spectrum is the one that is verified.
//!
//! A quantum is a power of two and independent of the size of the volume. Integers (the samples of an isotropic
//! volume) stay exact.

use super::data::Spectrum;

/// The smallest quantum, voxels: coordinates of 2^20 voxels are at most 2^30 of them.
pub const FINEST_QUANTUM: f64 = 1.0 / 1024.0;

/// The largest quantum, voxels.
const COARSEST_QUANTUM: f64 = 1.0 / 32.0;

/// Least number of quanta in a tolerance, so that rounding moves positions by at most 1/24 of it.
const MIN_QUANTA_PER_TOLERANCE: f64 = 12.0;

/// Positions of a spectrum with a tolerance (voxels) are stored as multiples of so many voxels: 1/128 for the default
/// tolerance of 0.1 voxel.
pub fn quantum(tolerance: f64) -> f64 {
    let mut step = COARSEST_QUANTUM;
    while step > FINEST_QUANTUM && step * MIN_QUANTA_PER_TOLERANCE > tolerance {
        step *= 0.5;
    }
    step
}

impl Spectrum {
    /// The spectrum with positions rounded as by the file: those of trajectories to the [`quantum`], those of events to
    /// [`FINEST_QUANTUM`]. Idempotent.
    pub fn quantised(mut self) -> Spectrum {
        let step = quantum(self.tolerance());
        // Every `f32` that a multiple of the step cannot be is larger than any coordinate, or a multiple itself.
        let rounded = |x: f32| ((f64::from(x) / step).round() * step) as f32;
        for knot in &mut self.patch_mut().knots {
            knot.position = knot.position.map(rounded);
        }
        for event in &mut self.about_mut().events {
            event.position = event.position.map(|x| (x / FINEST_QUANTUM).round() * FINEST_QUANTUM);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quanta_are_powers_of_two_and_at_most_a_twelfth_of_the_tolerance() {
        assert_eq!(quantum(0.1), 1.0 / 128.0);
        assert_eq!(quantum(0.4), 1.0 / 32.0);
        assert_eq!([10.0, 1e-9, 0.0].map(quantum), [1.0 / 32.0, 1.0 / 1024.0, 1.0 / 1024.0]);
        for i in 20..200 {
            let tolerance = f64::from(i) * 2e-3;
            let step = quantum(tolerance);
            assert!(step.log2().fract() == 0.0 && 12.0 * step <= tolerance, "{tolerance}");
            assert!(24.0 * step > tolerance || step == COARSEST_QUANTUM, "{tolerance}");
        }
    }
}
