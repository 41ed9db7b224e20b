//! A set of small numbers that gives them back in order.
//!
//! One bit for each number that may be in it, and one above for each word of bits that has any: what
//! is looked at to list the set is what is set, and a 64th of a 64th of the rest.

const BITS: usize = u64::BITS as usize;

/// A set of numbers below a bound.
#[derive(Clone, Debug)]
pub(super) struct Numbers {
    words: Vec<u64>,
    /// One bit for each word that is not zero.
    filled: Vec<u64>,
}

impl Numbers {
    /// The empty set of numbers below `bound`.
    pub(super) fn new(bound: usize) -> Self {
        let n_words = bound.div_ceil(BITS);
        Numbers { words: vec![0; n_words], filled: vec![0; n_words.div_ceil(BITS)] }
    }

    #[inline]
    pub(super) fn insert(&mut self, number: u32) {
        let word = number as usize / BITS;
        if self.words[word] == 0 {
            self.filled[word / BITS] |= 1 << (word % BITS);
        }
        self.words[word] |= 1 << (number as usize % BITS);
    }

    /// Takes a number out, if it is in.
    #[inline]
    pub(super) fn remove(&mut self, number: u32) {
        let word = number as usize / BITS;
        self.words[word] &= !(1 << (number as usize % BITS));
        if self.words[word] == 0 {
            self.filled[word / BITS] &= !(1 << (word % BITS));
        }
    }

    /// Takes all numbers out.
    pub(super) fn clear(&mut self) {
        for (i, filled) in self.filled.iter_mut().enumerate() {
            ones(std::mem::take(filled), i, |word| self.words[word as usize] = 0);
        }
    }

    /// Calls `report` for all numbers, increasing.
    #[inline]
    pub(super) fn each(&self, mut report: impl FnMut(u32)) {
        for (i, &filled) in self.filled.iter().enumerate() {
            ones(filled, i, |word| {
                ones(self.words[word as usize], word as usize, &mut report);
            });
        }
    }

    /// As [`Numbers::each`]; the set is empty then.
    #[inline]
    pub(super) fn drain(&mut self, mut report: impl FnMut(u32)) {
        for (i, filled) in self.filled.iter_mut().enumerate() {
            ones(std::mem::take(filled), i, |word| {
                ones(std::mem::take(&mut self.words[word as usize]), word as usize, &mut report);
            });
        }
    }
}

/// The numbers of the bits that are set in the word of index `i`, increasing.
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
        fn it_is_the_set_in_order(
            changes in prop::collection::vec((0u32..9000, any::<bool>()), 0..300),
        ) {
            let mut numbers = Numbers::new(9000);
            let mut expected = BTreeSet::new();
            for (number, is_in) in changes {
                if is_in {
                    numbers.insert(number);
                    expected.insert(number);
                } else {
                    numbers.remove(number);
                    expected.remove(&number);
                }
            }
            let expected: Vec<u32> = expected.into_iter().collect();
            let mut listed = Vec::new();
            numbers.each(|number| listed.push(number));
            prop_assert_eq!(&listed, &expected);
            listed.clear();
            numbers.drain(|number| listed.push(number));
            prop_assert_eq!(&listed, &expected);
            numbers.each(|number| panic!("{number} is left"));
            listed.iter().for_each(|&number| numbers.insert(number));
            numbers.clear();
            numbers.each(|number| panic!("{number} is left"));
        }
    }
}
