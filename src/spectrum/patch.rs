//! The tables of a spectrum before they are checked, and how they become one.

use super::{About, Collapse, Knot, Spectrum, Triangle};
use crate::error::{Error, Result};

/// The tables of a spectrum, or of a part of one: isovalues, trajectories, triangles.
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

impl Spectrum {
    /// The spectrum of a patch whose table of isovalues need not be minimal or sorted: isovalues that no knot,
    /// lifetime or collapse refers to are left out; events are sorted by isovalue.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the tables do not fit 32-bit indices or the result does not pass [`Spectrum::check`].
    ///
    /// # Panics
    ///
    /// If the patch refers to a rank beyond its table.
    pub fn from_patch(mut about: About, mut patch: Patch) -> Result<Spectrum> {
        let n_vertices = patch.first_knot.len().saturating_sub(1);
        let n_knots = patch.knots.len();
        if u32::try_from(n_vertices.max(n_knots).max(patch.triangles.len())).is_err() {
            return Err(Error::input(format!(
                "{n_vertices} vertices with {n_knots} knots, expected fewer than 2^32"
            )));
        }
        about.events.sort_by(|a, b| a.isovalue.total_cmp(&b.isovalue));
        if patch.first_knot.is_empty() {
            patch.first_knot.push(0);
        }
        let isovalues = used_isovalues(&patch);
        let ranks: Vec<u32> = (patch.isovalues.iter())
            .map(|&x| isovalues.partition_point(|&c| c < x) as u32)
            .collect();
        let rank = |old: u32| ranks[old as usize];
        patch.knots.iter_mut().for_each(|k| k.rank = rank(k.rank));
        patch
            .triangles
            .iter_mut()
            .for_each(|t| (t.birth, t.death) = (rank(t.birth), rank(t.death)));
        patch.collapses.iter_mut().for_each(|c| c.rank = rank(c.rank));
        patch.isovalues = isovalues;
        Spectrum::new(about, patch)
    }
}

/// Every isovalue in use, once, increasing.
fn used_isovalues(patch: &Patch) -> Vec<f64> {
    let mut used = vec![false; patch.isovalues.len()];
    patch.knots.iter().for_each(|k| used[k.rank as usize] = true);
    patch.collapses.iter().for_each(|c| used[c.rank as usize] = true);
    for triangle in &patch.triangles {
        used[triangle.birth as usize] = true;
        used[triangle.death as usize] = true;
    }
    // Adding zero turns -0 into 0.
    let in_use = patch.isovalues.iter().zip(used).filter(|(_, is_used)| *is_used);
    let mut isovalues: Vec<f64> = in_use.map(|(c, _)| c + 0.0).collect();
    isovalues.sort_unstable_by(f64::total_cmp);
    isovalues.dedup();
    isovalues
}
