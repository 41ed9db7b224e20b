//! A spectrum in memory, or a file or a folder of which parts are read on demand.

use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use isospectrum::file::{self, FileQuery, FolderQuery, SpectrumFile, SpectrumFolder};
use isospectrum::{Mesh, Query, Result, Spectrum};

/// A spectrum in memory, a file, or a folder of parts. The index for queries is built on first use.
pub(crate) enum Handle {
    Whole { spectrum: Arc<Spectrum>, query: OnceLock<Mutex<Query<Arc<Spectrum>>>> },
    File { file: Arc<SpectrumFile>, query: Box<Mutex<FileQuery>>, all: OnceLock<Arc<Spectrum>> },
    Folder { folder: Box<SpectrumFolder>, query: Box<Mutex<FolderQuery>> },
}

impl Handle {
    pub(crate) fn whole(spectrum: Spectrum) -> Handle {
        Handle::Whole { spectrum: Arc::new(spectrum), query: OnceLock::new() }
    }

    /// Opens a folder of parts without reading any part.
    pub(crate) fn folder(path: &Path) -> Result<Handle> {
        let folder = Box::new(SpectrumFolder::open(path)?);
        let query = Box::new(Mutex::new(FolderQuery::new((*folder).clone())?));
        Ok(Handle::Folder { folder, query })
    }

    /// Opens a file of either format, or a folder of parts.
    pub(crate) fn open(path: &Path) -> Result<Handle> {
        if file::is_folder(path) {
            return Handle::folder(path);
        }
        if path.extension().is_some_and(|e| e == "thesis") {
            return file::thesis::read(path).map(Handle::whole);
        }
        let file = Arc::new(SpectrumFile::open(path)?);
        let query = Box::new(Mutex::new(FileQuery::new(file.clone())));
        Ok(Handle::File { file, query, all: OnceLock::new() })
    }

    /// The spectrum; of a file or a folder without trajectories and triangles.
    pub(crate) fn summary(&self) -> &Spectrum {
        match self {
            Handle::Whole { spectrum, .. } => spectrum,
            Handle::File { file, .. } => file.description(),
            Handle::Folder { folder, .. } => folder.whole(),
        }
    }

    /// Numbers of trajectories, knots and triangles.
    pub(crate) fn size(&self) -> [u64; 3] {
        match self {
            Handle::Whole { spectrum: s, .. } => {
                [s.n_vertices(), s.knots().len(), s.triangles().len()].map(|n| n as u64)
            }
            Handle::File { file, .. } => {
                let size = file.size();
                [size.trajectories, size.knots, size.triangles]
            }
            Handle::Folder { folder, .. } => folder.index().size,
        }
    }

    /// The mesh at an isovalue, in the voxel frame.
    pub(crate) fn mesh_at(&self, isovalue: f64) -> Result<Mesh> {
        match self {
            Handle::Whole { spectrum, query } => {
                let query = query.get_or_init(|| Mutex::new(Query::new(spectrum.clone())));
                query.lock().unwrap_or_else(PoisonError::into_inner).mesh_at(isovalue)
            }
            Handle::File { query, .. } => {
                query.lock().unwrap_or_else(PoisonError::into_inner).mesh_at(isovalue)
            }
            Handle::Folder { query, .. } => {
                query.lock().unwrap_or_else(PoisonError::into_inner).mesh_at(isovalue)
            }
        }
    }

    /// A spectrum with at least the triangles alive at the isovalues and between them.
    pub(crate) fn around(&self, isovalues: &[f64]) -> Result<Arc<Spectrum>> {
        match self {
            Handle::Whole { spectrum, .. } => Ok(spectrum.clone()),
            Handle::File { file, all, .. } => match all.get() {
                Some(all) => Ok(all.clone()),
                None => file.read_around(isovalues).map(Arc::new),
            },
            Handle::Folder { folder, .. } => folder.read_around(isovalues).map(Arc::new),
        }
    }

    /// The whole spectrum.
    pub(crate) fn all(&self) -> Result<Arc<Spectrum>> {
        let Handle::File { file, all, .. } = self else {
            let (low, high) = self.summary().range();
            return self.around(&[low, high]);
        };
        if let Some(all) = all.get() {
            return Ok(all.clone());
        }
        let read = Arc::new(file.read()?);
        Ok(all.get_or_init(|| read).clone())
    }
}
