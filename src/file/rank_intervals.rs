//! Intervals from one rank to a later one, coded by the ranks at which many of them end.
//!
//! # Theory
//!
//! The table of isovalues holds every event and every sample at which a vertex is born, so the number of ranks from one
//! isovalue of the sweep to the next is large and varies. But most intervals end at few ranks: those of tracked vertices
//! at the isovalues of the sweep, those along lattice edges, in volumes of integers, at integers. These ranks are listed as
//! *frequent ends*, and an interval is coded by the number of frequent ends after its start, up to its own end.

use super::column::{CodedColumns, Column, Columns, collected};
use crate::error::{Error, Result};

/// A rank is a frequent end if at least one in so many intervals ends there. This bounds the number of frequent ends.
const INTERVALS_PER_FREQUENT_END: usize = 1024;

/// The code of an interval whose length is stored. Other codes count frequent ends and must fit into a byte.
const EXPLICIT_LENGTH: u64 = 0;
const MAX_CODE: usize = 255;

/// Appends intervals, each from a rank to a later one.
pub(super) fn write_intervals(columns: &mut CodedColumns, intervals: &[(u32, u32)]) {
    let ends = frequent_ends(intervals);
    let mut lengths = Vec::new();
    let code = |&(from, to): &(u32, u32)| {
        let passed = ends.partition_point(|&s| s <= to) - ends.partition_point(|&s| s <= from);
        if ends.binary_search(&to).is_ok() && passed <= MAX_CODE {
            return passed as u64;
        }
        lengths.push(u64::from(to - from - 1));
        EXPLICIT_LENGTH
    };
    let codes: Vec<u64> = intervals.iter().map(code).collect();
    let previous = std::iter::once(0).chain(ends.iter().copied());
    let steps: Vec<u64> = ends.iter().zip(previous).map(|(end, p)| u64::from(end - p)).collect();
    columns.counted(steps.iter().copied());
    columns.counted(lengths.iter().copied());
    columns.column(codes.iter().copied());
}

/// The ranks at which many intervals end, ascending.
fn frequent_ends(intervals: &[(u32, u32)]) -> Vec<u32> {
    let mut ends: Vec<u32> = intervals.iter().map(|interval| interval.1).collect();
    ends.sort_unstable();
    let is_frequent = |equal: &&[u32]| equal.len() * INTERVALS_PER_FREQUENT_END >= intervals.len();
    ends.chunk_by(|a, b| a == b).filter(is_frequent).map(|equal| equal[0]).collect()
}

/// Reads intervals one after the other.
#[derive(Debug)]
pub(super) struct IntervalReader {
    frequent_ends: Vec<u32>,
    lengths: Column<'static>,
    codes: Column<'static>,
    n: usize,
    n_lengths: usize,
    next: usize,
    next_length: usize,
}

impl IntervalReader {
    /// Takes the columns of `n` intervals off the front of a section, of a table of `n_isovalues` ranks.
    pub(super) fn new(columns: &mut Columns, n: usize, n_isovalues: u32) -> Result<Self> {
        let n_ends = columns.count()?;
        let steps = columns.column(n_ends, 32)?;
        let mut rank = 0;
        let frequent_ends = collected(n_ends, |i| {
            let step = steps.get(i)?;
            rank += step;
            if i > 0 && step == 0 || rank >= n_isovalues.into() {
                return Err(Error::input(format!(
                    "frequent end {i} at rank {rank}, expected increasing ranks below {n_isovalues}"
                )));
            }
            Ok(rank as u32)
        })?;
        let n_lengths = columns.count()?;
        let lengths = columns.column(n_lengths, 32)?.into_owned();
        let codes = columns.column(n, 8)?.into_owned();
        Ok(IntervalReader { frequent_ends, lengths, codes, n, n_lengths, next: 0, next_length: 0 })
    }

    /// The end of the next interval, which starts at a rank. It may be beyond the last rank.
    pub(super) fn next(&mut self, from: u32) -> Result<u64> {
        let code = self.codes.get(self.next)?;
        self.next += 1;
        if code == EXPLICIT_LENGTH {
            if self.next_length == self.n_lengths {
                return Err(Error::input("fewer lengths than its intervals need"));
            }
            self.next_length += 1;
            return Ok(u64::from(from) + 1 + self.lengths.get(self.next_length - 1)?);
        }
        let first = self.frequent_ends.partition_point(|&end| end <= from);
        let end = self.frequent_ends.get(first + code as usize - 1);
        end.map(|&end| end.into()).ok_or_else(|| {
            Error::input(format!("frequent end {code} after rank {from}, expected fewer"))
        })
    }

    /// Checks that all intervals and lengths were read.
    pub(super) fn end(self) -> Result<()> {
        if (self.next, self.next_length) == (self.n, self.n_lengths) {
            Ok(())
        } else {
            Err(Error::input("more intervals than are needed"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::Content;
    use super::*;

    fn written(intervals: &[(u32, u32)]) -> Content<'static> {
        let mut columns = CodedColumns::new();
        write_intervals(&mut columns, intervals);
        columns.end()
    }

    fn read(content: &Content, from: &[u32], n_isovalues: u32) -> Result<Vec<u64>> {
        let mut columns = content.columns();
        let mut intervals = IntervalReader::new(&mut columns, from.len(), n_isovalues)?;
        let ends = from.iter().map(|&f| intervals.next(f)).collect::<Result<_>>()?;
        intervals.end()?;
        columns.end()?;
        Ok(ends)
    }

    #[test]
    fn intervals_are_read_as_they_were_written() {
        // Most end at every hundredth rank, a few elsewhere, and one has more frequent ends in it than a code can count.
        let mut intervals: Vec<(u32, u32)> = (0..60_000u32)
            .map(|i| {
                let from = i.wrapping_mul(2_654_435_761) % 30_000;
                (from, 100 * (from / 100 + 1 + i % 5) + u32::from(i % 97 == 0))
            })
            .collect();
        intervals.push((3, 40_000));
        let content = written(&intervals);
        let from: Vec<u32> = intervals.iter().map(|w| w.0).collect();
        let ends: Vec<u64> = intervals.iter().map(|w| w.1.into()).collect();
        assert_eq!(read(&content, &from, 40_001).expect("just written"), ends);
        // A code is one of five, 2.3 bits; one interval in 97 also stores its length.
        let n = content.bytes().len();
        assert!(n < 19_500, "{n}");
        let error = read(&content, &from, 300).expect_err("fewer ranks").to_string();
        assert!(error.contains("expected increasing ranks below 300"), "{error}");
    }

    #[test]
    fn intervals_without_an_end_are_refused() {
        assert_eq!(read(&written(&[(0, 5), (2, 5)]), &[0, 2], 6).expect("just written"), [5, 5]);
        let error = read(&written(&[(0, 5), (2, 5)]), &[0, 5], 6);
        let error = error.expect_err("no frequent end after 5").to_string();
        assert_eq!(error, "frequent end 1 after rank 5, expected fewer");
        // A frequent end at 5, no lengths, and an interval that needs a length.
        let mut columns = CodedColumns::new();
        columns.counted([5].into_iter());
        columns.counted([].into_iter());
        columns.column([0, 1].into_iter());
        let error = read(&columns.end(), &[0, 2], 6).expect_err("no length").to_string();
        assert_eq!(error, "fewer lengths than its intervals need");
    }

    #[test]
    fn no_intervals_take_a_few_bytes() {
        let content = written(&[]);
        assert!(read(&content, &[], 0).expect("just written").is_empty());
        assert!(content.bytes().len() < 20, "{}", content.bytes().len());
    }
}
