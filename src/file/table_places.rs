//! Where the tables of a file are, for a reader that fetches them by position: a page that is linked to the file.

use std::io::{Read as _, Seek as _, SeekFrom};
use std::ops::Range;
use std::path::Path;

use super::section::HEADER_LENGTH;
use crate::error::{Error, Result};
use crate::input;

/// The last bytes of a file, which begin with the position of the tables.
const FOOTER_LENGTH: u64 = 16;

/// The places of the tables of a file that a page needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TablePlaces {
    /// The bytes of section `INFO`.
    pub(crate) info: Range<u64>,
    /// From section `ISOV` to the end of the file; the index is among them. Events before them can take megabytes.
    pub(crate) rest: Range<u64>,
    /// The checksum of section `INDX`, which has those of all chunks: no other spectrum has the same.
    pub(crate) index_crc: u32,
}

impl TablePlaces {
    /// The places in a file whose tables were read.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] if the file has changed since.
    pub(crate) fn read(path: &Path) -> Result<TablePlaces> {
        let (mut file, n_bytes) = input::open(path)?;
        let mut bytes = |place: Range<u64>| {
            let mut bytes = Vec::new();
            let n = place.end.saturating_sub(place.start);
            let read = file.seek(SeekFrom::Start(place.start));
            let read = read.and_then(|_| file.by_ref().take(n).read_to_end(&mut bytes));
            read.map_err(|e| Error::io(path, e)).map(|_| bytes)
        };
        let end = n_bytes.saturating_sub(FOOTER_LENGTH);
        let footer = bytes(end..n_bytes)?;
        let start = footer.first_chunk().map_or(0, |start| u64::from_le_bytes(*start));
        let tables = bytes(start.min(end)..end)?;
        places(&tables, start)
            .map(|places| TablePlaces { rest: places.rest.start..n_bytes, ..places })
            .ok_or_else(|| Error::input(format!("{}: changed while it was read", path.display())))
    }
}

/// The places of tables that begin at a position.
fn places(tables: &[u8], start: u64) -> Option<TablePlaces> {
    let (mut info, mut isovalues, mut index_crc) = (None, None, None);
    let mut at = 0;
    while at < tables.len() {
        let head = tables.get(at..at + HEADER_LENGTH)?;
        let length = u64::from_le_bytes(head[8..16].try_into().ok()?);
        let end = (at + HEADER_LENGTH).checked_add(usize::try_from(length).ok()?)?;
        match &head[..4] {
            b"INFO" => info = Some(start + at as u64..start + end as u64),
            b"ISOV" => isovalues = Some(start + at as u64),
            b"INDX" => index_crc = Some(u32::from_le_bytes(head[24..28].try_into().ok()?)),
            _ => {}
        }
        at = end;
    }
    let rest = isovalues?..start + tables.len() as u64;
    Some(TablePlaces { info: info?, rest, index_crc: index_crc? })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A section of so many stored bytes.
    fn section(tag: &[u8; 4], n: usize, crc: u32) -> Vec<u8> {
        let mut bytes = tag.to_vec();
        bytes.extend(0u32.to_le_bytes());
        (0..2).for_each(|_| bytes.extend((n as u64).to_le_bytes()));
        bytes.extend(crc.to_le_bytes());
        bytes.resize(bytes.len() + n, 7);
        bytes
    }

    #[test]
    fn the_places_are_those_of_the_sections_whatever_is_between_them() {
        let sections =
            [(b"INFO", 5, 1), (b"EVNT", 40, 2), (b"ISOV", 3, 3), (b"COLL", 0, 4), (b"INDX", 9, 5)];
        let tables: Vec<u8> =
            sections.iter().flat_map(|&(tag, n, crc)| section(tag, n, crc)).collect();
        let found = places(&tables, 1000).expect("all are there");
        assert_eq!(found, TablePlaces { info: 1000..1033, rest: 1101..1197, index_crc: 5 });
        // A section is missing, or ends beyond the tables.
        assert_eq!(places(&tables[..160], 1000), None);
        assert_eq!(places(&tables[..tables.len() - 37], 1000), None);
        assert_eq!(places(&tables[..190], 1000).map(|places| places.index_crc), Some(5));
    }
}
