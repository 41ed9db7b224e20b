//! What a spectrum holds: all of it, or a folder of parts, of which those are read that are wanted.

use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use isospectrum::file::{self, FolderQuery, SpectrumFolder};
use isospectrum::{Mesh, Query, Result, Spectrum};

/// See the module. What answers queries is built when it is wanted first.
pub(crate) enum Held {
    Whole { spectrum: Arc<Spectrum>, query: OnceLock<Mutex<Query<Arc<Spectrum>>>> },
    Folder { folder: Box<SpectrumFolder>, query: Box<Mutex<FolderQuery>> },
}

impl Held {
    pub(crate) fn whole(spectrum: Spectrum) -> Held {
        Held::Whole { spectrum: Arc::new(spectrum), query: OnceLock::new() }
    }

    /// A folder of parts, of which none is read.
    pub(crate) fn folder(path: &Path) -> Result<Held> {
        let folder = Box::new(SpectrumFolder::open(path)?);
        let query = Box::new(Mutex::new(FolderQuery::new((*folder).clone())?));
        Ok(Held::Folder { folder, query })
    }

    /// Of a file of either format, or a folder.
    pub(crate) fn open(path: &Path) -> Result<Held> {
        if file::is_folder(path) {
            return Held::folder(path);
        }
        let is_thesis = path.extension().is_some_and(|e| e == "thesis");
        let read = if is_thesis { file::thesis::read(path) } else { file::read(path) };
        read.map(Held::whole)
    }

    /// What is known of the whole; of a folder without triangles.
    pub(crate) fn told(&self) -> &Spectrum {
        match self {
            Held::Whole { spectrum, .. } => spectrum,
            Held::Folder { folder, .. } => folder.whole(),
        }
    }

    /// Trajectories, knots and triangles.
    pub(crate) fn size(&self) -> [u64; 3] {
        match self {
            Held::Whole { spectrum: s, .. } => {
                [s.n_vertices(), s.knots().len(), s.triangles().len()].map(|n| n as u64)
            }
            Held::Folder { folder, .. } => folder.index().size,
        }
    }

    /// The mesh at an isovalue, voxel frame.
    pub(crate) fn mesh_at(&self, isovalue: f64) -> Result<Mesh> {
        match self {
            Held::Whole { spectrum, query } => {
                let query = query.get_or_init(|| Mutex::new(Query::new(spectrum.clone())));
                query.lock().unwrap_or_else(PoisonError::into_inner).mesh_at(isovalue)
            }
            Held::Folder { query, .. } => {
                query.lock().unwrap_or_else(PoisonError::into_inner).mesh_at(isovalue)
            }
        }
    }

    /// A spectrum with all triangles that live at some isovalues, or between them.
    pub(crate) fn around(&self, isovalues: &[f64]) -> Result<Arc<Spectrum>> {
        match self {
            Held::Whole { spectrum, .. } => Ok(spectrum.clone()),
            Held::Folder { folder, .. } => folder.read_around(isovalues).map(Arc::new),
        }
    }

    /// All of it.
    pub(crate) fn all(&self) -> Result<Arc<Spectrum>> {
        let (low, high) = self.told().range();
        self.around(&[low, high])
    }
}
