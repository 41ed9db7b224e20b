//! Mean, standard deviation and percentiles of the samples of a volume, by which isovalues can be given.

use num_traits::AsPrimitive as _;
use serde::{Deserialize, Serialize};

use super::grid::Volume;
use super::histogram::Histogram;
use super::samples::{Samples, with_samples};
use crate::error::{Error, Result};

/// Percents of the stored percentiles below the first half per cent (the other end is symmetric): finer towards the ends,
/// where isovalues of densities are. In between every half per cent is stored.
const TAIL_PERCENTS: [f64; 10] = [0.0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3];

/// Statistics of the samples of a volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Statistics {
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation.
    pub deviation: f64,
    /// Percents, from 0 to 100 and strictly increasing, each with the value that this share of the samples does not exceed.
    percentiles: Vec<(f64, f64)>,
}

impl Statistics {
    /// The key of the statistics in the metadata of a spectrum.
    pub const NAME: &str = "samples";

    /// Statistics of the samples of a volume; with a mask, of those inside it.
    pub fn of(volume: &Volume) -> Statistics {
        let mut tally = Tally::new(volume.range());
        match volume.mask() {
            Some(_) => tally.add(volume.values()),
            None => tally.add_all(volume.samples()),
        }
        tally.statistics()
    }

    /// The value that `percent` (0 to 100) of the samples do not exceed, interpolated between the stored percentiles.
    pub fn percentile(&self, percent: f64) -> f64 {
        let next = self.percentiles.partition_point(|p| p.0 < percent);
        let (percent_after, after) = self.percentiles[next.min(self.percentiles.len() - 1)];
        let (percent_before, before) = self.percentiles[next.saturating_sub(1)];
        if percent_after <= percent_before {
            return after;
        }
        let t = ((percent - percent_before) / (percent_after - percent_before)).clamp(0.0, 1.0);
        before * (1.0 - t) + after * t
    }

    /// From the metadata of a spectrum; none if they are missing or invalid.
    pub(crate) fn of_json(json: &serde_json::Value) -> Option<Statistics> {
        let statistics = Statistics::deserialize(json).ok()?;
        let pairs = &statistics.percentiles;
        let is_valid = pairs.len() >= 2
            && pairs.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 <= w[1].1)
            && pairs.iter().all(|p| p.1.is_finite())
            && statistics.mean.is_finite()
            && statistics.deviation.is_finite();
        is_valid.then_some(statistics)
    }
}

/// Accumulates statistics. The result does not depend on the order of the samples or on how they are divided between
/// tallies, because sums are integers.
#[derive(Clone, Debug)]
pub struct Tally {
    /// The middle of the range, which is subtracted first: squares of values far from zero would lose digits.
    middle: f64,
    /// Integer units per unit of value, a power of two: no value is farther than [`MAX_UNITS`] from the middle.
    units: f64,
    sum: i128,
    squares: i128,
    histogram: Histogram,
}

/// Largest distance from the middle in integer units: squares of 2^35 samples at this distance fit 128 bits, 2^-46 of the
/// range is finer than any printed mean, and integers of up to 32 bits are exact.
const MAX_UNITS: f64 = (1u64 << 46) as f64;

impl Tally {
    /// An empty tally; all samples must be in the range.
    pub fn new((low, high): (f64, f64)) -> Tally {
        let histogram = Histogram::of_values(std::iter::empty(), (low, high));
        // From the bits of the number: a logarithm may round up or down.
        let exponent = (0.5 * high - 0.5 * low).to_bits() >> 52;
        let units = MAX_UNITS / (2.0 * f64::from_bits(exponent << 52));
        Tally { middle: 0.5 * low + 0.5 * high, units, sum: 0, squares: 0, histogram }
    }

    fn add(&mut self, values: impl Iterator<Item = f64>) {
        let Tally { middle, units, sum, squares, histogram } = self;
        histogram.add(values.inspect(|value| {
            let x = i128::from(((value - *middle) * *units).round() as i64);
            *sum += x;
            *squares += x * x;
        }));
    }

    /// Adds samples.
    pub fn add_all(&mut self, samples: &Samples) {
        with_samples!(samples, s => self.add(s.iter().map(|&v| v.as_())));
    }

    /// Both sums (i128), then index (u32), count (u64) and largest value (f64) of each bin that is not empty; little endian.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = [self.sum, self.squares].map(i128::to_le_bytes).concat();
        for (i, n, largest) in self.histogram.bins() {
            bytes.extend((i as u32).to_le_bytes());
            bytes.extend(n.to_le_bytes());
            bytes.extend(largest.to_le_bytes());
        }
        bytes
    }

    /// Adds the bytes of another tally of the same range.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for damaged bytes.
    pub fn add_bytes(&mut self, bytes: &[u8]) -> Result<()> {
        let wrong = || Error::input("damaged statistics");
        let (sums, bins) = bytes.split_at_checked(32).ok_or_else(wrong)?;
        let number = |bytes: &[u8]| bytes.iter().rev().fold(0u128, |n, &b| n << 8 | u128::from(b));
        let [sum, squares] = [0, 16].map(|at| number(&sums[at..at + 16]) as i128);
        self.sum = self.sum.checked_add(sum).ok_or_else(wrong)?;
        self.squares = self.squares.checked_add(squares).ok_or_else(wrong)?;
        bins.chunks(20).try_for_each(|bin| {
            if bin.len() < 20 {
                return Err(wrong());
            }
            let (i, n) = (number(&bin[..4]) as usize, number(&bin[4..12]) as u64);
            let largest = f64::from_bits(number(&bin[12..]) as u64);
            if self.histogram.add_to(i, n, largest) { Ok(()) } else { Err(wrong()) }
        })
    }

    /// The statistics of all samples so far.
    pub fn statistics(&self) -> Statistics {
        let n = self.histogram.total() as f64;
        // In integer units: squares stay finite for any range.
        let (mean, squares) = (self.sum as f64 / n, self.squares as f64 / n);
        let halves = (1..=199).map(|i| 0.5 * f64::from(i));
        let percents = TAIL_PERCENTS
            .into_iter()
            .chain(halves)
            .chain(TAIL_PERCENTS.iter().rev().map(|p| 100.0 - p));
        Statistics {
            mean: self.middle + mean / self.units,
            deviation: (squares - mean * mean).max(0.0).sqrt() / self.units,
            percentiles: percents.map(|p| (p, self.histogram.percentile(p))).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Placement, Samples};

    fn volume(samples: Vec<f32>) -> Volume {
        let n = samples.len();
        let samples = Samples::F32(samples);
        Volume::new("row", [n / 4, 2, 2], samples, Placement::default()).expect("a volume")
    }

    #[test]
    fn mean_deviation_and_percentiles_of_evenly_spread_samples() {
        let volume = volume((0..4000).map(|i| 1e4 + i as f32).collect());
        let found = Statistics::of(&volume);
        assert_eq!(found.mean, 1e4 + 1999.5);
        // Of n whole numbers: (n^2 - 1) / 12.
        let deviation = ((4000.0f64 * 4000.0 - 1.0) / 12.0).sqrt();
        assert!((found.deviation - deviation).abs() < 1e-9 * deviation, "{}", found.deviation);
        for percent in [0.0, 0.1, 12.3, 50.0, 99.95, 100.0] {
            let expected = 1e4 + 3999.0 * percent / 100.0;
            // A sample is a 4,000th of all, and a bin a 65,536th of the range.
            assert!((found.percentile(percent) - expected).abs() <= 1.1, "{percent}");
        }
        let json = serde_json::to_value(&found).expect("JSON");
        assert_eq!(Statistics::of_json(&json), Some(found));
    }

    #[test]
    fn tallies_of_parts_add_up_to_the_same_in_any_order() {
        for (offset, scale) in [(0.0f32, 1.0f32), (1e6, 1.0), (-3e-20, 1e-22), (0.0, 1e30)] {
            let value = |i: usize| offset + scale * ((i * 7919 % 4001) as f32).sin();
            let volume = volume((0..4000).map(value).collect());
            let whole = Statistics::of(&volume);
            let Samples::F32(all) = volume.samples() else { panic!("floats") };
            let mut joined = Tally::new(volume.range());
            for part in all.chunks(611).rev() {
                let mut tally = Tally::new(volume.range());
                tally.add_all(&Samples::F32(part.to_vec()));
                joined.add_bytes(&tally.to_bytes()).expect("a tally");
            }
            assert_eq!(joined.statistics(), whole);
            let from = f64::from(offset);
            let mean = from + all.iter().map(|&v| f64::from(v) - from).sum::<f64>() / 4000.0;
            let (low, high) = volume.range();
            // A mean is exact to 2^-46 of the range, and to the precision of f64.
            let exact = 1e-12 * (high - low) + 4.0 * f64::EPSILON * mean.abs();
            assert!((whole.mean - mean).abs() < exact, "{mean} {}", whole.mean);
            let bytes = joined.to_bytes();
            assert!(joined.add_bytes(&bytes[..31]).is_err());
            assert!(joined.add_bytes(&bytes[..bytes.len() - 1]).is_err());
            let mut far = bytes.clone();
            far[34] = 7;
            assert!(joined.add_bytes(&far).is_err());
        }
    }

    #[test]
    fn invalid_metadata_have_no_statistics() {
        for wrong in [
            "null",
            "{\"mean\":1,\"deviation\":1,\"percentiles\":[]}",
            "{\"mean\":1,\"deviation\":1,\"percentiles\":[[0,1],[0,2]]}",
            "{\"mean\":1,\"deviation\":1,\"percentiles\":[[0,2],[100,1]]}",
            "{\"mean\":1,\"percentiles\":[[0,1],[100,2]]}",
        ] {
            let json = serde_json::from_str(wrong).expect("JSON");
            assert_eq!(Statistics::of_json(&json), None, "{wrong}");
        }
    }
}
