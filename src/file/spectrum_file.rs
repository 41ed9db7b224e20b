//! Reads and writes spectrum files, as a whole or as far as some isovalues need.

use std::fs::File;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use super::column::Content;
use super::container::{FileTables, TableContents, assembled};
use super::decode::Decoder;
use super::encode::{Encoded, encode};
use super::header::write_info;
use super::samples::Samples;
use super::source::{Seeking, Source};
use super::tables;
use super::tree::Tree;
use super::units::Units;
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{About, Patch, Size, Spectrum};

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
    encoded(spectrum.clone()).map(|(_, encoded)| encoded.spectrum)
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
    let (tree, encoded) = encoded(spectrum)?;
    written(&tree, encoded)
}

/// The file of a spectrum in the chunks of a tree.
fn written(tree: &Tree, Encoded { spectrum, order, chunks }: Encoded) -> Result<Written> {
    let tables = TableContents {
        info: Content::Plain(write_info(&spectrum)?.into()),
        events: Content::Plain(tables::write_events(spectrum.events()).into()),
        isovalues: Content::Plain(tables::write_isovalues(spectrum.isovalues()).into()),
        collapses: Content::Plain(tables::write_collapses(spectrum.collapses()).into()),
    };
    Ok(Written { bytes: assembled(&tables, tree, chunks)?, spectrum, order })
}

fn encoded(spectrum: Spectrum) -> Result<(Tree, Encoded)> {
    spectrum.check()?;
    let units = Units::of_file(spectrum.tolerance());
    let tree = Tree::of(spectrum.triangles(), spectrum.isovalues().len() as u32);
    let encoded = encode(spectrum, &tree, units)?;
    Ok((tree, encoded))
}

/// The spectrum in the bytes of a file.
///
/// # Errors
///
/// [`Error::Input`] if they are not a spectrum file, are damaged, or the spectrum does not pass
/// [`Spectrum::check`].
pub fn from_bytes(bytes: &[u8]) -> Result<Spectrum> {
    let tables = FileTables::read(&bytes)?;
    whole(tables, &bytes)
}

/// The whole spectrum.
fn whole(tables: FileTables, source: &dyn Source) -> Result<Spectrum> {
    let last = tables.isovalues.len() as u32;
    let mut patch = patch(&tables, source, 0..=last)?;
    let FileTables { info, events, collapses, .. } = tables;
    patch.collapses = collapses;
    let size = info.size;
    let spectrum = Spectrum::new(info.about(events), patch)?;
    check_size(&size, &Size::of(&spectrum))?;
    Ok(spectrum)
}

/// The vertices and triangles of the chunks that some ranks need.
fn patch(tables: &FileTables, source: &dyn Source, ranks: RangeInclusive<u32>) -> Result<Patch> {
    let units = Units::of_file(tables.info.tolerance);
    let bytes = |i: usize| {
        let place = &tables.places[i];
        let bytes = source.bytes(place.start, place.end - place.start)?;
        if crc32fast::hash(&bytes) != tables.sizes[i].crc {
            return Err(Error::input("damaged: its checksum is wrong"));
        }
        Ok(bytes)
    };
    let decoder = Decoder {
        tree: &tables.tree,
        sizes: &tables.sizes,
        isovalues: &tables.isovalues,
        samples: Samples::new(tables.info.volume(), units),
        units,
        bytes: &bytes,
    };
    decoder.patch(ranks)
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
            let tables = FileTables::read(&source)?;
            let description = Spectrum::new(about(&tables), Patch::empty())?;
            Ok((tables, description))
        };
        let (tables, description) = opened().map_err(|e: Error| e.of_file(path))?;
        Ok(SpectrumFile { path: path.to_owned(), source, tables, description })
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The description of the spectrum, its range and its events; without isovalues, vertices and triangles.
    pub fn description(&self) -> &Spectrum {
        &self.description
    }

    /// The size of the whole spectrum.
    pub fn size(&self) -> Size {
        self.tables.info.size
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
    pub fn read(self) -> Result<Spectrum> {
        whole(self.tables, &self.source).map_err(|e| e.of_file(&self.path))
    }

    /// The spectrum with all triangles that are alive at some isovalues, or between them. Its range is that of the whole, but its meshes
    /// elsewhere are incomplete, and it has no collapses. Vertices and triangles are in the order of the whole.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if one of the chunks is damaged, or they do not pass [`Spectrum::check`].
    pub fn read_around(&self, isovalues: &[f64]) -> Result<Spectrum> {
        let ranks = self.ranks_of(isovalues);
        let read = || Spectrum::new(about(&self.tables), patch(&self.tables, &self.source, ranks)?);
        read().map_err(|e| e.of_file(&self.path))
    }

    /// The triangles and the bytes of the chunks that [`SpectrumFile::read_around`] reads.
    pub fn needed_around(&self, isovalues: &[f64]) -> (u64, u64) {
        let chunks = self.tables.tree.at(self.ranks_of(isovalues));
        chunks.fold((0, 0), |(triangles, bytes), i| {
            let size = self.tables.sizes[i];
            (triangles + size.triangles, bytes + size.bytes)
        })
    }

    /// The ranks of isovalues and those between them.
    fn ranks_of(&self, isovalues: &[f64]) -> RangeInclusive<u32> {
        let below = |c: f64| self.tables.isovalues.partition_point(|&x| x <= c);
        let ranks = isovalues.iter().map(|&c| below(c).saturating_sub(1) as u32);
        ranks.clone().min().unwrap_or(0)..=ranks.max().unwrap_or(0)
    }
}

/// All but the geometry.
fn about(tables: &FileTables) -> About {
    tables.info.about(tables.events.clone())
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, LazyLock};

    use super::*;
    use crate::kernels::{Backend, Choice};
    use crate::progress::Silent;
    use crate::random::Random;
    use crate::spectrum::Query;
    use crate::sweep::{Parameters, compute};
    use crate::volume::phantom;

    /// A spectrum, and its file in chunks of few triangles.
    fn in_chunks() -> (Spectrum, Vec<u8>, FileTables) {
        static ONCE: LazyLock<(Spectrum, Vec<u8>)> = LazyLock::new(computed);
        let (spectrum, bytes) = ONCE.clone();
        let tables = FileTables::read(&&bytes[..]).expect("just written");
        (spectrum, bytes, tables)
    }

    fn computed() -> (Spectrum, Vec<u8>) {
        let volume = Arc::new(phantom("blobs:12").expect("a phantom"));
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent).expect("one");
        let spectrum = spectrum.quantised();
        let n_ranks = spectrum.isovalues().len() as u32;
        let tree = Tree::with_chunks_of(500, spectrum.triangles(), n_ranks);
        let units = Units::of_file(spectrum.tolerance());
        let encoded = encode(spectrum, &tree, units).expect("a mesh");
        let Written { bytes, spectrum, .. } = written(&tree, encoded).expect("a short description");
        let tables = FileTables::read(&&bytes[..]).expect("just written");
        assert!(tables.sizes.len() >= 9, "{} chunks", tables.sizes.len());
        (spectrum, bytes)
    }

    /// The file with some bytes of chunks replaced, and checksums that fit.
    fn with_chunks(bytes: &[u8], tables: &FileTables, chunks: &[Vec<u8>]) -> Vec<u8> {
        let mut file = bytes[..16].to_vec();
        let mut sizes = tables.sizes.clone();
        for (size, chunk) in sizes.iter_mut().zip(chunks) {
            (size.bytes, size.crc) = (chunk.len() as u64, crc32fast::hash(chunk));
            file.extend(chunk);
        }
        let position = file.len();
        let mut rest = &bytes[tables.places[tables.places.len() - 1].end as usize..];
        let start = rest;
        for tag in [*b"INFO", *b"EVNT", *b"ISOV", *b"COLL"] {
            super::super::section::split_section(&mut rest, tag).expect("just written");
        }
        file.extend(&start[..start.len() - rest.len()]);
        super::super::container::write_end(&mut file, &tables.tree, &sizes, position);
        file
    }

    fn chunks_of(bytes: &[u8], tables: &FileTables) -> Vec<Vec<u8>> {
        let of =
            |place: &std::ops::Range<u64>| bytes[place.start as usize..place.end as usize].to_vec();
        tables.places.iter().map(of).collect()
    }

    #[test]
    fn a_file_of_many_chunks_is_read_as_written_and_written_again() {
        let (spectrum, bytes, tables) = in_chunks();
        let read = from_bytes(&bytes).expect("just written");
        assert!(read == spectrum);
        let units = Units::of_file(read.tolerance());
        let again = encode(read, &tables.tree, units).expect("a mesh");
        assert!(written(&tables.tree, again).expect("a file").bytes == bytes);
    }

    #[test]
    fn chunks_at_an_isovalue_give_the_mesh_of_the_whole() {
        let (spectrum, bytes, tables) = in_chunks();
        let mut whole = Query::new(&spectrum);
        let (low, high) = spectrum.range();
        let between = (0..40).map(|i| low + (high - low) * f64::from(i) / 39.0);
        let of_table = spectrum.isovalues().iter().copied().step_by(13);
        let (mut n_read, mut n_meshes) = (0, 0);
        for c in between.chain(of_table).filter(|c| (low..=high).contains(c)) {
            let rank = spectrum.rank_at(c).expect("inside");
            let patch = patch(&tables, &&bytes[..], rank..=rank).expect("just written");
            let part = Spectrum::new(about(&tables), patch).expect("valid");
            n_read += part.triangles().len();
            n_meshes += 1;
            assert_eq!(
                part.mesh_at(c).expect("inside"),
                whole.mesh_at(c).expect("inside"),
                "at {c}"
            );
        }
        let (mean, all) = (n_read / n_meshes, spectrum.triangles().len());
        assert!(2 * mean < all, "{mean} of {all} triangles are read");
    }

    #[test]
    fn a_damaged_chunk_is_named_and_the_others_still_give_meshes() {
        let (spectrum, mut bytes, tables) = in_chunks();
        let last = tables.sizes.len() - 1;
        bytes[tables.places[last].start as usize + 40] ^= 4;
        let error = from_bytes(&bytes).expect_err("damaged").to_string();
        let span = &tables.tree.chunks()[last].span;
        let [from, to] = [span.start, span.end - 1].map(|rank| spectrum.isovalues()[rank as usize]);
        let expected =
            format!("chunk {last} (isovalues {from} to {to}): damaged: its checksum is wrong");
        assert_eq!(error, expected);
        let below = span.start - 1;
        let patch = patch(&tables, &&bytes[..], below..=below).expect("another chunk");
        Spectrum::new(about(&tables), patch).expect("valid");
    }

    #[test]
    fn chunks_that_are_missing_doubled_or_swapped_are_refused() {
        let (_, bytes, tables) = in_chunks();
        let chunks = chunks_of(&bytes, &tables);
        assert!(with_chunks(&bytes, &tables, &chunks) == bytes);
        for i in 1..chunks.len() {
            for (what, change) in [
                (
                    "doubled",
                    (|chunks, i| chunks[i] = chunks[i - 1].clone()) as fn(&mut Vec<Vec<u8>>, usize),
                ),
                ("swapped", |chunks, i| chunks.swap(i - 1, i)),
                ("empty", |chunks, i| chunks[i].clear()),
            ] {
                let mut chunks = chunks.clone();
                change(&mut chunks, i);
                let error = from_bytes(&with_chunks(&bytes, &tables, &chunks)).expect_err(what);
                let error = error.to_string();
                assert!(
                    error.starts_with("chunk ") && !error.contains('\n'),
                    "{what} {i}: {error}"
                );
            }
            // Without their bytes in the index, other bytes are in no chunk.
            let place = &tables.places[i];
            let without = [&bytes[..place.start as usize], &bytes[place.end as usize..]].concat();
            assert!(from_bytes(&without).is_err());
        }
    }

    #[test]
    fn changed_bytes_of_chunks_under_checksums_that_fit_are_refused_or_still_valid() {
        let (_, bytes, tables) = in_chunks();
        let original = chunks_of(&bytes, &tables);
        let mut random = Random::new(11);
        let mut n_read = 0;
        for _ in 0..100 {
            let mut chunks = original.clone();
            let i = random.below(chunks.len());
            let mut sections = Vec::new();
            let mut rest = &chunks[i][..];
            while rest.len() > 28 {
                let n = u64::from_le_bytes(rest[8..16].try_into().expect("eight bytes")) as usize;
                sections.push(rest[..28 + n].to_vec());
                rest = &rest[28 + n..];
            }
            let section = &mut sections[random.below(3)];
            let at = 28 + random.below(section.len() - 28);
            section[at] = random.below(256) as u8;
            let crc = crc32fast::hash(&[&section[..24], &section[28..]].concat());
            section[24..28].copy_from_slice(&crc.to_le_bytes());
            chunks[i] = sections.concat();
            match from_bytes(&with_chunks(&bytes, &tables, &chunks)) {
                Ok(spectrum) => {
                    spectrum.check().expect("what is read is valid");
                    n_read += 1;
                }
                Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
            }
        }
        assert!(n_read > 0, "all were refused");
    }
}
