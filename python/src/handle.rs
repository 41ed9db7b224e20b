//! A spectrum in memory, or a file of which chunks are read on demand.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use isospectrum::file::{self, FileQuery, SpectrumFile};
use isospectrum::{Mesh, Query, Result, Spectrum};

/// A spectrum in memory, or a file. The index for queries is built on first use.
pub(crate) enum Handle {
    Whole { spectrum: Arc<Spectrum>, query: Box<OnceLock<Shared<Query<Arc<Spectrum>>>>> },
    File { file: Arc<SpectrumFile>, query: Box<Shared<FileQuery>> },
}

/// A query, and a mesh whose memory is used again.
pub(crate) struct Asked<Q> {
    query: Q,
    mesh: Mesh,
}

/// A query for one thread at a time.
type Shared<Q> = Mutex<Asked<Q>>;

impl<Q> Asked<Q> {
    fn shared(query: Q) -> Shared<Q> {
        Mutex::new(Asked { query, mesh: Mesh::default() })
    }
}

impl Handle {
    pub(crate) fn whole(spectrum: Spectrum) -> Handle {
        Handle::Whole { spectrum: Arc::new(spectrum), query: Box::default() }
    }

    /// Opens a file of either format.
    pub(crate) fn open(path: &Path) -> Result<Handle> {
        if path.extension().is_some_and(|e| e == "thesis") {
            return file::thesis::read(path).map(Handle::whole);
        }
        let file = Arc::new(SpectrumFile::open(path)?);
        let query = Box::new(Asked::shared(FileQuery::new(file.clone())));
        Ok(Handle::File { file, query })
    }

    /// The spectrum; of a file without trajectories and triangles.
    pub(crate) fn summary(&self) -> &Spectrum {
        match self {
            Handle::Whole { spectrum, .. } => spectrum,
            Handle::File { file, .. } => file.description(),
        }
    }

    /// The file, if the spectrum is one.
    pub(crate) fn path(&self) -> Option<&Path> {
        match self {
            Handle::Whole { .. } => None,
            Handle::File { file, .. } => Some(file.path()),
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
        }
    }

    /// The mesh at an isovalue, in the voxel frame.
    pub(crate) fn mesh_at(&self, isovalue: f64) -> Result<Mesh> {
        match self {
            Handle::Whole { spectrum, query } => {
                let query = query.get_or_init(|| Asked::shared(Query::new(spectrum.clone())));
                locked(query).query.mesh_at(isovalue)
            }
            Handle::File { query, .. } => locked(query).query.mesh_at(isovalue),
        }
    }

    /// Calls `take` with the mesh at an isovalue, in the voxel frame.
    pub(crate) fn with_mesh_at<R>(
        &self,
        isovalue: f64,
        take: impl FnOnce(&Mesh) -> R,
    ) -> Result<R> {
        match self {
            Handle::Whole { spectrum, query } => {
                let query = query.get_or_init(|| Asked::shared(Query::new(spectrum.clone())));
                let Asked { query, mesh } = &mut *locked(query);
                query.mesh_at_into(isovalue, mesh).map(|()| take(mesh))
            }
            Handle::File { query, .. } => {
                let Asked { query, mesh } = &mut *locked(query);
                query.mesh_at_into(isovalue, mesh).map(|()| take(mesh))
            }
        }
    }

    /// A spectrum with at least the triangles alive at the isovalues and between them.
    pub(crate) fn around(&self, isovalues: &[f64]) -> Result<Arc<Spectrum>> {
        match self {
            Handle::Whole { spectrum, .. } => Ok(spectrum.clone()),
            Handle::File { query, .. } => locked(query).query.around(isovalues),
        }
    }

    /// The whole spectrum.
    pub(crate) fn all(&self) -> Result<Arc<Spectrum>> {
        match self {
            Handle::Whole { spectrum, .. } => Ok(spectrum.clone()),
            Handle::File { query, .. } => locked(query).query.whole(),
        }
    }
}

/// What a mutex holds. A panic while it was locked leaves it usable.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
