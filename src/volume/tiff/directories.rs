//! Checks the directories of a TIFF file before decoding: the decoder allocates memory for as many values as a directory
//! declares, and does not apply its limit to the first.

use std::io::{self, Read, Seek, SeekFrom};

use crate::volume::data_error::invalid;

/// Bytes of a value, by the number of its type from 1 on.
const SIZES: [u64; 18] = [1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8];

/// Checks that every value of every directory is in a file of `length` bytes, and leaves the reader at the start.
///
/// # Errors
///
/// `InvalidData` if one is not, or the directories form a circle. The decoder rejects files that are not TIFF.
pub(super) fn check(reader: &mut (impl Read + Seek), length: u64) -> io::Result<()> {
    let found = check_all(reader, length);
    reader.seek(SeekFrom::Start(0))?;
    match found {
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
            Err(invalid("the file ends inside a directory of pages"))
        }
        found => found,
    }
}

fn check_all(reader: &mut (impl Read + Seek), length: u64) -> io::Result<()> {
    let mut head = [0; 4];
    reader.read_exact(&mut head)?;
    let big_endian = head[0] == b'M';
    let is_big = head[2..].contains(&43);
    let mut file = NumberReader { reader, big_endian };
    let width = if is_big { 8 } else { 4 };
    if is_big {
        file.next(4)?;
    }
    let mut at = file.next(width)?;
    let mut n_left = length / 6 + 1;
    while at != 0 {
        n_left = n_left
            .checked_sub(1)
            .ok_or_else(|| invalid("directories of pages that form a circle"))?;
        file.reader.seek(SeekFrom::Start(at))?;
        let n_entries = file.next(if is_big { 8 } else { 2 })?;
        if n_entries > length / 12 {
            return Err(invalid(format!("a directory of {n_entries} entries in {length} bytes")));
        }
        for _ in 0..n_entries {
            let (tag, kind) = (file.next(2)?, file.next(2)?);
            let n = file.next(width)?;
            let size = SIZES.get((kind as usize).wrapping_sub(1)).copied().unwrap_or(0);
            if n.saturating_mul(size.max(1)) > length {
                return Err(invalid(format!(
                    "{n} values of tag {tag} in a file of {length} bytes"
                )));
            }
            file.next(width)?;
        }
        at = file.next(width)?;
    }
    Ok(())
}

/// Reads numbers in the byte order of the file.
struct NumberReader<'a, R> {
    reader: &'a mut R,
    big_endian: bool,
}

impl<R: Read> NumberReader<'_, R> {
    /// The next number, of `width` bytes.
    fn next(&mut self, width: usize) -> io::Result<u64> {
        let mut bytes = [0; 8];
        self.reader.read_exact(&mut bytes[..width])?;
        if self.big_endian {
            bytes[..width].reverse();
        }
        Ok(u64::from_le_bytes(bytes))
    }
}
