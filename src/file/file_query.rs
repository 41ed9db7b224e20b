//! The mesh at any isovalue of a spectrum file, of which only the chunks that were needed are in memory.

use std::ops::Range;
use std::sync::Arc;

use super::spectrum_file::SpectrumFile;
use crate::error::Result;
use crate::spectrum::{Mesh, Query, Spectrum};

/// When as many triangles were read as this times those of the whole, the whole is read: the search structures of a [`Query`]
/// are then worth their time.
const MAX_READ: u64 = 1;

/// Answers queries on a spectrum file. Chunks are read when they are first needed; those of the last isovalue stay in memory, and the whole
/// once it was read.
#[derive(Debug)]
pub struct FileQuery {
    file: Arc<SpectrumFile>,
    /// The ranks at which the query has meshes.
    ranks: Range<u32>,
    query: Query<Arc<Spectrum>>,
    /// Triangles read for meshes so far.
    n_read: u64,
    whole: Option<Arc<Spectrum>>,
}

impl FileQuery {
    /// Without any chunk yet.
    pub fn new(file: Arc<SpectrumFile>) -> FileQuery {
        let none = Arc::new(file.description().clone());
        FileQuery { file, ranks: 0..0, query: Query::for_some(none, 1), n_read: 0, whole: None }
    }

    /// The mesh at `isovalue`, as [`Query::mesh_at`] of the whole spectrum returns it.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Range`] outside the range of the spectrum; [`crate::Error::Input`] if a chunk is damaged.
    pub fn mesh_at(&mut self, isovalue: f64) -> Result<Mesh> {
        self.file.description().check_isovalue(isovalue)?;
        if !self.ranks.contains(&self.file.rank_of(isovalue)) {
            self.read(isovalue)?;
        }
        self.query.mesh_at(isovalue)
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
            None => self.file.read_around(isovalues).map(Arc::new),
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
        let whole = Arc::new(self.file.read()?);
        Ok(self.whole.insert(whole).clone())
    }

    fn read(&mut self, isovalue: f64) -> Result<()> {
        let (n, _) = self.file.needed_around(&[isovalue]);
        self.n_read += n;
        if self.whole.is_some() || self.n_read > MAX_READ * self.file.size().triangles {
            self.query = Query::new(self.whole()?);
            self.ranks = 0..u32::MAX;
        } else {
            let part = self.file.read_around(&[isovalue])?;
            self.query = Query::for_some(Arc::new(part), 1);
            self.ranks = self.file.ranks_around(isovalue);
        }
        Ok(())
    }
}
