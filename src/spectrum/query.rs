//! The mesh at any isovalue (thesis sections 4.1 and 4.3).
//!
//! The active triangles come from the interval tree, or from the last query where the isovalue
//! moved a little; each of their vertices is found in its trajectory by binary search and
//! interpolated. The cost is that of the active triangles: marks left by earlier queries are told
//! apart by a stamp, so nothing of the spectrum's size is ever cleared.

use std::ops::Deref;

use rayon::prelude::*;

use super::active_set::ActiveSet;
use super::assembly::Assembly;
use super::{Knot, Spectrum, SurfaceMesh, Triangle};
use crate::error::{Error, Result};

/// For so many isovalues a look at every triangle, which takes a sixtieth of the time that building the search structures does, is faster.
const FEW: usize = 32;

/// Trajectories of at most so many knots are searched where the knots are, which are needed anyway.
const SHORT: usize = 4;

/// Answers queries on one spectrum, fastest where successive isovalues are close.
///
/// `S` is how the spectrum is held: `&Spectrum`, or `Arc<Spectrum>` for a query that lives as long as it likes.
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
    active: Active,
    assembly: Assembly,
}

/// How living triangles and the places of their vertices are found.
#[derive(Clone, Debug)]
enum Active {
    Indexed(Box<Index>),
    /// By a look at all of them: those of the last mesh.
    Seen(Vec<u32>),
}

/// The search structures.
#[derive(Clone, Debug)]
struct Index {
    active: ActiveSet,
    /// The vertices of each triangle, and whether it is a cap; closer together than in
    /// [`Spectrum::triangles`].
    triangles: Vec<([u32; 3], bool)>,
    trajectories: Trajectories,
}

/// Knots as meshes need them.
#[derive(Clone, Debug)]
struct Trajectories {
    /// As [`Spectrum::knots`].
    knots: Vec<TimedKnot>,
    /// Their ranks alone: a search among many knots finds sixteen in a cache line.
    ranks: Vec<u32>,
}

impl<S: Deref<Target = Spectrum>> Query<S> {
    /// Builds the search structures, in O(n log n) of the number of triangles. The spectrum must
    /// pass [`Spectrum::check`].
    pub fn new(spectrum: S) -> Self {
        let active = Active::Indexed(Box::new(Index::new(&spectrum)));
        Query { active, assembly: Assembly::new(&spectrum), spectrum }
    }

    /// The same for so many isovalues: where they are few, no search structures are built.
    pub fn for_some(spectrum: S, n_isovalues: usize) -> Self {
        if n_isovalues > FEW {
            return Query::new(spectrum);
        }
        Query { active: Active::Seen(Vec::new()), assembly: Assembly::new(&spectrum), spectrum }
    }

    /// The mesh at `isovalue`: the triangles with birth <= isovalue < death, by index, and their
    /// vertices, by number.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] outside the closed [`Spectrum::range`].
    pub fn mesh_at(&mut self, isovalue: f64) -> Result<SurfaceMesh> {
        let mut mesh = SurfaceMesh::default();
        self.mesh_at_into(isovalue, &mut mesh)?;
        Ok(mesh)
    }

    /// As [`Query::mesh_at`], into a mesh whose memory is used again.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] outside the closed [`Spectrum::range`]; the mesh then stays as it is.
    pub fn mesh_at_into(&mut self, isovalue: f64, mesh: &mut SurfaceMesh) -> Result<()> {
        let spectrum = &*self.spectrum;
        spectrum.check_isovalue(isovalue)?;
        let Some(rank) = spectrum.rank_at(isovalue) else {
            *mesh = SurfaceMesh::default();
            return Ok(());
        };
        let assembly = &mut self.assembly;
        match &mut self.active {
            Active::Indexed(index) => {
                let Index { active, triangles, trajectories } = &mut **index;
                let triangles = active.move_to(rank).iter().map(|&i| triangles[i as usize]);
                let place = |v| trajectories.vertex_at(spectrum, v, rank, isovalue);
                assembly.assemble(triangles, place, mesh);
            }
            Active::Seen(seen) => {
                let all = spectrum.triangles();
                let lives = |t: &Triangle| t.birth <= rank && rank < t.death;
                let living = (0..all.len() as u32).into_par_iter();
                *seen = living.filter(|&i| lives(&all[i as usize])).collect();
                let told = |&i: &u32| (all[i as usize].vertices, all[i as usize].cap);
                let place = |v| spectrum.vertex_at(v, rank, isovalue);
                assembly.assemble(seen.iter().map(told), place, mesh);
            }
        }
        Ok(())
    }
}

impl<S> Query<S> {
    /// Of the vertices and the triangles of the last mesh, which of the spectrum's they are.
    pub fn parts(&self) -> (&[u32], &[u32]) {
        let triangles = match &self.active {
            Active::Indexed(index) => index.active.triangles(),
            Active::Seen(seen) => seen,
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

/// A knot as meshes need it: with its isovalue, so that no table has to be asked for it.
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
    /// Whether there is a mesh at `isovalue`.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] outside the closed [`Spectrum::range`], and for what is no number.
    pub fn check_isovalue(&self, isovalue: f64) -> Result<()> {
        let (low, high) = self.range();
        if low <= isovalue && isovalue <= high {
            return Ok(());
        }
        Err(Error::Range { isovalue, low, high })
    }

    /// The largest rank whose isovalue is at most `isovalue`; none below the first.
    pub fn rank_at(&self, isovalue: f64) -> Option<u32> {
        let n = self.isovalues().partition_point(|&c| c <= isovalue);
        n.checked_sub(1).map(|rank| rank as u32)
    }

    /// Position (voxel frame) of vertex `v` at `isovalue`, whose rank is `rank`:
    /// linear between the knots on either side, exact at a knot, that of the first or last knot
    /// beyond them.
    ///
    /// # Panics
    ///
    /// If the vertex has no knots.
    pub fn vertex_at(&self, v: u32, rank: u32, isovalue: f64) -> [f32; 3] {
        let ([before, after], t) = self.way_between_knots(v, rank, isovalue);
        let [before, after] = [before, after].map(|i| &self.knots()[i]);
        if t == 0.0 { before.position } else { between(before.position, after.position, t) }
    }

    /// The knots on either side of vertex `v` at `isovalue`, whose rank is `rank`, as indices among all knots, and how
    /// far it is from the first to the second: 0 where it is at the first, or there is one side only.
    pub(crate) fn way_between_knots(&self, v: u32, rank: u32, isovalue: f64) -> ([usize; 2], f64) {
        let around = self.knots_around(v, rank);
        let [low, high] = around.map(|i| self.isovalues()[self.knots()[i].rank as usize]);
        (around, if low < high { fraction(isovalue, low, high) } else { 0.0 })
    }

    /// The last knot of vertex `v` not above `rank` and the first one above, as indices among all knots;
    /// twice the same before the first and from the last on.
    pub(super) fn knots_around(&self, v: u32, rank: u32) -> [usize; 2] {
        let trajectory = self.trajectory(v);
        let next = trajectory.partition_point(|knot| knot.rank <= rank);
        let first = self.first_knot()[v as usize] as usize;
        [first + next.saturating_sub(1), first + next.min(trajectory.len() - 1)]
    }
}

/// Where `isovalue` lies between `low` and `high`, in [0, 1], 0 where these are equal; halved first, so that even the
/// widest range does not overflow.
pub(super) fn fraction(isovalue: f64, low: f64, high: f64) -> f64 {
    let share = (0.5 * isovalue - 0.5 * low) / (0.5 * high - 0.5 * low);
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

/// The position at the fraction `t` of the way between two knots.
#[inline]
fn between(p: [f32; 3], q: [f32; 3], t: f64) -> [f32; 3] {
    // In double precision: a coordinate of a large volume has no bits to spare.
    std::array::from_fn(|i| ((1.0 - t) * f64::from(p[i]) + t * f64::from(q[i])) as f32)
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
        let mut indexed = Query::for_some(&spectrum, FEW + 1);
        let mut seen = Query::for_some(&spectrum, FEW);
        assert!(matches!((&indexed.active, &seen.active), (Active::Indexed(_), Active::Seen(_))));
        let (low, high) = spectrum.range();
        let places = [low, high].into_iter().chain((1..20).map(|i| {
            let share = f64::from(i * 7 % 20) / 20.0;
            low + share * (high - low)
        }));
        // At isovalues of the table, too.
        for c in places.chain(spectrum.isovalues().iter().copied().step_by(97)) {
            if spectrum.check_isovalue(c).is_err() {
                continue;
            }
            let [a, b] = [&mut indexed, &mut seen].map(|query| query.mesh_at(c).expect("inside"));
            assert!(c == high || !a.triangles.is_empty(), "nothing to compare at {c}");
            assert_eq!(a, b, "at {c}");
            assert_eq!(indexed.parts(), seen.parts(), "at {c}");
        }
    }
}
