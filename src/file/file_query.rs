//! The mesh at any isovalue of a spectrum file, of which only the chunks that were needed are in memory.

use std::sync::Arc;

use super::file_walk::FileWalk;
use super::spectrum_file::SpectrumFile;
use crate::error::Result;
use crate::spectrum::{Mesh, Query, Spectrum};

/// Default for the most triangles of a spectrum that stays in memory as a whole: about 1 GB with its search structures.
const MAX_TRIANGLES: u64 = 8_000_000;

/// Extracts meshes from a spectrum file. Chunks are read when they are first needed; those of the last isovalue stay in memory, and
/// the whole once as much was read: the search structures of a [`Query`] are then worth their time.
#[derive(Debug)]
pub struct FileQuery {
    walk: FileWalk,
    /// Of the chunks in memory; none before the first mesh.
    query: Option<Query<Arc<Spectrum>>>,
    whole: Option<Arc<Spectrum>>,
    /// Triangles read so far.
    n_read: u64,
    max_triangles: u64,
}

impl FileQuery {
    /// Without any chunk yet.
    pub fn new(file: Arc<SpectrumFile>) -> FileQuery {
        FileQuery::within(file, MAX_TRIANGLES)
    }

    /// As [`FileQuery::new`], with the most triangles of a spectrum that stays in memory as a whole.
    pub fn within(file: Arc<SpectrumFile>, max_triangles: u64) -> FileQuery {
        let walk = FileWalk::new(file);
        FileQuery { walk, query: None, whole: None, n_read: 0, max_triangles }
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
        self.read_at(isovalue)?;
        let query = match (self.query.take(), &self.whole) {
            (Some(query), _) => query,
            (None, Some(whole)) => Query::new(whole.clone()),
            (None, None) => Query::for_some(self.walk.spectrum()?, 1),
        };
        self.query.insert(query).mesh_at_into(isovalue, mesh)
    }

    /// Reads the chunks of an isovalue that are not in memory, or the whole if that is worth its time.
    fn read_at(&mut self, isovalue: f64) -> Result<()> {
        if self.whole.is_some() || !self.walk.needs_others(isovalue) {
            return Ok(());
        }
        // The old search structures are dropped before chunks are read.
        self.query = None;
        let file = self.walk.file();
        file.description().check_isovalue(isovalue)?;
        let n_triangles = file.size().triangles;
        self.n_read += file.needed_around(&[isovalue]).0;
        if self.n_read > n_triangles && n_triangles <= self.max_triangles {
            return self.whole().map(drop);
        }
        self.walk.to(isovalue, &mut |_, _| {})
    }

    /// A spectrum with all triangles that are alive at some isovalues, or between them, as [`SpectrumFile::read_around`]; or the whole, if it
    /// is in memory.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFile::read_around`].
    pub fn around(&self, isovalues: &[f64]) -> Result<Arc<Spectrum>> {
        match &self.whole {
            Some(whole) => Ok(whole.clone()),
            None => self.walk.file().read_around(isovalues).map(Arc::new),
        }
    }

    /// The whole spectrum, which is read once.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFile::read`].
    pub fn whole(&mut self) -> Result<Arc<Spectrum>> {
        if let Some(whole) = &self.whole {
            return Ok(whole.clone());
        }
        let file = self.walk.file().clone();
        (self.query, self.walk) = (None, FileWalk::new(file.clone()));
        let whole = Arc::new(file.read()?);
        self.whole = Some(whole.clone());
        Ok(whole)
    }
}
