//! Sections: parts of a file with their own length and checksum.
//!
//! Sections follow one another in a fixed order. A file contains no offsets, so
//! nothing can point outside it.
//!
//! # Invariants
//!
//! A section is unpacked to at most [`MAX_RATIO`] times its stored length, so a small file
//! cannot use much memory; a section that deflates better than that is stored uncompressed.
//! All sections are split off before the first is unpacked, so that the declared sizes can be compared first.

use std::borrow::Cow;
use std::io::{Read as _, Write as _};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;

use super::column::Content;
use crate::error::{Error, Result};

/// Bytes of the header of a section.
pub(super) const HEADER_LENGTH: usize = 28;

/// Most unpacked bytes per stored byte.
const MAX_RATIO: usize = 64;

/// The content is uncompressed.
const METHOD_RAW: u32 = 0;

/// The content is a zlib stream.
const METHOD_ZLIB: u32 = 1;

/// The content is coded columns.
const METHOD_CODED: u32 = 2;

/// Most numbers of coded columns per stored byte of a section, and of the sections of a chunk together.
const MAX_NUMBERS_PER_BYTE: usize = 64;
pub(super) const MAX_NUMBERS_PER_BYTE_OF_CHUNK: usize = 16;

/// How a section of plain content is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    /// Uncompressed, so that it is readable.
    Raw,
    /// Deflated, level 6.
    Deflated,
}

/// Appends a section to a file. It has at least `min` stored bytes, unless its content is plain and shorter.
pub(super) fn write_section(
    file: &mut Vec<u8>,
    tag: [u8; 4],
    content: &Content,
    packing: Packing,
    min: usize,
) {
    let (method, stored, length) = match content {
        Content::Plain(content) => stored_plain(content, packing, min),
        Content::Coded { bytes, n_numbers } => {
            let mut stored = bytes.to_vec();
            stored.resize(stored.len().max(min).max(n_numbers.div_ceil(MAX_NUMBERS_PER_BYTE)), 0);
            (METHOD_CODED, stored.into(), *n_numbers)
        }
    };
    let head = file.len();
    file.extend(tag);
    file.extend(method.to_le_bytes());
    file.extend((stored.len() as u64).to_le_bytes());
    file.extend((length as u64).to_le_bytes());
    let mut crc = crc32fast::Hasher::new();
    crc.update(&file[head..]);
    crc.update(&stored);
    file.extend(crc.finalize().to_le_bytes());
    file.extend(&*stored);
}

/// The packing, the stored bytes, and the length of plain content.
fn stored_plain(content: &[u8], packing: Packing, min: usize) -> (u32, Cow<'_, [u8]>, usize) {
    let deflated = (packing == Packing::Deflated).then(|| deflate(content));
    let worthwhile = |d: &Vec<u8>| {
        (min..content.len()).contains(&d.len())
            && content.len() <= d.len().saturating_mul(MAX_RATIO)
    };
    match deflated.filter(worthwhile) {
        Some(deflated) => (METHOD_ZLIB, deflated.into(), content.len()),
        None => (METHOD_RAW, content.into(), content.len()),
    }
}

/// A section that is split off and not unpacked yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section<'a> {
    tag: [u8; 4],
    method: u32,
    stored: &'a [u8],
    /// The declared length of the content, or the number of numbers in coded columns.
    declared: usize,
}

/// The error for a file that ends inside a section.
pub(super) fn truncated(tag: [u8; 4]) -> Error {
    Error::input(format!("the file ends inside section {}", tag.escape_ascii()))
}

/// The error for bytes after the last section.
pub(super) fn trailing_bytes(n: u64) -> Error {
    Error::input(format!("{n} bytes after the last section"))
}

/// The number of stored bytes, from the header of the section `tag`. The checksum is not checked.
///
/// # Errors
///
/// [`Error::Input`] if it is the header of another section.
pub(super) fn stored_length(head: &[u8], tag: [u8; 4]) -> Result<u64> {
    let (found, rest) = head.split_first_chunk::<4>().ok_or_else(|| truncated(tag))?;
    if *found != tag {
        let (found, expected) = (found.escape_ascii(), tag.escape_ascii());
        return Err(Error::input(format!("section '{found}', expected '{expected}'")));
    }
    let length = rest.get(4..).and_then(|rest| rest.first_chunk::<8>());
    Ok(u64::from_le_bytes(*length.ok_or_else(|| truncated(tag))?))
}

/// Splits the section `tag` off the front of `file`.
///
/// # Errors
///
/// [`Error::Input`] if there is another section, the file ends too early, its checksum is wrong, or it declares more
/// than its length allows.
pub(super) fn split_section<'a>(file: &mut &'a [u8], tag: [u8; 4]) -> Result<Section<'a>> {
    let name = String::from_utf8_lossy(&tag).into_owned();
    let truncated = || truncated(tag);
    let (head, rest) = file.split_at_checked(HEADER_LENGTH).ok_or_else(truncated)?;
    stored_length(head, tag)?;
    let number = |at: usize| u32::from_le_bytes(head[at..at + 4].try_into().expect("four bytes"));
    let length = |at: usize| {
        let length = u64::from_le_bytes(head[at..at + 8].try_into().expect("eight bytes"));
        usize::try_from(length).map_err(|_| truncated())
    };
    let (stored, rest) = rest.split_at_checked(length(8)?).ok_or_else(truncated)?;
    let mut crc = crc32fast::Hasher::new();
    crc.update(&head[..24]);
    crc.update(stored);
    if crc.finalize() != number(24) {
        return Err(Error::input(format!("section {name} is damaged: its checksum is wrong")));
    }
    *file = rest;
    let (method, declared) = (number(4), length(16)?);
    match method {
        METHOD_RAW if declared == stored.len() => {}
        METHOD_ZLIB if declared <= stored.len().saturating_mul(MAX_RATIO) => {}
        METHOD_CODED if declared <= stored.len().saturating_mul(MAX_NUMBERS_PER_BYTE) => {}
        METHOD_RAW | METHOD_ZLIB | METHOD_CODED => {
            return Err(Error::input(format!(
                "section {name}: {} bytes cannot hold {declared}",
                stored.len()
            )));
        }
        _ => {
            return Err(Error::input(format!("section {name}: packing {method}, expected 0 to 2")));
        }
    }
    Ok(Section { tag, method, stored, declared })
}

impl<'a> Section<'a> {
    /// Bytes in the file, without the header.
    pub(super) fn n_stored(&self) -> usize {
        self.stored.len()
    }

    /// Bytes of the unpacked content, or numbers in coded columns.
    pub(super) fn n_content(&self) -> usize {
        self.declared
    }

    /// Whether the content is uncompressed.
    pub(super) fn is_plain(&self) -> bool {
        self.method == METHOD_RAW
    }

    /// Checks whether the content is coded columns as `expected`.
    pub(super) fn check_coded(&self, expected: bool) -> Result<()> {
        if (self.method == METHOD_CODED) == expected {
            return Ok(());
        }
        let (tag, method) = (self.tag.escape_ascii(), self.method);
        let expected = if expected { "2" } else { "0 or 1" };
        Err(Error::input(format!("section {tag}: packing {method}, expected {expected}")))
    }

    /// The count at the front of the content; none if the content is shorter.
    pub(super) fn first_count(&self) -> Option<u64> {
        let mut count = [0; 8];
        let read = match self.method {
            METHOD_CODED => {
                return self.content().ok()?.columns().count().ok().map(|n| n as u64);
            }
            METHOD_RAW => (&mut { self.stored }).read_exact(&mut count),
            _ => ZlibDecoder::new(self.stored).read_exact(&mut count),
        };
        read.ok().map(|()| u64::from_le_bytes(count))
    }

    /// Unpacks the section. Coded columns are decoded later.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the stored bytes do not unpack to exactly the declared length.
    pub(super) fn content(&self) -> Result<Content<'a>> {
        match self.method {
            METHOD_CODED => {
                Ok(Content::Coded { bytes: self.stored.into(), n_numbers: self.declared })
            }
            METHOD_RAW => Ok(Content::Plain(self.stored.into())),
            _ => {
                let content = inflate(self.stored, self.declared);
                let name = String::from_utf8_lossy(&self.tag);
                let error = |what| Error::input(format!("section {name}: {what}"));
                content.map(|content| Content::Plain(content.into())).map_err(error)
            }
        }
    }
}

pub(super) fn deflate(content: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
    encoder.write_all(content).and_then(|()| encoder.finish()).expect("memory takes every byte")
}

/// Unpacks exactly `expected` bytes from exactly `stored`.
pub(super) fn inflate(stored: &[u8], expected: usize) -> std::result::Result<Vec<u8>, String> {
    let mut content = Vec::with_capacity(expected);
    let mut decoder = ZlibDecoder::new(stored);
    // One byte more than expected, so that the end of the stream and its checksum are read.
    let limit = expected as u64 + 1;
    decoder.by_ref().take(limit).read_to_end(&mut content).map_err(|e| e.to_string())?;
    if content.len() != expected || decoder.total_in() != stored.len() as u64 {
        return Err(format!(
            "{} bytes unpack to {} or more, expected {expected}",
            stored.len(),
            content.len()
        ));
    }
    Ok(content)
}
