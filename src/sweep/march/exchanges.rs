//! Changes the mesh to fit another region of exact cells, cluster by cluster, and widens the region where an exchange is refused.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::state::{MAX_ATTEMPTS, March, State};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::mesh::{Face, Vertex, bounds};
use crate::sweep::calendar::Passage;
use crate::sweep::clusters::{Cluster, clusters};
use crate::sweep::exchange::{Refused, exchange};
use crate::sweep::exchanged::Exchanged;
use crate::sweep::join::{Joined, join};
use crate::sweep::region::Region;
use crate::sweep::remesh::improve::Improvement;
use crate::sweep::tracked::Tracked;

/// Distance from a cluster's blocks within which an exchange may change faces, voxels; multiplied by the number of the attempt.
const FACE_REACH: f32 = 1.0;

impl March<'_, '_> {
    /// Changes the mesh to fit another region, or a larger one. Returns the vertices that are new or removed.
    ///
    /// Cells become exact first, then others are released, so that a refusal of one does not affect the other.
    pub(super) fn exchange(
        &mut self,
        state: &mut State,
        target: Region,
        passage: Passage,
        kernels: &mut dyn Kernels,
    ) -> Result<BTreeSet<Vertex>> {
        if state.region.is_all_exact() {
            let blocks = state.region.blocks().clone();
            assert!(
                self.calendar
                    .blocks(self.grid, Passage::between(self.exact(), state.at, state.at))
                    .is_subset(&blocks),
                "blocks at {} that the region lacks",
                state.at
            );
            state.region = Region::layer_exact(self.grid);
            for b in blocks {
                state.region.add(b);
            }
        }
        let mut new: BTreeSet<Vertex> = BTreeSet::new();
        if !target.is_all_exact() {
            let mut both = target.clone();
            let added: Vec<u32> =
                state.region.blocks().iter().copied().filter(|&b| both.add(b)).collect();
            let now = Passage::between(self.exact(), state.at, state.at);
            self.calendar.grow_around(&mut both, now, &added);
            self.follow(state, both, now, &mut new);
            if state.region.is_all_exact() {
                // The blocks of the whole step: the isosurface enters some of them only later.
                let blocks = self.calendar.blocks(self.grid, passage);
                self.make_all_exact(state, Region::all_exact(self.grid, blocks));
            }
        }
        if !state.region.is_all_exact() {
            self.follow(state, target, passage, &mut new);
        }
        let improved = self.improve(state, &new, kernels)?;
        new.extend(improved);
        Ok(new)
    }

    /// Changes the mesh to fit another region, or a larger one, cluster by cluster.
    fn follow(
        &mut self,
        state: &mut State,
        mut target: Region,
        passage: Passage,
        new: &mut BTreeSet<Vertex>,
    ) {
        for attempt in 0usize.. {
            if target.is_all_exact() {
                self.make_all_exact(state, target);
                new.clear();
                break;
            }
            let regions = [&state.region, &target];
            let near = FACE_REACH * (1 + attempt) as f32;
            let clusters = clusters(&state.tracked, &state.places, regions, self.exact(), near);
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
    fn make_all_exact(&mut self, state: &mut State, closed: Region) {
        self.record.clear(state.at);
        state.tracked = Tracked::default();
        state.places = self.places(&state.tracked);
        // The intervals of blocks that the isosurface has left end here.
        let has_left = |b: &u32| !closed.holds(*b);
        let mut left: Vec<u32> = state.since.keys().copied().filter(has_left).collect();
        left.sort_unstable();
        left.into_iter().for_each(|b| self.no_longer_exact(state, b));
        for &b in closed.blocks() {
            state.since.entry(b).or_insert(state.at);
        }
        state.region = closed;
    }

    /// Ends the interval in which a block was exact, if it was.
    fn no_longer_exact(&mut self, state: &mut State, block: u32) {
        if let Some(since) = state.since.remove(&block) {
            self.record_exact(block, since, state.at);
        }
    }

    /// Joins the exchanged parts to the mesh; returns the refused clusters.
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
        new.extend(&joined.vertices);
        self.put(state, joined);
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

    /// Makes more blocks of the target exact where exchanges were refused: around the samples that fail. After
    /// [`MAX_ATTEMPTS`] the blocks of these clusters that would be released stay exact, too, or, where there are none, whole components
    /// of the mesh become exact; and everything does if there is nothing else.
    fn widen(
        &mut self,
        target: &mut Region,
        State { region, tracked, .. }: &State,
        clusters: &[Cluster],
        refused: Vec<(usize, Refused)>,
        passage: Passage,
        attempt: usize,
    ) {
        let before = target.blocks().clone();
        for (i, Refused { samples, .. }) in refused {
            let Cluster { blocks, faces } = &clusters[i];
            // None if the exchange needs more of the mesh, which the next attempt has.
            self.add_ring(target, self.blocks_at_samples(samples));
            if attempt < MAX_ATTEMPTS {
                continue;
            }
            let is_released = |b: &u32| region.holds(*b) && !before.contains(b);
            let mut kept: BTreeSet<u32> = blocks.iter().copied().filter(is_released).collect();
            if kept.is_empty() {
                kept = self.blocks_of(tracked, &components(tracked, faces));
            }
            for b in kept {
                target.add(b);
            }
        }
        let added: Vec<u32> = target.blocks().difference(&before).copied().collect();
        if added.is_empty() && attempt >= MAX_ATTEMPTS {
            log::debug!("given up");
            self.counts.given_up += 1;
            *target = Region::all_exact(self.grid, self.calendar.blocks(self.grid, passage));
        } else {
            self.calendar.grow_around(target, passage, &added);
        }
    }

    /// Remeshes the new parts of the mesh. Returns the vertices that are new or removed.
    fn improve(
        &mut self,
        state: &mut State,
        new: &BTreeSet<Vertex>,
        kernels: &mut dyn Kernels,
    ) -> Result<Vec<Vertex>> {
        let improvement =
            Improvement { field: self.field(), parameters: self.parameters(), isovalue: state.at };
        let begins = |v: &Vertex| self.record.begins(*v, state.at);
        let new: &BTreeSet<Vertex> = &new.iter().copied().filter(begins).collect();
        let made = improvement.improved(&state.tracked, new, kernels)?;
        let made: Vec<&Exchanged> = made.iter().collect();
        let Ok(joined) = join(&state.tracked, &made) else { return Ok(Vec::new()) };
        let vertices = joined.vertices.clone();
        self.put(state, joined);
        let mesh = &state.tracked.mesh;
        for &v in new.iter().chain(&vertices) {
            if mesh.has_vertex(v) && self.record.begins(v, state.at) {
                self.record.begins_at(v, mesh.position(v), mesh.vertex_normal(v));
            }
        }
        Ok(vertices)
    }

    /// Records a mesh with changed parts, and puts it in the place of the present one.
    fn put(&mut self, state: &mut State, joined: Joined) {
        self.record.exchanged(&joined, state.at);
        state.tracked = joined.tracked;
        let faces = joined.faces.iter().map(|f| f.0);
        state.places.update(&state.tracked, joined.placed, faces);
    }

    /// Makes blocks exact; if all of them are already, their neighbours, ring by ring until one was not exact.
    fn add_ring(&self, region: &mut Region, mut seen: BTreeSet<u32>) {
        let mut ring: Vec<u32> = seen.iter().copied().collect();
        while !ring.is_empty() && !ring.iter().fold(false, |any, &b| region.add(b) | any) {
            let around = ring.iter().flat_map(|&b| self.grid.blocks_around(b));
            ring = around.filter(|&b| seen.insert(b)).collect();
        }
    }
}

/// The faces of the connected components that contain some faces.
fn components(tracked: &Tracked, faces: &[Face]) -> BTreeSet<Face> {
    let mesh = &tracked.mesh;
    let mut found: BTreeSet<Face> = faces.iter().copied().collect();
    let mut open: Vec<Face> = found.iter().copied().collect();
    while let Some(f) = open.pop() {
        let adjacent = mesh.face_halfedges(f).map(|h| mesh.face(h.twin()));
        open.extend(adjacent.into_iter().filter(|&g| !mesh.is_cap(g) && found.insert(g)));
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
    use crate::sweep::march::state::WorkDone;
    use crate::sweep::parameters::Parameters;
    use crate::volume::phantom;

    #[test]
    fn intervals_of_exact_blocks_end_when_the_isosurface_has_left_them() {
        let volume = Arc::new(phantom("sphere:16").expect("a phantom"));
        let parameters = Parameters::default();
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let field = Arc::new(Field::new(volume.clone()));
        let sweep =
            Sweep::new(&volume, field, &parameters, &backend, &Silent, None).expect("a sweep");
        let calendar = Calendar::new(&sweep.exact, &sweep.topology, sweep.range);
        let done = WorkDone { share: Mutex::new(0.0), stage: sweep.stages.tracking(&Silent) };
        let (low, high) = sweep.range;
        let [start, end] = [0.4, 0.7].map(|share| low + share * (high - low));
        let begun = March::new(&sweep, &calendar, &done, start, None).expect("begun");
        let (mut march, mut state) = begun;
        let before = state.region.blocks().clone();
        state.at = end;
        let now = Passage::between(&sweep.exact, end, end);
        let after = calendar.blocks(march.grid, now);
        march.make_all_exact(&mut state, Region::all_exact(march.grid, after.clone()));
        let left: BTreeSet<u32> = before.difference(&after).copied().collect();
        assert!(!left.is_empty() && !after.is_empty(), "a sphere shrinks");
        let cells: BTreeSet<u32> = left.iter().flat_map(|&b| march.grid.cells_of(b)).collect();
        assert_eq!(march.exact_intervals.iter().map(|s| s.cell).collect::<BTreeSet<u32>>(), cells);
        assert!(march.exact_intervals.iter().all(|s| (s.low, s.high) == (start, end)));
        let since = |b: &u32| if before.contains(b) { start } else { end };
        assert_eq!(state.since.len(), after.len());
        assert!(after.iter().all(|b| state.since[b] == since(b)));
    }
}
