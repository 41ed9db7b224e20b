//! Samples packed by run lengths.
//!
//! Source: DICOM PS3.5, annex G. Each frame is a fragment: how many segments there are and where, then the segments, one for
//! each byte of a sample, the highest first.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

use crate::volume::decode::invalid;

/// Most bytes that one byte of runs can stand for: two stand for up to 128.
const RATIO: usize = 64;

/// Bytes of the head of a frame.
const HEAD: usize = 64;

/// Where the fragments are, as offsets and lengths, behind the table that comes first; `at` is where that begins.
///
/// # Errors
///
/// `InvalidData` for other than fragments.
pub(super) fn fragments(file: impl Read + Seek, mut at: u64) -> io::Result<Vec<(u64, u32)>> {
    let mut reader = BufReader::new(file);
    reader.seek(SeekFrom::Start(at))?;
    let mut all = Vec::new();
    loop {
        let mut head = [0; 8];
        reader.read_exact(&mut head)?;
        let [a, b, c, d, e, f, g, h] = head;
        let length = u32::from_le_bytes([e, f, g, h]);
        match [a, b, c, d] {
            [0xfe, 0xff, 0x00, 0xe0] => all.push((at + 8, length)),
            [0xfe, 0xff, 0xdd, 0xe0] => break,
            _ => return Err(invalid("samples that are no fragments, expected them packed")),
        }
        reader.seek_relative(i64::from(length))?;
        at += 8 + u64::from(length);
    }
    if !all.is_empty() {
        all.remove(0);
    }
    Ok(all)
}

/// The bytes of `n` samples of `size` bytes of each of their numbers, little endian, one sample after the other.
///
/// # Errors
///
/// `InvalidData` where the segments are not as many or not as long as that.
pub(super) fn unpacked(bytes: &[u8], n: usize, size: usize, of: usize) -> io::Result<Vec<u8>> {
    let n_segments = size * of;
    let word = |i: usize| {
        let word = bytes.get(4 * i..4 * i + 4).and_then(|word| word.try_into().ok());
        word.map(u32::from_le_bytes).ok_or_else(|| invalid("runs without a head"))
    };
    if word(0)? as usize != n_segments || n_segments > 15 || bytes.len() < HEAD {
        let found = word(0)?;
        return Err(invalid(format!("{found} segments of runs, expected {n_segments}")));
    }
    if n.saturating_mul(n_segments) > bytes.len().saturating_mul(RATIO) {
        return Err(invalid(format!("{} bytes of runs, too few for {n} samples", bytes.len())));
    }
    let mut all = vec![0; n * n_segments];
    for segment in 0..n_segments {
        let runs = bytes.get(word(1 + segment)? as usize..).unwrap_or_default();
        // The highest byte of each number comes first, and is the last of it here.
        let byte = segment / size * size + size - 1 - segment % size;
        let to = all.iter_mut().skip(byte).step_by(n_segments);
        if unpack(runs, to) < n {
            return Err(invalid(format!(
                "segment {segment} of runs ends early, expected {n} bytes"
            )));
        }
    }
    Ok(all)
}

/// Fills `to` from runs; how many bytes there were.
fn unpack<'a>(mut runs: &[u8], mut to: impl Iterator<Item = &'a mut u8>) -> usize {
    let mut n = 0;
    while let Some((&head, rest)) = runs.split_first() {
        // 128 stands for nothing.
        let (length, is_run) = match head {
            0..=127 => (usize::from(head) + 1, false),
            128 => (0, true),
            _ => (257 - usize::from(head), true),
        };
        let taken = if length == 0 {
            0
        } else if is_run {
            1
        } else {
            length
        };
        let Some(values) = rest.get(..taken) else { return n };
        for i in 0..length {
            let Some(byte) = to.next() else { return n };
            *byte = values[if is_run { 0 } else { i }];
            n += 1;
        }
        runs = &rest[taken..];
    }
    n
}
