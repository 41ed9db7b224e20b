//! Samples that change, and their order.
//!
//! # Invariants
//!
//! Of equal samples the one with the higher index is lower, as with the ramp of the exact field. The layer around
//! the volume is a neighbour of every sample at the border, lower than all samples or higher.

use rayon::prelude::*;

use crate::topology::exact::power_of_two_from;
use crate::volume::{Outside, Volume};

/// Samples in planes of z, x fastest in each.
pub(super) struct Lattice {
    pub(super) dims: [usize; 3],
    pub(super) planes: Vec<Vec<f64>>,
    pub(super) order: TieOrder,
    pub(super) grain: Grain,
}

/// All samples are multiples of the grain: a power of two, coarser than the levels of the exact field. So both have the
/// same order, including ties.
#[derive(Clone, Copy)]
pub(super) struct Grain {
    pub(super) size: f64,
    inverse: f64,
}

impl Grain {
    /// The grain for a range of samples.
    pub(super) fn of_range((low, high): (f64, f64)) -> Self {
        // Quarters do not overflow. Multiples stay below 2^50, sums of them exact.
        let range = power_of_two_from(high * 0.25 - low * 0.25);
        let largest = power_of_two_from(0.25 * low.abs().max(high.abs()));
        let size = (range / (1u64 << 38) as f64).max(largest / (1u64 << 46) as f64);
        Grain { size, inverse: 1.0 / size }
    }

    /// The nearest multiple.
    #[inline]
    pub(super) fn round(self, value: f64) -> f64 {
        // From 2^52 on, f64 numbers are integers.
        const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;
        ((value * self.inverse + WHOLE) - WHOLE) * self.size
    }
}

/// The order of equal samples and of the layer.
#[derive(Clone, Copy)]
pub(super) struct TieOrder {
    /// Whether the layer around the volume is lower than all samples.
    pub(super) layer_is_low: bool,
    /// Whether the field is negated: then of equal samples the one with the lower index is lower.
    pub(super) is_negated: bool,
}

impl TieOrder {
    /// Whether a value at sample `a` is lower than one at sample `b`.
    #[inline]
    pub(super) fn is_lower(self, at_a: f64, a: usize, at_b: f64, b: usize) -> bool {
        at_a < at_b || (at_a == at_b && a != b && (a > b) != self.is_negated)
    }
}

impl Lattice {
    /// The samples of a volume, as multiples of `grain`.
    pub(super) fn of(volume: &Volume, grain: Grain) -> Self {
        let plane = volume.dims()[0] * volume.dims()[1];
        let sample = |s| grain.round(volume.samples().get(s));
        let of_plane = |z| (z * plane..(z + 1) * plane).map(sample).collect();
        Lattice {
            dims: volume.dims(),
            planes: (0..volume.dims()[2]).into_par_iter().map(of_plane).collect(),
            order: TieOrder { layer_is_low: volume.outside() == Outside::Low, is_negated: false },
            grain,
        }
    }

    /// All samples, x fastest.
    pub(super) fn into_samples(self) -> Vec<f64> {
        let mut samples = Vec::with_capacity(self.dims.iter().product());
        self.planes.into_iter().for_each(|plane| samples.extend(plane));
        samples
    }

    /// Number of samples of a plane.
    fn plane(&self) -> usize {
        self.dims[0] * self.dims[1]
    }

    #[inline]
    pub(super) fn get(&self, sample: usize) -> f64 {
        self.planes[sample / self.plane()][sample % self.plane()]
    }

    pub(super) fn set(&mut self, sample: usize, value: f64) {
        let plane = self.plane();
        self.planes[sample / plane][sample % plane] = value;
    }

    /// Whether sample `a` is lower than sample `b`.
    pub(super) fn is_lower(&self, a: usize, b: usize) -> bool {
        self.order.is_lower(self.get(a), a, self.get(b), b)
    }

    /// The neighbours of a sample along lattice edges, and whether the sample is at the border.
    pub(super) fn neighbours(&self, sample: usize) -> ([Option<usize>; 6], bool) {
        let [nx, ny, _] = self.dims;
        let position = [sample % nx, sample / nx % ny, sample / (nx * ny)];
        let strides = [1, nx, nx * ny];
        let mut found = [None; 6];
        for a in 0..3 {
            found[2 * a] = (position[a] > 0).then(|| sample - strides[a]);
            found[2 * a + 1] = (position[a] + 1 < self.dims[a]).then(|| sample + strides[a]);
        }
        (found, found.contains(&None))
    }

    /// All samples without a lower neighbour, ascending.
    pub(super) fn minima(&self) -> Vec<usize> {
        (0..self.dims[2]).into_par_iter().flat_map_iter(|z| self.minima_of(z)).collect()
    }

    /// The minima of a plane.
    fn minima_of(&self, z: usize) -> Vec<usize> {
        let [nx, ny, nz] = self.dims;
        let first = z * nx * ny;
        let mut found = Vec::new();
        let is_inner = z > 0 && z + 1 < nz;
        for y in 0..ny {
            let row = y * nx;
            if !(is_inner && y > 0 && y + 1 < ny && nx > 2) {
                found.extend((first + row..first + row + nx).filter(|&s| self.is_minimum(s)));
                continue;
            }
            let (plane, below, above) = (&self.planes[z], &self.planes[z - 1], &self.planes[z + 1]);
            found.extend(Some(first + row).filter(|&s| self.is_minimum(s)));
            for i in row + 1..row + nx - 1 {
                // The lowest neighbour with a lower index, and with a higher one.
                let before = plane[i - 1].min(plane[i - nx]).min(below[i]);
                let after = plane[i + 1].min(plane[i + nx]).min(above[i]);
                let value = plane[i];
                if before >= value && after >= value {
                    let is_tied = if self.order.is_negated { before } else { after } == value;
                    found.extend((!is_tied).then_some(first + i));
                }
            }
            found.extend(Some(first + row + nx - 1).filter(|&s| self.is_minimum(s)));
        }
        found
    }

    /// Whether a sample has no lower neighbour.
    pub(super) fn is_minimum(&self, sample: usize) -> bool {
        let (around, at_border) = self.neighbours(sample);
        let drains = at_border && self.order.layer_is_low
            || around.into_iter().flatten().any(|n| self.is_lower(n, sample));
        !drains
    }

    /// Negates the field, with the layer and the order of equal samples.
    pub(super) fn negate(&mut self) {
        self.planes.par_iter_mut().flatten().for_each(|x| *x = -*x);
        self.order.layer_is_low = !self.order.layer_is_low;
        self.order.is_negated = !self.order.is_negated;
    }
}
