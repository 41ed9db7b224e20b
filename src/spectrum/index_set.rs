//! A set of indices that lists them in order.
//!
//! One bit for each possible index, and one bit for each word of these that is not zero: listing
//! reads the words that are not zero, and one word for each 4096 possible indices.

const BITS: usize = u64::BITS as usize;

/// A set of indices below a bound.
#[derive(Clone, Debug)]
pub(super) struct IndexSet {
    words: Vec<u64>,
    /// One bit for each word that is not zero.
    filled: Vec<u64>,
}

impl IndexSet {
    /// The empty set of indices below `bound`.
    pub(super) fn new(bound: usize) -> Self {
        let n_words = bound.div_ceil(BITS);
        IndexSet { words: vec![0; n_words], filled: vec![0; n_words.div_ceil(BITS)] }
    }

    #[inline]
    pub(super) fn insert(&mut self, index: u32) {
        let word = index as usize / BITS;
        if self.words[word] == 0 {
            self.filled[word / BITS] |= 1 << (word % BITS);
        }
        self.words[word] |= 1 << (index as usize % BITS);
    }

    /// Removes an index, if present.
    #[inline]
    pub(super) fn remove(&mut self, index: u32) {
        let word = index as usize / BITS;
        self.words[word] &= !(1 << (index as usize % BITS));
        if self.words[word] == 0 {
            self.filled[word / BITS] &= !(1 << (word % BITS));
        }
    }

    /// Removes all indices.
    pub(super) fn clear(&mut self) {
        for (i, filled) in self.filled.iter_mut().enumerate() {
            ones(std::mem::take(filled), i, |word| self.words[word as usize] = 0);
        }
    }

    /// Calls `report` for all indices, increasing.
    #[inline]
    pub(super) fn each(&self, mut report: impl FnMut(u32)) {
        for (i, &filled) in self.filled.iter().enumerate() {
            ones(filled, i, |word| {
                ones(self.words[word as usize], word as usize, &mut report);
            });
        }
    }

    /// As [`IndexSet::each`], and empties the set.
    #[inline]
    pub(super) fn drain(&mut self, mut report: impl FnMut(u32)) {
        for (i, filled) in self.filled.iter_mut().enumerate() {
            ones(std::mem::take(filled), i, |word| {
                ones(std::mem::take(&mut self.words[word as usize]), word as usize, &mut report);
            });
        }
    }
}

/// Calls `report` for the indices of the bits that are set in word `i`, increasing.
#[inline]
fn ones(mut word: u64, i: usize, mut report: impl FnMut(u32)) {
    let base = (i * BITS) as u32;
    while word != 0 {
        report(base + word.trailing_zeros());
        word &= word - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn it_lists_the_elements_in_order(
            changes in prop::collection::vec((0u32..9000, any::<bool>()), 0..300),
        ) {
            let mut set = IndexSet::new(9000);
            let mut expected = BTreeSet::new();
            for (number, is_in) in changes {
                if is_in {
                    set.insert(number);
                    expected.insert(number);
                } else {
                    set.remove(number);
                    expected.remove(&number);
                }
            }
            let expected: Vec<u32> = expected.into_iter().collect();
            let mut listed = Vec::new();
            set.each(|number| listed.push(number));
            prop_assert_eq!(&listed, &expected);
            listed.clear();
            set.drain(|number| listed.push(number));
            prop_assert_eq!(&listed, &expected);
            set.each(|number| panic!("{number} is left"));
            listed.iter().for_each(|&number| set.insert(number));
            set.clear();
            set.each(|number| panic!("{number} is left"));
        }
    }
}
