//! Of a folder of parts, the spectrum of the chunks that some isovalues need: they are read when they are needed first, and dropped
//! when they are many.

use std::sync::Arc;

use super::folder::{SpectrumFolder, above, at_least, living};
use crate::error::Result;
use crate::spectrum::{Joiner, Seam, Spectrum, Triangle};

/// Chunks within this share of the range of an isovalue are read with those that live at it: search structures are
/// built anew with every chunk, and the next isovalue is most often near.
const AHEAD: f64 = 1.0 / 16.0;

/// See the module. What was read stays until more is wanted than may be kept; then no more stays than lives where the new isovalues are.
#[derive(Debug)]
pub struct FolderSpectrum {
    folder: SpectrumFolder,
    /// Of each part, its chunks that are there.
    is_read: Vec<Vec<bool>>,
    spectrum: Arc<Spectrum>,
    seam: Seam,
    most: u64,
}

/// A chunk by its part and its number there.
type Place = (usize, usize);

impl FolderSpectrum {
    /// Of a folder, of which nothing is read yet; no more than so many triangles are kept, but those that are needed.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if what is known of the whole passes no check.
    pub fn within(folder: SpectrumFolder, triangles: u64) -> Result<FolderSpectrum> {
        let (spectrum, seam) = (nothing(&folder)?, Joiner::default().finish().1);
        let is_read = none_read(&folder);
        Ok(FolderSpectrum { folder, is_read, spectrum, seam, most: triangles })
    }

    /// The folder.
    pub fn folder(&self) -> &SpectrumFolder {
        &self.folder
    }

    /// What is there: its range is that of the whole, though its meshes are the whole's at no other isovalues than those that it
    /// [has](FolderSpectrum::has).
    pub fn spectrum(&self) -> &Arc<Spectrum> {
        &self.spectrum
    }

    /// A spectrum of nothing that is there.
    pub(super) fn nothing(&self) -> Result<Arc<Spectrum>> {
        nothing(&self.folder)
    }

    /// Whether all is there that lives at some isovalues.
    pub fn has(&self, isovalues: &[f64]) -> bool {
        self.missing(isovalues, 0.0).0.is_empty()
    }

    /// Reads what lives at some isovalues and is not there. The spectrum is another one then; who has dropped the one before saves its memory.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFolder::read_between`]; then nothing is there.
    pub fn read_at(&mut self, isovalues: &[f64]) -> Result<()> {
        isovalues.iter().try_for_each(|&c| self.folder.whole().check_isovalue(c))?;
        if self.has(isovalues) {
            return Ok(());
        }
        let (low, high) = self.folder.whole().range();
        let far = AHEAD * (high - low);
        let (mut wanted, n) = self.missing(isovalues, far);
        if self.spectrum.triangles().len() as u64 + n > self.most {
            self.emptied()?;
            let (all, n) = self.missing(isovalues, far);
            wanted = if n > self.most { self.missing(isovalues, 0.0).0 } else { all };
        }
        self.read(&wanted)
    }

    /// How many chunks are kept.
    pub fn n_read(&self) -> usize {
        self.is_read.iter().flatten().filter(|&&is_read| is_read).count()
    }

    /// The chunks so near to some isovalues that are not there, and how many triangles they have.
    fn missing(&self, isovalues: &[f64], far: f64) -> (Vec<Place>, u64) {
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

    /// Drops all that was read; what it was, to be gone on with.
    fn emptied(&mut self) -> Result<(Arc<Spectrum>, Seam, Vec<Vec<bool>>)> {
        let empty = nothing(&self.folder)?;
        let seam = std::mem::replace(&mut self.seam, Joiner::default().finish().1);
        let spectrum = std::mem::replace(&mut self.spectrum, empty);
        let is_read = std::mem::replace(&mut self.is_read, none_read(&self.folder));
        Ok((spectrum, seam, is_read))
    }

    fn read(&mut self, places: &[Place]) -> Result<()> {
        // Their memory is that of what comes in their place. Where one is damaged all are read anew by the next one who asks.
        let (spectrum, seam, mut is_read) = self.emptied()?;
        let spectrum = Arc::unwrap_or_clone(spectrum);
        let mut joiner = Joiner::resume(spectrum.into_parts().1, seam);
        for &place in places {
            let (part, chunk) = place;
            let (patch, shared) = self.folder.chunk(place)?;
            let there = self.folder.index().parts[part].chunks.iter().zip(&is_read[part]);
            let there = there.filter(|c| *c.1);
            // A triangle is there if a chunk in which it lives is.
            let there = there.map(|(c, _)| (above(&patch, c.from), at_least(&patch, c.to)));
            let there: Vec<(u32, u32)> = there.collect();
            let is_new = |t: &Triangle| !there.iter().any(|c| t.birth < c.1 && c.0 <= t.death);
            let (patch, shared) = living(&patch, &shared, is_new);
            self.folder.append(&mut joiner, place, (&patch, &shared))?;
            is_read[part][chunk] = true;
        }
        let (patch, seam) = joiner.finish();
        self.spectrum = Arc::new(self.folder.spectrum(patch, self.folder.whole().range())?);
        (self.seam, self.is_read) = (seam, is_read);
        Ok(())
    }
}

fn nothing(folder: &SpectrumFolder) -> Result<Arc<Spectrum>> {
    let (none, _) = Joiner::default().finish();
    folder.spectrum(none, folder.whole().range()).map(Arc::new)
}

fn none_read(folder: &SpectrumFolder) -> Vec<Vec<bool>> {
    folder.index().parts.iter().map(|part| vec![false; part.chunks.len()]).collect()
}
