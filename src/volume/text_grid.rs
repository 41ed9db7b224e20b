//! Samples as text with z fastest and x slowest, as programs of chemistry write them.

use std::collections::VecDeque;
use std::io::{self, BufRead};

use super::data_error::invalid;
use super::layout::{Channel, Compression};
use super::memory::try_filled_vec;
use super::stream::DEFLATE_RATIO;
use super::text::{TextReader, check_text_length, shortened, split_number};

/// Samples in a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextGrid {
    pub(super) dims: [usize; 3],
    pub(super) channel: Channel,
    /// Bytes of the file.
    pub(super) length: u64,
    pub(super) compression: Compression,
}

impl TextGrid {
    /// Reads the samples of the channel, without keeping the text, and reorders them: x fastest. `first` are words that
    /// precede the next ones of the reader.
    ///
    /// # Errors
    ///
    /// `InvalidData` for too few of them, and other than numbers.
    pub(super) fn read(
        &self,
        text: &mut TextReader<impl BufRead>,
        mut first: VecDeque<String>,
    ) -> io::Result<Vec<f64>> {
        let TextGrid { dims: [nx, ny, nz], channel, .. } = *self;
        let what = format!("{nx}x{ny}x{nz} samples of {}", channel.of);
        let all = self.dims.iter().try_fold(channel.of, |n, &d| n.checked_mul(d));
        let all = all.ok_or_else(|| invalid(format!("{what}, more than memory can hold")))?;
        let is_packed = self.compression != Compression::None;
        let ratio = if is_packed { DEFLATE_RATIO } else { 1 };
        check_text_length(self.length.saturating_mul(ratio), all, &what)?;
        // Of compressed text, memory grows with the samples that exist.
        let mut in_order = Vec::new();
        let mut samples =
            if is_packed { Vec::new() } else { try_filled_vec(all / channel.of, 0.0)? };
        let place = |at: usize| at / (ny * nz) + nx * (at / nz % ny + ny * (at % nz));
        let mut i = 0;
        while i < all {
            let next;
            let word = match first.pop_front() {
                Some(word) => {
                    next = word;
                    Some(next.as_str())
                }
                None => text.word()?,
            };
            let word =
                word.ok_or_else(|| invalid(format!("{i} numbers, expected {all} for {what}")))?;
            let mut rest = word;
            while !rest.is_empty() && i < all {
                let (value, after) = split_number(rest).ok_or_else(|| {
                    let start = shortened(word);
                    invalid(format!("'{start}' as number {i} of the text, expected one of {what}"))
                })?;
                rest = after;
                if i % channel.of == channel.index {
                    if is_packed {
                        in_order.push(value);
                    } else {
                        samples[place(i / channel.of)] = value;
                    }
                }
                i += 1;
            }
            if !rest.is_empty() {
                return Err(self.too_many(all, &what));
            }
        }
        if !first.is_empty() {
            return Err(self.too_many(all, &what));
        }
        if is_packed {
            samples = try_filled_vec(in_order.len(), 0.0)?;
            for (at, value) in in_order.into_iter().enumerate() {
                samples[place(at)] = value;
            }
        }
        Ok(samples)
    }

    /// Checks that nothing follows the samples.
    pub(super) fn check_end(&self, text: &mut TextReader<impl BufRead>) -> io::Result<()> {
        if text.word()?.is_none() {
            return Ok(());
        }
        let [nx, ny, nz] = self.dims;
        let all = nx * ny * nz * self.channel.of;
        Err(self.too_many(all, &format!("{nx}x{ny}x{nz} samples of {}", self.channel.of)))
    }

    fn too_many(&self, all: usize, what: &str) -> io::Error {
        invalid(format!("more than the {all} numbers of {what}"))
    }
}
