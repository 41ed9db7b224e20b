//! Samples in a stream that may be packed and may hold several numbers per sample.
//!
//! A header is free to lie, so what it claims is held against the length of the file before memory is taken: exactly for
//! plain data, and by the greatest possible compression (1032 to 1 for deflate, zlib technical notes) for packed ones, whose
//! memory grows with what is inflated, and of which no byte beyond the samples is kept.

use std::io::{self, BufRead, Read};
use std::path::Path;

use flate2::bufread::{MultiGzDecoder, ZlibDecoder};

use super::decode::{SampleType, invalid, read_samples, size_of_grid};
use crate::volume::Samples;

/// Most bytes that one byte of a deflate stream can stand for.
pub(crate) const DEFLATE_RATIO: u64 = 1032;

/// How bytes are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    Plain,
    Gzip,
    Zlib,
}

impl Packing {
    /// How a file of this name is packed: gzip by `.gz`, in any case.
    pub(crate) fn of_name(path: &Path) -> Packing {
        let is_gzip = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        if is_gzip { Packing::Gzip } else { Packing::Plain }
    }
}

/// One of the numbers that each sample is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) index: usize,
    pub(crate) of: usize,
}

impl Channel {
    /// Samples of one number.
    pub(crate) const ONLY: Channel = Channel { index: 0, of: 1 };
}

/// What is where in a stream.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub(crate) dims: [usize; 3],
    pub(crate) sample_type: SampleType,
    pub(crate) big_endian: bool,
    /// Numbers per sample, one beside the other.
    pub(crate) channel: Channel,
    /// Bytes before the samples, unpacked.
    pub(crate) skip: u64,
}

impl Layout {
    /// The samples in words.
    pub(crate) fn what(&self) -> String {
        let [x, y, z] = self.dims;
        let times = if self.channel.of > 1 { format!("{} x ", self.channel.of) } else { "".into() };
        format!("{times}{x}x{y}x{z} {}", self.sample_type)
    }

    /// Number of samples, and of the bytes that they and all before them take.
    ///
    /// # Errors
    ///
    /// `InvalidData` if that is more than memory can hold.
    pub(crate) fn size(&self) -> io::Result<(usize, u64)> {
        let size = size_of_grid(self.dims, self.sample_type).and_then(|(n, bytes)| {
            let all = (bytes as u64).checked_mul(self.channel.of as u64)?;
            Some((n, all.checked_add(self.skip)?))
        });
        let too_many = || invalid(format!("{} samples, more than memory can hold", self.what()));
        size.ok_or_else(too_many)
    }
}

/// Reads the samples of a stream of which the file has `left` bytes. What follows them is not looked at.
///
/// # Errors
///
/// `InvalidData` where the stream is too short, damaged, or claims more than its length can stand for.
pub(crate) fn read(
    reader: &mut impl BufRead,
    left: u64,
    packing: Packing,
    layout: &Layout,
) -> io::Result<Samples> {
    let (_, n_bytes) = layout.size()?;
    let what = layout.what();
    match packing {
        Packing::Plain => {
            if left < n_bytes {
                let (found, skip) = (left.saturating_sub(layout.skip), layout.skip);
                let expected = n_bytes - skip;
                return Err(invalid(format!(
                    "{found} bytes of samples, expected {expected} for {what}"
                )));
            }
            unpacked(reader, left, layout)
        }
        Packing::Gzip | Packing::Zlib => {
            if n_bytes > left.saturating_mul(DEFLATE_RATIO) {
                return Err(invalid(format!(
                    "{left} bytes of packed data, too few for the {n_bytes} bytes of {what}"
                )));
            }
            let read = match packing {
                Packing::Gzip => to_the_end(&mut MultiGzDecoder::new(reader), left, layout),
                _ => to_the_end(&mut ZlibDecoder::new(reader), left, layout),
            };
            read.map_err(|e| damaged(e, n_bytes, &what))
        }
    }
}

/// As [`read`], and checks that nothing follows the samples.
pub(crate) fn read_all(
    reader: &mut impl BufRead,
    left: u64,
    packing: Packing,
    layout: &Layout,
) -> io::Result<Samples> {
    let samples = read(reader, left, packing, layout)?;
    // Packed data that go on leave bytes behind: the checksum was not reached.
    let rest = io::copy(&mut reader.take(1), &mut io::sink())?;
    if rest > 0 {
        let ((_, n_bytes), what) = (layout.size()?, layout.what());
        return Err(invalid(format!(
            "the packed data hold more than the {n_bytes} bytes of {what}"
        )));
    }
    Ok(samples)
}

/// The samples of a reader that unpacks, with the checksum behind them if they are the last.
fn to_the_end(reader: &mut impl Read, left: u64, layout: &Layout) -> io::Result<Samples> {
    let samples = unpacked(reader, left, layout)?;
    // Reading past the end checks what follows the data.
    let _more = reader.read(&mut [0])?;
    Ok(samples)
}

/// Says what is wrong with packed data.
pub(crate) fn damaged(e: io::Error, n_bytes: u64, what: &str) -> io::Error {
    match e.kind() {
        io::ErrorKind::UnexpectedEof => {
            invalid(format!("the packed data end early, expected {n_bytes} bytes for {what}"))
        }
        // What flate2 says of a stream that is none, or whose checksum is wrong.
        io::ErrorKind::InvalidInput => invalid(format!("damaged packed data: {e}")),
        _ => e,
    }
}

/// The samples of a reader that has unpacked what `left` bytes of the file stand for.
pub(crate) fn unpacked(reader: &mut impl Read, left: u64, layout: &Layout) -> io::Result<Samples> {
    let (n, _) = layout.size()?;
    let skipped = io::copy(&mut reader.by_ref().take(layout.skip), &mut io::sink())?;
    if skipped < layout.skip {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    let Layout { sample_type, big_endian, channel, .. } = *layout;
    let size = sample_type.n_bytes();
    // Samples rarely deflate to more than they were.
    let n_earned = usize::try_from(left).unwrap_or(usize::MAX) / size / channel.of.max(1);
    if channel == Channel::ONLY {
        return read_samples(reader, sample_type, big_endian, n, n_earned);
    }
    let mut picked = Picked { reader, size, channel, rows: Vec::new() };
    read_samples(&mut picked, sample_type, big_endian, n, n_earned)
}

/// Hands on one number of each sample.
struct Picked<'a, R> {
    reader: &'a mut R,
    /// Bytes of a number.
    size: usize,
    channel: Channel,
    /// Whole samples, as many as are read at a time.
    rows: Vec<u8>,
}

impl<R: Read> Read for Picked<'_, R> {
    /// Only whole numbers are asked for, and are handed on.
    fn read(&mut self, wanted: &mut [u8]) -> io::Result<usize> {
        let row = self.size * self.channel.of;
        let n = (wanted.len() / self.size).min((1 << 16) / row.max(1) + 1);
        self.rows.resize(n * row, 0);
        self.reader.read_exact(&mut self.rows)?;
        let at = self.size * self.channel.index;
        for (to, from) in wanted.chunks_exact_mut(self.size).zip(self.rows.chunks_exact(row)) {
            to.copy_from_slice(&from[at..at + self.size]);
        }
        Ok(n * self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_channel_of_several_is_picked() {
        let data: Vec<u8> = (0..3 * 8 * 2u16).flat_map(u16::to_be_bytes).collect();
        let layout = Layout {
            dims: [2, 2, 4],
            sample_type: SampleType::U16,
            big_endian: true,
            channel: Channel { index: 1, of: 3 },
            skip: 0,
        };
        let left = data.len() as u64;
        let samples = read(&mut &data[..], left, Packing::Plain, &layout).expect("all are there");
        assert_eq!(samples, Samples::U16((0..16).map(|i| 3 * i + 1).collect()));
        assert!(read(&mut &data[2..], left - 2, Packing::Plain, &layout).is_err());
    }
}
