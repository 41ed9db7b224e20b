//! The mesh at any isovalue (thesis sections 4.1 and 4.3).
//!
//! The active triangles come from the interval tree, or from the last query where the isovalue
//! moved a little; each of their vertices is found in its trajectory by binary search and
//! interpolated. The cost is proportional to the number of active triangles; no array of the spectrum's size is cleared.

use std::ops::Deref;

use rayon::prelude::*;

use super::active_set::ActiveSet;
use super::assembly::Assembly;
use super::data::Spectrum;
use super::elements::{Knot, Triangle};
use super::interpolate::{between, fraction};
use super::mesh::Mesh;
use crate::error::Result;

/// For at most so many isovalues, scanning all triangles is faster: a scan takes a sixtieth of the time that building the search structures takes.
const MAX_SCANS: usize = 32;

/// Trajectories of at most so many knots are searched in the array of knots, which is read anyway.
const SHORT: usize = 4;

/// Answers queries on one spectrum, fastest where successive isovalues are close.
///
/// `S` is a reference to the spectrum: `&Spectrum`, or `Arc<Spectrum>` for a query without a lifetime.
///
/// ```
/// use std::sync::Arc;
///
/// # fn of(spectrum: isospectrum::Spectrum) -> isospectrum::Result<()> {
/// let spectrum = Arc::new(spectrum);
/// let mut query = isospectrum::Query::new(spectrum.clone());
/// let mesh = query.mesh_at(spectrum.range().0)?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Query<S> {
    spectrum: S,
    search: Search,
    assembly: Assembly,
}

/// How active triangles and the positions of their vertices are found.
#[derive(Clone, Debug)]
enum Search {
    Indexed(Box<Index>),
    /// By a scan of all triangles; the active triangles of the last mesh.
    Scan(Vec<u32>),
}

/// The search structures.
#[derive(Clone, Debug)]
struct Index {
    active: ActiveSet,
    /// The vertices of each triangle, and whether it is a cap; more compact than
    /// [`Spectrum::triangles`].
    triangles: Vec<([u32; 3], bool)>,
    trajectories: Trajectories,
}

/// The knots, arranged for interpolation.
#[derive(Clone, Debug)]
struct Trajectories {
    /// As [`Spectrum::knots`].
    knots: Vec<TimedKnot>,
    /// Their ranks: sixteen fit in a cache line, which makes searches in long trajectories faster.
    ranks: Vec<u32>,
}

impl<S: Deref<Target = Spectrum>> Query<S> {
    /// Builds the search structures, in O(n log n) of the number of triangles. The spectrum must
    /// pass [`Spectrum::check`].
    pub fn new(spectrum: S) -> Self {
        let search = Search::Indexed(Box::new(Index::new(&spectrum)));
        Query { search, assembly: Assembly::new(&spectrum), spectrum }
    }

    /// A query for a known number of isovalues. If there are few, no search structures are built.
    pub fn for_some(spectrum: S, n_isovalues: usize) -> Self {
        if n_isovalues > MAX_SCANS {
            return Query::new(spectrum);
        }
        Query { search: Search::Scan(Vec::new()), assembly: Assembly::new(&spectrum), spectrum }
    }

    /// The mesh at `isovalue`: the triangles with birth <= isovalue < death, by index, and their
    /// vertices, by number.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside the closed [`Spectrum::range`].
    pub fn mesh_at(&mut self, isovalue: f64) -> Result<Mesh> {
        let mut mesh = Mesh::default();
        self.mesh_at_into(isovalue, &mut mesh)?;
        Ok(mesh)
    }

    /// As [`Query::mesh_at`], reusing the memory of a mesh.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside the closed [`Spectrum::range`]; the mesh is then unchanged.
    pub fn mesh_at_into(&mut self, isovalue: f64, mesh: &mut Mesh) -> Result<()> {
        let spectrum = &*self.spectrum;
        spectrum.check_isovalue(isovalue)?;
        let Some(rank) = spectrum.rank_at(isovalue) else {
            *mesh = Mesh::default();
            return Ok(());
        };
        let assembly = &mut self.assembly;
        match &mut self.search {
            Search::Indexed(index) => {
                let Index { active, triangles, trajectories } = &mut **index;
                let triangles = active.move_to(rank).iter().map(|&i| triangles[i as usize]);
                let position = |v| trajectories.vertex_at(spectrum, v, rank, isovalue);
                assembly.assemble(triangles, position, mesh);
            }
            Search::Scan(active) => {
                let all = spectrum.triangles();
                let is_active = |t: &Triangle| t.birth <= rank && rank < t.death;
                let numbers = (0..all.len() as u32).into_par_iter();
                *active = numbers.filter(|&i| is_active(&all[i as usize])).collect();
                let triangle = |&i: &u32| (all[i as usize].vertices, all[i as usize].cap);
                let position = |v| spectrum.vertex_at(v, rank, isovalue);
                assembly.assemble(active.iter().map(triangle), position, mesh);
            }
        }
        Ok(())
    }
}

impl<S> Query<S> {
    /// The numbers in the spectrum of the vertices and the triangles of the last mesh.
    pub fn parts(&self) -> (&[u32], &[u32]) {
        let triangles = match &self.search {
            Search::Indexed(index) => index.active.triangles(),
            Search::Scan(active) => active,
        };
        (self.assembly.vertices(), triangles)
    }
}

impl Index {
    fn new(spectrum: &Spectrum) -> Self {
        let knots = spectrum.knots().iter().map(|k| TimedKnot::new(k, spectrum.isovalues()));
        Index {
            active: ActiveSet::new(spectrum.triangles()),
            triangles: spectrum.triangles().iter().map(|t| (t.vertices, t.cap)).collect(),
            trajectories: Trajectories {
                knots: knots.collect(),
                ranks: spectrum.knots().iter().map(|knot| knot.rank).collect(),
            },
        }
    }
}

impl Trajectories {
    /// As [`Spectrum::vertex_at`].
    #[inline]
    fn vertex_at(&self, spectrum: &Spectrum, v: u32, rank: u32, isovalue: f64) -> [f32; 3] {
        let first_knot = spectrum.first_knot();
        let range = first_knot[v as usize] as usize..first_knot[v as usize + 1] as usize;
        let trajectory = &self.knots[range.clone()];
        let next = if trajectory.len() <= SHORT {
            trajectory.partition_point(|knot| knot.isovalue <= isovalue)
        } else {
            self.ranks[range].partition_point(|&r| r <= rank)
        };
        let before = &trajectory[next.saturating_sub(1)];
        let after = &trajectory[next.min(trajectory.len() - 1)];
        if before.isovalue == after.isovalue || before.isovalue == isovalue {
            return before.position;
        }
        between(
            before.position,
            after.position,
            fraction(isovalue, before.isovalue, after.isovalue),
        )
    }
}

/// A knot with its isovalue, so that no table has to be read.
#[derive(Clone, Copy, Debug)]
struct TimedKnot {
    isovalue: f64,
    position: [f32; 3],
}

impl TimedKnot {
    fn new(knot: &Knot, isovalues: &[f64]) -> Self {
        TimedKnot { isovalue: isovalues[knot.rank as usize], position: knot.position }
    }
}

impl Spectrum {
    /// The mesh at one isovalue, by a scan of all triangles. A [`Query`] is faster for many isovalues.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`].
    pub fn mesh_at(&self, isovalue: f64) -> Result<Mesh> {
        Query::for_some(self, 1).mesh_at(isovalue)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Backend, Choice};
    use crate::progress::Silent;
    use crate::sweep::{Parameters, compute};
    use crate::volume::phantom;

    #[test]
    fn meshes_are_the_same_with_search_structures_and_without() {
        let volume = std::sync::Arc::new(phantom("blobs:16").expect("a phantom"));
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent).expect("one");
        let mut indexed = Query::for_some(&spectrum, MAX_SCANS + 1);
        let mut scanning = Query::for_some(&spectrum, MAX_SCANS);
        assert!(matches!(
            (&indexed.search, &scanning.search),
            (Search::Indexed(_), Search::Scan(_))
        ));
        let (low, high) = spectrum.range();
        let isovalues = [low, high].into_iter().chain((1..20).map(|i| {
            let share = f64::from(i * 7 % 20) / 20.0;
            low + share * (high - low)
        }));
        // At isovalues of the table, too.
        for c in isovalues.chain(spectrum.isovalues().iter().copied().step_by(97)) {
            if spectrum.check_isovalue(c).is_err() {
                continue;
            }
            let [a, b] =
                [&mut indexed, &mut scanning].map(|query| query.mesh_at(c).expect("inside"));
            assert!(c == high || !a.triangles.is_empty(), "nothing to compare at {c}");
            assert_eq!(a, b, "at {c}");
            assert_eq!(indexed.parts(), scanning.parts(), "at {c}");
        }
    }
}
