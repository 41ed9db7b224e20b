//! A spectrum from a patch whose table may contain isovalues that nothing refers to.

use super::data::Spectrum;
use super::elements::Patch;
use super::metadata::About;
use crate::error::{Error, Result};

impl Spectrum {
    /// A spectrum of a patch, whose table of isovalues need not be minimal or sorted. Isovalues that no knot, lifetime or
    /// collapse refers to are removed, and events are sorted by isovalue.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the numbers of vertices, knots or triangles do not fit 32-bit indices or the result does not pass
    /// [`Spectrum::check`].
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
        if patch.first_knot.is_empty() {
            patch.first_knot.push(0);
        }
        about.events.sort_by(|a, b| a.isovalue.total_cmp(&b.isovalue));
        let isovalues = used_isovalues(&patch);
        let ranks: Vec<u32> =
            patch.isovalues.iter().map(|&x| isovalues.partition_point(|&c| c < x) as u32).collect();
        let rank = |old: u32| ranks[old as usize];
        patch.knots.iter_mut().for_each(|k| k.rank = rank(k.rank));
        patch
            .triangles
            .iter_mut()
            .for_each(|t| (t.birth, t.death) = (rank(t.birth), rank(t.death)));
        patch.collapses.iter_mut().for_each(|c| c.rank = rank(c.rank));
        Spectrum::new(about, Patch { isovalues, ..patch })
    }
}

/// The isovalues of a patch that something refers to, increasing; minus zero as zero.
fn used_isovalues(patch: &Patch) -> Vec<f64> {
    let mut used = vec![false; patch.isovalues.len()];
    patch.knots.iter().for_each(|k| used[k.rank as usize] = true);
    patch.collapses.iter().for_each(|c| used[c.rank as usize] = true);
    for triangle in &patch.triangles {
        used[triangle.birth as usize] = true;
        used[triangle.death as usize] = true;
    }
    let used = patch.isovalues.iter().zip(used).filter(|(_, u)| *u).map(|(c, _)| c + 0.0);
    let mut isovalues: Vec<f64> = used.collect();
    isovalues.sort_unstable_by(f64::total_cmp);
    isovalues.dedup();
    isovalues
}
