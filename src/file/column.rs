//! Columns of numbers: the content of sections.
//!
//! Small sections have columns in planes: a byte `width` (1 to 8) and then `width` planes of one byte per number, lowest
//! byte first. Small numbers in a wide column leave planes of zeros, and each plane has its own
//! statistics; deflate compresses both well. In large sections the numbers of all columns are coded one after the
//! other ([`super::coder`]). Signed numbers are zigzag coded
//! (0, -1, 1, -2, ... become 0, 1, 2, 3, ...).
//!
//! # Invariants
//!
//! A number in planes takes at least one byte, and a coded section declares how many numbers it has, which its length limits: no count
//! makes a reader reserve memory out of proportion to the file.

use std::borrow::Cow;

use super::coder::{Coder as _, ColumnModels, Decoder, Encoder};
use crate::error::{Error, Result};

/// Bits of the width of a coded column, and of a count.
const WIDTH_BITS: u32 = 4;
const COUNT_BITS: u32 = 40;

/// A decoder checks after so many numbers whether it has read past the end.
const NUMBERS_PER_CHECK: usize = 4096;

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

/// Writes the content of a section of coded columns.
#[derive(Debug)]
pub(super) struct CodedColumns {
    encoder: Encoder,
    n_numbers: usize,
}

impl CodedColumns {
    pub(super) fn new() -> CodedColumns {
        CodedColumns { encoder: Encoder::new(), n_numbers: 0 }
    }

    /// Writes the count of the columns after it.
    pub(super) fn count(&mut self, n: usize) {
        self.encoder.bits(COUNT_BITS, n as u64);
    }

    pub(super) fn column(&mut self, values: impl Iterator<Item = u64> + Clone) {
        let all = values.clone().fold(0, |all, v| all | v);
        let width = (64 - all.leading_zeros()).div_ceil(8).max(1);
        self.encoder.bits(WIDTH_BITS, width.into());
        let mut models = ColumnModels::new();
        for value in values {
            models.number(&mut self.encoder, value);
            self.n_numbers += 1;
        }
    }

    /// Writes a count and a column of that many numbers.
    pub(super) fn counted(&mut self, values: impl ExactSizeIterator<Item = u64> + Clone) {
        self.count(values.len());
        self.column(values);
    }

    pub(super) fn end(self) -> Content<'static> {
        Content::Coded { bytes: self.encoder.end().into(), n_numbers: self.n_numbers }
    }
}

/// The unpacked content of a section.
#[derive(Clone, Debug)]
pub(crate) enum Content<'a> {
    /// Columns in planes, or other bytes.
    Plain(Cow<'a, [u8]>),
    /// Coded columns, and the sum of their lengths.
    Coded { bytes: Cow<'a, [u8]>, n_numbers: usize },
}

impl Content<'_> {
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Content::Plain(bytes) | Content::Coded { bytes, .. } => bytes,
        }
    }

    /// The numbers of coded columns.
    pub(super) fn n_numbers(&self) -> usize {
        match self {
            Content::Plain(_) => 0,
            Content::Coded { n_numbers, .. } => *n_numbers,
        }
    }

    pub(super) fn columns(&self) -> Columns<'_> {
        match self {
            Content::Plain(bytes) => Columns::new(bytes),
            Content::Coded { bytes, n_numbers } => {
                Columns(Rest::Coded { decoder: Decoder::new(bytes), left: *n_numbers })
            }
        }
    }
}

/// Takes columns off the content of one section.
#[derive(Debug)]
pub(super) struct Columns<'a>(Rest<'a>);

/// What has not been read.
#[derive(Debug)]
enum Rest<'a> {
    Planes(&'a [u8]),
    /// With the number of numbers that are left.
    Coded {
        decoder: Decoder<'a>,
        left: usize,
    },
}

impl<'a> Columns<'a> {
    /// Columns in planes.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Columns(Rest::Planes(bytes))
    }

    /// The next count.
    pub(super) fn count(&mut self) -> Result<usize> {
        let count = match &mut self.0 {
            Rest::Planes(bytes) => {
                let bytes = take(bytes, 8)?;
                u64::from_le_bytes(bytes.try_into().expect("eight bytes were taken"))
            }
            Rest::Coded { decoder, .. } => decoder.bits(COUNT_BITS, 0),
        };
        usize::try_from(count).map_err(|_| too_short())
    }

    /// The next column: `n` numbers of at most `bits` bits.
    pub(super) fn column(&mut self, n: usize, bits: u32) -> Result<Column<'a>> {
        let width = match &mut self.0 {
            Rest::Planes(bytes) => usize::from(take(bytes, 1)?[0]),
            Rest::Coded { decoder, .. } => decoder.bits(WIDTH_BITS, 0) as usize,
        };
        if !(1..=8).contains(&width) {
            return Err(Error::input(format!("a column is {width} bytes wide, expected 1 to 8")));
        }
        let numbers = match &mut self.0 {
            Rest::Planes(bytes) => {
                let planes = take(bytes, width.checked_mul(n).ok_or_else(too_short)?)?;
                Numbers::Planes { planes, n, width }
            }
            Rest::Coded { decoder, left } => {
                *left = left.checked_sub(n).ok_or_else(too_short)?;
                Numbers::decoded(decoder, n, width)?
            }
        };
        Ok(Column { numbers, limit: u64::MAX >> (64 - bits) })
    }

    /// Whether nothing is left of columns in planes.
    pub(super) fn is_empty(&self) -> bool {
        matches!(self.0, Rest::Planes([]))
    }

    /// Checks that nothing is left, except for zeros after coded numbers.
    pub(super) fn end(self) -> Result<()> {
        let n_left = match self.0 {
            Rest::Planes(bytes) => bytes.len(),
            Rest::Coded { left, .. } if left > 0 => {
                return Err(Error::input(format!("{left} numbers too many")));
            }
            Rest::Coded { decoder, .. } => {
                decoder.rest().ok_or_else(too_short)?.iter().filter(|&&b| b != 0).count()
            }
        };
        match n_left {
            0 => Ok(()),
            n => Err(Error::input(format!("{n} bytes too many"))),
        }
    }
}

fn take<'a>(from: &mut &'a [u8], n: usize) -> Result<&'a [u8]> {
    let (taken, rest) = from.split_at_checked(n).ok_or_else(too_short)?;
    *from = rest;
    Ok(taken)
}

/// One column.
#[derive(Clone, Debug)]
pub(super) struct Column<'a> {
    numbers: Numbers<'a>,
    limit: u64,
}

/// The numbers of a column: in planes, or decoded into a type of their width.
#[derive(Clone, Debug)]
enum Numbers<'a> {
    Planes { planes: &'a [u8], n: usize, width: usize },
    Narrow(Vec<u8>),
    Wide(Vec<u32>),
    Widest(Vec<u64>),
}

impl Numbers<'_> {
    /// Decodes the next `n` numbers, each of at most `width` bytes.
    fn decoded(decoder: &mut Decoder, n: usize, width: usize) -> Result<Self> {
        let mut models = ColumnModels::new();
        let max = u64::MAX >> (64 - 8 * width);
        let mut next = |i: usize| {
            let value = models.number(decoder, 0);
            if value > max || i.is_multiple_of(NUMBERS_PER_CHECK) && decoder.rest().is_none() {
                return Err(too_short());
            }
            Ok(value)
        };
        Ok(match width {
            1 => Numbers::Narrow(collected(n, |i| Ok(next(i)? as u8))?),
            2..=4 => Numbers::Wide(collected(n, |i| Ok(next(i)? as u32))?),
            _ => Numbers::Widest(collected(n, next)?),
        })
    }

    fn get(&self, i: usize) -> u64 {
        match self {
            Numbers::Planes { planes, n, width } => {
                let plane = |plane: usize| u64::from(planes[plane * n + i]);
                (0..*width).rev().fold(0, |value, p| value << 8 | plane(p))
            }
            Numbers::Narrow(all) => all[i].into(),
            Numbers::Wide(all) => all[i].into(),
            Numbers::Widest(all) => all[i],
        }
    }
}

impl Column<'_> {
    /// The column without its source: decoded numbers are in memory already.
    pub(super) fn into_owned(self) -> Column<'static> {
        let Column { numbers, limit } = self;
        let numbers = match numbers {
            Numbers::Planes { n, .. } => Numbers::Widest((0..n).map(|i| numbers.get(i)).collect()),
            Numbers::Narrow(all) => Numbers::Narrow(all),
            Numbers::Wide(all) => Numbers::Wide(all),
            Numbers::Widest(all) => Numbers::Widest(all),
        };
        Column { numbers, limit }
    }

    /// Number `i`.
    pub(super) fn get(&self, i: usize) -> Result<u64> {
        let value = self.numbers.get(i);
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

/// The results of `read` for 0 to `n` - 1. The capacity is reserved at once: columns of `n` numbers have been read, so `n` is not too large.
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
