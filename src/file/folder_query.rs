//! The mesh at any isovalue of a folder of parts, which are read when they are needed first.

use std::sync::Arc;

use super::folder::SpectrumFolder;
use crate::error::Result;
use crate::spectrum::{Joiner, Query, Seam, Spectrum, SurfaceMesh};

/// Parts that live within this share of the range of an isovalue are read with those that live at it: the search structures are
/// built anew with every part, and the next isovalue is most often near.
const AHEAD: f64 = 1.0 / 16.0;

/// See the module. What was read stays.
#[derive(Debug)]
pub struct FolderQuery {
    folder: SpectrumFolder,
    is_read: Vec<bool>,
    query: Query<Arc<Spectrum>>,
    spectrum: Arc<Spectrum>,
    seam: Seam,
}

impl FolderQuery {
    /// Of a folder, of which nothing is read yet.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if what is known of the whole passes no check.
    pub fn new(folder: SpectrumFolder) -> Result<FolderQuery> {
        let (patch, seam) = Joiner::default().finish();
        let spectrum = Arc::new(folder.spectrum(patch, folder.whole().range())?);
        let query = Query::new(spectrum.clone());
        let is_read = vec![false; folder.index().parts.len()];
        Ok(FolderQuery { folder, is_read, query, spectrum, seam })
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
        self.folder.whole().check_isovalue(isovalue)?;
        let is_missing = |folder: &SpectrumFolder, is_read: &[bool], between| {
            folder.parts_between(between).filter(|&i| !is_read[i]).collect::<Vec<usize>>()
        };
        if !is_missing(&self.folder, &self.is_read, (isovalue, isovalue)).is_empty() {
            let (low, high) = self.folder.whole().range();
            let far = AHEAD * (high - low);
            let around = (isovalue - far, isovalue + far);
            self.read(&is_missing(&self.folder, &self.is_read, around))?;
        }
        self.query.mesh_at_into(isovalue, mesh)
    }

    /// How many parts have been read.
    pub fn n_read(&self) -> usize {
        self.is_read.iter().filter(|&&is_read| is_read).count()
    }

    fn read(&mut self, numbers: &[usize]) -> Result<()> {
        // Their memory is that of what comes in their place.
        let (none, no_seam) = Joiner::default().finish();
        let range = self.folder.whole().range();
        let empty = Arc::new(self.folder.spectrum(none, range)?);
        self.query = Query::new(empty.clone());
        let seam = std::mem::replace(&mut self.seam, no_seam);
        let spectrum = std::mem::replace(&mut self.spectrum, empty);
        let spectrum = Arc::unwrap_or_clone(spectrum);
        let mut joiner = Joiner::resume(spectrum.into_parts().1, seam);
        // Where one is damaged all are read anew by the next query.
        let was_read = std::mem::take(&mut self.is_read);
        self.is_read = vec![false; was_read.len()];
        for &number in numbers {
            let (patch, shared) = self.folder.part(number)?;
            self.folder.append(&mut joiner, number, (&patch, &shared))?;
        }
        let (patch, seam) = joiner.finish();
        self.spectrum = Arc::new(self.folder.spectrum(patch, range)?);
        self.query = Query::new(self.spectrum.clone());
        (self.seam, self.is_read) = (seam, was_read);
        numbers.iter().for_each(|&i| self.is_read[i] = true);
        Ok(())
    }
}
