//! Reads the pages of a TIFF file as numbers, whatever colours they stand for.
//!
//! The decoder inverts pages whose smallest number is white (of floats it makes 1 - v), and rejects pages with a colour table.
//! Here the samples are the numbers that are stored: the value of both interpretations is replaced by that of
//! "black is zero" while it is read. So are tags of tiles, where a writer before TIFF 6.0 has used those of strips.

use std::io::{self, Read, Seek, SeekFrom};

/// The values of the tag PhotometricInterpretation that are replaced, and the one in their place.
const WHITE_IS_ZERO: u64 = 0;
const PALETTE: u64 = 3;
pub(super) const BLACK_IS_ZERO: u8 = 1;

/// Whether pages of a value of PhotometricInterpretation are read as "black is zero".
pub(super) fn is_replaced(value: u64) -> bool {
    matches!(value, WHITE_IS_ZERO | PALETTE)
}

/// A byte of a file and the one in its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Replaced {
    /// Offset in the file.
    pub(super) place: u64,
    pub(super) by: u8,
}

/// A reader that replaces bytes.
pub(super) struct AsStored<R> {
    reader: R,
    at: u64,
    /// Ascending by their places.
    replaced: Vec<Replaced>,
}

impl<R: Read + Seek> AsStored<R> {
    /// A reader from the start of a file on; `replaced` in any order.
    pub(super) fn new(mut reader: R, mut replaced: Vec<Replaced>) -> io::Result<Self> {
        reader.seek(SeekFrom::Start(0))?;
        replaced.sort_unstable();
        Ok(AsStored { reader, at: 0, replaced })
    }
}

impl<R: Read> Read for AsStored<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.reader.read(buffer)?;
        let end = self.at + n as u64;
        let first = self.replaced.partition_point(|byte| byte.place < self.at);
        for byte in self.replaced[first..].iter().take_while(|byte| byte.place < end) {
            buffer[(byte.place - self.at) as usize] = byte.by;
        }
        self.at = end;
        Ok(n)
    }
}

impl<R: Seek> Seek for AsStored<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.reader.seek(to)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaced_bytes_are_found_wherever_reads_begin_and_end() {
        let bytes = [9u8; 10];
        for (from, n) in [(0, 10), (2, 1), (3, 4), (6, 4), (7, 3), (4, 2)] {
            let replaced = [6, 2].map(|place| Replaced { place, by: BLACK_IS_ZERO }).to_vec();
            let mut reader = AsStored::new(io::Cursor::new(bytes), replaced).expect("in memory");
            reader.seek(SeekFrom::Start(from)).expect("inside");
            let mut found = vec![0; n];
            reader.read_exact(&mut found).expect("inside");
            let expected = (from..from + n as u64).map(|i| if i == 2 || i == 6 { 1 } else { 9 });
            assert_eq!(found, expected.collect::<Vec<u8>>(), "from {from}");
        }
    }
}
