//! Ways from one rank to a later one, told by the stations that they pass.
//!
//! # Theory
//!
//! The table of isovalues holds every event and every sample at which something is born, so that from one
//! sampling isovalue to the next is a long way in ranks, and another one each time. But most ways end at few ranks: those
//! of tracked vertices at sampling isovalues, those along lattice edges, in volumes of whole numbers, at whole numbers.
//! Such ranks are *stations*, and a way that ends at one is told by how many it passes.

use super::column::{CodedColumns, Column, Columns, collected};
use crate::error::{Error, Result};

/// A rank is a station if one in so many ways ends there, so there are no more stations than that.
const WAYS_PER_STATION: usize = 1024;

/// The code of a way that is told by its length in ranks; the others are how many stations it passes, that at its end included,
/// which must fit into a byte.
const BY_ITSELF: u64 = 0;
const MOST_PASSED: usize = 255;

/// Appends ways, each from a rank to a later one.
pub(super) fn write_ways(columns: &mut CodedColumns, ways: &[(u32, u32)]) {
    let stations = stations(ways);
    let mut lengths = Vec::new();
    let code = |&(from, to): &(u32, u32)| {
        let passed =
            stations.partition_point(|&s| s <= to) - stations.partition_point(|&s| s <= from);
        if stations.binary_search(&to).is_ok() && passed <= MOST_PASSED {
            return passed as u64;
        }
        lengths.push(u64::from(to - from - 1));
        BY_ITSELF
    };
    let codes: Vec<u64> = ways.iter().map(code).collect();
    let before = std::iter::once(0).chain(stations.iter().copied());
    let steps: Vec<u64> = stations.iter().zip(before).map(|(s, b)| u64::from(s - b)).collect();
    columns.counted(steps.iter().copied());
    columns.counted(lengths.iter().copied());
    columns.column(codes.iter().copied());
}

/// The ranks at which many ways end, ascending.
fn stations(ways: &[(u32, u32)]) -> Vec<u32> {
    let mut ends: Vec<u32> = ways.iter().map(|way| way.1).collect();
    ends.sort_unstable();
    let many = ends.chunk_by(|a, b| a == b).filter(|c| c.len() * WAYS_PER_STATION >= ways.len());
    many.map(|c| c[0]).collect()
}

/// Ways, read one after the other.
#[derive(Debug)]
pub(super) struct Ways<'a> {
    stations: Vec<u32>,
    lengths: Column<'a>,
    codes: Column<'a>,
    n: usize,
    n_lengths: usize,
    next: usize,
    next_length: usize,
}

impl<'a> Ways<'a> {
    /// Takes the columns of `n` ways off the front of a section; there are `n_isovalues` ranks.
    pub(super) fn new(columns: &mut Columns<'a>, n: usize, n_isovalues: usize) -> Result<Self> {
        let n_stations = columns.count()?;
        let steps = columns.column(n_stations, 32)?;
        let mut rank = 0;
        let stations = collected(n_stations, |i| {
            let step = steps.get(i)?;
            rank += step;
            if i > 0 && step == 0 || rank >= n_isovalues as u64 {
                return Err(Error::input(format!(
                    "station {i} at rank {rank}, expected a later one than before of {n_isovalues}"
                )));
            }
            Ok(rank as u32)
        })?;
        let n_lengths = columns.count()?;
        let lengths = columns.column(n_lengths, 32)?;
        let codes = columns.column(n, 8)?;
        Ok(Ways { stations, lengths, codes, n, n_lengths, next: 0, next_length: 0 })
    }

    /// Where the next way leads from a rank; that may be behind the last rank.
    pub(super) fn next(&mut self, from: u32) -> Result<u64> {
        let code = self.codes.get(self.next)?;
        self.next += 1;
        if code == BY_ITSELF {
            if self.next_length == self.n_lengths {
                return Err(Error::input("fewer lengths than its ways need"));
            }
            self.next_length += 1;
            return Ok(u64::from(from) + 1 + self.lengths.get(self.next_length - 1)?);
        }
        let passed = self.stations.partition_point(|&s| s <= from);
        let end = self.stations.get(passed + code as usize - 1);
        end.map(|&s| s.into()).ok_or_else(|| {
            Error::input(format!("a way past {code} stations from rank {from}, expected fewer"))
        })
    }

    /// Ends reading: nothing may be left.
    pub(super) fn end(self) -> Result<()> {
        if (self.next, self.next_length) == (self.n, self.n_lengths) {
            Ok(())
        } else {
            Err(Error::input("more ways are told than are needed"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::Content;
    use super::*;

    fn written(ways: &[(u32, u32)]) -> Content<'static> {
        let mut columns = CodedColumns::new();
        write_ways(&mut columns, ways);
        columns.end()
    }

    fn read(content: &Content, from: &[u32], n_isovalues: usize) -> Result<Vec<u64>> {
        let mut columns = content.columns();
        let mut ways = Ways::new(&mut columns, from.len(), n_isovalues)?;
        let ends = from.iter().map(|&f| ways.next(f)).collect::<Result<_>>()?;
        ways.end()?;
        columns.end()?;
        Ok(ends)
    }

    #[test]
    fn ways_come_back() {
        // Most end at every hundredth rank, a few elsewhere, and one is longer than a code may be.
        let mut ways: Vec<(u32, u32)> = (0..60_000u32)
            .map(|i| {
                let from = i.wrapping_mul(2_654_435_761) % 30_000;
                (from, 100 * (from / 100 + 1 + i % 5) + u32::from(i % 97 == 0))
            })
            .collect();
        ways.push((3, 40_000));
        let content = written(&ways);
        let from: Vec<u32> = ways.iter().map(|w| w.0).collect();
        let ends: Vec<u64> = ways.iter().map(|w| w.1.into()).collect();
        assert_eq!(read(&content, &from, 40_001).expect("just written"), ends);
        // How many stations are passed is one of five, and told in 2.3 bits; one in 97 takes a length more.
        let n = content.bytes().len();
        assert!(n < 19_500, "{n}");
        let error = read(&content, &from, 300).expect_err("fewer ranks").to_string();
        assert!(error.contains("expected a later one than before of 300"), "{error}");
    }

    #[test]
    fn ways_that_lead_nowhere_are_refused() {
        assert_eq!(read(&written(&[(0, 5), (2, 5)]), &[0, 2], 6).expect("just written"), [5, 5]);
        let error = read(&written(&[(0, 5), (2, 5)]), &[0, 5], 6);
        let error = error.expect_err("no station behind 5").to_string();
        assert_eq!(error, "a way past 1 stations from rank 5, expected fewer");
        // Stations at 5, no lengths, and a way that is told by its length.
        let mut columns = CodedColumns::new();
        columns.counted([5].into_iter());
        columns.counted([].into_iter());
        columns.column([0, 1].into_iter());
        let error = read(&columns.end(), &[0, 2], 6).expect_err("no length").to_string();
        assert_eq!(error, "fewer lengths than its ways need");
    }

    #[test]
    fn no_ways_take_a_few_bytes() {
        let content = written(&[]);
        assert!(read(&content, &[], 0).expect("just written").is_empty());
        assert!(content.bytes().len() < 20, "{}", content.bytes().len());
    }
}
