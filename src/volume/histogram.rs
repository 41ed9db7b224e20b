//! Histograms of the samples of a volume.

use super::grid::Volume;

/// Bins over the range: a percentile is at most a 65,536th of the range above the least value that suffices.
const N_BINS: usize = 1 << 16;

/// A histogram of samples over their range.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Histogram {
    range: (f64, f64),
    counts: Vec<u64>,
    /// The largest value in each bin; minus infinity in an empty one.
    largest: Vec<f64>,
    total: u64,
}

impl Histogram {
    /// The histogram of the samples of a volume; with a mask, of those inside it.
    pub fn of(volume: &Volume) -> Self {
        Self::of_values(volume.values(), volume.range())
    }

    /// The histogram of values, all of which are in the range.
    pub fn of_values(values: impl Iterator<Item = f64>, range: (f64, f64)) -> Self {
        let mut histogram = Histogram {
            range,
            counts: vec![0; N_BINS],
            largest: vec![f64::NEG_INFINITY; N_BINS],
            total: 0,
        };
        histogram.add(values);
        histogram
    }

    /// Counts more values of the range.
    pub(super) fn add(&mut self, values: impl Iterator<Item = f64>) {
        let (low, high) = self.range;
        for value in values {
            let share = (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low);
            let bin = ((share * N_BINS as f64) as usize).min(N_BINS - 1);
            self.counts[bin] += 1;
            self.largest[bin] = self.largest[bin].max(value);
            self.total += 1;
        }
    }

    /// Index, number of values and largest value of each bin that is not empty.
    pub(super) fn bins(&self) -> impl Iterator<Item = (usize, u64, f64)> {
        let bins = self.counts.iter().zip(&self.largest).enumerate();
        bins.filter(|(_, (n, _))| **n > 0).map(|(i, (&n, &largest))| (i, n, largest))
    }

    /// Number of values.
    pub(super) fn total(&self) -> u64 {
        self.total
    }

    /// Adds `n` values to a bin, of which `largest` is the largest. Returns false if there is no such bin, the value is not in the
    /// range, or the count overflows.
    pub(super) fn add_to(&mut self, bin: usize, n: u64, largest: f64) -> bool {
        if !(self.range.0..=self.range.1).contains(&largest) {
            return false;
        }
        let Some(total) = self.total.checked_add(n) else { return false };
        let Some(count) = self.counts.get_mut(bin) else { return false };
        *count += n;
        self.largest[bin] = self.largest[bin].max(largest);
        self.total = total;
        true
    }

    /// A value that at least `percent` (0 to 100) of the samples do not exceed: a sample, at most a 65,536th of the range above the
    /// least one of which that is true. Of 0 percent it is the smallest sample of all.
    pub fn percentile(&self, percent: f64) -> f64 {
        let (low, high) = self.range;
        if percent <= 0.0 {
            return low;
        }
        let wanted = percent / 100.0 * self.total as f64;
        let mut below = 0.0;
        for (_, count, largest) in self.bins() {
            below += count as f64;
            if below >= wanted {
                return largest;
            }
        }
        high
    }

    /// The threshold with the largest variance between the samples on both sides (Otsu 1979); the middle of all such
    /// thresholds.
    pub fn otsu(&self) -> f64 {
        let mean_of = |i: usize| i as f64 + 0.5;
        let all: f64 = self.counts.iter().enumerate().map(|(i, &n)| mean_of(i) * n as f64).sum();
        let total = self.total as f64;
        let (mut below, mut sum) = (0.0, 0.0);
        let (mut best, mut first, mut last) = (-1.0, 0, 0);
        for (i, &n) in self.counts.iter().enumerate().take(N_BINS - 1) {
            below += n as f64;
            sum += mean_of(i) * n as f64;
            if below == 0.0 || below == total {
                continue;
            }
            let apart = sum / below - (all - sum) / (total - below);
            let variance = below * (total - below) * apart * apart;
            if variance > best {
                (best, first, last) = (variance, i, i);
            } else if variance == best {
                last = i;
            }
        }
        let (low, high) = self.range;
        low + (high - low) * (0.5 * (first + last) as f64 + 1.0) / N_BINS as f64
    }

    /// Number of samples in each of `n` equal parts of `low` to `high`; samples outside are ignored.
    pub fn parts(&self, n: usize, (low, high): (f64, f64)) -> Vec<u64> {
        let (first, last) = self.range;
        let mut parts = vec![0; n];
        for (i, &count) in self.counts.iter().enumerate() {
            let value = first + (last - first) * ((i as f64 + 0.5) / N_BINS as f64);
            let share = (value - low) / (high - low);
            if count > 0 && (0.0..1.0).contains(&share) {
                parts[(share * n as f64) as usize] += count;
            }
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn otsu_parts_two_groups_in_the_middle_between_them() {
        // A bin is 11 / 65,536 wide.
        let bin = 11.0 / N_BINS as f64;
        let of = |values: &[f64]| Histogram::of_values(values.iter().copied(), (0.0, 11.0)).otsu();
        assert!((of(&[0.0, 0.0, 0.0, 11.0]) - 5.5).abs() <= bin);
        assert!((of(&[0.0, 1.0, 0.5, 9.0, 10.0, 11.0, 10.5]) - 5.0).abs() <= bin);
    }

    #[test]
    fn a_percentile_covers_its_share_of_the_samples() {
        let values: Vec<f64> =
            (0..10_007).map(|i| (f64::from(i * i % 10_007) * 0.37).exp2().ln()).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let h = Histogram::of_values(values.iter().copied(), (low, high));
        for percent in [0.1, 1.0, 33.3, 50.0, 90.0, 99.0, 99.9, 100.0] {
            let found = h.percentile(percent);
            let share = |x: f64| values.iter().filter(|&&v| v <= x).count() as f64 / 10_007.0;
            assert!(share(found) >= percent / 100.0, "{percent}");
            assert!(share(found - (high - low) / 65_536.0) < percent / 100.0, "{percent}");
        }
        assert_eq!([0.0, 100.0].map(|p| h.percentile(p)), [low, high]);
    }

    #[test]
    fn every_sample_is_counted_once() {
        let h = Histogram::of_values([0.0, 1.0, 1.0, 3.0, 4.0].into_iter(), (0.0, 4.0));
        assert_eq!(h.parts(4, (0.0, 4.0)), [1, 2, 0, 2]);
        assert_eq!(h.percentile(0.0), 0.0);
        assert_eq!(h.percentile(50.0), 1.0);
        assert_eq!(h.percentile(100.0), 4.0);
        assert_eq!(h.parts(1, (2.0, 4.0)), [2]);
    }
}
