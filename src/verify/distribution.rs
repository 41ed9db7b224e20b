//! Distributions of values as histograms: mean, percentiles, minimum and maximum.
//!
//! Memory does not grow with the number of values, so the distances of all triangles at all
//! isovalues can be pooled. A percentile is exact to one bin, a four-thousandth of the range:
//! a thousandth of a voxel for distances.

use serde::Serialize;

/// Bins of a histogram.
const BINS: usize = 4000;

/// Values in [0, `top`]; larger ones count as `top`.
#[derive(Clone, Debug)]
pub(super) struct Distribution {
    top: f64,
    bins: Vec<u64>,
    n: u64,
    sum: f64,
    min: f64,
    max: f64,
}

/// Statistics of a distribution. All but `n` are `None` (`null` in JSON) if there are no values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Summary {
    /// Number of values.
    pub n: u64,
    /// Mean.
    pub mean: Option<f64>,
    /// Smallest value.
    pub min: Option<f64>,
    /// First percentile.
    pub p01: Option<f64>,
    /// Median.
    pub p50: Option<f64>,
    /// 75th percentile.
    pub p75: Option<f64>,
    /// 90th percentile.
    pub p90: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// 99th percentile.
    pub p99: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
}

impl Distribution {
    /// An empty distribution of values in [0, `top`].
    pub(super) fn new(top: f64) -> Self {
        Distribution { top, bins: vec![0; BINS], n: 0, sum: 0.0, min: f64::INFINITY, max: 0.0 }
    }

    /// Adds a value; NaN counts as `top`.
    pub(super) fn add(&mut self, value: f64) {
        self.add_weighted(value, 1);
    }

    /// Adds a value that stands for `n` values; NaN counts as `top`.
    pub(super) fn add_weighted(&mut self, value: f64, n: u64) {
        let value = if value.is_nan() { self.top } else { value.clamp(0.0, self.top) };
        let bin = (value / self.top * BINS as f64) as usize;
        self.bins[bin.min(BINS - 1)] += n;
        self.n += n;
        self.sum += n as f64 * value;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    /// Adds the values of another distribution with the same range.
    pub(super) fn merge(&mut self, other: &Distribution) {
        assert_eq!(self.top, other.top);
        for (mine, theirs) in self.bins.iter_mut().zip(&other.bins) {
            *mine += theirs;
        }
        self.n += other.n;
        self.sum += other.sum;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    /// The value below which a share of all values is, too large by at most one bin.
    pub(super) fn percentile(&self, share: f64) -> Option<f64> {
        let wanted = (share * self.n as f64).ceil().max(1.0) as u64;
        let mut seen = 0;
        for (i, count) in self.bins.iter().enumerate() {
            seen += count;
            if seen >= wanted {
                let upper = (i + 1) as f64 / BINS as f64 * self.top;
                return Some(upper.clamp(self.min, self.max));
            }
        }
        None
    }

    /// The number of values in bins that reach beyond `limit`: with none of these, all percentiles are at most `limit`.
    pub(super) fn n_beyond(&self, limit: f64) -> u64 {
        // A bin may end a rounding error above `limit`.
        let first = (limit / self.top * BINS as f64 + 1e-9).floor().clamp(0.0, BINS as f64);
        self.bins[first as usize..].iter().sum()
    }

    /// The number of values.
    pub(super) fn n(&self) -> u64 {
        self.n
    }

    /// The share of values up to `value`, exact to one bin; `None` if there are no values.
    pub(super) fn share_within(&self, value: f64) -> Option<f64> {
        let n_bins = (value / self.top * BINS as f64).round().clamp(0.0, BINS as f64) as usize;
        let within: u64 = self.bins[..n_bins].iter().sum();
        (self.n > 0).then(|| within as f64 / self.n as f64)
    }

    /// The statistics.
    pub(super) fn summary(&self) -> Summary {
        if self.n == 0 {
            return Summary::default();
        }
        Summary {
            n: self.n,
            mean: Some(self.sum / self.n as f64),
            min: Some(self.min),
            p01: self.percentile(0.01),
            p50: self.percentile(0.5),
            p75: self.percentile(0.75),
            p90: self.percentile(0.9),
            p95: self.percentile(0.95),
            p99: self.percentile(0.99),
            max: Some(self.max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_exact_to_one_bin() {
        let mut d = Distribution::new(1.0);
        for i in 0..1000 {
            d.add(f64::from(i) / 1000.0);
        }
        let s = d.summary();
        // And the rounding of decimals.
        let bin = 1.0 / BINS as f64 + 1e-12;
        // The 990th and the 10th of the thousand.
        assert!((s.p99.unwrap() - 0.989).abs() <= bin, "{s:?}");
        assert!((s.p01.unwrap() - 0.009).abs() <= bin, "{s:?}");
        assert_eq!((s.n, s.min, s.max), (1000, Some(0.0), Some(0.999)));
        assert_eq!(d.share_within(0.25), Some(0.25));
        assert_eq!((d.share_within(0.0), d.share_within(9.0)), (Some(0.0), Some(1.0)));
    }

    #[test]
    fn merging_is_adding_all_values() {
        let (mut a, mut b, mut both) =
            (Distribution::new(2.0), Distribution::new(2.0), Distribution::new(2.0));
        for i in 0..50 {
            let value = f64::from(i) * 0.0625;
            if i % 3 == 0 { &mut a } else { &mut b }.add(value);
            both.add(value);
        }
        a.merge(&b);
        assert_eq!(a.summary(), both.summary());
    }

    #[test]
    fn nothing_has_no_percentiles() {
        assert_eq!(Distribution::new(1.0).summary(), Summary::default());
    }
}
