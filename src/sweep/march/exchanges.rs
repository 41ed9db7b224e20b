//! The mesh of one region of exact cells becomes that of another: which exchanges are tried, and what is asked for where one is
//! refused.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::state::{March, State};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::mesh::{Face, Vertex, bounds};
use crate::sweep::calendar::Passage;
use crate::sweep::clusters::{Cluster, clusters};
use crate::sweep::exchange::{Refused, exchange};
use crate::sweep::exchanged::Exchanged;
use crate::sweep::join::join;
use crate::sweep::region::Region;
use crate::sweep::remesh::improve::Improvement;
use crate::sweep::tracked::Tracked;

/// An exchange is tried so often before blocks that should be released there stay exact; three times as often before whole
/// components of the mesh become exact; and nine times before everything does.
const MOST_ATTEMPTS: usize = 3;

/// More samples than these are no place: what was refused is too large to tell.
const MOST_NAMED: usize = 64;

/// An exchange changes faces this near to its blocks at most, voxels; as much farther in every further attempt.
const NEAR: f32 = 1.0;
const MOST_WIDER: usize = 4;

impl March<'_, '_> {
    /// Makes the mesh that of another region, or of a larger one. Returns the vertices that have come or gone.
    ///
    /// Cells become exact first, and others tracked then: what is refused of the one is nothing to the other.
    pub(super) fn exchange(
        &mut self,
        state: &mut State,
        target: Region,
        passage: Passage,
        kernels: &mut dyn Kernels,
    ) -> Result<BTreeSet<Vertex>> {
        if state.region.is_closed() {
            let blocks = state.region.blocks().clone();
            debug_assert!(
                self.calendar
                    .blocks(self.grid, Passage::between(self.exact(), state.at, state.at))
                    .is_subset(&blocks),
                "blocks at {} that nobody has",
                state.at
            );
            state.region = Region::open(self.grid);
            for b in blocks {
                state.region.add(b);
            }
        }
        let mut new: BTreeSet<Vertex> = BTreeSet::new();
        if !target.is_closed() {
            let mut both = target.clone();
            let added: Vec<u32> =
                state.region.blocks().iter().copied().filter(|&b| both.add(b)).collect();
            let now = Passage::between(self.exact(), state.at, state.at);
            self.calendar.close_around(&mut both, now, &added);
            self.follow(state, both, now, &mut new);
            if state.region.is_closed() {
                // For the whole step, which goes to blocks that the isosurface does not meet yet.
                let blocks = self.calendar.blocks(self.grid, passage);
                self.drop_all(state, Region::closed(self.grid, blocks));
            }
        }
        if !state.region.is_closed() {
            self.follow(state, target, passage, &mut new);
        }
        let improved = self.improve(state, &new, kernels)?;
        new.extend(improved);
        Ok(new)
    }

    /// Makes the mesh that of another region, or of a larger one: cluster by cluster, each as soon as it can be.
    fn follow(
        &mut self,
        state: &mut State,
        mut target: Region,
        passage: Passage,
        new: &mut BTreeSet<Vertex>,
    ) {
        for attempt in 0usize.. {
            if target.is_closed() {
                self.drop_all(state, target);
                new.clear();
                break;
            }
            let regions = [&state.region, &target];
            let near = NEAR * (1 + attempt).min(MOST_WIDER) as f32;
            let clusters = clusters(&state.tracked, regions, self.exact(), near);
            if clusters.is_empty() {
                break;
            }
            let (before, at, exact) = (&state.tracked, state.at, self.exact());
            let made: Vec<std::result::Result<Exchanged, Refused>> =
                clusters.par_iter().map(|c| exchange(before, c, regions, exact, at)).collect();
            self.counts.exchanges += clusters.len() as u64;
            let refused = self.commit(state, &target, &clusters, made, new);
            self.counts.exchanges_refused += refused.len() as u64;
            log::debug!(
                "{} of {} clusters refused: {:?}",
                refused.len(),
                clusters.len(),
                refused
                    .iter()
                    .take(8)
                    .map(|r| (r.1.why, r.1.samples.len(), clusters[r.0].blocks.len()))
                    .collect::<Vec<_>>()
            );
            if refused.is_empty() {
                break;
            }
            self.widen(&mut target, state, &clusters, refused, passage, attempt);
        }
    }

    /// The blocks that faces meet.
    fn blocks_of(&self, tracked: &Tracked, faces: &BTreeSet<Face>) -> BTreeSet<u32> {
        let scale = self.field().inverse_cell_size();
        let boxes = faces.iter().map(|&f| bounds(tracked.mesh.corners(f)));
        boxes.flat_map(|(low, high)| self.grid.blocks_in(low * scale, high * scale)).collect()
    }

    /// Makes everything exact.
    fn drop_all(&mut self, state: &mut State, closed: Region) {
        self.record.clear(state.at);
        state.tracked = Tracked::default();
        // Those that the isosurface has left are exact no more: should they become so again, it is since then.
        let has_left = |b: &u32| !closed.holds(*b);
        let mut left: Vec<u32> = state.since.keys().copied().filter(has_left).collect();
        left.sort_unstable();
        left.into_iter().for_each(|b| self.no_longer_exact(state, b));
        for &b in closed.blocks() {
            state.since.entry(b).or_insert(state.at);
        }
        state.region = closed;
    }

    /// A block was exact until now, if it was.
    fn no_longer_exact(&mut self, state: &mut State, block: u32) {
        if let Some(since) = state.since.remove(&block) {
            self.show(block, since, state.at);
        }
    }

    /// Puts what was made of clusters into the mesh; returns which were refused.
    fn commit(
        &mut self,
        state: &mut State,
        target: &Region,
        clusters: &[Cluster],
        made: Vec<std::result::Result<Exchanged, Refused>>,
        new: &mut BTreeSet<Vertex>,
    ) -> Vec<(usize, Refused)> {
        let mut refused = Vec::new();
        let mut good: Vec<(usize, Exchanged)> = Vec::new();
        for (cluster, made) in made.into_iter().enumerate() {
            match made {
                Ok(made) => good.push((cluster, made)),
                Err(why) => refused.push((cluster, why)),
            }
        }
        let joined = loop {
            if good.is_empty() {
                return refused;
            }
            let parts: Vec<&Exchanged> = good.iter().map(|g| &g.1).collect();
            match join(&state.tracked, &parts) {
                Ok(joined) => break joined,
                Err(place) => {
                    let sample = self.sample_at(place);
                    let block = self.grid.block_of_cell(sample);
                    let near: BTreeSet<u32> =
                        block.into_iter().flat_map(|b| self.grid.blocks_around(b)).collect();
                    let is_it = |c: &Cluster| c.blocks.iter().any(|b| near.contains(b));
                    let i = good.iter().position(|g| is_it(&clusters[g.0])).unwrap_or(0);
                    let (cluster, _) = good.remove(i);
                    refused.push((cluster, Refused { why: "not joined", samples: vec![sample] }));
                }
            }
        };
        self.record.exchanged(&joined, state.at);
        new.extend(&joined.vertices);
        state.tracked = joined.tracked;
        for (cluster, _) in good {
            let cluster = &clusters[cluster];
            for &b in &cluster.blocks {
                if target.holds(b) {
                    state.since.insert(b, state.at);
                } else {
                    self.no_longer_exact(state, b);
                }
            }
            state.region.follow(target, &cluster.blocks);
        }
        refused
    }

    /// Changes what is asked for where that was refused.
    fn widen(
        &mut self,
        target: &mut Region,
        State { region, tracked, .. }: &State,
        clusters: &[Cluster],
        refused: Vec<(usize, Refused)>,
        passage: Passage,
        attempt: usize,
    ) {
        let mut added: Vec<u32> = Vec::new();
        let mut around: Vec<Vec<u32>> = Vec::new();
        for (i, Refused { samples, .. }) in refused {
            let blocks = &clusters[i].blocks;
            let is_released = |b: &u32| region.holds(*b) && !target.holds(*b);
            let is_stubborn = attempt >= MOST_ATTEMPTS || samples.len() > MOST_NAMED;
            if is_stubborn && blocks.iter().any(is_released) {
                added.extend(blocks.iter().copied().filter(is_released));
            } else if attempt >= 3 * MOST_ATTEMPTS {
                let whole = components(tracked, &clusters[i].faces);
                added.extend(self.blocks_of(tracked, &whole));
            } else if !samples.is_empty() {
                around.push(samples);
            } else if attempt > MOST_WIDER {
                // What names no sample asks for more of the mesh, of which there is no more after a while.
                around.push(blocks.iter().flat_map(|&b| self.grid.samples_around(b)).collect());
            }
        }
        added.retain(|&b| target.add(b));
        self.calendar.close_around(target, passage, &added);
        if !around.is_empty() || attempt >= 9 * MOST_ATTEMPTS {
            self.grow(target, &around, passage, attempt);
        }
    }

    /// Makes more blocks exact around samples at which exchanges were refused, or everything.
    fn grow(
        &mut self,
        target: &mut Region,
        refused: &[Vec<u32>],
        passage: Passage,
        attempt: usize,
    ) {
        let before = target.blocks().clone();
        for samples in refused {
            self.add_ring(target, self.blocks_at_samples(samples.iter().copied()));
        }
        let added: Vec<u32> = target.blocks().difference(&before).copied().collect();
        if added.is_empty() || attempt >= 9 * MOST_ATTEMPTS {
            log::debug!("given up");
            self.counts.given_up += 1;
            *target = Region::closed(self.grid, self.calendar.blocks(self.grid, passage));
        } else {
            self.calendar.close_around(target, passage, &added);
        }
    }

    /// Better triangles where the mesh is new. Returns the vertices that have come or gone.
    fn improve(
        &mut self,
        state: &mut State,
        new: &BTreeSet<Vertex>,
        kernels: &mut dyn Kernels,
    ) -> Result<Vec<Vertex>> {
        let improvement = Improvement {
            field: self.field(),
            region: &state.region,
            parameters: self.parameters(),
            isovalue: state.at,
        };
        let record = &self.record;
        let is_new = |v: Vertex| new.contains(&v) && record.begins(v, state.at);
        let made = improvement.improved(&state.tracked, &is_new, kernels)?;
        let made: Vec<&Exchanged> = made.iter().collect();
        let Ok(joined) = join(&state.tracked, &made) else { return Ok(Vec::new()) };
        self.record.exchanged(&joined, state.at);
        state.tracked = joined.tracked;
        let mesh = &state.tracked.mesh;
        for &v in new.iter().chain(&joined.vertices) {
            if mesh.has_vertex(v) && self.record.begins(v, state.at) {
                self.record.begins_at(v, mesh.position(v), mesh.vertex_normal(v));
            }
        }
        Ok(joined.vertices)
    }

    /// Makes blocks exact, or those around them, farther and farther away until one was not.
    fn add_ring(&self, region: &mut Region, mut seen: BTreeSet<u32>) {
        let mut ring: Vec<u32> = seen.iter().copied().collect();
        while !ring.is_empty() && !ring.iter().fold(false, |any, &b| region.add(b) | any) {
            let around = ring.iter().flat_map(|&b| self.grid.blocks_around(b));
            ring = around.filter(|&b| seen.insert(b)).collect();
        }
    }
}

/// The faces of the components of the mesh to which some faces belong.
fn components(tracked: &Tracked, faces: &[Face]) -> BTreeSet<Face> {
    let mesh = &tracked.mesh;
    let mut found: BTreeSet<Face> = faces.iter().copied().collect();
    let mut open: Vec<Face> = found.iter().copied().collect();
    while let Some(f) = open.pop() {
        let beside = mesh.face_halfedges(f).map(|h| mesh.face(h.twin()));
        open.extend(beside.into_iter().filter(|&g| !mesh.is_cap(g) && found.insert(g)));
    }
    found
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::field::Field;
    use crate::kernels::{Backend, Choice};
    use crate::progress::Silent;
    use crate::sweep::calendar::Calendar;
    use crate::sweep::context::Sweep;
    use crate::sweep::march::state::Done;
    use crate::sweep::parameters::Parameters;
    use crate::volume::phantom;

    #[test]
    fn where_everything_becomes_exact_what_was_exact_before_is_shown_until_then() {
        let volume = Arc::new(phantom("sphere:16").expect("a phantom"));
        let parameters = Parameters::default();
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let field = Arc::new(Field::new(volume.clone()));
        let sweep = Sweep::new(&volume, field, &parameters, (&backend, &Silent)).expect("a sweep");
        let calendar = Calendar::new(&sweep.exact, &sweep.topology, sweep.range);
        let done = Done { share: Mutex::new(0.0), progress: &Silent };
        let (low, high) = sweep.range;
        let [start, end] = [0.4, 0.7].map(|share| low + share * (high - low));
        let begun = March::begun(&sweep, &calendar, &done, (start, None)).expect("begun");
        let (mut march, mut state) = begun;
        let before = state.region.blocks().clone();
        state.at = end;
        let now = Passage::between(&sweep.exact, end, end);
        let after = calendar.blocks(march.grid, now);
        march.drop_all(&mut state, Region::closed(march.grid, after.clone()));
        let left: BTreeSet<u32> = before.difference(&after).copied().collect();
        assert!(!left.is_empty() && !after.is_empty(), "a sphere shrinks");
        let cells: BTreeSet<u32> = left.iter().flat_map(|&b| march.grid.cells_of(b)).collect();
        assert_eq!(march.shown.iter().map(|s| s.0).collect::<BTreeSet<u32>>(), cells);
        assert!(march.shown.iter().all(|s| (s.1, s.2) == (start, end)));
        let since = |b: &u32| if before.contains(b) { start } else { end };
        assert_eq!(state.since.len(), after.len());
        assert!(after.iter().all(|b| state.since[b] == since(b)));
    }
}
