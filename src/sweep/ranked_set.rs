//! A set of numbers below a limit, and the rank of each in it.
//!
//! # Theory
//!
//! A bit per number, and for each word of bits the number of bits in the words before (Jacobson, *Space-efficient static trees and graphs*, 1989).

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

/// See the module.
pub(super) struct RankedSet {
    /// Words of bits, each with the number of bits in the words before.
    words: Vec<(u64, u32)>,
    len: u32,
}

impl RankedSet {
    /// The set of some numbers below `n`.
    pub(super) fn new(n: usize, numbers: impl ParallelIterator<Item = u32>) -> Self {
        let words: Vec<AtomicU64> = (0..n.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        numbers.for_each(|number| {
            let (word, bit) = (&words[number as usize / 64], 1 << (number % 64));
            // Most numbers occur several times, and reading is cheaper.
            if word.load(Ordering::Relaxed) & bit == 0 {
                word.fetch_or(bit, Ordering::Relaxed);
            }
        });
        let mut len = 0;
        let words = words.into_iter().map(|word| {
            let (word, before) = (word.into_inner(), len);
            len += word.count_ones();
            (word, before)
        });
        RankedSet { words: words.collect(), len }
    }

    /// How many numbers it has.
    pub(super) fn len(&self) -> usize {
        self.len as usize
    }

    pub(super) fn contains(&self, number: u32) -> bool {
        self.words[number as usize / 64].0 >> (number % 64) & 1 == 1
    }

    /// How many numbers below `number` it has.
    pub(super) fn rank(&self, number: u32) -> u32 {
        let (word, before) = self.words[number as usize / 64];
        before + (word & ((1 << (number % 64)) - 1)).count_ones()
    }

    /// Its numbers, ascending.
    pub(super) fn iter(&self) -> impl Iterator<Item = u32> {
        let of_word = |(i, &(word, _)): (u32, &(u64, u32))| {
            let rest = std::iter::successors(Some(word), |&word| Some(word & word.wrapping_sub(1)));
            let bits = rest.take_while(|&word| word != 0);
            bits.map(move |word| 64 * i + word.trailing_zeros())
        };
        (0..).zip(&self.words).flat_map(of_word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn ranks_count_the_numbers_below() {
        let mut random = Random::new(3);
        for n in [1, 64, 65, 1000] {
            let numbers: Vec<u32> = (0..n / 3 + 1).map(|_| random.below(n) as u32).collect();
            let set = RankedSet::new(n, numbers.par_iter().copied());
            let mut sorted = numbers;
            sorted.sort_unstable();
            sorted.dedup();
            assert_eq!(set.iter().collect::<Vec<u32>>(), sorted);
            assert_eq!(set.len(), sorted.len());
            let is_right = |i: u32| {
                set.rank(i) as usize == sorted.partition_point(|&x| x < i)
                    && set.contains(i) == sorted.contains(&i)
            };
            assert!((0..n as u32).all(is_right));
        }
    }
}
