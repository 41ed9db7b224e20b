//! The mesh at any isovalue of a folder of parts. Chunks are read when they are first needed, and dropped when too many are in memory.

use std::sync::Arc;

use super::folder::SpectrumFolder;
use super::folder_spectrum::FolderSpectrum;
use crate::error::Result;
use crate::spectrum::{Mesh, Query, Spectrum};

/// Default for the most triangles in memory: about 1 GB with their trajectories and search structures.
const MAX_TRIANGLES: u64 = 8_000_000;

/// Extracts meshes from a folder. When a limit of triangles is reached, only the chunks at the new isovalue stay in memory.
#[derive(Debug)]
pub struct FolderQuery {
    read: FolderSpectrum,
    query: Query<Arc<Spectrum>>,
}

impl FolderQuery {
    /// A query of a folder, with the default limit.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if the description of the whole is invalid.
    pub fn new(folder: SpectrumFolder) -> Result<FolderQuery> {
        FolderQuery::within(folder, MAX_TRIANGLES)
    }

    /// As [`FolderQuery::new`], with a limit of triangles in memory. It is exceeded only if one mesh needs more.
    ///
    /// # Errors
    ///
    /// As [`FolderQuery::new`].
    pub fn within(folder: SpectrumFolder, triangles: u64) -> Result<FolderQuery> {
        let read = FolderSpectrum::within(folder, triangles)?;
        Ok(FolderQuery { query: Query::new(read.spectrum().clone()), read })
    }

    /// The mesh at an isovalue: that of [`Query::mesh_at`] of the whole, except for the order of its vertices and triangles.
    ///
    /// # Errors
    ///
    /// As [`Query::mesh_at_into`] and [`SpectrumFolder::read_between`].
    pub fn mesh_at(&mut self, isovalue: f64) -> Result<Mesh> {
        let mut mesh = Mesh::default();
        self.mesh_at_into(isovalue, &mut mesh)?;
        Ok(mesh)
    }

    /// As [`FolderQuery::mesh_at`], reusing the memory of a mesh.
    ///
    /// # Errors
    ///
    /// As [`FolderQuery::mesh_at`].
    pub fn mesh_at_into(&mut self, isovalue: f64, mesh: &mut Mesh) -> Result<()> {
        if !self.read.has(&[isovalue]) {
            // The old search structures are dropped before new ones are built.
            self.query = Query::new(self.read.empty()?);
            let read = self.read.read_at(&[isovalue]);
            self.query = Query::new(self.read.spectrum().clone());
            read?;
        }
        self.query.mesh_at_into(isovalue, mesh)
    }

    /// The number of chunks in memory.
    pub fn n_read(&self) -> usize {
        self.read.n_read()
    }

    /// The number of triangles in memory.
    pub fn n_triangles(&self) -> usize {
        self.read.spectrum().triangles().len()
    }
}
