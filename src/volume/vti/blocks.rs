//! The bytes of an array: its length, or those of its packed blocks, and then the samples.

use std::io::{self, Read};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use crate::volume::Samples;
use crate::volume::decode::invalid;
use crate::volume::stream::{self, Layout};

/// How the arrays of a file are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoding {
    pub(super) big_endian: bool,
    /// Bytes of a length.
    pub(super) length_bytes: usize,
    /// Whether samples are in blocks of zlib.
    pub(super) is_packed: bool,
}

impl Encoding {
    pub(super) const PLAIN: Encoding =
        Encoding { big_endian: false, length_bytes: 4, is_packed: false };

    fn length(self, reader: &mut impl Read) -> io::Result<u64> {
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
    encoding: Encoding,
    layout: &Layout,
) -> io::Result<Samples> {
    let (_, n_bytes) = layout.size()?;
    let what = layout.what();
    let ends = |e| stream::damaged(e, n_bytes, &what);
    if !encoding.is_packed {
        let found = encoding.length(reader).map_err(ends)?;
        if found != n_bytes || n_bytes > left {
            let found = found.min(left);
            return Err(invalid(format!(
                "{found} bytes of samples, expected {n_bytes} for {what}"
            )));
        }
        return stream::unpacked(reader, left, layout).map_err(ends);
    }
    let lengths = Lengths::read(reader, left, encoding).map_err(ends)?;
    if lengths.unpacked != n_bytes {
        let found = lengths.unpacked;
        return Err(invalid(format!("{found} bytes of samples, expected {n_bytes} for {what}")));
    }
    let mut blocks = Blocks {
        reader,
        sizes: lengths.sizes.into_iter(),
        block: Vec::new(),
        at: 0,
        most: lengths.largest,
    };
    let samples = stream::unpacked(&mut blocks, left, layout).map_err(ends)?;
    Ok(samples)
}

/// Reads an array that is written as base64: its lengths by themselves where it is packed.
pub(super) fn read_base64(text: &[u8], encoding: Encoding, layout: &Layout) -> io::Result<Samples> {
    let text: Vec<u8> = text.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect();
    if !encoding.is_packed {
        let wanted = layout.size()?.1.saturating_add(encoding.length_bytes as u64);
        let bytes = decoded(part(&text, 0, wanted))?;
        return read(&mut &bytes[..], bytes.len() as u64, encoding, layout);
    }
    // How many blocks there are tells how long the lengths are.
    let mut first = &decoded(part(&text, 0, encoding.length_bytes as u64))?[..];
    let n = encoding.length(&mut first)?;
    let n_head = n.saturating_add(3).saturating_mul(encoding.length_bytes as u64);
    let head = decoded(part(&text, 0, n_head))?;
    let head = &head[..head.len().min(usize::try_from(n_head).unwrap_or(usize::MAX))];
    let lengths = Lengths::read(&mut &head[..], head.len() as u64, encoding)?;
    let start = letters(n_head);
    let packed = lengths.sizes.iter().fold(0u64, |sum, &n| sum.saturating_add(n));
    let mut bytes = head.to_vec();
    bytes.extend(decoded(part(&text, start, packed))?);
    read(&mut &bytes[..], bytes.len() as u64, encoding, layout)
}

/// How many letters stand for so many bytes.
fn letters(n_bytes: u64) -> u64 {
    n_bytes.div_ceil(3).saturating_mul(4)
}

/// The letters from `start` on that stand for so many bytes, as far as they are there.
fn part(text: &[u8], start: u64, n_bytes: u64) -> &[u8] {
    let clamp = |at: u64| usize::try_from(at).unwrap_or(usize::MAX).min(text.len());
    &text[clamp(start)..clamp(start.saturating_add(letters(n_bytes)))]
}

fn decoded(letters: &[u8]) -> io::Result<Vec<u8>> {
    // Whole groups of four; what was cut short is missed later.
    let whole = &letters[..letters.len() / 4 * 4];
    // An array whose lengths are padded goes on after the padding.
    let end = whole.chunks_exact(4).position(|group| group.contains(&b'='));
    let end = end.map_or(whole.len(), |group| 4 * (group + 1));
    STANDARD.decode(&whole[..end]).map_err(|e| invalid(format!("damaged base64: {e}")))
}

/// The head of packed data.
struct Lengths {
    /// Packed bytes of each block.
    sizes: Vec<u64>,
    /// Bytes of all blocks once unpacked, and of the largest.
    unpacked: u64,
    largest: u64,
}

impl Lengths {
    fn read(reader: &mut impl Read, left: u64, encoding: Encoding) -> io::Result<Self> {
        let mut next = || encoding.length(reader);
        let (n, each, last) = (next()?, next()?, next()?);
        if n.saturating_mul(encoding.length_bytes as u64) > left {
            return Err(invalid(format!("{n} packed blocks, more than the file has room for")));
        }
        let sizes = (0..n).map(|_| next()).collect::<io::Result<Vec<u64>>>()?;
        let whole = if last == 0 { n } else { n.saturating_sub(1) };
        let unpacked = whole.saturating_mul(each).saturating_add(if n > 0 { last } else { 0 });
        Ok(Lengths { sizes, unpacked, largest: each.max(last) })
    }
}

/// Unpacks one block after the other.
struct Blocks<'a, R> {
    reader: &'a mut R,
    sizes: std::vec::IntoIter<u64>,
    block: Vec<u8>,
    at: usize,
    most: u64,
}

impl<R: Read> Read for Blocks<'_, R> {
    fn read(&mut self, wanted: &mut [u8]) -> io::Result<usize> {
        while self.at == self.block.len() {
            let Some(size) = self.sizes.next() else { return Ok(0) };
            self.block.clear();
            self.at = 0;
            let mut packed = ZlibDecoder::new(self.reader.by_ref().take(size));
            packed.by_ref().take(self.most).read_to_end(&mut self.block)?;
            // The checksum behind the block, and what is left of its bytes.
            let _more = packed.read(&mut [0])?;
            io::copy(&mut packed.into_inner(), &mut io::sink())?;
        }
        let n = wanted.len().min(self.block.len() - self.at);
        wanted[..n].copy_from_slice(&self.block[self.at..self.at + n]);
        self.at += n;
        Ok(n)
    }
}
