//! Samples in a stream that may be compressed and may have several numbers per sample.
//!
//! A header may declare any size, so it is checked against the length of the file before memory is allocated: exactly for
//! uncompressed data, and by the largest possible compression (1032 to 1 for deflate, zlib technical notes) for compressed
//! data. Their memory grows with the decompressed bytes, and bytes after the samples are not kept.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::{MultiGzDecoder, ZlibDecoder};

use super::data_error::invalid;
use super::decode::read_samples;
use super::layout::{Channel, Compression, SampleLayout};
use super::samples::Samples;

/// Most bytes that one byte of a deflate stream can expand to.
pub(crate) const DEFLATE_RATIO: u64 = 1032;

/// Reads the samples of a stream of which the file has `left` bytes. Bytes after the samples are ignored.
///
/// # Errors
///
/// `InvalidData` if the stream is too short, damaged, or declares more than its length can expand to.
pub(crate) fn read(
    reader: &mut impl BufRead,
    left: u64,
    compression: Compression,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    let (_, n_bytes) = layout.size()?;
    match compression {
        Compression::None if left < n_bytes => {
            let found = left.saturating_sub(layout.skip);
            Err(layout.wrong_length(found, n_bytes - layout.skip))
        }
        Compression::None => read_decompressed(reader, left, layout),
        Compression::Gzip => Ok(decompress(MultiGzDecoder::new(reader), left, layout)?.0),
        Compression::Zlib => Ok(decompress(ZlibDecoder::new(reader), left, layout)?.0),
    }
}

/// As [`read`] for gzip, and checks that nothing follows the samples.
pub(crate) fn read_gzip_to_end(
    reader: &mut impl BufRead,
    left: u64,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    let (samples, is_end) = decompress(MultiGzDecoder::new(reader), left, layout)?;
    if is_end {
        return Ok(samples);
    }
    let ((_, n_bytes), what) = (layout.size()?, layout.describe());
    Err(invalid(format!("the compressed data have more than the {n_bytes} bytes of {what}")))
}

/// The number of bytes of a gzip stream, decompressed.
pub(crate) fn gzip_bytes(reader: &mut impl BufRead) -> io::Result<u64> {
    let describe = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => invalid("the compressed data end early"),
        io::ErrorKind::InvalidInput => invalid(format!("damaged compressed data: {e}")),
        _ => e,
    };
    io::copy(&mut MultiGzDecoder::new(reader), &mut io::sink()).map_err(describe)
}

/// Reads samples from a decompressor. Returns whether the data end after them.
fn decompress(
    mut decoder: impl Read,
    left: u64,
    layout: &SampleLayout,
) -> io::Result<(Samples, bool)> {
    let ((_, n_bytes), what) = (layout.size()?, layout.describe());
    if n_bytes > left.saturating_mul(DEFLATE_RATIO) {
        return Err(invalid(format!(
            "{left} bytes of compressed data, too few for the {n_bytes} bytes of {what}"
        )));
    }
    let describe = |e| describe_damage(e, n_bytes, &what);
    let samples = read_decompressed(&mut decoder, left, layout).map_err(describe)?;
    // Reading past the end verifies the checksum.
    let n_more = decoder.read(&mut [0]).map_err(describe)?;
    Ok((samples, n_more == 0))
}

/// The bytes of a text that may be compressed.
pub(crate) fn text(file: File, compression: Compression) -> Box<dyn BufRead> {
    const BUFFER_BYTES: usize = 1 << 16;
    let reader = BufReader::with_capacity(BUFFER_BYTES, file);
    match compression {
        Compression::None => Box::new(reader),
        Compression::Gzip => {
            Box::new(BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(reader)))
        }
        Compression::Zlib => {
            Box::new(BufReader::with_capacity(BUFFER_BYTES, ZlibDecoder::new(reader)))
        }
    }
}

/// Describes an error of compressed text.
pub(crate) fn describe_text_damage(e: io::Error) -> io::Error {
    match e.kind() {
        io::ErrorKind::UnexpectedEof => invalid("the compressed text ends early"),
        io::ErrorKind::InvalidInput => invalid(format!("damaged compressed data: {e}")),
        _ => e,
    }
}

/// Describes an error of compressed data.
pub(crate) fn describe_damage(e: io::Error, n_bytes: u64, what: &str) -> io::Error {
    match e.kind() {
        io::ErrorKind::UnexpectedEof => {
            invalid(format!("the compressed data end early, expected {n_bytes} bytes for {what}"))
        }
        // flate2, for other than a stream of its format, and for a wrong checksum.
        io::ErrorKind::InvalidInput => invalid(format!("damaged compressed data: {e}")),
        _ => e,
    }
}

/// Reads samples from a decompressed stream; `left` is the number of bytes that the file has for them.
pub(crate) fn read_decompressed(
    reader: &mut impl Read,
    left: u64,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    let (n, _) = layout.size()?;
    let skipped = io::copy(&mut reader.by_ref().take(layout.skip), &mut io::sink())?;
    if skipped < layout.skip {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    let SampleLayout { sample_type, big_endian, channel, .. } = *layout;
    let size = sample_type.n_bytes();
    // Samples rarely deflate to more bytes than they had.
    let n_backed = usize::try_from(left).unwrap_or(usize::MAX) / size / channel.of.max(1);
    if channel == Channel::ONLY {
        return read_samples(reader, sample_type, big_endian, n, n_backed);
    }
    let mut picked = OneChannel { reader, size, channel, rows: Vec::new() };
    read_samples(&mut picked, sample_type, big_endian, n, n_backed)
}

/// A reader of one number of each sample.
struct OneChannel<'a, R> {
    reader: &'a mut R,
    /// Bytes of a number.
    size: usize,
    channel: Channel,
    /// Buffer for whole samples.
    rows: Vec<u8>,
}

impl<R: Read> Read for OneChannel<'_, R> {
    /// The length of `wanted` must be a multiple of the size of a number.
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
    use crate::volume::layout::SampleType;

    #[test]
    fn one_channel_of_several_is_picked() {
        let data: Vec<u8> = (0..3 * 8 * 2u16).flat_map(u16::to_be_bytes).collect();
        let layout = SampleLayout {
            dims: [2, 2, 4],
            sample_type: SampleType::U16,
            big_endian: true,
            channel: Channel { index: 1, of: 3 },
            skip: 0,
        };
        let left = data.len() as u64;
        let samples =
            read(&mut &data[..], left, Compression::None, &layout).expect("all are there");
        assert_eq!(samples, Samples::U16((0..16).map(|i| 3 * i + 1).collect()));
        assert!(read(&mut &data[2..], left - 2, Compression::None, &layout).is_err());
    }
}
