//! A spectrum as a folder of parts, `.ispt`. Each part has its own files, which are read only when they are needed.
//!
//! # Layout
//!
//! `index.json` ([`Index`]), which lists all other files; `whole.isp`, a spectrum file without triangles, with the events and the description of the
//! whole. A part, which is a brick, is divided into chunks by isovalue: each has the triangles that are alive somewhere in
//! its interval, with their whole lifetimes, so a triangle may be in several. A chunk has a spectrum file,
//! `000000-000.isp`, and the keys of the vertices that it shares with other chunks, `000000-000.seam` (`folder_index`).
//!
//! # Invariants
//!
//! Vertices with equal keys are one vertex, with the same trajectory in every chunk. A triangle is in all chunks of its part in whose
//! intervals it is alive, so it is new to a reader that has read none of these. Every chunk contains the hash of its plan and its number.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::folder_index::{
    ChunkName, INDEX, Index, IndexedChunk, PART, WHOLE, chunk_name, read_seam, seam_name,
};
use super::spectrum_file::from_bytes;
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{About, Joiner, Patch, Spectrum, Triangle, shown_first};

/// Whether a path is that of a folder of parts.
pub fn is_folder(path: &Path) -> bool {
    path.join(INDEX).is_file()
}

/// The names of the files that were written into a folder of parts, from its index.
///
/// # Errors
///
/// [`Error::Io`] and [`Error::Input`] if it has no index of this version, or a damaged one.
pub fn own_files(path: &Path) -> Result<Vec<String>> {
    read_index(path).map(|(index, _)| index.files())
}

/// Reads the index of a folder; also returns the size of its file in bytes.
fn read_index(path: &Path) -> Result<(Index, u64)> {
    let file = path.join(INDEX);
    let bytes = input::read(&file)?;
    let index = Index::from_bytes(&bytes).map_err(|e| e.of_file(&file))?;
    Ok((index, bytes.len() as u64))
}

/// A folder of parts. Parts are read on demand.
#[derive(Clone, Debug)]
pub struct SpectrumFolder {
    path: PathBuf,
    index: Index,
    whole: Spectrum,
    bytes: u64,
}

impl SpectrumFolder {
    /// Reads the index and the description of the whole.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] if it is not a folder of this version, or it is damaged.
    pub fn open(path: &Path) -> Result<SpectrumFolder> {
        let (index, of_index) = read_index(path)?;
        let file = path.join(WHOLE);
        let whole = input::read(&file)?;
        let parts = index.parts.iter().fold(0u64, |n, p| n.saturating_add(p.bytes()));
        let bytes = parts.saturating_add(of_index).saturating_add(whole.len() as u64);
        if crc32fast::hash(&whole) != index.whole_crc32 {
            let file = file.display();
            return Err(Error::input(format!("{file}: expected the file that {INDEX} belongs to")));
        }
        let whole = from_bytes(&whole).map_err(|e| e.of_file(&file))?;
        index.check_cover(whole.volume().dims).map_err(|e| e.of_file(&path.join(INDEX)))?;
        Ok(SpectrumFolder { path: path.to_owned(), index, whole, bytes })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The index.
    pub fn index(&self) -> &Index {
        &self.index
    }

    /// Bytes of all its files, according to the index.
    pub fn n_bytes(&self) -> u64 {
        self.bytes
    }

    /// The description of the whole: a spectrum without triangles.
    pub fn whole(&self) -> &Spectrum {
        &self.whole
    }

    /// The chunks whose intervals contain isovalues between two, both included: part, number of the chunk in the part, and entry, ascending.
    pub fn chunks_between(
        &self,
        between: (f64, f64),
    ) -> impl Iterator<Item = ((usize, usize), &IndexedChunk)> + '_ {
        let parts = self.index.parts.iter().enumerate();
        let all = parts.flat_map(|(i, part)| {
            part.chunks.iter().enumerate().map(move |(k, chunk)| ((i, k), chunk))
        });
        all.filter(move |(_, chunk)| chunk.meets(between))
    }

    /// The isovalue to show first, as [`Spectrum::shown_first`], but from the index alone: the number of triangles in the chunks at an
    /// isovalue is used instead of the area.
    pub fn shown_first(&self) -> f64 {
        shown_first(self.whole.range(), |c| {
            self.chunks_between((c, c)).map(|(_, chunk)| chunk.triangles as f64).sum()
        })
    }

    /// The spectrum between two isovalues of its range, both included: its meshes there are those of the whole. Other chunks
    /// are not read, and other triangles are dropped; apart from the result, one chunk at a time is in memory.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] outside the whole's range; [`Error::Io`]; [`Error::Input`] for chunks that are damaged or inconsistent.
    pub fn read_between(&self, between: (f64, f64)) -> Result<Spectrum> {
        [between.0, between.1].into_iter().try_for_each(|c| self.whole.check_isovalue(c))?;
        let mut joiner = Joiner::default();
        let mut before = None;
        for (place, chunk) in self.chunks_between(between) {
            // All chunks of this part from the first one that was read up to this one have been read.
            let from = before.filter(|&(number, _)| number == place.0);
            let (_, from) = from.unwrap_or((place.0, f64::NEG_INFINITY));
            let (patch, shared) = self.chunk(place)?;
            // Alive in the interval, and new: not born in an earlier chunk.
            let [low, high] = [between.0, between.1].map(|x| above(&patch, x));
            let first = if from > f64::NEG_INFINITY { at_least(&patch, from) } else { 0 };
            let kept = |t: &Triangle| first <= t.birth && t.birth < high && t.death >= low;
            let (patch, shared) = sub_patch(&patch, &shared, kept);
            self.append(&mut joiner, place, (&patch, &shared))?;
            before = Some((place.0, chunk.to));
        }
        self.spectrum(joiner.finish().0, between)
    }

    /// The spectrum with all triangles that are alive at some isovalues, or between them. Its range is that of the whole, but its meshes
    /// elsewhere are incomplete.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFolder::read_between`].
    pub fn read_around(&self, isovalues: &[f64]) -> Result<Spectrum> {
        let low = isovalues.iter().copied().fold(f64::INFINITY, f64::min);
        let high = isovalues.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        self.read_between((low, high))?.changed(|about, _| about.range = self.whole.range())
    }

    /// The whole spectrum.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFolder::read_between`].
    pub fn read(&self) -> Result<Spectrum> {
        self.read_between(self.whole.range())
    }

    /// A spectrum of some chunks, with the description of the whole.
    pub(super) fn spectrum(&self, patch: Patch, range: (f64, f64)) -> Result<Spectrum> {
        Spectrum::from_patch(About { range, ..self.whole.about().clone() }, patch)
    }

    /// Appends a chunk.
    pub(super) fn append(
        &self,
        joiner: &mut Joiner,
        place: (usize, usize),
        (patch, shared): (&Patch, &[(u32, u64)]),
    ) -> Result<()> {
        joiner.append(patch, shared)?.map_err(|at| {
            let file = self.path.join(chunk_name(place));
            Error::input(format!(
                "{}: the vertex at {:?} differs from that of a neighbouring part, expected parts of one volume",
                file.display(),
                at.0
            ))
        })
    }

    /// Reads a chunk, and its shared vertices, ascending, with their keys.
    pub(super) fn chunk(&self, place: (usize, usize)) -> Result<(Patch, Vec<(u32, u64)>)> {
        let file = self.path.join(chunk_name(place));
        let found = from_bytes(&input::read(&file)?).map_err(|e| e.of_file(&file))?;
        let (number, chunk) = place;
        let expected = ChunkName { plan: self.index.plan.clone(), number, chunk };
        let name = found.parameters().get(PART).map(ChunkName::deserialize);
        if !name.is_some_and(|name| name.is_ok_and(|name| name == expected)) {
            let ChunkName { plan, .. } = expected;
            return Err(Error::input(format!(
                "{}: expected chunk {chunk} of part {number} of plan {plan}",
                file.display()
            )));
        }
        let n_triangles = self.index.parts[number].chunks[chunk].triangles;
        if found.triangles().len() as u64 != n_triangles {
            return Err(Error::input(format!(
                "{}: {} triangles, expected {n_triangles}",
                file.display(),
                found.triangles().len()
            )));
        }
        let seam = self.path.join(seam_name(place));
        let shared = read_seam(number, &input::read(&seam)?).map_err(|e| e.of_file(&seam))?;
        let ascends = shared.windows(2).all(|w| w[0].0 < w[1].0);
        if !ascends || shared.last().is_some_and(|s| s.0 as usize >= found.n_vertices()) {
            return Err(Error::input(format!("{}: belongs to another part", seam.display())));
        }
        Ok((found.into_parts().1, shared))
    }
}

/// The first rank of a patch above an isovalue.
pub(super) fn above(patch: &Patch, isovalue: f64) -> u32 {
    patch.isovalues.partition_point(|&c| c <= isovalue) as u32
}

/// The first rank of a patch at or above an isovalue.
pub(super) fn at_least(patch: &Patch, isovalue: f64) -> u32 {
    patch.isovalues.partition_point(|&c| c < isovalue) as u32
}

/// The triangles of a patch for which `is_kept` is true, as a patch, and its shared vertices with their keys.
pub(crate) fn sub_patch(
    patch: &Patch,
    shared: &[(u32, u64)],
    is_kept: impl Fn(&Triangle) -> bool,
) -> (Patch, Vec<(u32, u64)>) {
    let Patch { isovalues, first_knot, knots, triangles, .. } = patch;
    let mut triangles: Vec<Triangle> = triangles.iter().filter(|t| is_kept(t)).copied().collect();
    let mut is_used = vec![false; first_knot.len().saturating_sub(1)];
    triangles.iter().flat_map(|t| t.vertices).for_each(|v| is_used[v as usize] = true);
    let mut number = vec![u32::MAX; is_used.len()];
    let isovalues = isovalues.clone();
    let mut kept = Patch { isovalues, first_knot: vec![0], ..Patch::default() };
    for v in (0..is_used.len()).filter(|&v| is_used[v]) {
        number[v] = kept.first_knot.len() as u32 - 1;
        kept.knots.extend(&knots[first_knot[v] as usize..first_knot[v + 1] as usize]);
        kept.first_knot.push(kept.knots.len() as u32);
    }
    triangles.iter_mut().for_each(|t| t.vertices = t.vertices.map(|v| number[v as usize]));
    kept.triangles = triangles;
    let shared = shared.iter().filter(|s| is_used[s.0 as usize]);
    let shared = shared.map(|&(v, key)| (number[v as usize], key)).collect();
    (kept, shared)
}
