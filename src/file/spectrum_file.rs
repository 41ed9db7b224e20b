//! Reads and writes spectrum files, as a whole or as far as some isovalues need.

use std::borrow::Cow;
use std::fs::File;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};

use super::container::{FileTables, check_size};
use super::read_patch::{Chunks, chunks_at, read_patch, same_chunks};
use super::source::{Seeking, Source};
use super::tree::Tree;
use super::writer::{Packed, TreeWriter, packed};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{About, Patch, Size, Spectrum, shown_first};

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
    SpectrumFile::open(path)?.read()
}

/// The spectrum with vertices and triangles in the order of a file. Writing and reading a spectrum changes nothing but this order and
/// the precision of positions ([`Spectrum::quantised`]); both are idempotent.
///
/// # Errors
///
/// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn in_file_order(spectrum: &Spectrum) -> Result<Spectrum> {
    into_bytes(spectrum.clone()).map(|written| written.spectrum)
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
    spectrum.check()?;
    let tree = Tree::of(spectrum.triangles(), spectrum.isovalues().len() as u32);
    written(tree, spectrum)
}

/// The file of a spectrum in the chunks of a tree.
fn written(tree: Tree, spectrum: Spectrum) -> Result<Written> {
    let Packed { tree, spectrum, order } = packed(tree, spectrum, None)?;
    let mut bytes = Vec::new();
    let mut writer = TreeWriter::new(&mut bytes)?;
    writer.push(tree)?;
    writer.end(&spectrum)?;
    Ok(Written { bytes, spectrum, order })
}

/// The bytes of a file whose chunks have few triangles.
#[cfg(test)]
pub(crate) fn to_bytes_in_chunks_of(most: usize, spectrum: Spectrum) -> Vec<u8> {
    let n_ranks = spectrum.isovalues().len() as u32;
    let tree = Tree::with_chunks_of(most, spectrum.triangles(), n_ranks);
    written(tree, spectrum).expect("a valid spectrum").bytes
}

/// The spectrum in the bytes of a file.
///
/// # Errors
///
/// [`Error::Input`] if they are not a spectrum file, are damaged, or the spectrum does not pass
/// [`Spectrum::check`].
pub fn from_bytes(bytes: &[u8]) -> Result<Spectrum> {
    let tables = FileTables::read(&bytes)?;
    let patch = whole_patch(&tables, &bytes)?;
    whole(tables.about, patch, tables.size)
}

/// The vertices and triangles of all chunks, and the collapses.
fn whole_patch(tables: &FileTables, source: &dyn Source) -> Result<Patch> {
    let mut patch = read_patch(tables, source, f64::NEG_INFINITY..=f64::INFINITY)?;
    patch.collapses.clone_from(&tables.collapses);
    Ok(patch)
}

/// The whole spectrum, checked.
fn whole(about: About, patch: Patch, size: Size) -> Result<Spectrum> {
    let spectrum = Spectrum::new(about, patch)?;
    check_size(&size, &Size::of(&spectrum))?;
    Ok(spectrum)
}

/// An open spectrum file, of which only what is needed is read: a mesh needs some of the chunks.
///
/// ```no_run
/// use isospectrum::file::SpectrumFile;
///
/// let file = SpectrumFile::open("scan.isp")?;
/// let mesh = file.read_around(&[120.0])?.mesh_at(120.0)?;
/// # Ok::<(), isospectrum::Error>(())
/// ```
pub struct SpectrumFile {
    path: PathBuf,
    source: Seeking<File>,
    /// Without events.
    tables: FileTables,
    /// The spectrum without triangles.
    description: Spectrum,
}

impl std::fmt::Debug for SpectrumFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SpectrumFile").field("path", &self.path).finish_non_exhaustive()
    }
}

impl SpectrumFile {
    /// Opens a file and reads its tables. It may be from an untrusted source.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] if it is not a spectrum file, or its tables are damaged.
    pub fn open(path: impl AsRef<Path>) -> Result<SpectrumFile> {
        let path = path.as_ref();
        let (file, n_bytes) = input::open(path)?;
        let source = Seeking::new(file, n_bytes);
        let opened = || {
            let mut tables = FileTables::read(&source)?;
            let events = std::mem::take(&mut tables.about.events);
            let about = About { events, ..tables.about.clone() };
            let description = Spectrum::new(about, Patch::empty())?;
            Ok((tables, description))
        };
        let (tables, description) = opened().map_err(|e: Error| e.of_file(path))?;
        Ok(SpectrumFile { path: path.to_owned(), source, tables, description })
    }

    /// `n` of its bytes, which exist.
    pub(super) fn bytes(&self, from: u64, n: u64) -> Result<Cow<'_, [u8]>> {
        self.source.bytes(from, n).map_err(|e| e.of_file(&self.path))
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn tables(&self) -> &FileTables {
        &self.tables
    }

    /// Its chunks, to be decoded.
    pub(super) fn chunks(&self) -> Chunks<'_> {
        Chunks::new(&self.tables, &self.source)
    }

    /// The description of the spectrum, its range and its events; without isovalues, vertices and triangles.
    pub fn description(&self) -> &Spectrum {
        &self.description
    }

    /// The size of the whole spectrum.
    pub fn size(&self) -> Size {
        self.tables.size
    }

    /// Bytes of the file.
    pub fn n_bytes(&self) -> u64 {
        self.source.n_bytes()
    }

    /// The whole spectrum.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if a chunk is damaged or the spectrum does not pass [`Spectrum::check`].
    pub fn read(&self) -> Result<Spectrum> {
        let about = self.description.about().clone();
        let read = whole_patch(&self.tables, &self.source)
            .and_then(|patch| whole(about, patch, self.tables.size));
        read.map_err(|e| e.of_file(&self.path))
    }

    /// The spectrum with all triangles that are alive at some isovalues, or between them. Its range is that of the whole, but its meshes
    /// elsewhere are incomplete, and it has no collapses. Vertices and triangles are in the order of the whole.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if one of the chunks is damaged, or they do not pass [`Spectrum::check`].
    pub fn read_around(&self, isovalues: &[f64]) -> Result<Spectrum> {
        let isovalues = interval(isovalues);
        let read = || {
            let patch = read_patch(&self.tables, &self.source, isovalues)?;
            Spectrum::new(self.description.about().clone(), patch)
        };
        read().map_err(|e| e.of_file(&self.path))
    }

    /// The triangles and the bytes of the chunks that [`SpectrumFile::read_around`] reads.
    pub fn needed_around(&self, isovalues: &[f64]) -> (u64, u64) {
        let chunks = chunks_at(&self.tables, &interval(isovalues));
        chunks.fold((0, 0), |(triangles, bytes), i| {
            let size = self.tables.index.sizes()[i];
            (triangles + size.triangles, bytes + size.bytes)
        })
    }

    /// The most triangles of the chunks that [`SpectrumFile::read_around`] reads for one isovalue.
    pub fn most_at_once(&self) -> u64 {
        let index = &self.tables.index;
        let starts = index.trees().flat_map(|tree| {
            let spans = tree.tree.chunks().iter().map(|chunk| chunk.span.start);
            spans.filter_map(move |rank| self.tables.isovalues[tree.number].get(rank as usize))
        });
        starts.map(|&c| self.needed_around(&[c]).0).max().unwrap_or(0)
    }

    /// The number of trees of chunks: one for each brick with triangles.
    pub fn n_trees(&self) -> usize {
        self.tables.index.n_trees()
    }

    /// The isovalue to show first, as [`Spectrum::shown_first`], but from the index alone: the number of triangles in the chunks at an
    /// isovalue is used instead of the area.
    pub fn shown_first(&self) -> f64 {
        shown_first(self.tables.about.range, |c| self.needed_around(&[c]).0 as f64)
    }

    /// The isovalues at which [`SpectrumFile::read_around`] reads the same chunks as for `isovalue`, from the first up to, but not including,
    /// the second.
    pub fn same_chunks(&self, isovalue: f64) -> Range<f64> {
        same_chunks(&self.tables, isovalue)
    }
}

/// The least interval with some isovalues.
fn interval(isovalues: &[f64]) -> RangeInclusive<f64> {
    let low = isovalues.iter().copied().fold(f64::INFINITY, f64::min);
    low..=isovalues.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests;
