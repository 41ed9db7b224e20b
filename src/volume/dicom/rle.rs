//! Run length encoding of frames.
//!
//! Source: DICOM PS3.5, annex G. Each frame is a fragment: number and offsets of the segments, then the segments, one for
//! each byte of a sample, the most significant first.

use std::io;

use crate::volume::data_error::invalid;

/// Most bytes that one byte of runs can expand to: two expand to up to 128.
const MAX_COMPRESSION_RATIO: usize = 64;

/// Bytes of the header of a frame.
const HEADER_BYTES: usize = 64;

/// Decompresses `n` samples of `n_channels` numbers of `size` bytes, little endian, one sample after the other.
///
/// # Errors
///
/// `InvalidData` for another number of segments, or shorter ones.
pub(super) fn decompress(
    bytes: &[u8],
    n: usize,
    size: usize,
    n_channels: usize,
) -> io::Result<Vec<u8>> {
    let n_segments = size * n_channels;
    let word = |i: usize| {
        let word = bytes.get(4 * i..4 * i + 4).and_then(|word| word.try_into().ok());
        word.map(u32::from_le_bytes).ok_or_else(|| invalid("runs without a header"))
    };
    if word(0)? as usize != n_segments || n_segments > 15 || bytes.len() < HEADER_BYTES {
        let found = word(0)?;
        return Err(invalid(format!("{found} segments of runs, expected {n_segments}")));
    }
    if n.saturating_mul(n_segments) > bytes.len().saturating_mul(MAX_COMPRESSION_RATIO) {
        return Err(invalid(format!("{} bytes of runs, too few for {n} samples", bytes.len())));
    }
    let mut all = vec![0; n * n_segments];
    for segment in 0..n_segments {
        let runs = bytes.get(word(1 + segment)? as usize..).unwrap_or_default();
        // The most significant byte comes first in the file, last here.
        let byte = segment / size * size + size - 1 - segment % size;
        let to = all.iter_mut().skip(byte).step_by(n_segments);
        if expand(runs, to) < n {
            return Err(invalid(format!(
                "segment {segment} of runs ends early, expected {n} bytes"
            )));
        }
    }
    Ok(all)
}

/// Expands runs into `to` and returns the number of bytes.
fn expand<'a>(mut runs: &[u8], mut to: impl Iterator<Item = &'a mut u8>) -> usize {
    let mut n = 0;
    while let Some((&head, rest)) = runs.split_first() {
        // Bytes to write and bytes to read; 128 is no run.
        let (length, taken) = match head {
            0..=127 => (usize::from(head) + 1, usize::from(head) + 1),
            128 => (0, 0),
            _ => (257 - usize::from(head), 1),
        };
        let Some(values) = rest.get(..taken) else { return n };
        for i in 0..length {
            let Some(byte) = to.next() else { return n };
            *byte = values[i.min(taken - 1)];
            n += 1;
        }
        runs = &rest[taken..];
    }
    n
}
