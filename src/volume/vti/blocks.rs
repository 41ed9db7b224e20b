//! The bytes of an array: its length, or the lengths of its compressed blocks, then the samples.

use std::io::{self, Read};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use crate::volume::data_error::invalid;
use crate::volume::layout::SampleLayout;
use crate::volume::samples::Samples;
use crate::volume::stream;

/// The encoding of the arrays of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct VtiEncoding {
    pub(super) big_endian: bool,
    /// Bytes of a length: 4 or 8.
    pub(super) length_bytes: usize,
    /// Whether samples are in blocks of zlib.
    pub(super) is_compressed: bool,
}

impl VtiEncoding {
    pub(super) const PLAIN: VtiEncoding =
        VtiEncoding { big_endian: false, length_bytes: 4, is_compressed: false };

    fn read_length(self, reader: &mut impl Read) -> io::Result<u64> {
        let mut bytes = [0; 8];
        let read = &mut bytes[..self.length_bytes];
        reader.read_exact(read)?;
        if self.big_endian {
            read.reverse();
        }
        Ok(u64::from_le_bytes(bytes))
    }
}

/// Reads an array of which the file has at most `left` bytes.
pub(super) fn read(
    reader: &mut impl Read,
    left: u64,
    encoding: VtiEncoding,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    let (_, n_bytes) = layout.size()?;
    let what = layout.describe();
    let describe = |e| stream::describe_damage(e, n_bytes, &what);
    if !encoding.is_compressed {
        let found = encoding.read_length(reader).map_err(describe)?;
        if found != n_bytes || n_bytes > left {
            return Err(layout.wrong_length(found.min(left), n_bytes));
        }
        return stream::read_decompressed(reader, left, layout).map_err(describe);
    }
    let lengths = Lengths::read(reader, left, encoding).map_err(describe)?;
    if lengths.n_bytes != n_bytes {
        return Err(layout.wrong_length(lengths.n_bytes, n_bytes));
    }
    let mut blocks = Blocks {
        reader,
        sizes: lengths.sizes.into_iter(),
        block: Vec::new(),
        at: 0,
        max_block_bytes: lengths.largest,
    };
    let samples = stream::read_decompressed(&mut blocks, left, layout).map_err(describe)?;
    Ok(samples)
}

/// Reads an array in base64. The lengths of a compressed array are encoded separately.
pub(super) fn read_base64(
    text: &[u8],
    encoding: VtiEncoding,
    layout: &SampleLayout,
) -> io::Result<Samples> {
    let text: Vec<u8> = text.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect();
    if !encoding.is_compressed {
        // Some writers encode the length separately: padding ends it.
        let n_length_bytes = encoding.length_bytes as u64;
        let length = part(&text, 0, n_length_bytes);
        if length.contains(&b'=') {
            let mut bytes = decode_base64(length)?;
            let start = n_characters(n_length_bytes);
            bytes.extend(decode_base64(part(&text, start, layout.size()?.1))?);
            return read(&mut &bytes[..], bytes.len() as u64, encoding, layout);
        }
        let wanted = layout.size()?.1.saturating_add(encoding.length_bytes as u64);
        let bytes = decode_base64(part(&text, 0, wanted))?;
        return read(&mut &bytes[..], bytes.len() as u64, encoding, layout);
    }
    // The first length is the number of blocks.
    let mut first = &decode_base64(part(&text, 0, encoding.length_bytes as u64))?[..];
    let n = encoding.read_length(&mut first)?;
    let n_lengths_bytes = n.saturating_add(3).saturating_mul(encoding.length_bytes as u64);
    let head = decode_base64(part(&text, 0, n_lengths_bytes))?;
    let head = &head[..head.len().min(usize::try_from(n_lengths_bytes).unwrap_or(usize::MAX))];
    let lengths = Lengths::read(&mut &head[..], head.len() as u64, encoding)?;
    let start = n_characters(n_lengths_bytes);
    let compressed = lengths.sizes.iter().fold(0u64, |sum, &n| sum.saturating_add(n));
    let mut bytes = head.to_vec();
    bytes.extend(decode_base64(part(&text, start, compressed))?);
    read(&mut &bytes[..], bytes.len() as u64, encoding, layout)
}

/// Characters of base64 for a number of bytes.
fn n_characters(n_bytes: u64) -> u64 {
    n_bytes.div_ceil(3).saturating_mul(4)
}

/// The characters from `start` on for `n_bytes` bytes, as far as there are.
fn part(text: &[u8], start: u64, n_bytes: u64) -> &[u8] {
    let clamp = |at: u64| usize::try_from(at).unwrap_or(usize::MAX).min(text.len());
    &text[clamp(start)..clamp(start.saturating_add(n_characters(n_bytes)))]
}

fn decode_base64(characters: &[u8]) -> io::Result<Vec<u8>> {
    // Whole groups of four; a later check finds missing bytes.
    let whole = &characters[..characters.len() / 4 * 4];
    // Padding ends the lengths; the blocks follow it.
    let end = whole.chunks_exact(4).position(|group| group.contains(&b'='));
    let end = end.map_or(whole.len(), |group| 4 * (group + 1));
    STANDARD.decode(&whole[..end]).map_err(|e| invalid(format!("damaged base64: {e}")))
}

/// The lengths before compressed blocks.
struct Lengths {
    /// Compressed bytes of each block.
    sizes: Vec<u64>,
    /// Decompressed bytes of all blocks, and of the largest.
    n_bytes: u64,
    largest: u64,
}

impl Lengths {
    fn read(reader: &mut impl Read, left: u64, encoding: VtiEncoding) -> io::Result<Self> {
        let mut next = || encoding.read_length(reader);
        let (n, each, last) = (next()?, next()?, next()?);
        if n.saturating_mul(encoding.length_bytes as u64) > left {
            return Err(invalid(format!("{n} compressed blocks, more than the file can hold")));
        }
        let sizes = (0..n).map(|_| next()).collect::<io::Result<Vec<u64>>>()?;
        let whole = if last == 0 { n } else { n.saturating_sub(1) };
        let n_bytes = whole.saturating_mul(each).saturating_add(if n > 0 { last } else { 0 });
        Ok(Lengths { sizes, n_bytes, largest: each.max(last) })
    }
}

/// Decompresses one block after the other.
struct Blocks<'a, R> {
    reader: &'a mut R,
    sizes: std::vec::IntoIter<u64>,
    block: Vec<u8>,
    at: usize,
    max_block_bytes: u64,
}

impl<R: Read> Read for Blocks<'_, R> {
    fn read(&mut self, wanted: &mut [u8]) -> io::Result<usize> {
        while self.at == self.block.len() {
            let Some(size) = self.sizes.next() else { return Ok(0) };
            self.block.clear();
            self.at = 0;
            let mut compressed = ZlibDecoder::new(self.reader.by_ref().take(size));
            compressed.by_ref().take(self.max_block_bytes).read_to_end(&mut self.block)?;
            // Verify the checksum and skip the remaining bytes of the block.
            let _more = compressed.read(&mut [0])?;
            io::copy(&mut compressed.into_inner(), &mut io::sink())?;
        }
        let n = wanted.len().min(self.block.len() - self.at);
        wanted[..n].copy_from_slice(&self.block[self.at..self.at + n]);
        self.at += n;
        Ok(n)
    }
}
