//! The precision a spectrum is stored with.
//!
//! The file keeps positions in steps of a [`quantum`]. [`Spectrum::quantised`] rounds to exactly what comes
//! back from a file, so that what is verified is what is stored.
//!
//! A step is a power of two, the same in a volume of any size, and leaves whole numbers (the samples of an isotropic
//! volume) exact.

use super::Spectrum;

/// The finest step, voxels: coordinates of 2^20 voxels are at most 2^30 of them.
pub const FINEST_QUANTUM: f64 = 1.0 / 1024.0;

/// The coarsest step, voxels.
const COARSEST_QUANTUM: f64 = 1.0 / 32.0;

/// A tolerance is so many steps at least, so that what rounding moves is a twenty-fourth of it at most.
const STEPS_PER_TOLERANCE: f64 = 12.0;

/// Positions of a spectrum of a tolerance (voxels) are stored as whole multiples of this many voxels: 1/128 with the usual
/// one of 0.1 voxel.
pub fn quantum(tolerance: f64) -> f64 {
    let mut step = COARSEST_QUANTUM;
    while step > FINEST_QUANTUM && step * STEPS_PER_TOLERANCE > tolerance {
        step *= 0.5;
    }
    step
}

impl Spectrum {
    /// The spectrum with positions rounded as the file rounds them. Doing it again changes nothing.
    pub fn quantised(mut self) -> Spectrum {
        let step = quantum(self.tolerance());
        // Every `f32` that a multiple of the step cannot be is larger than any coordinate, or a multiple itself.
        let rounded = |x: f32| ((f64::from(x) / step).round() * step) as f32;
        for knot in &mut self.patch.knots {
            knot.position = knot.position.map(rounded);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_powers_of_two_and_fit_into_the_tolerance() {
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
