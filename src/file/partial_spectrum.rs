//! The spectrum of those chunks of a file that some isovalues need. Chunks are read when they are first needed.

use std::ops::Range;
use std::sync::Arc;

use super::spectrum_file::SpectrumFile;
use crate::error::Result;
use crate::spectrum::Spectrum;

/// All isovalues.
const ALL: Range<f64> = f64::NEG_INFINITY..f64::INFINITY;

/// Keeps the chunks of the last isovalues; once as many triangles were read as the whole has, the whole, if it is not too large.
#[derive(Debug)]
pub struct PartialSpectrum {
    file: Arc<SpectrumFile>,
    /// The isovalues at which the spectrum is complete.
    isovalues: Range<f64>,
    spectrum: Arc<Spectrum>,
    /// Triangles read so far.
    n_read: u64,
    max_triangles: u64,
}

impl PartialSpectrum {
    /// Without any chunk yet. The whole is kept if it has at most so many triangles.
    pub fn new(file: Arc<SpectrumFile>, max_triangles: u64) -> PartialSpectrum {
        let spectrum = Arc::new(file.description().clone());
        PartialSpectrum { file, isovalues: 0.0..0.0, spectrum, n_read: 0, max_triangles }
    }

    /// The file.
    pub fn file(&self) -> &Arc<SpectrumFile> {
        &self.file
    }

    /// The spectrum of the chunks in memory. Its range is that of the whole, but its meshes are complete only at isovalues that it
    /// [has](PartialSpectrum::has).
    pub fn spectrum(&self) -> &Arc<Spectrum> {
        &self.spectrum
    }

    /// Whether all chunks at some isovalues are in memory.
    pub fn has(&self, isovalues: &[f64]) -> bool {
        isovalues.iter().all(|c| self.isovalues.contains(c))
    }

    /// Whether all chunks of the file are in memory.
    pub fn is_whole(&self) -> bool {
        self.isovalues == ALL
    }

    /// Reads the chunks of some isovalues, and of those between them, unless they are in memory.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside the range of the spectrum; [`Error::Input`](crate::Error::Input) if a chunk is damaged.
    pub fn read_at(&mut self, isovalues: &[f64]) -> Result<()> {
        isovalues.iter().try_for_each(|&c| self.file.description().check_isovalue(c))?;
        if self.has(isovalues) {
            return Ok(());
        }
        let n_triangles = self.file.size().triangles;
        self.n_read += self.file.needed_around(isovalues).0;
        if self.n_read > n_triangles && n_triangles <= self.max_triangles {
            return self.whole().map(drop);
        }
        // The old chunks are dropped before new ones are read.
        self.isovalues = 0.0..0.0;
        self.spectrum = Arc::new(self.file.description().clone());
        self.spectrum = Arc::new(self.file.read_around(isovalues)?);
        let same = isovalues.iter().map(|&c| self.file.same_chunks(c));
        let join = |a: Range<f64>, b: Range<f64>| a.start.min(b.start)..a.end.max(b.end);
        self.isovalues = same.reduce(join).unwrap_or(0.0..0.0);
        Ok(())
    }

    /// The whole spectrum, which is read once and kept.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if a chunk is damaged.
    pub fn whole(&mut self) -> Result<Arc<Spectrum>> {
        if !self.is_whole() {
            self.spectrum = Arc::new(self.file.read()?);
            self.isovalues = ALL;
        }
        Ok(self.spectrum.clone())
    }
}
