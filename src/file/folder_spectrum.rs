//! The spectrum of those chunks of a folder of parts that some isovalues need. Chunks are read when they are first needed, and dropped
//! when too many are in memory.

use std::sync::Arc;

use super::folder::{SpectrumFolder, above, at_least, sub_patch};
use crate::error::Result;
use crate::spectrum::{Joiner, Seam, Spectrum, Triangle};

/// Chunks within this share of the range of an isovalue are read together with those at it: search structures are
/// rebuilt with every chunk, and the next isovalue is usually near.
const READ_AHEAD: f64 = 1.0 / 16.0;

/// Keeps the chunks that were read. When a limit of triangles is reached, only those at the new isovalues stay in memory.
#[derive(Debug)]
pub struct FolderSpectrum {
    folder: SpectrumFolder,
    /// By part, then by chunk, whether it is in `spectrum`.
    is_read: Vec<Vec<bool>>,
    spectrum: Arc<Spectrum>,
    seam: Seam,
    max_triangles: u64,
}

/// A chunk by its part and its number in the part.
type ChunkId = (usize, usize);

impl FolderSpectrum {
    /// Without any chunk yet, and with a limit of triangles in memory. It is exceeded only if one request needs more.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if the description of the whole is invalid.
    pub fn within(folder: SpectrumFolder, triangles: u64) -> Result<FolderSpectrum> {
        let (spectrum, seam) = (empty(&folder)?, Joiner::default().finish().1);
        let is_read = none_read(&folder);
        Ok(FolderSpectrum { folder, is_read, spectrum, seam, max_triangles: triangles })
    }

    /// The folder.
    pub fn folder(&self) -> &SpectrumFolder {
        &self.folder
    }

    /// The spectrum of the chunks in memory. Its range is that of the whole, but its meshes are complete only at isovalues that it
    /// [has](FolderSpectrum::has).
    pub fn spectrum(&self) -> &Arc<Spectrum> {
        &self.spectrum
    }

    /// A spectrum without any chunk.
    pub(super) fn empty(&self) -> Result<Arc<Spectrum>> {
        empty(&self.folder)
    }

    /// Whether all chunks at some isovalues are in memory.
    pub fn has(&self, isovalues: &[f64]) -> bool {
        self.missing(isovalues, 0.0).0.is_empty()
    }

    /// Reads the missing chunks at some isovalues and replaces the spectrum. If the caller has dropped the previous one, its memory is reused.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFolder::read_between`]; then no chunk is in memory.
    pub fn read_at(&mut self, isovalues: &[f64]) -> Result<()> {
        isovalues.iter().try_for_each(|&c| self.folder.whole().check_isovalue(c))?;
        if self.has(isovalues) {
            return Ok(());
        }
        let (low, high) = self.folder.whole().range();
        let far = READ_AHEAD * (high - low);
        let (mut wanted, n) = self.missing(isovalues, far);
        if self.spectrum.triangles().len() as u64 + n > self.max_triangles {
            self.take_all()?;
            let (all, n) = self.missing(isovalues, far);
            wanted = if n > self.max_triangles { self.missing(isovalues, 0.0).0 } else { all };
        }
        self.read(&wanted)
    }

    /// The number of chunks in memory.
    pub fn n_read(&self) -> usize {
        self.is_read.iter().flatten().filter(|&&is_read| is_read).count()
    }

    /// The missing chunks within a distance of some isovalues, and the number of their triangles.
    fn missing(&self, isovalues: &[f64], far: f64) -> (Vec<ChunkId>, u64) {
        let parts = self.folder.index().parts.iter().zip(&self.is_read).enumerate();
        let chunks = parts.flat_map(|(i, (part, is_read))| {
            let chunks = part.chunks.iter().zip(is_read).enumerate();
            chunks.filter(|(_, (_, is_read))| !**is_read).map(move |(k, (c, _))| ((i, k), c))
        });
        let around = |&c: &f64| (c - far, c + far);
        let missing =
            chunks.filter(|(_, chunk)| isovalues.iter().map(around).any(|ends| chunk.meets(ends)));
        missing.fold((Vec::new(), 0), |(mut places, n), (place, chunk)| {
            places.push(place);
            (places, n + chunk.triangles)
        })
    }

    /// Returns everything in memory and leaves nothing.
    fn take_all(&mut self) -> Result<(Arc<Spectrum>, Seam, Vec<Vec<bool>>)> {
        let nothing = empty(&self.folder)?;
        let seam = std::mem::replace(&mut self.seam, Joiner::default().finish().1);
        let spectrum = std::mem::replace(&mut self.spectrum, nothing);
        let is_read = std::mem::replace(&mut self.is_read, none_read(&self.folder));
        Ok((spectrum, seam, is_read))
    }

    fn read(&mut self, places: &[ChunkId]) -> Result<()> {
        // The old arrays are extended, not copied. If a chunk is damaged, nothing is left, and the next request reads everything again.
        let (spectrum, seam, mut is_read) = self.take_all()?;
        let spectrum = Arc::unwrap_or_clone(spectrum);
        let mut joiner = Joiner::resume(spectrum.into_parts().1, seam);
        for &place in places {
            let (part, chunk) = place;
            let (patch, shared) = self.folder.chunk(place)?;
            let present = self.folder.index().parts[part].chunks.iter().zip(&is_read[part]);
            let present = present.filter(|c| *c.1);
            // A triangle is in memory if a chunk in which it is alive is.
            let present = present.map(|(c, _)| (above(&patch, c.from), at_least(&patch, c.to)));
            let present: Vec<(u32, u32)> = present.collect();
            let is_new = |t: &Triangle| !present.iter().any(|c| t.birth < c.1 && c.0 <= t.death);
            let (patch, shared) = sub_patch(&patch, &shared, is_new);
            self.folder.append(&mut joiner, place, (&patch, &shared))?;
            is_read[part][chunk] = true;
        }
        let (patch, seam) = joiner.finish();
        self.spectrum = Arc::new(self.folder.spectrum(patch, self.folder.whole().range())?);
        (self.seam, self.is_read) = (seam, is_read);
        Ok(())
    }
}

fn empty(folder: &SpectrumFolder) -> Result<Arc<Spectrum>> {
    let (none, _) = Joiner::default().finish();
    folder.spectrum(none, folder.whole().range()).map(Arc::new)
}

fn none_read(folder: &SpectrumFolder) -> Vec<Vec<bool>> {
    folder.index().parts.iter().map(|part| vec![false; part.chunks.len()]).collect()
}
