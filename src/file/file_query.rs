//! The mesh at any isovalue of a spectrum file, of which only the chunks that were needed are in memory.

use std::sync::Arc;

use super::partial_spectrum::PartialSpectrum;
use super::spectrum_file::SpectrumFile;
use crate::error::Result;
use crate::spectrum::{Mesh, Query, Spectrum};

/// Default for the most triangles of a spectrum that stays in memory as a whole: about 1 GB with its search structures.
const MAX_TRIANGLES: u64 = 8_000_000;

/// Extracts meshes from a spectrum file. Chunks are read when they are first needed; those of the last isovalue stay in memory, and
/// the whole once as much was read: the search structures of a [`Query`] are then worth their time.
#[derive(Debug)]
pub struct FileQuery {
    read: PartialSpectrum,
    /// Of the chunks in memory; none before the first mesh.
    query: Option<Query<Arc<Spectrum>>>,
}

impl FileQuery {
    /// Without any chunk yet.
    pub fn new(file: Arc<SpectrumFile>) -> FileQuery {
        FileQuery::within(file, MAX_TRIANGLES)
    }

    /// As [`FileQuery::new`], with the most triangles of a spectrum that stays in memory as a whole.
    pub fn within(file: Arc<SpectrumFile>, max_triangles: u64) -> FileQuery {
        FileQuery { read: PartialSpectrum::new(file, max_triangles), query: None }
    }

    /// The mesh at `isovalue`, as [`Query::mesh_at`] of the whole spectrum returns it.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Range`] outside the range of the spectrum; [`crate::Error::Input`] if a chunk is damaged.
    pub fn mesh_at(&mut self, isovalue: f64) -> Result<Mesh> {
        let mut mesh = Mesh::default();
        self.mesh_at_into(isovalue, &mut mesh)?;
        Ok(mesh)
    }

    /// As [`FileQuery::mesh_at`], reusing the memory of a mesh.
    ///
    /// # Errors
    ///
    /// As [`FileQuery::mesh_at`].
    pub fn mesh_at_into(&mut self, isovalue: f64, mesh: &mut Mesh) -> Result<()> {
        if !self.read.has(&[isovalue]) {
            // The old search structures are dropped before chunks are read.
            self.query = None;
            self.read.read_at(&[isovalue])?;
        }
        let query = self.query.get_or_insert_with(|| {
            let spectrum = self.read.spectrum().clone();
            if self.read.is_whole() { Query::new(spectrum) } else { Query::for_some(spectrum, 1) }
        });
        query.mesh_at_into(isovalue, mesh)
    }

    /// A spectrum with all triangles that are alive at some isovalues, or between them, as [`SpectrumFile::read_around`]; or the whole, if it
    /// is in memory.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFile::read_around`].
    pub fn around(&self, isovalues: &[f64]) -> Result<Arc<Spectrum>> {
        if self.read.is_whole() {
            return Ok(self.read.spectrum().clone());
        }
        self.read.file().read_around(isovalues).map(Arc::new)
    }

    /// The whole spectrum, which is read once.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFile::read`].
    pub fn whole(&mut self) -> Result<Arc<Spectrum>> {
        if !self.read.is_whole() {
            self.query = None;
        }
        self.read.whole()
    }
}
