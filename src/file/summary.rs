//! What a spectrum file tells in its first sections, and no more is read: milliseconds, whatever is behind them.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::section::{self, Section, cut_section, stored_length};
use super::{
    HEAD, Info, LAST_WITHOUT_SIZE, LONGEST_INFO, after_head, from_bytes, read_info, tables, within,
};
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{About, Patch, Size, Spectrum, Told, VolumeInfo};

/// The sections that are passed over.
const PASSED_OVER: [[u8; 4]; 5] = [*b"ISOV", *b"VERT", *b"TRIA", *b"POSN", *b"COLL"];

/// What is known of a spectrum in a file without its geometry.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Summary {
    /// A spectrum without triangles, which has the events and all that is known of the whole.
    pub told: Spectrum,
    /// How much the file holds.
    pub size: Size,
    /// Bytes of the file.
    pub bytes: u64,
}

impl Summary {
    /// What is known of a spectrum that was read whole from a file of so many bytes.
    pub fn of(spectrum: Spectrum, bytes: u64) -> Summary {
        Summary { size: Size::of(&spectrum), told: spectrum, bytes }
    }

    /// Reads what a file tells. Of what is passed over the lengths are checked, not the checksums. Files before version 5, which tell no
    /// size, are read whole.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] if it is not a spectrum file, or what is read is damaged.
    pub fn read(path: &Path) -> Result<Summary> {
        let (mut file, length) = input::open(path)?;
        Summary::from_reader(&mut file, length).map_err(|e| e.of_file(path))
    }

    /// As [`Summary::read`], of a file of a length that is read from its beginning.
    ///
    /// # Errors
    ///
    /// [`Error::Input`], also where reading fails.
    pub fn from_reader(file: &mut (impl Read + Seek), length: u64) -> Result<Summary> {
        let mut rest = Rest { file, left: length };
        let head = rest.take(length.min(HEAD as u64))?;
        let (version, _) = after_head(&head)?;
        if version <= LAST_WITHOUT_SIZE {
            let bytes = [head, rest.take(rest.left)?].concat();
            return Ok(Summary::of(from_bytes(&bytes)?, length));
        }
        let stored = rest.section(*b"INFO", LONGEST_INFO as u64)?;
        let info: Info<VolumeInfo, Told> = read_info(&cut(&stored, *b"INFO")?)?;
        let stored = rest.section(*b"EVNT", u64::MAX)?;
        let events = cut(&stored, *b"EVNT")?.content()?;
        let events = tables::read_events(&events).map_err(within("EVNT"))?;
        for tag in PASSED_OVER {
            rest.pass_over(tag)?;
        }
        rest.end()?;
        let size = info.size.ok_or_else(|| Error::input("section INFO: no size"))?;
        let about = About {
            parameters: info.parameters,
            events,
            ..About::new(info.volume, info.range, info.tolerance)
        };
        let none = Patch { first_knot: vec![0], ..Patch::default() };
        Ok(Summary { told: Spectrum::new(about, none)?, size, bytes: length })
    }
}

/// What is left of a file.
struct Rest<'a, F> {
    file: &'a mut F,
    left: u64,
}

impl<F: Read + Seek> Rest<'_, F> {
    /// The next bytes, no more than are left.
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

    /// The head of the next section, and how many bytes are stored behind it.
    fn section_head(&mut self, tag: [u8; 4]) -> Result<(Vec<u8>, u64)> {
        let truncated = || section::truncated(tag);
        let n = section::HEAD as u64;
        if self.left < n {
            return Err(truncated());
        }
        let head = self.take(n)?;
        let length = stored_length(&head, tag)?;
        if length > self.left { Err(truncated()) } else { Ok((head, length)) }
    }

    /// A section with its head, of at most so many stored bytes.
    fn section(&mut self, tag: [u8; 4], most: u64) -> Result<Vec<u8>> {
        let (mut section, length) = self.section_head(tag)?;
        if length > most {
            let name = tag.escape_ascii();
            return Err(Error::input(format!(
                "section {name}: {length} bytes, expected at most {most}"
            )));
        }
        section.extend(self.take(length)?);
        Ok(section)
    }

    /// Goes on behind a section.
    fn pass_over(&mut self, tag: [u8; 4]) -> Result<()> {
        let (_, length) = self.section_head(tag)?;
        let unread = |e: std::io::Error| Error::input(format!("cannot be passed over: {e}"));
        let by = i64::try_from(length).map_err(|_| section::truncated(tag))?;
        self.file.seek(SeekFrom::Current(by)).map_err(unread)?;
        self.left -= length;
        Ok(())
    }

    fn end(&self) -> Result<()> {
        if self.left == 0 { Ok(()) } else { Err(section::left_over(self.left)) }
    }
}

/// The section that these bytes are.
fn cut(mut stored: &[u8], tag: [u8; 4]) -> Result<Section<'_>> {
    cut_section(&mut stored, tag)
}
