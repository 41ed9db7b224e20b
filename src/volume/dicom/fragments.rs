//! The fragments of compressed frames.
//!
//! Source: DICOM PS3.5, A.4. A frame has one fragment or several. Which fragments belong to it follows from the offsets of
//! frames: those in the item before the first fragment, or 64-bit ones in an element of their own. Files with several fragments per
//! frame that have neither are read if a frame starts with the first bytes of its format.

use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;

use crate::volume::data_error::invalid;

/// First bytes of a frame: JPEG, a codestream of JPEG 2000, a JP2 file.
const STARTS: [[u8; 3]; 3] = [[0xff, 0xd8, 0xff], [0xff, 0x4f, 0xff], [0, 0, 0]];

/// Bytes before the content of a fragment: tag and length.
const HEAD_BYTES: u64 = 8;

/// The fragments of the frames of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Fragments {
    /// Byte in the file and length of each.
    all: Vec<(u64, u32)>,
    /// The fragments of each frame.
    frames: Vec<Range<usize>>,
}

impl Fragments {
    /// Finds the fragments of `n_frames` from byte `at` on, where the item with the offsets of frames is; `offsets` are those of
    /// the element with 64-bit ones, if the file has it.
    ///
    /// # Errors
    ///
    /// `InvalidData` for other than fragments.
    pub(super) fn find(
        file: impl Read + Seek,
        at: u64,
        n_frames: usize,
        offsets: &[u64],
    ) -> io::Result<Fragments> {
        let mut reader = BufReader::new(file);
        reader.seek(SeekFrom::Start(at))?;
        let (mut at, mut first_bytes, mut all) = (at, Vec::new(), Vec::new());
        // The offsets in the first item, if there are as many as frames.
        let mut table = Vec::new();
        let mut is_table = true;
        loop {
            let mut head = [0; HEAD_BYTES as usize];
            reader.read_exact(&mut head)?;
            let [a, b, c, d, e, f, g, h] = head;
            let length = u32::from_le_bytes([e, f, g, h]);
            match [a, b, c, d] {
                [0xfe, 0xff, 0x00, 0xe0] => {}
                [0xfe, 0xff, 0xdd, 0xe0] => break,
                _ => return Err(invalid("samples without fragments, expected compressed ones")),
            }
            at += HEAD_BYTES;
            let mut n_read = 0;
            if is_table && u64::from(length) == 4 * n_frames as u64 {
                for _ in 0..n_frames {
                    let mut offset = [0; 4];
                    reader.read_exact(&mut offset)?;
                    table.push(u64::from(u32::from_le_bytes(offset)));
                }
                n_read = length;
            } else if !is_table {
                all.push((at, length));
                let mut start = [0; 3];
                n_read = length.min(3);
                reader.read_exact(&mut start[..n_read as usize])?;
                first_bytes.push(start);
            }
            is_table = false;
            reader.seek_relative(i64::from(length - n_read))?;
            at += u64::from(length);
        }
        let offsets = if offsets.len() == n_frames { offsets } else { &table[..] };
        let frames = frames(&all, &first_bytes, n_frames, offsets);
        Ok(Fragments { all, frames })
    }

    /// The number of fragments.
    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// The number of frames that have fragments.
    pub(super) fn n_frames(&self) -> usize {
        self.frames.len()
    }

    /// Byte and length of the fragments of a frame.
    pub(super) fn of_frame(&self, frame: usize) -> &[(u64, u32)] {
        self.frames.get(frame).map_or(&[], |range| &self.all[range.clone()])
    }
}

/// The fragments of each frame; as many as fragments if nothing else is known.
fn frames(
    all: &[(u64, u32)],
    first_bytes: &[[u8; 3]],
    n_frames: usize,
    offsets: &[u64],
) -> Vec<Range<usize>> {
    let n = all.len();
    if n_frames <= 1 {
        return std::iter::once(0..n).filter(|range| !range.is_empty()).collect();
    }
    if n == n_frames {
        return (0..n).map(|i| i..i + 1).collect();
    }
    // Offsets are from the head of the first fragment to that of a frame's first.
    let first = all.first().map_or(0, |&(at, _)| at);
    let find =
        |offset: &u64| all.binary_search_by_key(&first.saturating_add(*offset), |f| f.0).ok();
    let by_offset: Option<Vec<usize>> = offsets.iter().map(find).collect();
    let by_start =
        || -> Vec<usize> { (0..n).filter(|&i| STARTS.contains(&first_bytes[i])).collect() };
    let starts = by_offset.filter(|starts| starts.len() == n_frames).unwrap_or_else(by_start);
    let is_ascending = starts.first() == Some(&0) && starts.is_sorted_by(|a, b| a < b);
    if starts.len() != n_frames || !is_ascending {
        return (0..n).map(|i| i..i + 1).collect();
    }
    let ends = starts[1..].iter().copied().chain([n]);
    starts.iter().zip(ends).map(|(&start, end)| start..end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fragments after an item of offsets.
    fn items(table: &[u32], fragments: &[&[u8]]) -> Vec<u8> {
        let table: Vec<u8> = table.iter().flat_map(|offset| offset.to_le_bytes()).collect();
        let item = |bytes: &[u8]| {
            let length = (bytes.len() as u32).to_le_bytes();
            [&[0xfe, 0xff, 0x00, 0xe0], &length[..], bytes].concat()
        };
        let all = std::iter::once(item(&table)).chain(fragments.iter().map(|bytes| item(bytes)));
        let end = [0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0];
        all.flatten().chain(end).collect()
    }

    /// The number of fragments of each frame.
    fn sizes(bytes: &[u8], n_frames: usize, offsets: &[u64]) -> Vec<usize> {
        let found =
            Fragments::find(io::Cursor::new(bytes), 0, n_frames, offsets).expect("fragments");
        (0..found.n_frames()).map(|i| found.of_frame(i).len()).collect()
    }

    #[test]
    fn fragments_belong_to_the_frames_at_whose_offsets_they_are() {
        let start = [0xff, 0xd8, 0xff, 0xe0];
        let fragments: [&[u8]; 3] = [&[1, 2], &[3, 4], &start];
        assert_eq!(sizes(&items(&[], &fragments), 1, &[]), [3]);
        assert_eq!(sizes(&items(&[], &fragments), 3, &[]), [1, 1, 1]);
        assert_eq!(sizes(&items(&[0, 20], &fragments), 2, &[]), [2, 1]);
        assert_eq!(sizes(&items(&[], &fragments), 2, &[0, 10]), [1, 2]);
        assert_eq!(sizes(&items(&[], &[&start, &[1, 2], &start]), 2, &[]), [2, 1]);
        // Nothing says which frame has two.
        assert_eq!(sizes(&items(&[], &fragments), 2, &[]), [1, 1, 1]);
        assert_eq!(sizes(&items(&[0, 19], &fragments), 2, &[]), [1, 1, 1]);
    }
}
