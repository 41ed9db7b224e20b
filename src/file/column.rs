//! Columns: the one way in which numbers lie in a section.
//!
//! A column is a byte `width` (1 to 8) and then `width` planes of one byte per number, lowest
//! byte first. Small numbers in a wide column leave planes of zeros, and each plane has its own
//! statistics: both are what deflate is good at. Signed numbers are zigzag coded
//! (0, -1, 1, -2, ... become 0, 1, 2, 3, ...). FORMAT.md describes the same.
//!
//! # Invariants
//!
//! A number takes at least one byte, so a section of n bytes holds fewer than n numbers: no count
//! can ask for memory that the file's length has not earned.

use crate::error::{Error, Result};

/// Appends the column of `values` to `bytes`.
pub(crate) fn write_column(bytes: &mut Vec<u8>, values: &[u64]) {
    let all = values.iter().fold(0, |all, v| all | v);
    let width = (64 - all.leading_zeros()).div_ceil(8).max(1);
    bytes.push(width as u8);
    bytes.reserve(width as usize * values.len());
    for plane in 0..width {
        bytes.extend(values.iter().map(|v| (v >> (8 * plane)) as u8));
    }
}

/// Takes columns off the bytes of one section.
#[derive(Debug)]
pub(super) struct Columns<'a> {
    bytes: &'a [u8],
}

impl<'a> Columns<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Columns { bytes }
    }

    /// The next little-endian u64, which stands before the columns it counts.
    pub(super) fn count(&mut self) -> Result<usize> {
        let bytes = self.take(8)?;
        let count = u64::from_le_bytes(bytes.try_into().expect("eight bytes were taken"));
        usize::try_from(count).map_err(|_| too_short())
    }

    /// The next column, which must hold `n` numbers of at most `bits` bits.
    pub(super) fn column(&mut self, n: usize, bits: u32) -> Result<Column<'a>> {
        let width = usize::from(self.take(1)?[0]);
        if !(1..=8).contains(&width) {
            return Err(Error::input(format!("a column is {width} bytes wide, expected 1 to 8")));
        }
        let planes = self.take(width.checked_mul(n).ok_or_else(too_short)?)?;
        Ok(Column { planes, n, width, limit: u64::MAX >> (64 - bits) })
    }

    /// Ends the section: nothing may be left.
    pub(super) fn end(self) -> Result<()> {
        if self.bytes.is_empty() {
            Ok(())
        } else {
            Err(Error::input(format!("{} bytes too many", self.bytes.len())))
        }
    }

    fn take(&mut self, n: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(n).ok_or_else(too_short)?;
        self.bytes = rest;
        Ok(taken)
    }
}

/// One column, still in planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column<'a> {
    planes: &'a [u8],
    n: usize,
    width: usize,
    limit: u64,
}

impl Column<'_> {
    /// Number `i`.
    pub(super) fn get(&self, i: usize) -> Result<u64> {
        debug_assert!(i < self.n);
        let mut value = 0;
        for plane in (0..self.width).rev() {
            value = value << 8 | u64::from(self.planes[plane * self.n + i]);
        }
        if value > self.limit {
            return Err(Error::input(format!(
                "number {i} of a column is {value}, expected at most {}",
                self.limit
            )));
        }
        Ok(value)
    }

    /// Number `i` of a column of zigzag-coded numbers.
    pub(super) fn get_signed(&self, i: usize) -> Result<i64> {
        self.get(i).map(unzigzag)
    }
}

/// What `read` makes of 0, 1, ..., in a vector that never grows: columns of `n` numbers are there.
pub(super) fn collected<T>(n: usize, mut read: impl FnMut(usize) -> Result<T>) -> Result<Vec<T>> {
    let mut all = Vec::with_capacity(n);
    for i in 0..n {
        all.push(read(i)?);
    }
    Ok(all)
}

fn too_short() -> Error {
    Error::input("fewer bytes than its numbers need")
}

/// Signed to unsigned, small to small.
pub(super) fn zigzag(x: i64) -> u64 {
    (x << 1 ^ x >> 63) as u64
}

/// The inverse of [`zigzag`].
pub(super) fn unzigzag(x: u64) -> i64 {
    (x >> 1) as i64 ^ -((x & 1) as i64)
}
