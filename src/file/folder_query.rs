//! The mesh at any isovalue of a folder of parts, whose chunks are read when they are needed first, and dropped when they are many.

use std::sync::Arc;

use super::folder::SpectrumFolder;
use super::folder_spectrum::FolderSpectrum;
use crate::error::Result;
use crate::spectrum::{Query, Spectrum, SurfaceMesh};

/// Most triangles that are kept where nothing else is said: about 1 GB with their trajectories and search structures.
const MOST_TRIANGLES: u64 = 8_000_000;

/// See the module. What was read stays until more is wanted than may be kept; then no more stays than lives where the new isovalue is.
#[derive(Debug)]
pub struct FolderQuery {
    read: FolderSpectrum,
    query: Query<Arc<Spectrum>>,
}

impl FolderQuery {
    /// Of a folder, of which nothing is read yet.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if what is known of the whole passes no check.
    pub fn new(folder: SpectrumFolder) -> Result<FolderQuery> {
        FolderQuery::within(folder, MOST_TRIANGLES)
    }

    /// As [`FolderQuery::new`]; no more than so many triangles are kept, but those that a mesh needs.
    ///
    /// # Errors
    ///
    /// As [`FolderQuery::new`].
    pub fn within(folder: SpectrumFolder, triangles: u64) -> Result<FolderQuery> {
        let read = FolderSpectrum::within(folder, triangles)?;
        Ok(FolderQuery { query: Query::new(read.spectrum().clone()), read })
    }

    /// The mesh at an isovalue, as [`Query::mesh_at`] has it of the whole, but for the order of its vertices and triangles.
    ///
    /// # Errors
    ///
    /// As [`Query::mesh_at_into`] and [`SpectrumFolder::read_between`].
    pub fn mesh_at(&mut self, isovalue: f64) -> Result<SurfaceMesh> {
        let mut mesh = SurfaceMesh::default();
        self.mesh_at_into(isovalue, &mut mesh)?;
        Ok(mesh)
    }

    /// As [`FolderQuery::mesh_at`], into a mesh whose memory is used again.
    ///
    /// # Errors
    ///
    /// As [`FolderQuery::mesh_at`].
    pub fn mesh_at_into(&mut self, isovalue: f64, mesh: &mut SurfaceMesh) -> Result<()> {
        if !self.read.has(&[isovalue]) {
            // What is searched goes before what comes in its place.
            self.query = Query::new(self.read.nothing()?);
            let read = self.read.read_at(&[isovalue]);
            self.query = Query::new(self.read.spectrum().clone());
            read?;
        }
        self.query.mesh_at_into(isovalue, mesh)
    }

    /// How many chunks are kept.
    pub fn n_read(&self) -> usize {
        self.read.n_read()
    }

    /// How many triangles are kept.
    pub fn n_triangles(&self) -> usize {
        self.read.spectrum().triangles().len()
    }
}
