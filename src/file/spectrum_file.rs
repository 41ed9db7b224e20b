//! The spectrum file as a whole: its sections in order.

use std::path::Path;

use super::column::Content;
use super::geometry::{self, Tables};
use super::header::{MAX_INFO, after_header, header, in_section, read_info};
use super::parts::Parts;
use super::section::{Packing, Section, split_section, trailing_bytes, write_section};
use super::units::Units;
use super::{tables, trajectories, triangles};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{Patch, Size, Spectrum};

/// The number of vertices without a triangle is at most this plus the stored bytes of section `VERT`. Without a limit a small
/// file could have millions of them.
const FREE_UNUSED_VERTICES: usize = 4096;

/// Writes a spectrum to `path`: to a temporary file in the same folder, which is then renamed.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn write(spectrum: &Spectrum, path: impl AsRef<Path>) -> Result<()> {
    let bytes = to_bytes(spectrum)?;
    write_atomically(path.as_ref(), |writer| writer.write_all(&bytes))
}

/// Reads a spectrum. The file may be from an untrusted source.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if it is not a spectrum file, is damaged, or does not pass
/// [`Spectrum::check`].
pub fn read(path: impl AsRef<Path>) -> Result<Spectrum> {
    let path = path.as_ref();
    from_bytes(&input::read(path)?).map_err(|e| e.of_file(path))
}

/// The spectrum with vertices and triangles in the order of a file. Writing and reading a spectrum changes nothing but this order and
/// the precision of positions ([`Spectrum::quantised`]); both are idempotent.
///
/// # Errors
///
/// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn in_file_order(spectrum: &Spectrum) -> Result<Spectrum> {
    spectrum.check()?;
    let units = Units::of_file(spectrum.tolerance());
    Ok(triangles::arranged(spectrum.clone(), units).spectrum)
}

/// The bytes of the file of a spectrum. [`from_bytes`] returns the spectrum as changed by
/// [`Spectrum::quantised`] and [`in_file_order`], exactly; its file has the same bytes again.
///
/// # Errors
///
/// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn to_bytes(spectrum: &Spectrum) -> Result<Vec<u8>> {
    into_bytes(spectrum.clone()).map(|written| written.bytes)
}

/// The bytes of a file, with the spectrum in it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Written {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// The spectrum, in the order of the file. Its positions are not rounded.
    pub spectrum: Spectrum,
    /// By vertex of the file, its number in the original spectrum.
    pub order: Vec<u32>,
}

/// As [`to_bytes`], but consumes the spectrum, which takes less memory.
///
/// # Errors
///
/// As [`to_bytes`].
pub fn into_bytes(spectrum: Spectrum) -> Result<Written> {
    let units = Units::of_file(spectrum.tolerance());
    let Parts { spectrum, order, sections } = Parts::new(spectrum, units)?;
    let [info, isovalues, ranks, triangles, positions] = sections;
    if info.bytes().len() > MAX_INFO {
        return Err(Error::input(format!(
            "the description of the spectrum takes {} bytes, expected at most {MAX_INFO}",
            info.bytes().len()
        )));
    }
    let mut file = header();
    write_section(&mut file, *b"INFO", &info, Packing::Raw, 0);
    for (tag, content) in [
        (*b"EVNT", Content::Plain(tables::write_events(spectrum.events()).into())),
        (*b"ISOV", isovalues),
        (*b"VERT", ranks),
        (*b"TRIA", triangles),
        (*b"POSN", positions),
        (*b"COLL", Content::Plain(tables::write_collapses(spectrum.collapses()).into())),
    ] {
        // A reader refuses more vertices without a triangle than the section has bytes.
        let min = if tag == *b"VERT" { n_unused(&spectrum) } else { 0 };
        write_section(&mut file, tag, &content, Packing::Deflated, min);
    }
    Ok(Written { bytes: file, spectrum, order })
}

/// The number of vertices without a triangle in a spectrum in the order of a file, where they are the last ones.
fn n_unused(spectrum: &Spectrum) -> usize {
    let corners = spectrum.triangles().iter().flat_map(|triangle| triangle.vertices);
    spectrum.n_vertices() - corners.max().map_or(0, |last| last as usize + 1)
}

/// The spectrum in the bytes of a file.
///
/// # Errors
///
/// [`Error::Input`] if they are not a spectrum file, are damaged, or the spectrum does not pass
/// [`Spectrum::check`].
pub fn from_bytes(bytes: &[u8]) -> Result<Spectrum> {
    let sections = Sections::split(after_header(bytes)?)?;
    let info = read_info(&sections.info)?;
    let events = tables::read_events(&sections.events.content()?).map_err(in_section("EVNT"))?;
    let isovalues =
        tables::read_isovalues(&sections.isovalues.content()?).map_err(in_section("ISOV"))?;
    let max_unused = sections.max_unused()?;
    let content = sections.ranks.content()?;
    let n_isovalues = isovalues.len();
    let ranks =
        trajectories::read_ranks(&content, n_isovalues, max_unused).map_err(in_section("VERT"))?;
    drop(content);
    let content = sections.triangles.content()?;
    let triangles = triangles::read_triangles(&content, &ranks, n_isovalues, max_unused)
        .map_err(in_section("TRIA"))?;
    drop(content);
    let content = sections.positions.content()?;
    let units = Units::of_file(info.tolerance);
    let tables = Tables {
        volume: info.volume(),
        isovalues: &isovalues,
        ranks: &ranks,
        triangles: &triangles,
    };
    let knots = geometry::read_geometry(&content, tables, units).map_err(in_section("POSN"))?;
    drop(content);
    let collapses =
        tables::read_collapses(&sections.collapses.content()?).map_err(in_section("COLL"))?;
    let size = info.size;
    let about = info.into_about(events);
    let first_knot = ranks.first_knot;
    let spectrum =
        Spectrum::new(about, Patch { isovalues, first_knot, knots, triangles, collapses })?;
    check_size(&size, &Size::of(&spectrum))?;
    Ok(spectrum)
}

/// Checks that the declared size is that of the content.
fn check_size(declared: &Size, found: &Size) -> Result<()> {
    let mut pairs = declared.named().into_iter().zip(found.named());
    match pairs.find(|(declared, found)| declared != found) {
        None => Ok(()),
        Some(((what, declared), (_, found))) => {
            Err(Error::input(format!("section INFO: {declared} {what}, found {found}")))
        }
    }
}

/// The sections of a file, not unpacked.
struct Sections<'a> {
    info: Section<'a>,
    events: Section<'a>,
    isovalues: Section<'a>,
    ranks: Section<'a>,
    triangles: Section<'a>,
    positions: Section<'a>,
    collapses: Section<'a>,
}

impl<'a> Sections<'a> {
    /// Splits the bytes after the header of a file.
    fn split(mut rest: &'a [u8]) -> Result<Self> {
        let mut next = |tag: &[u8; 4]| split_section(&mut rest, *tag);
        let (info, events, isovalues) = (next(b"INFO")?, next(b"EVNT")?, next(b"ISOV")?);
        let (ranks, triangles, positions) = (next(b"VERT")?, next(b"TRIA")?, next(b"POSN")?);
        let collapses = next(b"COLL")?;
        for (section, is_coded) in [
            (info, false),
            (events, false),
            (isovalues, false),
            (ranks, true),
            (triangles, true),
            (positions, true),
            (collapses, false),
        ] {
            section.check_coded(is_coded)?;
        }
        if !rest.is_empty() {
            return Err(trailing_bytes(rest.len() as u64));
        }
        Ok(Sections { info, events, isovalues, ranks, triangles, positions, collapses })
    }

    /// The most vertices without a triangle. Each of the others takes a number of `TRIA` where it is used
    /// first, so a file with too many vertices is refused before they are unpacked.
    fn max_unused(&self) -> Result<usize> {
        let max = self.ranks.n_stored().saturating_add(FREE_UNUSED_VERTICES);
        let n = self.ranks.first_count().unwrap_or(0);
        if n > max.saturating_add(self.triangles.n_content()) as u64 {
            return Err(Error::input(format!(
                "section VERT: {n} vertices, expected no more than sections VERT and TRIA have room for"
            )));
        }
        Ok(max)
    }
}
