//! Mean, standard deviation and percentiles of the samples of a volume: what isovalues are written by.

use num_traits::AsPrimitive as _;
use serde::{Deserialize, Serialize};

use super::{Histogram, Samples, Volume};
use crate::volume::with_samples;

/// Percentiles that are known: every half per cent, and finer towards both ends, where densities have their isovalues.
const TAIL: [f64; 10] = [0.0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3];

/// What is known of the samples of a volume without them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Statistics {
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation.
    pub deviation: f64,
    /// Percents, from 0 to 100 and strictly increasing, each with the value that so many of the samples do not exceed.
    percentiles: Vec<(f64, f64)>,
}

impl Statistics {
    /// Under this name the parameters of a spectrum tell those of its volume.
    pub const NAME: &str = "samples";

    /// Those of a volume, of its samples inside the mask where it has one.
    pub fn of(volume: &Volume) -> Statistics {
        let mut tally = Tally::new(volume.range());
        match volume.mask() {
            Some(_) => tally.add(volume.values()),
            None => tally.add_all(volume.samples()),
        }
        tally.statistics()
    }

    /// The value that `percent` (0 to 100) of the samples do not exceed: straight between known percentiles.
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

    /// As a spectrum's parameters tell them; none where they do not, or not so that percentiles can be found.
    pub(crate) fn of_json(told: &serde_json::Value) -> Option<Statistics> {
        let told = Statistics::deserialize(told).ok()?;
        let pairs = &told.percentiles;
        let is_good = pairs.len() >= 2
            && pairs.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 <= w[1].1)
            && pairs.iter().all(|p| p.1.is_finite())
            && told.mean.is_finite()
            && told.deviation.is_finite();
        is_good.then_some(told)
    }
}

/// Statistics in the making, of samples that come one after the other: what comes out depends on their order alone, not on how
/// many came at a time.
pub(crate) struct Tally {
    /// From the middle of the range: squares of what is far from zero would lose digits.
    middle: f64,
    n: f64,
    sum: f64,
    squares: f64,
    histogram: Histogram,
}

impl Tally {
    /// Of nothing yet; all samples to come lie in a range.
    pub(crate) fn new((low, high): (f64, f64)) -> Tally {
        let histogram = Histogram::of_values(std::iter::empty(), (low, high));
        Tally { middle: 0.5 * low + 0.5 * high, n: 0.0, sum: 0.0, squares: 0.0, histogram }
    }

    fn add(&mut self, values: impl Iterator<Item = f64>) {
        let Tally { middle, n, sum, squares, histogram } = self;
        histogram.add(values.inspect(|value| {
            let x = value - *middle;
            *n += 1.0;
            *sum += x;
            *squares += x * x;
        }));
    }

    /// Takes more samples.
    pub(crate) fn add_all(&mut self, samples: &Samples) {
        with_samples!(samples, s => self.add(s.iter().map(|&v| v.as_())));
    }

    /// What is known of all samples so far.
    pub(crate) fn statistics(&self) -> Statistics {
        let mean = self.sum / self.n;
        let halves = (1..=199).map(|i| 0.5 * f64::from(i));
        let percents = TAIL.into_iter().chain(halves).chain(TAIL.iter().rev().map(|p| 100.0 - p));
        Statistics {
            mean: self.middle + mean,
            deviation: (self.squares / self.n - mean * mean).max(0.0).sqrt(),
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
        let told = serde_json::to_value(&found).expect("JSON");
        assert_eq!(Statistics::of_json(&told), Some(found));
    }

    #[test]
    fn what_is_told_wrongly_is_not_known() {
        for wrong in [
            "null",
            "{\"mean\":1,\"deviation\":1,\"percentiles\":[]}",
            "{\"mean\":1,\"deviation\":1,\"percentiles\":[[0,1],[0,2]]}",
            "{\"mean\":1,\"deviation\":1,\"percentiles\":[[0,2],[100,1]]}",
            "{\"mean\":1,\"percentiles\":[[0,1],[100,2]]}",
        ] {
            let told = serde_json::from_str(wrong).expect("JSON");
            assert_eq!(Statistics::of_json(&told), None, "{wrong}");
        }
    }
}
