//! The mesh at any isovalue of a spectrum file, of which only the chunks that were needed are in memory.

use std::ops::Range;
use std::sync::Arc;

use super::spectrum_file::SpectrumFile;
use crate::error::Result;
use crate::spectrum::{Mesh, Query, Spectrum};

/// When as many triangles were read as this times those of the whole, the whole is read: the search structures of a [`Query`]
/// are then worth their time.
const MAX_READ: u64 = 1;

/// Answers queries on a spectrum file. Chunks are read when they are first needed; those of the last isovalue stay in memory.
#[derive(Debug)]
pub struct FileQuery {
    file: Arc<SpectrumFile>,
    /// The ranks whose chunks are in memory.
    ranks: Range<u32>,
    query: Query<Arc<Spectrum>>,
    /// Triangles read so far.
    n_read: u64,
}

impl FileQuery {
    /// Without any chunk yet.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Input`] if the description of the whole is invalid.
    pub fn new(file: Arc<SpectrumFile>) -> FileQuery {
        let none = Arc::new(file.description().clone());
        FileQuery { file, ranks: 0..0, query: Query::for_some(none, 1), n_read: 0 }
    }

    /// The mesh at `isovalue`, as [`Query::mesh_at`] of the whole spectrum returns it.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Range`] outside the range of the spectrum; [`crate::Error::Input`] if a chunk is damaged.
    pub fn mesh_at(&mut self, isovalue: f64) -> Result<Mesh> {
        self.file.description().check_isovalue(isovalue)?;
        if !self.file.is_at(isovalue, &self.ranks) {
            self.read(isovalue)?;
        }
        self.query.mesh_at(isovalue)
    }

    fn read(&mut self, isovalue: f64) -> Result<()> {
        let (n, _) = self.file.needed_around(&[isovalue]);
        self.n_read += n;
        if self.n_read > MAX_READ * self.file.size().triangles {
            self.query = Query::new(Arc::new(self.file.read()?));
            self.ranks = 0..u32::MAX;
        } else {
            let part = self.file.read_around(&[isovalue])?;
            self.query = Query::for_some(Arc::new(part), 1);
            self.ranks = self.file.ranks_around(isovalue);
        }
        Ok(())
    }
}
