//! A second field on the surfaces, by its value at every knot.
//!
//! The field is sampled at the knots, once for all isovalues, and interpolated between them along the trajectories as
//! positions are. So a picture needs no samples, and a page holds one number per knot instead of a volume.

use rayon::prelude::*;

use crate::spectrum::Spectrum;

/// The values of a field at the knots of a spectrum.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotValues {
    /// The name of the field.
    pub name: String,
    /// One value per knot, as long as [`Spectrum::knots`]; NaN outside of the field.
    pub values: Vec<f32>,
}

impl KnotValues {
    /// Samples a field, given as a function of the position in the voxel frame, at all knots.
    pub fn sampled(
        spectrum: &Spectrum,
        name: &str,
        value_at: impl Fn([f32; 3]) -> f64 + Sync,
    ) -> Self {
        let values = spectrum.knots().par_iter().map(|knot| value_at(knot.position) as f32);
        KnotValues { name: name.to_owned(), values: values.collect() }
    }

    /// The value at vertex `v` at `isovalue` with rank `rank`, interpolated between knots as the position is.
    pub fn at(&self, spectrum: &Spectrum, v: u32, rank: u32, isovalue: f64) -> f32 {
        let ([before, after], t) = spectrum.bracketing_knots(v, rank, isovalue);
        let [p, q] = [before, after].map(|i| f64::from(self.values[i]));
        // At a knot the next value does not count, even if it is NaN.
        if t == 0.0 { p as f32 } else { ((1.0 - t) * p + t * q) as f32 }
    }
}
