//! The mesh at any isovalue of a folder of parts, whose chunks are read when they are needed first, and dropped when they are many.

use std::sync::Arc;

use super::folder::{SpectrumFolder, above, at_least, living};
use crate::error::Result;
use crate::spectrum::{Joiner, Query, Seam, Spectrum, SurfaceMesh, Triangle};

/// Chunks within this share of the range of an isovalue are read with those that live at it: the search structures are
/// built anew with every chunk, and the next isovalue is most often near.
const AHEAD: f64 = 1.0 / 16.0;

/// Most triangles that are kept where nothing else is said: about 1 GB with their trajectories and search structures.
const MOST_TRIANGLES: u64 = 8_000_000;

/// See the module. What was read stays until more is wanted than may be kept; then no more stays than lives where the new isovalue is.
#[derive(Debug)]
pub struct FolderQuery {
    folder: SpectrumFolder,
    /// Of each part, its chunks that are there.
    is_read: Vec<Vec<bool>>,
    query: Query<Arc<Spectrum>>,
    spectrum: Arc<Spectrum>,
    seam: Seam,
    most: u64,
}

/// A chunk by its part and its number there.
type Place = (usize, usize);

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
        let (patch, seam) = Joiner::default().finish();
        let spectrum = Arc::new(folder.spectrum(patch, folder.whole().range())?);
        let query = Query::new(spectrum.clone());
        let is_read = none_read(&folder);
        Ok(FolderQuery { folder, is_read, query, spectrum, seam, most: triangles })
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
        if !self.missing((isovalue, isovalue)).0.is_empty() {
            let (low, high) = self.folder.whole().range();
            let far = AHEAD * (high - low);
            let around = (isovalue - far, isovalue + far);
            let held = self.spectrum.triangles().len() as u64;
            let (mut wanted, n) = self.missing(around);
            if held + n > self.most {
                self.forget()?;
                let (all, n) = self.missing(around);
                wanted = if n > self.most { self.missing((isovalue, isovalue)).0 } else { all };
            }
            self.read(&wanted)?;
        }
        self.query.mesh_at_into(isovalue, mesh)
    }

    /// How many chunks are kept.
    pub fn n_read(&self) -> usize {
        self.is_read.iter().flatten().filter(|&&is_read| is_read).count()
    }

    /// How many triangles are kept.
    pub fn n_triangles(&self) -> usize {
        self.spectrum.triangles().len()
    }

    /// The chunks between two isovalues that are not there, and how many triangles they have.
    fn missing(&self, between: (f64, f64)) -> (Vec<Place>, u64) {
        let chunks = self.folder.chunks_between(between);
        let missing = chunks.filter(|((part, chunk), _)| !self.is_read[*part][*chunk]);
        missing.fold((Vec::new(), 0), |(mut places, n), (place, chunk)| {
            places.push(place);
            (places, n + chunk.triangles)
        })
    }

    /// Drops all that was read; what it was, to be gone on with.
    fn emptied(&mut self) -> Result<(Arc<Spectrum>, Seam, Vec<Vec<bool>>)> {
        let (none, no_seam) = Joiner::default().finish();
        let empty = Arc::new(self.folder.spectrum(none, self.folder.whole().range())?);
        self.query = Query::new(empty.clone());
        let seam = std::mem::replace(&mut self.seam, no_seam);
        let spectrum = std::mem::replace(&mut self.spectrum, empty);
        let is_read = std::mem::replace(&mut self.is_read, none_read(&self.folder));
        Ok((spectrum, seam, is_read))
    }

    fn forget(&mut self) -> Result<()> {
        self.emptied().map(drop)
    }

    fn read(&mut self, places: &[Place]) -> Result<()> {
        // Their memory is that of what comes in their place. Where one is damaged all are read anew by the next query.
        let (spectrum, seam, mut is_read) = self.emptied()?;
        let spectrum = Arc::unwrap_or_clone(spectrum);
        let mut joiner = Joiner::resume(spectrum.into_parts().1, seam);
        for &place in places {
            let (part, chunk) = place;
            let (patch, shared) = self.folder.chunk(place)?;
            let there = self.folder.index().parts[part].chunks.iter().zip(&is_read[part]);
            let there = there.filter(|c| *c.1);
            // A triangle is there if a chunk in which it lives is.
            let there = there.map(|(c, _)| (above(&patch, c.from), at_least(&patch, c.to)));
            let there: Vec<(u32, u32)> = there.collect();
            let is_new = |t: &Triangle| !there.iter().any(|c| t.birth < c.1 && c.0 <= t.death);
            let (patch, shared) = living(&patch, &shared, is_new);
            self.folder.append(&mut joiner, place, (&patch, &shared))?;
            is_read[part][chunk] = true;
        }
        let (patch, seam) = joiner.finish();
        self.spectrum = Arc::new(self.folder.spectrum(patch, self.folder.whole().range())?);
        self.query = Query::new(self.spectrum.clone());
        (self.seam, self.is_read) = (seam, is_read);
        Ok(())
    }
}

fn none_read(folder: &SpectrumFolder) -> Vec<Vec<bool>> {
    folder.index().parts.iter().map(|part| vec![false; part.chunks.len()]).collect()
}
