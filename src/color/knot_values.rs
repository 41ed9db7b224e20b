//! A second field on the surfaces: its value at every knot.
//!
//! A field is sampled where the knots are, once for all isovalues, and follows the trajectories between them as
//! positions do. So a picture needs no samples, and a page holds a number per knot and no volume.

use rayon::prelude::*;

use crate::spectrum::Spectrum;

/// The values of a field at the knots of a spectrum.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotValues {
    /// What it is the field of.
    pub name: String,
    /// One per knot, as long as [`Spectrum::knots`]; not a number where the field does not reach.
    pub values: Vec<f32>,
}

impl KnotValues {
    /// Samples a field, which is told the positions of knots in the voxel frame.
    pub fn sampled(
        spectrum: &Spectrum,
        name: &str,
        value_at: impl Fn([f32; 3]) -> f64 + Sync,
    ) -> Self {
        let values = spectrum.knots().par_iter().map(|knot| value_at(knot.position) as f32);
        KnotValues { name: name.to_owned(), values: values.collect() }
    }

    /// The value at vertex `v` at `isovalue`, whose rank is `rank`: between knots as the position is.
    pub fn at(&self, spectrum: &Spectrum, v: u32, rank: u32, isovalue: f64) -> f32 {
        let ([before, after], t) = spectrum.way_between_knots(v, rank, isovalue);
        let [p, q] = [before, after].map(|i| f64::from(self.values[i]));
        // A knot counts by itself where the mesh is at it.
        if t == 0.0 { p as f32 } else { ((1.0 - t) * p + t * q) as f32 }
    }
}
