//! The description of a spectrum file, from its first sections: it takes milliseconds, whatever the size of the file.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::header::{HEADER_LENGTH, MAX_INFO, after_header, in_section, read_info};
use super::section::{self, Section, split_section, stored_length};
use super::tables;
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{Patch, Size, Spectrum};

/// The sections that are skipped.
const SKIPPED: [[u8; 4]; 5] = [*b"ISOV", *b"VERT", *b"TRIA", *b"POSN", *b"COLL"];

/// The description of the spectrum in a file, without its geometry.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Summary {
    /// The description as a spectrum without triangles.
    pub spectrum: Spectrum,
    /// The size of the spectrum in the file.
    pub size: Size,
    /// Bytes of the file.
    pub bytes: u64,
}

impl Summary {
    /// The summary of a spectrum that was read completely from a file of so many bytes.
    pub fn of(spectrum: Spectrum, bytes: u64) -> Summary {
        Summary { size: Size::of(&spectrum), spectrum, bytes }
    }

    /// Reads the first sections of a file. Of the other sections only the lengths are checked, not the checksums.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] if it is not a spectrum file, or the sections that are read are damaged.
    pub fn read(path: &Path) -> Result<Summary> {
        let (mut file, length) = input::open(path)?;
        Summary::from_reader(&mut file, length).map_err(|e| e.of_file(path))
    }

    /// As [`Summary::read`], from the start of a reader with the length of the file.
    ///
    /// # Errors
    ///
    /// [`Error::Input`], also if reading fails.
    pub fn from_reader(file: &mut (impl Read + Seek), length: u64) -> Result<Summary> {
        let mut rest = Rest { file, left: length };
        after_header(&rest.take(length.min(HEADER_LENGTH as u64))?)?;
        let stored = rest.section(*b"INFO", MAX_INFO as u64)?;
        let info = read_info(&whole_section(&stored, *b"INFO")?)?;
        let stored = rest.section(*b"EVNT", u64::MAX)?;
        let events = whole_section(&stored, *b"EVNT")?.content()?;
        let events = tables::read_events(&events).map_err(in_section("EVNT"))?;
        for tag in SKIPPED {
            rest.skip(tag)?;
        }
        rest.end()?;
        let size = info.size;
        let about = info.into_about(events);
        let none = Patch { first_knot: vec![0], ..Patch::default() };
        Ok(Summary { spectrum: Spectrum::new(about, none)?, size, bytes: length })
    }
}

/// The unread rest of a file.
struct Rest<'a, F> {
    file: &'a mut F,
    left: u64,
}

impl<F: Read + Seek> Rest<'_, F> {
    /// The next `n` bytes; there must be as many.
    fn take(&mut self, n: u64) -> Result<Vec<u8>> {
        let unread = |what: String| Error::input(format!("{n} bytes cannot be read: {what}"));
        let mut bytes = Vec::new();
        let length = usize::try_from(n).map_err(|e| unread(e.to_string()))?;
        bytes.try_reserve_exact(length).map_err(|e| unread(e.to_string()))?;
        let read = self.file.by_ref().take(n).read_to_end(&mut bytes);
        if read.map_err(|e| unread(e.to_string()))? < length {
            return Err(unread("the file has become shorter".to_owned()));
        }
        self.left -= n;
        Ok(bytes)
    }

    /// The header of the next section, and the number of stored bytes.
    fn section_header(&mut self, tag: [u8; 4]) -> Result<(Vec<u8>, u64)> {
        let truncated = || section::truncated(tag);
        let n = section::HEADER_LENGTH as u64;
        if self.left < n {
            return Err(truncated());
        }
        let header = self.take(n)?;
        let length = stored_length(&header, tag)?;
        if length > self.left { Err(truncated()) } else { Ok((header, length)) }
    }

    /// A section with its header, of at most `max` stored bytes.
    fn section(&mut self, tag: [u8; 4], max: u64) -> Result<Vec<u8>> {
        let (mut section, length) = self.section_header(tag)?;
        if length > max {
            let name = tag.escape_ascii();
            return Err(Error::input(format!(
                "section {name}: {length} bytes, expected at most {max}"
            )));
        }
        section.extend(self.take(length)?);
        Ok(section)
    }

    /// Skips a section.
    fn skip(&mut self, tag: [u8; 4]) -> Result<()> {
        let (_, length) = self.section_header(tag)?;
        let unread = |e: std::io::Error| Error::input(format!("cannot be skipped: {e}"));
        let by = i64::try_from(length).map_err(|_| section::truncated(tag))?;
        self.file.seek(SeekFrom::Current(by)).map_err(unread)?;
        self.left -= length;
        Ok(())
    }

    fn end(&self) -> Result<()> {
        if self.left == 0 { Ok(()) } else { Err(section::trailing_bytes(self.left)) }
    }
}

/// The section that consists of these bytes.
fn whole_section(mut stored: &[u8], tag: [u8; 4]) -> Result<Section<'_>> {
    split_section(&mut stored, tag)
}
