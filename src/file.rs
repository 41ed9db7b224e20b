//! The spectrum file, `.isp`, and the layout of the thesis: read and write side by side.
//!
//! FORMAT.md describes the file byte by byte. It is small because every number is stored as the
//! distance from a guess made of what precedes it, and coded by what its neighbours lead to expect
//! (`column`, `coder`), and safe to read from anyone: sections carry lengths and checksums
//! (`section`), nothing points anywhere, and what was read is checked ([`Spectrum::check`]).

mod coder;
mod column;
mod connectivity;
mod facing;
mod folder;
mod folder_index;
mod folder_query;
mod folder_spectrum;
mod geometry;
mod holes;
mod parts;
mod predict;
mod samples;
mod section;
mod stations;
mod summary;
mod tables;
pub mod thesis;
mod trajectories;
mod triangles;
mod version_1;
mod version_5;

use std::path::Path;

use serde::{Deserialize, Serialize};

pub use crate::atomic_file::{
    TemporaryFolder, block_writes, final_path, parent_folder, write_atomically,
};
pub(crate) use facing::Units;
pub(crate) use folder::living;
pub use folder::{SpectrumFolder, is_folder};
pub(crate) use folder_index::{ChunkName, PART, chunk_name, key_in_part, seam_bytes, seam_name};
pub use folder_index::{INDEX, Index, IndexedChunk, IndexedPart, WHOLE};
pub use folder_query::FolderQuery;
pub use folder_spectrum::FolderSpectrum;
pub(crate) use parts::parts;
use parts::parts_of;
pub use summary::Summary;

use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{About, Patch, Size, Spectrum, Told, VolumeInfo};
use column::Content;
use section::{Packing, Section, cut_section, left_over, write_section};

/// The first bytes of every spectrum file. They differ from text and show whether a transfer
/// changed line ends or cut the eighth bit, as those of PNG do.
pub const MAGIC: [u8; 8] = *b"\x89ISP\r\n\x1a\n";

/// The version of the format this library writes; it reads this one and all before.
pub const VERSION: u32 = 6;

/// Up to this version files told normals, in a section of its own. It is checked and not looked at: normals
/// follow from the mesh.
const LAST_WITH_NORMALS: u32 = 2;

/// Up to this version positions counted finer units, and every rank was told by its distance from the one before.
const LAST_WITHOUT_STATIONS: u32 = 4;

/// Up to this version columns were in planes, and triangles told when they die.
const LAST_UNCODED: u32 = 5;

/// Up to this version section `INFO` told no size.
const LAST_WITHOUT_SIZE: u32 = 4;

/// Length of what precedes the first section: magic, version, checksum of both.
const HEAD: usize = 16;

/// Most bytes of section `INFO`, which takes a few hundred. Read, JSON takes up to a hundred times its length.
const LONGEST_INFO: usize = 1 << 20;

/// Vertices that no triangle uses are at most as many as section `VERT` has bytes in the file, and so many more. They
/// are of no use, and deflate tells of a thousand of them in a byte.
const FREE_VERTICES: usize = 4096;

/// Section `INFO`: what is known of a spectrum beside its geometry.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Info<V, P> {
    volume: V,
    range: (f64, f64),
    tolerance: f64,
    parameters: P,
    /// From version 5 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size: Option<Size>,
}

/// Writes a spectrum to `path`: beside it first, then renamed.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn write(spectrum: &Spectrum, path: impl AsRef<Path>) -> Result<()> {
    let bytes = to_bytes(spectrum)?;
    write_atomically(path.as_ref(), |writer| writer.write_all(&bytes))
}

/// Reads a spectrum. The file may come from anyone.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if it is not a spectrum file, is damaged, or does not pass
/// [`Spectrum::check`].
pub fn read(path: impl AsRef<Path>) -> Result<Spectrum> {
    decode_file(path.as_ref(), from_bytes)
}

/// Reads a file and decodes it; what is wrong with its content is said with its path.
fn decode_file(path: &Path, decode: impl Fn(&[u8]) -> Result<Spectrum>) -> Result<Spectrum> {
    let bytes = input::read(path)?;
    decode(&bytes).map_err(|e| e.of_file(path))
}

/// The spectrum with vertices and triangles in the order in which a file keeps them. This and
/// [`Spectrum::quantised`] are all that a file changes; doing it again changes nothing.
///
/// # Errors
///
/// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn arranged(spectrum: &Spectrum) -> Result<Spectrum> {
    spectrum.check()?;
    let units = Units::of_file(VERSION, spectrum.tolerance());
    Ok(triangles::arranged(spectrum.clone(), units).spectrum)
}

/// The content of the section that says what a spectrum is of: JSON.
fn info(spectrum: &Spectrum) -> Result<Vec<u8>> {
    let info = Info {
        volume: spectrum.volume(),
        range: spectrum.range(),
        tolerance: spectrum.tolerance(),
        parameters: spectrum.parameters(),
        size: Some(Size::of(spectrum)),
    };
    serde_json::to_vec(&info).map_err(|e| Error::input(e.to_string()))
}

/// The bytes of the file of a spectrum. [`from_bytes`] gives back the spectrum as
/// [`Spectrum::quantised`] and [`arranged`] make it, exactly; its bytes are the same again.
///
/// # Errors
///
/// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn to_bytes(spectrum: &Spectrum) -> Result<Vec<u8>> {
    into_bytes(spectrum.clone()).map(|written| written.bytes)
}

/// The bytes of a file, and what is in it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Written {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// The spectrum, in the order of the file; its positions are not rounded.
    pub spectrum: Spectrum,
    /// Of each of its vertices, which it was before.
    pub order: Vec<u32>,
}

/// As [`to_bytes`], of a spectrum that is not needed any more as it was: it takes less memory.
///
/// # Errors
///
/// As [`to_bytes`].
pub fn into_bytes(spectrum: Spectrum) -> Result<Written> {
    let units = Units::of_file(VERSION, spectrum.tolerance());
    let (spectrum, [info, isovalues, ranks, triangles, positions], order) =
        parts_of(spectrum, units)?;
    if info.bytes().len() > LONGEST_INFO {
        return Err(Error::input(format!(
            "the description of the spectrum takes {} bytes, expected at most {LONGEST_INFO}",
            info.bytes().len()
        )));
    }
    let mut file = MAGIC.to_vec();
    file.extend(VERSION.to_le_bytes());
    file.extend(crc32fast::hash(&file).to_le_bytes());
    write_section(&mut file, *b"INFO", &info, Packing::Raw, 0);
    for (tag, content) in [
        (*b"EVNT", Content::Plain(tables::write_events(spectrum.events()).into())),
        (*b"ISOV", isovalues),
        (*b"VERT", ranks),
        (*b"TRIA", triangles),
        (*b"POSN", positions),
        (*b"COLL", Content::Plain(tables::write_collapses(spectrum.collapses()).into())),
    ] {
        // A reader wants to see that vertices without a triangle are paid for.
        let least = if tag == *b"VERT" { n_unused(&spectrum) } else { 0 };
        write_section(&mut file, tag, &content, Packing::Deflated, least);
    }
    Ok(Written { bytes: file, spectrum, order })
}

/// How many vertices no triangle uses, of a spectrum in the order of a file, where they come last.
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
    let (version, rest) = after_head(bytes)?;
    let sections = Sections::cut(rest, version)?;
    let info = read_info(&sections.info)?;
    if info.size.is_some() != (version > LAST_WITHOUT_SIZE) {
        let found = if info.size.is_some() { "a" } else { "no" };
        return Err(Error::input(format!("section INFO: {found} size in version {version}")));
    }
    let events = tables::read_events(&sections.events.content()?).map_err(within("EVNT"))?;
    let isovalues =
        tables::read_isovalues(&sections.isovalues.content()?).map_err(within("ISOV"))?;
    let most_unused = sections.most_unused()?;
    let content = sections.ranks.content()?;
    let ranks = trajectories::read_ranks(&content, isovalues.len(), version, most_unused)
        .map_err(within("VERT"))?;
    drop(content);
    let content = sections.triangles.content()?;
    let n_isovalues = isovalues.len();
    let triangles = match version {
        ..=LAST_UNCODED => {
            version_5::read_triangles(&content, &ranks, n_isovalues, version, most_unused)
        }
        _ => triangles::read_triangles(&content, &ranks, n_isovalues, most_unused),
    };
    let triangles = triangles.map_err(within("TRIA"))?;
    drop(content);
    let content = sections.positions.content()?;
    let knots = if version == 1 {
        version_1::read_geometry(&content, &ranks, &isovalues, &triangles)
    } else {
        let units = Units::of_file(version, info.tolerance);
        geometry::read_geometry(&content, &info.volume, &ranks, (&isovalues, &triangles), units)
    };
    drop(content);
    let knots = knots.map_err(within("POSN"))?;
    let collapses =
        tables::read_collapses(&sections.collapses.content()?).map_err(within("COLL"))?;
    let about = About {
        parameters: info.parameters,
        events,
        ..About::new(info.volume, info.range, info.tolerance)
    };
    let first_knot = ranks.first_knot;
    let spectrum =
        Spectrum::new(about, Patch { isovalues, first_knot, knots, triangles, collapses })?;
    info.size.map_or(Ok(()), |told| check_size(&told, &Size::of(&spectrum)))?;
    Ok(spectrum)
}

/// Checks that a file holds as much as it tells.
fn check_size(told: &Size, found: &Size) -> Result<()> {
    let other = told.named().into_iter().zip(found.named()).find(|(told, found)| told != found);
    other.map_or(Ok(()), |((what, told), (_, found))| {
        Err(Error::input(format!("section INFO: {told} {what}, found {found}")))
    })
}

/// The sections of a file, none of them unpacked.
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
    /// Cuts what follows the head of a file of a version.
    fn cut(mut rest: &'a [u8], version: u32) -> Result<Self> {
        let mut next = |tag: &[u8; 4]| cut_section(&mut rest, *tag);
        let (info, events, isovalues) = (next(b"INFO")?, next(b"EVNT")?, next(b"ISOV")?);
        let (ranks, triangles, positions) = (next(b"VERT")?, next(b"TRIA")?, next(b"POSN")?);
        if version <= LAST_WITH_NORMALS {
            next(b"NRML")?;
        }
        let collapses = next(b"COLL")?;
        for (section, may_be_coded) in [
            (info, false),
            (events, false),
            (isovalues, false),
            (ranks, true),
            (triangles, true),
            (positions, true),
            (collapses, false),
        ] {
            section.check_coded(may_be_coded && version > LAST_UNCODED)?;
        }
        if !rest.is_empty() {
            return Err(left_over(rest.len() as u64));
        }
        Ok(Sections { info, events, isovalues, ranks, triangles, positions, collapses })
    }

    /// How many vertices may be of no use to any triangle. Each of the others takes a byte of `TRIA` when it is used
    /// first, so a file that claims more vertices than it has room for is known before they are unpacked.
    fn most_unused(&self) -> Result<usize> {
        let most = self.ranks.n_stored().saturating_add(FREE_VERTICES);
        let n = self.ranks.first_count().unwrap_or(0);
        if n > most.saturating_add(self.triangles.n_content()) as u64 {
            return Err(Error::input(format!(
                "section VERT: {n} vertices, expected no more than sections VERT and TRIA have room for"
            )));
        }
        Ok(most)
    }
}

/// What section `INFO` says.
fn read_info(section: &Section<'_>) -> Result<Info<VolumeInfo, Told>> {
    let n = section.n_content();
    if !section.is_plain() || n > LONGEST_INFO {
        return Err(Error::input(format!(
            "section INFO: {n} bytes, expected at most {LONGEST_INFO} stored as they are"
        )));
    }
    serde_json::from_slice(section.content()?.bytes()).map_err(|e| {
        // It names keys, which may be long and hold line ends.
        let said = e.to_string();
        let said: String =
            said.chars().take(200).map(|c| if c.is_control() { '?' } else { c }).collect();
        Error::input(format!("section INFO: {said}"))
    })
}

/// What to say of vertices that no triangle uses.
fn too_many_unused(n: usize, most: usize) -> Error {
    Error::input(format!("{n} vertices without a triangle, expected at most {most}"))
}

/// The version, and what follows it.
fn after_head(bytes: &[u8]) -> Result<(u32, &[u8])> {
    let magic = bytes.get(..MAGIC.len()).unwrap_or(bytes);
    if bytes.is_empty() || !MAGIC.starts_with(magic) {
        return Err(Error::input("not a spectrum file: it does not start with \\x89ISP"));
    }
    let (head, rest) = bytes
        .split_at_checked(HEAD)
        .ok_or_else(|| Error::input("the file ends inside its head"))?;
    let number = |at: usize| u32::from_le_bytes(head[at..at + 4].try_into().expect("four bytes"));
    if crc32fast::hash(&head[..12]) != number(12) {
        return Err(Error::input("the head of the file is damaged: its checksum does not fit"));
    }
    let version = number(8);
    if !(1..=VERSION).contains(&version) {
        return Err(Error::input(format!(
            "format version {version}, expected 1 to {VERSION}; a newer isospectrum may read it"
        )));
    }
    Ok((version, rest))
}

/// Says in which section something was wrong.
fn within(section: &str) -> impl Fn(Error) -> Error + '_ {
    move |error| match error {
        Error::Input(what) => Error::input(format!("section {section}: {what}")),
        other => other,
    }
}
