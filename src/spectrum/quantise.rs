//! The precision a spectrum is stored with.
//!
//! The file keeps positions in steps of [`QUANTUM`]. [`Spectrum::quantised`] rounds to exactly what comes
//! back from a file, so that what is verified is what is stored.
//!
//! A step of 1/256 voxel is a twenty-fifth of the usual tolerance of 0.1 voxel, is the same in a
//! volume of any size, and leaves whole numbers (the border of an isotropic volume) exact.

use super::Spectrum;

/// Positions are stored as whole multiples of this many voxels.
pub const QUANTUM: f64 = 1.0 / 256.0;

impl Spectrum {
    /// The spectrum with positions rounded as the file rounds them. Doing it again changes nothing.
    pub fn quantised(mut self) -> Spectrum {
        for knot in &mut self.patch.knots {
            knot.position = knot.position.map(|x| from_fixed(to_fixed(x)));
        }
        self
    }
}

/// A coordinate in quanta.
pub(crate) fn to_fixed(x: f32) -> i32 {
    (f64::from(x) / QUANTUM).round() as i32
}

/// The coordinate of a number of quanta. Every `f32` of 2^16 voxels or more is a multiple of the
/// quantum already, and below that every multiple is an `f32`, so nothing is rounded here.
fn from_fixed(x: i32) -> f32 {
    (f64::from(x) * QUANTUM) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_voxels_stay_whole_and_rounding_is_half_a_quantum_at_most() {
        for i in -1..=2048i32 {
            assert_eq!(from_fixed(to_fixed(i as f32)), i as f32);
            let x = i as f32 * 0.731_f32;
            assert!(f64::from((from_fixed(to_fixed(x)) - x).abs()) <= QUANTUM / 2.0);
            let fixed = to_fixed(x);
            assert_eq!(to_fixed(from_fixed(fixed)), fixed);
        }
    }
}
