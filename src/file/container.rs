//! The spectrum file as a container: a header, the chunks, tables that describe the whole, and a footer that says where these begin.
//!
//! # Invariants
//!
//! The positions of chunks follow from their lengths, which add up to what is before the tables: none overlaps another, and every byte of a file
//! belongs to something with a checksum.

use std::io::{self, Write};
use std::ops::Range;

use super::column::Content;
use super::decode::UNUSED_PER_BYTE;
use super::encode::ChunkContents;
use super::header::{HEADER_LENGTH, after_header, header, in_section, read_info};
use super::index::{ChunkSize, Index};
use super::seam::write_seam;
use super::section::{
    MAX_NUMBERS_PER_BYTE_OF_CHUNK, Packing, split_section, trailing_bytes, write_section,
};
use super::source::Source;
use super::tables;
use super::tree::Tree;
use crate::error::{Error, Result};
use crate::spectrum::{About, Collapse, Size};

/// The last bytes of a file.
const END: [u8; 4] = *b"ISPE";

/// Bytes after the tables: their position (u64), the checksum of the position, and [`END`].
const FOOTER_LENGTH: usize = 16;

/// The contents of the tables of a file.
pub(super) struct TableContents {
    pub(super) info: Content<'static>,
    pub(super) events: Content<'static>,
    pub(super) isovalues: Content<'static>,
    pub(super) collapses: Content<'static>,
}

/// A chunk as it is stored.
pub(super) struct PackedChunk {
    bytes: Vec<u8>,
    pub(super) size: ChunkSize,
}

impl PackedChunk {
    /// Packs the contents of a chunk; in a file with several trees with its shared vertices and their keys.
    pub(super) fn new(contents: ChunkContents, shared: Option<&[(u32, u64)]>) -> Self {
        let ChunkContents { sections: [ranks, triangles, positions], size, n_unused } = contents;
        let min = least_bytes([&ranks, &triangles, &positions], n_unused);
        let mut bytes = Vec::new();
        for (tag, content, min) in
            [(*b"VERT", ranks, min), (*b"TRIA", triangles, 0), (*b"POSN", positions, 0)]
        {
            write_section(&mut bytes, tag, &content, Packing::Deflated, min);
        }
        if let Some(shared) = shared {
            let content = Content::Plain(write_seam(shared).into());
            write_section(&mut bytes, *b"SEAM", &content, Packing::Deflated, 0);
        }
        let (n_bytes, crc) = (bytes.len() as u64, crc32fast::hash(&bytes));
        PackedChunk { bytes, size: ChunkSize { bytes: n_bytes, crc, ..size } }
    }
}

/// Writes a file: tree after tree, then the tables.
pub(super) struct ContainerWriter<'a> {
    out: &'a mut dyn Write,
    /// Bytes written.
    position: u64,
    index: Index,
}

impl<'a> ContainerWriter<'a> {
    /// Writes the header.
    pub(super) fn new(out: &'a mut dyn Write) -> io::Result<Self> {
        let mut writer = ContainerWriter { out, position: 0, index: Index::default() };
        writer.write(&header())?;
        Ok(writer)
    }

    /// Appends a tree.
    pub(super) fn push(&mut self, tree: Tree, chunks: Vec<PackedChunk>) -> io::Result<()> {
        let sizes = chunks.iter().map(|chunk| chunk.size).collect();
        for chunk in chunks {
            self.write(&chunk.bytes)?;
        }
        self.index.push(tree, sizes);
        Ok(())
    }

    /// Writes the tables and the footer.
    pub(super) fn end(mut self, tables: &TableContents) -> io::Result<()> {
        let mut end = Vec::new();
        write_section(&mut end, *b"INFO", &tables.info, Packing::Raw, 0);
        for (tag, content) in [
            (*b"EVNT", &tables.events),
            (*b"ISOV", &tables.isovalues),
            (*b"COLL", &tables.collapses),
        ] {
            write_section(&mut end, tag, content, Packing::Deflated, 0);
        }
        write_end(&mut end, &self.index, self.position);
        self.write(&end)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.position += bytes.len() as u64;
        self.out.write_all(bytes)
    }
}

/// Appends the index, and the footer of tables that begin at `position`.
pub(super) fn write_end(file: &mut Vec<u8>, index: &Index, position: u64) {
    let index = Content::Plain(index.write().into());
    write_section(file, *b"INDX", &index, Packing::Deflated, 0);
    let position = position.to_le_bytes();
    file.extend(position);
    file.extend(crc32fast::hash(&position).to_le_bytes());
    file.extend(END);
}

/// The least number of stored bytes of section `VERT`: a reader refuses more numbers than the sections of a chunk have room for, and more vertices
/// without a triangle than `VERT` and `POSN` have.
fn least_bytes(sections: [&Content; 3], n_unused: usize) -> usize {
    let numbers: usize = sections.iter().map(|section| section.n_numbers()).sum();
    let [_, triangles, positions] = sections.map(|section| section.bytes().len());
    let for_numbers = numbers.div_ceil(MAX_NUMBERS_PER_BYTE_OF_CHUNK);
    let for_unused = n_unused.div_ceil(UNUSED_PER_BYTE);
    for_numbers.saturating_sub(triangles + positions).max(for_unused.saturating_sub(positions))
}

/// The tables of a file.
pub(super) struct FileTables {
    pub(super) about: About,
    pub(super) size: Size,
    /// By tree.
    pub(super) isovalues: Vec<Vec<f64>>,
    pub(super) collapses: Vec<Collapse>,
    pub(super) index: Index,
    /// The bytes of each chunk in the file.
    pub(super) places: Vec<Range<u64>>,
}

impl FileTables {
    /// Reads the tables, but no chunk.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if it is not a spectrum file, or the tables are damaged.
    pub(super) fn read(source: &dyn Source) -> Result<Self> {
        let n = source.n_bytes();
        let head = n.min(HEADER_LENGTH as u64);
        after_header(&source.bytes(0, head)?)?;
        let position = position(source)?;
        let tables = source.bytes(position, n - FOOTER_LENGTH as u64 - position)?;
        let mut rest = &*tables;
        let info = split_section(&mut rest, *b"INFO")?;
        info.check_coded(false)?;
        let info = read_info(&info)?;
        let mut next = |tag: &[u8; 4]| {
            let section = split_section(&mut rest, *tag)?;
            section.check_coded(false)?;
            section.content()
        };
        let events = tables::read_events(&next(b"EVNT")?).map_err(in_section("EVNT"))?;
        let isovalues = tables::read_isovalues(&next(b"ISOV")?).map_err(in_section("ISOV"))?;
        let n_ranks = |isovalues: &Vec<f64>| {
            let n = u32::try_from(isovalues.len()).ok().filter(|&n| n < u32::MAX);
            n.ok_or_else(|| Error::input("more isovalues than ranks"))
        };
        let n_ranks = isovalues.iter().map(n_ranks).collect::<Result<Vec<u32>>>()?;
        let collapses = tables::read_collapses(&next(b"COLL")?).map_err(in_section("COLL"))?;
        let index = Index::read(&next(b"INDX")?, &n_ranks).map_err(in_section("INDX"))?;
        if !rest.is_empty() {
            return Err(trailing_bytes(rest.len() as u64));
        }
        if index.n_trees() > 1 && !collapses.is_empty() {
            let (n, n_trees) = (collapses.len(), index.n_trees());
            return Err(Error::input(format!(
                "section COLL: {n} collapses of {n_trees} trees, expected one tree"
            )));
        }
        let places = places(index.sizes(), position)?;
        check_size(&info.size, &size_of(index.sizes(), &info.size))?;
        let (size, about) = (info.size, info.into_about(events));
        Ok(FileTables { about, size, isovalues, collapses, index, places })
    }
}

/// The position of the tables, from the footer.
fn position(source: &dyn Source) -> Result<u64> {
    let n = source.n_bytes();
    let truncated = || Error::input("the file ends too early, or other bytes follow its end");
    let at = n.checked_sub(FOOTER_LENGTH as u64).filter(|&at| at >= HEADER_LENGTH as u64);
    let at = at.ok_or_else(truncated)?;
    let footer = source.bytes(at, FOOTER_LENGTH as u64)?;
    let (position, rest) = footer.split_first_chunk::<8>().ok_or_else(truncated)?;
    if rest[4..] != END {
        return Err(truncated());
    }
    let crc = crc32fast::hash(position).to_le_bytes();
    let position = u64::from_le_bytes(*position);
    if rest[..4] != crc || !(HEADER_LENGTH as u64..=at).contains(&position) {
        return Err(Error::input("the end of the file is damaged: its checksum is wrong"));
    }
    Ok(position)
}

/// The bytes of chunks that end where the tables begin.
fn places(sizes: &[ChunkSize], end: u64) -> Result<Vec<Range<u64>>> {
    let mut at = HEADER_LENGTH as u64;
    let mut places = Vec::with_capacity(sizes.len());
    for size in sizes {
        let next = at.checked_add(size.bytes).filter(|&next| next <= end);
        let next = next.ok_or_else(|| Error::input("section INDX: chunks beyond the tables"))?;
        places.push(at..next);
        at = next;
    }
    if at == end {
        return Ok(places);
    }
    Err(Error::input(format!("section INDX: {} bytes are in no chunk", end - at)))
}

/// A size with the sums of what the chunks contain; what the index does not say is as declared.
fn size_of(sizes: &[ChunkSize], declared: &Size) -> Size {
    let sum = |of: fn(&ChunkSize) -> u64| sizes.iter().map(of).fold(0, u64::saturating_add);
    let trajectories = sum(|size| size.vertices - size.repeated);
    let knots = sum(|size| size.knots - 2 * size.repeated);
    Size { trajectories, knots, triangles: sum(|size| size.triangles), ..*declared }
}

/// Checks that the declared size is that of the content.
pub(super) fn check_size(declared: &Size, found: &Size) -> Result<()> {
    let mut pairs = declared.named().into_iter().zip(found.named());
    match pairs.find(|(declared, found)| declared != found) {
        None => Ok(()),
        Some(((what, declared), (_, found))) => {
            Err(Error::input(format!("section INFO: {declared} {what}, found {found}")))
        }
    }
}
