//! The precision a spectrum is stored with.
//!
//! The file keeps positions in steps of [`QUANTUM`] and normals in two 8-bit octahedral
//! components. [`Spectrum::quantised`] rounds to exactly what comes back from a file, so that what
//! is verified is what is stored.
//!
//! A step of 1/1024 voxel is a hundredth of the usual tolerance of 0.1 voxel, is the same in a
//! volume of any size, and leaves whole numbers (the border of an isotropic volume) exact.

use super::{Knot, Spectrum};

/// Positions are stored as whole multiples of this many voxels.
pub const QUANTUM: f64 = 1.0 / 1024.0;

impl Spectrum {
    /// The spectrum with positions and normals rounded as the file rounds them. Doing it again
    /// changes nothing.
    pub fn quantised(mut self) -> Spectrum {
        for knot in &mut self.knots {
            *knot = Knot {
                rank: knot.rank,
                position: knot.position.map(|x| from_fixed(to_fixed(x))),
                normal: knot.normal.map(|s| widen_normal(narrow_normal(s, 127))),
            };
        }
        self
    }
}

/// A coordinate in quanta.
pub(crate) fn to_fixed(x: f32) -> i32 {
    (f64::from(x) / QUANTUM).round() as i32
}

/// The coordinate of a number of quanta. Every `f32` of 2^14 voxels or more is a multiple of the
/// quantum already, and below that every multiple is an `f32`, so nothing is rounded here.
pub(crate) fn from_fixed(x: i32) -> f32 {
    (f64::from(x) * QUANTUM) as f32
}

/// The nearest code from -`radius` to `radius` to a component of a 16-bit octahedral code; files
/// have 127.
pub(crate) fn narrow_normal(s: i16, radius: i8) -> i8 {
    let radius = f64::from(radius);
    (f64::from(s) * radius / 32767.0).round().max(-radius) as i8
}

/// The nearest 16-bit code to a component of an 8-bit octahedral code.
pub(crate) fn widen_normal(s: i8) -> i16 {
    (f64::from(s).max(-127.0) * 32767.0 / 127.0).round() as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::normal;

    #[test]
    fn every_8_bit_component_survives_the_way_through_16_bits() {
        for s in -127..=127i8 {
            assert_eq!(narrow_normal(widen_normal(s), 127), s);
        }
        assert_eq!(narrow_normal(i16::MIN, 127), -127);
    }

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

    #[test]
    fn a_narrow_normal_is_within_a_degree() {
        // Half a step of 1/127 in both components, stretched at most by 3 on the way back to the
        // sphere (see `normal`): 0.0167 radians.
        for i in 0..5000 {
            let z = 1.0 - (2 * i + 1) as f32 / 5000.0;
            let (s, c) = (i as f32 * 2.4).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let n = [r * c, r * s, z];
            let m = normal::decode(normal::encode(n).map(|s| widen_normal(narrow_normal(s, 127))));
            let cosine: f32 = (0..3).map(|a| n[a] * m[a]).sum();
            assert!(cosine > (0.0167f32 + 1e-3).cos(), "{n:?} became {m:?}");
        }
    }
}
