//! Puts a spectrum together from patches that were tracked apart.
//!
//! Each patch has its own table of isovalues, and its ranks, vertices and knots count from zero.
//! [`SpectrumBuilder::finish`] merges the tables into one and appends the patches in the order in
//! which they were pushed, so the result does not depend on which of them was computed first.

use super::{About, Collapse, Knot, Spectrum, Triangle};
use crate::error::{Error, Result};

/// A part of a spectrum that shares no vertex with any other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    /// Isovalues that the ranks of this patch refer to, strictly increasing.
    pub isovalues: Vec<f64>,
    /// Start of each vertex's knots in `knots`, and the end: one more than there are vertices.
    pub first_knot: Vec<u32>,
    /// Knots by vertex; ranks refer to `isovalues` of this patch.
    pub knots: Vec<Knot>,
    /// Triangles; vertices and ranks are those of this patch.
    pub triangles: Vec<Triangle>,
    /// Collapses; vertices and ranks are those of this patch.
    pub collapses: Vec<Collapse>,
}

/// Collects patches and joins them.
#[derive(Clone, Debug, Default)]
pub struct SpectrumBuilder {
    patches: Vec<Patch>,
}

impl SpectrumBuilder {
    /// A builder without patches.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends a patch.
    pub fn push_patch(&mut self, patch: Patch) {
        self.patches.push(patch);
    }

    /// The spectrum of all patches in the order in which they were pushed. Isovalues that no knot,
    /// lifetime or collapse refers to are left out; events are sorted by isovalue.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the parts do not fit 32-bit indices or the result does not pass
    /// [`Spectrum::check`].
    ///
    /// # Panics
    ///
    /// If a patch refers to a rank beyond its table.
    pub fn finish(self, mut about: About) -> Result<Spectrum> {
        let total = |count: fn(&Patch) -> usize| self.patches.iter().map(count).sum::<usize>();
        let n_vertices = total(|p| p.first_knot.len().saturating_sub(1));
        let n_knots = total(|p| p.knots.len());
        if u32::try_from(n_vertices.max(n_knots).max(total(|p| p.triangles.len()))).is_err() {
            return Err(Error::input(format!(
                "{n_vertices} vertices with {n_knots} knots, expected fewer than 2^32"
            )));
        }
        about.events.sort_by(|a, b| a.isovalue.total_cmp(&b.isovalue));
        let mut joined = Patch {
            isovalues: merged_isovalues(&self.patches),
            first_knot: vec![0],
            ..Patch::default()
        };
        for patch in self.patches {
            append(&mut joined, patch);
        }
        Spectrum::new(about, joined)
    }
}

/// Every isovalue in use, once, increasing.
fn merged_isovalues(patches: &[Patch]) -> Vec<f64> {
    let mut isovalues = Vec::new();
    for patch in patches {
        let mut used = vec![false; patch.isovalues.len()];
        patch.knots.iter().for_each(|k| used[k.rank as usize] = true);
        patch.collapses.iter().for_each(|c| used[c.rank as usize] = true);
        for triangle in &patch.triangles {
            used[triangle.birth as usize] = true;
            used[triangle.death as usize] = true;
        }
        isovalues
            .extend(patch.isovalues.iter().zip(used).filter(|(_, u)| *u).map(|(c, _)| c + 0.0));
    }
    isovalues.sort_unstable_by(f64::total_cmp);
    isovalues.dedup();
    isovalues
}

/// Appends one patch to one whose table of isovalues is complete. The first one is taken as it is: most spectra have no
/// other.
fn append(joined: &mut Patch, mut patch: Patch) {
    let table = &joined.isovalues;
    let ranks: Vec<u32> =
        patch.isovalues.iter().map(|&x| table.partition_point(|&c| c < x) as u32).collect();
    let rank = |local: u32| ranks[local as usize];
    let vertex_base = (joined.first_knot.len() - 1) as u32;
    let knot_base = joined.knots.len() as u32;
    patch.knots.iter_mut().for_each(|k| k.rank = rank(k.rank));
    for t in &mut patch.triangles {
        t.vertices = t.vertices.map(|v| v + vertex_base);
        (t.birth, t.death) = (rank(t.birth), rank(t.death));
    }
    for c in &mut patch.collapses {
        (c.vertex, c.target) = (c.vertex + vertex_base, c.target + vertex_base);
        c.rank = rank(c.rank);
    }
    joined.first_knot.extend(patch.first_knot.iter().skip(1).map(|first| first + knot_base));
    extend(&mut joined.knots, patch.knots);
    extend(&mut joined.triangles, patch.triangles);
    extend(&mut joined.collapses, patch.collapses);
}

/// Appends; what comes first is not copied.
fn extend<T>(all: &mut Vec<T>, more: Vec<T>) {
    if all.is_empty() {
        *all = more;
    } else {
        all.extend(more);
    }
}
