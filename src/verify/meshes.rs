//! What a verification asks of a spectrum, in memory or in a file. Of a file only the chunks at one isovalue are in memory, so isovalues that
//! increase are answered fastest.

use std::borrow::Cow;
use std::sync::Arc;

use super::coherence::Lifetimes;
use super::vertex_set::VertexSet;
use crate::error::Result;
use crate::file::{FileWalk, SpectrumFile};
use crate::spectrum::{Mesh, Query, Spectrum};

/// The meshes of a spectrum.
pub(super) enum Meshes<'a> {
    /// Of one in memory.
    InMemory(&'a Spectrum, Box<Query<&'a Spectrum>>),
    /// Of a file.
    OfFile(Box<OfFile>),
}

/// The meshes of a file, and what is known of it so far.
pub(super) struct OfFile {
    walk: FileWalk,
    /// Of the chunks in memory; none before the first mesh of these.
    query: Option<Query<Arc<Spectrum>>>,
    lifetimes: Lifetimes,
}

impl<'a> Meshes<'a> {
    pub(super) fn in_memory(spectrum: &'a Spectrum) -> Self {
        Meshes::InMemory(spectrum, Box::new(Query::new(spectrum)))
    }

    pub(super) fn of_file(file: Arc<SpectrumFile>) -> Self {
        let walk = FileWalk::counting(file);
        let lifetimes = Lifetimes::new(walk.file().description(), walk.isovalues());
        Meshes::OfFile(Box::new(OfFile { walk, query: None, lifetimes }))
    }

    /// The spectrum with its range, events and parameters; of a file without triangles.
    pub(super) fn about(&self) -> &Spectrum {
        match self {
            Meshes::InMemory(spectrum, _) => spectrum,
            Meshes::OfFile(file) => file.walk.file().description(),
        }
    }

    /// Reads all chunks of a file up to an isovalue that were not read yet.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if a chunk is damaged.
    pub(super) fn see_up_to(&mut self, isovalue: f64) -> Result<()> {
        let Meshes::OfFile(file) = self else { return Ok(()) };
        let OfFile { walk, query, lifetimes } = &mut **file;
        if walk.is_behind(isovalue) {
            *query = None;
        }
        walk.up_to(isovalue, &mut |birth, death| lifetimes.add(birth, death))
    }

    /// The lifetimes of all triangles. All chunks of a file that were not read yet are read, and the whole is checked.
    ///
    /// # Errors
    ///
    /// As [`Meshes::see_up_to`].
    pub(super) fn lifetimes(&mut self) -> Result<Cow<'_, Lifetimes>> {
        match self {
            Meshes::InMemory(spectrum, _) => {
                let mut lifetimes = Lifetimes::new(spectrum, spectrum.isovalues().to_vec());
                spectrum.triangles().iter().for_each(|t| lifetimes.add(t.birth, t.death));
                Ok(Cow::Owned(lifetimes))
            }
            Meshes::OfFile(file) => {
                let OfFile { walk, query, lifetimes } = &mut **file;
                *query = None;
                walk.finish(&mut |birth, death| lifetimes.add(birth, death))?;
                Ok(Cow::Borrowed(lifetimes))
            }
        }
    }

    /// The mesh at an isovalue.
    ///
    /// # Errors
    ///
    /// As [`Meshes::see_up_to`]; [`Error::Range`](crate::Error::Range) outside the range of the spectrum.
    pub(super) fn mesh_at(&mut self, isovalue: f64) -> Result<Mesh> {
        match self {
            Meshes::InMemory(_, query) => query.mesh_at(isovalue),
            Meshes::OfFile(file) => {
                file.walk.file().description().check_isovalue(isovalue)?;
                file.read_at(isovalue)?;
                let query = match file.query.take() {
                    Some(query) => query,
                    None => Query::for_some(file.walk.spectrum()?, 1),
                };
                file.query.insert(query).mesh_at(isovalue)
            }
        }
    }

    /// The vertices of the mesh at an isovalue.
    ///
    /// # Errors
    ///
    /// As [`Meshes::mesh_at`].
    pub(super) fn vertices_at(&mut self, isovalue: f64) -> Result<VertexSet> {
        match self {
            Meshes::InMemory(spectrum, _) => {
                Ok(vertices(spectrum, isovalue, spectrum.n_vertices() as u64, u64::from))
            }
            Meshes::OfFile(file) => {
                file.read_at(isovalue)?;
                let spectrum = file.walk.spectrum()?;
                let number = |v: u32| file.walk.number_of(v);
                Ok(vertices(&spectrum, isovalue, file.walk.n_vertices(), number))
            }
        }
    }
}

impl OfFile {
    /// Reads the chunks of an isovalue that are not in memory.
    fn read_at(&mut self, isovalue: f64) -> Result<()> {
        if !self.walk.needs_others(isovalue) {
            return Ok(());
        }
        // It would keep the old chunks in memory.
        self.query = None;
        self.walk.to(isovalue, &mut |birth, death| self.lifetimes.add(birth, death))
    }
}

/// The vertices of the mesh of a spectrum at an isovalue, by numbers below `n`.
fn vertices(spectrum: &Spectrum, isovalue: f64, n: u64, number: impl Fn(u32) -> u64) -> VertexSet {
    let mut vertices = VertexSet::new(n);
    // Below the first isovalue of the table there is no mesh.
    if let Some(rank) = spectrum.rank_at(isovalue) {
        let alive = spectrum.triangles().iter().filter(|t| t.birth <= rank && rank < t.death);
        alive.flat_map(|t| t.vertices).for_each(|v| vertices.insert(number(v)));
    }
    vertices
}
