//! A table of isovalues, and the rank of an isovalue in it.
//!
//! # Theory
//!
//! Isovalues are divided into as many buckets of equal width as there are isovalues, so a search compares few of them. The bucket of an
//! isovalue never decreases with the isovalue, so the result is that of a binary search, whatever the distribution.

use rayon::prelude::*;

/// Items per task.
pub(super) const TASK_ITEMS: usize = 1 << 16;

/// Isovalues, increasing and different.
pub(super) struct IsovalueRanks {
    isovalues: Vec<f64>,
    /// By bucket, the rank of its first isovalue, and after the last one the number of isovalues.
    starts: Vec<u32>,
    /// Buckets per unit of the isovalue.
    per_unit: f64,
}

impl IsovalueRanks {
    /// A table of some isovalues.
    pub(super) fn new(isovalues: Vec<f64>) -> Self {
        let isovalues = sorted_unique(isovalues);
        let n = isovalues.len();
        let width = isovalues.last().zip(isovalues.first()).map_or(0.0, |(high, low)| high - low);
        let mut table =
            IsovalueRanks { isovalues, starts: vec![0; n + 1], per_unit: n as f64 / width };
        let mut n_filled = 0;
        for (rank, &c) in (0..).zip(&table.isovalues) {
            let bucket = table.bucket(c);
            table.starts[n_filled..=bucket].fill(rank);
            n_filled = n_filled.max(bucket + 1);
        }
        table.starts[n_filled..].fill(n as u32);
        table
    }

    /// The number of isovalues of the table that are lower.
    pub(super) fn rank(&self, isovalue: f64) -> u32 {
        if self.isovalues.is_empty() {
            return 0;
        }
        let bucket = self.bucket(isovalue);
        let [first, end] = [bucket, bucket + 1].map(|b| self.starts[b] as usize);
        (first + self.isovalues[first..end].partition_point(|&x| x < isovalue)) as u32
    }

    pub(super) fn into_isovalues(self) -> Vec<f64> {
        self.isovalues
    }

    /// The bucket of an isovalue. A product that is not a number becomes 0.
    fn bucket(&self, isovalue: f64) -> usize {
        let bucket = ((isovalue - self.isovalues[0]) * self.per_unit) as usize;
        bucket.min(self.isovalues.len() - 1)
    }
}

/// The isovalues that `collect` appends for all items, increasing and different; duplicates are removed early to save memory.
pub(super) fn isovalues_of<X: Sync>(
    items: &[X],
    collect: impl Fn(&X, &mut Vec<f64>) + Sync,
) -> Vec<f64> {
    let tasks = items.par_chunks(TASK_ITEMS).map(|items| {
        let mut isovalues = Vec::new();
        items.iter().for_each(|item| collect(item, &mut isovalues));
        sorted_unique(isovalues)
    });
    sorted_unique(tasks.collect::<Vec<Vec<f64>>>().concat())
}

/// Isovalues sorted and without duplicates.
fn sorted_unique(mut isovalues: Vec<f64>) -> Vec<f64> {
    isovalues.par_sort_unstable_by(f64::total_cmp);
    isovalues.dedup();
    isovalues
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn ranks_are_those_of_a_binary_search() {
        let mut random = Random::new(5);
        let few = vec![0.0, -0.0, 1.0, f64::from_bits(1), -5e307, 5e307, 1e308, -1e308];
        let clustered = (0..2000).map(|_| random.unit().powi(40) * 1e3).collect();
        let ulps = (0..100).map(|i| f64::from_bits(1f64.to_bits() + i / 2)).collect();
        let denormal = (0..100).map(f64::from_bits).collect();
        for isovalues in [few, clustered, ulps, denormal, vec![7.0], vec![]] {
            let table = IsovalueRanks::new(isovalues);
            let all = &table.isovalues;
            let between = all.windows(2).map(|w| 0.5 * w[0] + 0.5 * w[1]);
            let outside = [f64::MIN, f64::MAX];
            for c in all.iter().copied().chain(between).chain(outside) {
                assert_eq!(table.rank(c) as usize, all.partition_point(|&x| x < c), "{c}");
            }
        }
    }
}
