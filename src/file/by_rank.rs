//! Lists of numbers, one for each rank of a span.

use std::ops::Range;

/// No number.
const NONE: u32 = u32::MAX;

/// Lists of numbers, one for each rank of a span; the newest number of a rank comes first.
#[derive(Clone, Debug)]
pub(super) struct ByRank {
    start: u32,
    newest: Vec<u32>,
    /// By number, the one before it of its rank.
    before: Vec<u32>,
}

impl ByRank {
    pub(super) fn new(span: &Range<u32>) -> Self {
        ByRank { start: span.start, newest: vec![NONE; span.len()], before: Vec::new() }
    }

    /// Adds a number to the list of a rank. Ranks outside the span have none.
    pub(super) fn push(&mut self, rank: u32, number: u32) {
        let at = rank.checked_sub(self.start).map(|at| at as usize);
        let Some(newest) = at.and_then(|at| self.newest.get_mut(at)) else { return };
        if self.before.len() <= number as usize {
            self.before.resize(number as usize + 1, NONE);
        }
        self.before[number as usize] = std::mem::replace(newest, number);
    }

    /// The numbers of a rank of the span.
    pub(super) fn at(&self, rank: u32) -> impl Iterator<Item = u32> + '_ {
        let some = |number: u32| (number != NONE).then_some(number);
        let newest = self.newest[(rank - self.start) as usize];
        std::iter::successors(some(newest), move |&n| some(self.before[n as usize]))
    }
}
