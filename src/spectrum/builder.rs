//! Puts a spectrum together from patches that were tracked apart.
//!
//! Each patch has its own table of isovalues, and its ranks, vertices and knots count from zero.
//! [`SpectrumBuilder::finish`] merges the tables into one and appends the patches in the order in
//! which they were pushed, so the result does not depend on which of them was computed first.

use super::{Collapse, Event, Knot, Spectrum, Triangle, VolumeInfo};
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
    pub fn finish(
        self,
        volume: VolumeInfo,
        range: (f64, f64),
        tolerance: f64,
        parameters: serde_json::Value,
        mut events: Vec<Event>,
    ) -> Result<Spectrum> {
        let total = |count: fn(&Patch) -> usize| self.patches.iter().map(count).sum::<usize>();
        let n_vertices = total(|p| p.first_knot.len().saturating_sub(1));
        let n_knots = total(|p| p.knots.len());
        if u32::try_from(n_vertices.max(n_knots).max(total(|p| p.triangles.len()))).is_err() {
            return Err(Error::input(format!(
                "{n_vertices} vertices with {n_knots} knots, expected fewer than 2^32"
            )));
        }
        events.sort_by(|a, b| a.isovalue.total_cmp(&b.isovalue));
        let isovalues = merged_isovalues(&self.patches);
        let mut spectrum = Spectrum {
            volume,
            range,
            tolerance,
            parameters,
            events,
            isovalues,
            first_knot: vec![0],
            knots: Vec::new(),
            triangles: Vec::new(),
            collapses: Vec::new(),
        };
        let mut patches = self.patches.into_iter();
        // The first keeps its place in memory: often it is the only one, and large.
        if let Some(first) = patches.next() {
            begin(&mut spectrum, first);
        }
        spectrum
            .first_knot
            .reserve_exact((n_vertices + 1).saturating_sub(spectrum.first_knot.len()));
        spectrum.knots.reserve_exact(n_knots - spectrum.knots.len());
        patches.for_each(|patch| append(&mut spectrum, patch));
        spectrum.check()?;
        Ok(spectrum)
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

/// The ranks of a patch's isovalues in a table that has all those in use.
fn ranks(patch: &Patch, table: &[f64]) -> Vec<u32> {
    patch.isovalues.iter().map(|&x| table.partition_point(|&c| c < x) as u32).collect()
}

/// Makes one patch the first of a spectrum whose table of isovalues is complete.
fn begin(spectrum: &mut Spectrum, patch: Patch) {
    let ranks = ranks(&patch, &spectrum.isovalues);
    let Patch { first_knot, mut knots, mut triangles, mut collapses, .. } = patch;
    knots.iter_mut().for_each(|knot| knot.rank = ranks[knot.rank as usize]);
    for t in &mut triangles {
        (t.birth, t.death) = (ranks[t.birth as usize], ranks[t.death as usize]);
    }
    collapses.iter_mut().for_each(|c| c.rank = ranks[c.rank as usize]);
    if !first_knot.is_empty() {
        spectrum.first_knot = first_knot;
    }
    (spectrum.knots, spectrum.triangles, spectrum.collapses) = (knots, triangles, collapses);
}

/// Appends one patch to a spectrum whose table of isovalues is complete.
fn append(spectrum: &mut Spectrum, patch: Patch) {
    let ranks = ranks(&patch, &spectrum.isovalues);
    let rank = |local: u32| ranks[local as usize];
    let vertex_base = (spectrum.first_knot.len() - 1) as u32;
    let knot_base = spectrum.knots.len() as u32;
    spectrum.first_knot.extend(patch.first_knot.iter().skip(1).map(|first| first + knot_base));
    spectrum.knots.extend(patch.knots.iter().map(|knot| Knot { rank: rank(knot.rank), ..*knot }));
    spectrum.triangles.extend(patch.triangles.iter().map(|t| Triangle {
        vertices: t.vertices.map(|v| v + vertex_base),
        birth: rank(t.birth),
        death: rank(t.death),
        cap: t.cap,
    }));
    spectrum.collapses.extend(patch.collapses.iter().map(|c| Collapse {
        vertex: c.vertex + vertex_base,
        target: c.target + vertex_base,
        rank: rank(c.rank),
        upward: c.upward,
    }));
}
