//! Checks the directories of a TIFF file before decoding: the decoder allocates memory for as many values as a directory
//! declares, and does not apply its limit to the first.

use std::io::{self, Read, Seek, SeekFrom};

use super::interpretation::{self, BLACK_IS_ZERO, Replaced};
use crate::volume::data_error::invalid;

/// Bytes of a value, by the number of its type from 1 on.
const SIZES: [u64; 18] = [1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8];

/// The tag of the interpretation of numbers as colours.
const PHOTOMETRIC_INTERPRETATION: u64 = 262;

/// The tags of offsets and lengths of strips, and of tiles. They differ in their lowest byte.
const STRIPS: [u64; 2] = [273, 279];
const TILES: [u64; 2] = [324, 325];

/// The tag of the width of a tile.
const TILE_WIDTH: u64 = 322;

/// Checks that every value of every directory is in a file of `length` bytes. Returns the bytes of interpretations and tags that are
/// replaced.
///
/// # Errors
///
/// `InvalidData` if one is not, or the directories form a circle. The decoder rejects files that are not TIFF.
pub(super) fn check(reader: &mut (impl Read + Seek), length: u64) -> io::Result<Vec<Replaced>> {
    match check_all(reader, length) {
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
            Err(invalid("the file ends inside a directory of pages"))
        }
        found => found,
    }
}

fn check_all(reader: &mut (impl Read + Seek), length: u64) -> io::Result<Vec<Replaced>> {
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
    let mut replaced = Vec::new();
    while at != 0 {
        n_left = n_left
            .checked_sub(1)
            .ok_or_else(|| invalid("directories of pages that form a circle"))?;
        file.reader.seek(SeekFrom::Start(at))?;
        let n_entries = file.next(if is_big { 8 } else { 2 })?;
        if n_entries > length / 12 {
            return Err(invalid(format!("a directory of {n_entries} entries in {length} bytes")));
        }
        let (head_bytes, entry_bytes) = if is_big { (8, 20) } else { (2, 12) };
        // Tiles with the tags of strips, as libtiff wrote them before TIFF 6.0.
        let (mut has_tiles, mut of_strips) = ([false; 2], Vec::new());
        for i in 0..n_entries {
            let (tag, kind) = (file.next(2)?, file.next(2)?);
            let n = file.next(width)?;
            let size = SIZES.get((kind as usize).wrapping_sub(1)).copied().unwrap_or(0);
            // The decoder skips too little of such an entry, and takes its rest for the next one.
            if is_big && size == 0 {
                return Err(invalid(format!("a value of unknown type {kind} of tag {tag}")));
            }
            if n.saturating_mul(size.max(1)) > length {
                return Err(invalid(format!(
                    "{n} values of tag {tag} in a file of {length} bytes"
                )));
            }
            let mut value = [0; 8];
            file.reader.read_exact(&mut value[..width])?;
            let size = size as usize;
            if tag == PHOTOMETRIC_INTERPRETATION && n == 1 && (1..=width).contains(&size) {
                let value = file.number(value, size);
                let lowest = if big_endian { size as u64 - 1 } else { 0 };
                let place = at + head_bytes + (i + 1) * entry_bytes - width as u64 + lowest;
                if interpretation::is_replaced(value) {
                    replaced.push(Replaced { place, by: BLACK_IS_ZERO });
                }
            }
            has_tiles[0] |= tag == TILE_WIDTH;
            has_tiles[1] |= TILES.contains(&tag);
            if let Some(which) = STRIPS.iter().position(|&strips| strips == tag) {
                let place = at + head_bytes + i * entry_bytes + u64::from(big_endian);
                of_strips.push(Replaced { place, by: TILES[which] as u8 });
            }
        }
        if has_tiles == [true, false] {
            replaced.append(&mut of_strips);
        }
        at = file.next(width)?;
    }
    Ok(replaced)
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
        Ok(self.number(bytes, width))
    }

    /// The number of the first `width` bytes.
    fn number(&self, bytes: [u8; 8], width: usize) -> u64 {
        let mut number = [0; 8];
        number[..width].copy_from_slice(&bytes[..width]);
        if self.big_endian {
            number[..width].reverse();
        }
        u64::from_le_bytes(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A BigTIFF file of one directory with one value of a type.
    fn big_tiff(kind: u16) -> Vec<u8> {
        let mut bytes = b"II\x2b\0\x08\0\0\0".to_vec();
        [16u64, 1].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        [256, kind].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        [1u64, 5, 0].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_type_that_the_decoder_does_not_skip_whole_is_refused() {
        let checked = |kind: u16| {
            let bytes = big_tiff(kind);
            check(&mut io::Cursor::new(&bytes), bytes.len() as u64).map_err(|e| e.to_string())
        };
        for known in [1, 3, 4, 13, 16, 18] {
            assert_eq!(checked(known), Ok(Vec::new()), "{known}");
        }
        for unknown in [0, 14, 15, 19] {
            let found = checked(unknown).expect_err("unknown");
            assert_eq!(found, format!("a value of unknown type {unknown} of tag 256"));
        }
    }
}
