//! A spectrum in memory, or a file or a folder of which parts are read on demand.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use isospectrum::file::{self, FileQuery, FolderQuery, SpectrumFile, SpectrumFolder};
use isospectrum::{Mesh, Query, Result, Spectrum};

/// A spectrum in memory, a file, or a folder of parts. The index for queries is built on first use.
pub(crate) enum Handle {
    Whole { spectrum: Arc<Spectrum>, query: OnceLock<Mutex<Query<Arc<Spectrum>>>> },
    File { file: Arc<SpectrumFile>, query: Box<Mutex<FileQuery>> },
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
        Ok(Handle::File { file, query })
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
                locked(query).mesh_at(isovalue)
            }
            Handle::File { query, .. } => locked(query).mesh_at(isovalue),
            Handle::Folder { query, .. } => locked(query).mesh_at(isovalue),
        }
    }

    /// A spectrum with at least the triangles alive at the isovalues and between them.
    pub(crate) fn around(&self, isovalues: &[f64]) -> Result<Arc<Spectrum>> {
        match self {
            Handle::Whole { spectrum, .. } => Ok(spectrum.clone()),
            Handle::File { query, .. } => locked(query).around(isovalues),
            Handle::Folder { folder, .. } => folder.read_around(isovalues).map(Arc::new),
        }
    }

    /// The whole spectrum.
    pub(crate) fn all(&self) -> Result<Arc<Spectrum>> {
        if let Handle::File { query, .. } = self {
            return locked(query).whole();
        }
        let (low, high) = self.summary().range();
        self.around(&[low, high])
    }
}

/// What a mutex holds. A panic while it was locked leaves it usable.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
