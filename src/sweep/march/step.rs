//! One step: moves the mesh to the next isovalue, and makes blocks exact where that fails.

use std::collections::BTreeSet;

use glam::Vec3;
use rayon::prelude::*;

use super::ends::Ends;
use super::state::{MAX_ATTEMPTS, MAX_BACK_OFF, MIN_EXACT_STEPS, March, State};
use crate::error::Result;
use crate::extract::count::count_parts;
use crate::kernels::Kernels;
use crate::mesh::{Face, Vertex};
use crate::sweep::calendar::Passage;
use crate::sweep::cause::{Cause, FirstCauses};
use crate::sweep::remesh::criteria::Criteria;
use crate::sweep::remesh::remesh;
use crate::sweep::repair::{Shape, repair};
use crate::sweep::tracked::Tracked;
use crate::sweep::transport::{MAX_DEVIATION_FACTOR, Moved, Retry, Step, Transport, faults};

impl March<'_, '_> {
    /// Takes one step. Returns false if the step is too long.
    pub(super) fn take_step(
        &mut self,
        state: &mut State,
        step: Step,
        is_long: bool,
        kernels: &mut dyn Kernels,
    ) -> Result<bool> {
        self.step += 1;
        let is_taken =
            !self.is_before_events(state, step) && self.try_step(state, step, is_long, kernels)?;
        if is_taken {
            self.counts.steps += 1;
            self.finish_step(state, step.next);
        } else {
            self.counts.too_long += 1;
        }
        Ok(is_taken)
    }

    /// Moves the mesh to the end of a step; repeats that with more cells exact where it fails. Returns false if the step is too
    /// long.
    fn try_step(
        &mut self,
        state: &mut State,
        step: Step,
        is_long: bool,
        kernels: &mut dyn Kernels,
    ) -> Result<bool> {
        let region = self.plan(state, [step.at, step.next]);
        if is_long && !self.is_calm(state, &region) {
            return Ok(false);
        }
        let passage = Passage::between(self.exact(), step.at, step.next);
        self.exchange(state, region, passage, kernels)?;
        let mut retry: Option<Retry> = None;
        let mut attempt = 0;
        loop {
            let mut moved = self.moved(state, step, retry.as_ref(), kernels)?;
            if attempt == 0 && self.is_too_long(state, step, &moved) {
                return Ok(false);
            }
            // Folded faces are repaired before their cells become exact: at first, and after each exchange, as cuts leave slivers.
            if let Some(near) = self.repair_folded(state, step, &moved) {
                self.counts.repeated += 1;
                let again = self.retry(moved, BTreeSet::new(), near);
                moved = self.moved(state, step, Some(&again), kernels)?;
            }
            let counts = attempt < MAX_ATTEMPTS;
            let failed = if counts { self.blocks_at(&moved.places) } else { BTreeSet::new() };
            let failed = match self.slide(state, step, passage, &moved, failed, counts) {
                Ok(()) => return Ok(true),
                Err(failed) => failed,
            };
            log::debug!(
                "{} to {}: {} places failed, {} faces, {} exact blocks",
                step.at,
                step.next,
                moved.places.len(),
                state.tracked.mesh.n_faces(),
                state.region.blocks().len()
            );
            self.counts.repeated += 1;
            retry = Some(self.make_exact(state, failed, passage, moved, kernels)?);
            attempt += 1;
        }
    }

    /// Finishes a step: remeshes, records, and starts the back-off of blocks with faces that are still off.
    fn finish_step(&mut self, state: &mut State, isovalue: f64) {
        state.at = isovalue;
        let criteria = Criteria::new(self.field(), isovalue, self.parameters());
        let (causes, faults) = self.remesh_and_repair(state, criteria);
        let mut changed: Vec<Face> = causes.changed().collect();
        changed.sort_unstable();
        changed.dedup();
        self.record.forget(&state.tracked);
        self.record.changed(&state.tracked, changed, isovalue, |slot| causes.of(slot));
        state.places = self.places(&state.tracked);
        self.counts.faults += faults.len() as u64;
        let middle = |f: Face| state.tracked.mesh.corners(f).iter().sum::<Vec3>() / 3.0;
        let places: Vec<Vec3> = faults.into_iter().map(middle).collect();
        for b in self.blocks_at(&places) {
            self.back_off(state, b);
        }
        if log::log_enabled!(log::Level::Debug) {
            self.log_tracked_share(state);
        }
    }

    /// Logs the share of the isosurface that is tracked.
    fn log_tracked_share(&self, State { tracked, region, at, .. }: &State) {
        let n = |is_in: &dyn Fn(u32) -> bool| count_parts(self.exact(), *at, is_in).crossings.len();
        let (own, all) = (n(&|cell| !region.is_exact(cell)), n(&|_| true));
        log::debug!("at {at} {own} of {all} crossings tracked; {} faces", tracked.mesh.n_faces());
    }

    /// The mesh at the end of a step.
    fn moved(
        &self,
        state: &State,
        step: Step,
        retry: Option<&Retry>,
        kernels: &mut dyn Kernels,
    ) -> Result<Moved> {
        let transport = Transport {
            tracked: &state.tracked,
            places: &state.places,
            region: &state.region,
            exact: self.exact(),
            field: self.field(),
            parameters: self.parameters(),
            step,
            retry,
        };
        transport.moved(kernels)
    }

    /// Makes blocks whose tracking failed exact, and their neighbours if they are exact already. Returns the state for a retry.
    fn make_exact(
        &mut self,
        state: &mut State,
        failed: BTreeSet<u32>,
        passage: Passage,
        before: Moved,
        kernels: &mut dyn Kernels,
    ) -> Result<Retry> {
        let mut region = state.region.clone();
        for b in failed {
            self.back_off(state, b);
            if !region.add(b) {
                for near in self.grid.blocks_around(b) {
                    self.back_off(state, near);
                    region.add(near);
                }
            }
        }
        let old = state.region.blocks().clone();
        let added: Vec<u32> = region.blocks().difference(&old).copied().collect();
        self.calendar.grow_around(&mut region, passage, &added);
        let fresh = self.exchange(state, region, passage, kernels)?;
        let near = old.symmetric_difference(state.region.blocks()).copied().collect();
        Ok(self.retry(before, fresh, near))
    }

    /// Repairs faces that fold during the step, mostly where the seam runs into the mesh. Returns the blocks of the changed
    /// faces; `None` if nothing changed.
    fn repair_folded(
        &mut self,
        state: &mut State,
        step: Step,
        moved: &Moved,
    ) -> Option<BTreeSet<u32>> {
        let corners = moved.folded.iter().flat_map(|f| state.tracked.mesh.corners(*f));
        let places: Vec<Vec3> = corners.collect();
        let ends = Ends::of(&state.tracked.mesh, moved);
        let during = [step.at, step.next];
        let repaired = self.repair_in_step(state, &moved.folded, &ends, step, during);
        log::debug!("{} edits for {} folded faces", repaired.corners.len(), moved.folded.len());
        if repaired.corners.is_empty() {
            return None;
        }
        self.record.forget(&state.tracked);
        state.places.update(&state.tracked, [], repaired.faces.iter().copied());
        self.record.changed(&state.tracked, repaired.faces, state.at, |_| Cause::Repair);
        Some(self.blocks_at(&places))
    }

    /// Remeshes at the end of a step, and repairs failing faces. Returns the causes of the changes, and the faces that still fail.
    fn remesh_and_repair(
        &self,
        State { tracked, region, .. }: &mut State,
        criteria: Criteria,
    ) -> (FirstCauses, Vec<Face>) {
        let mut causes = FirstCauses::new(&mut tracked.mesh);
        remesh(&mut tracked.mesh, &criteria, &mut causes);
        let max_deviation = MAX_DEVIATION_FACTOR * self.parameters().error as f32;
        let bad = faults(tracked, &criteria, max_deviation, tracked.mesh.par_faces().collect());
        let place = |tracked: &Tracked, v: Vertex| tracked.mesh.position(v);
        let shape = Shape { criteria, max_deviation, place: &place };
        repair(tracked, region, &[shape], &bad);
        let edited = causes.attribute(&mut tracked.mesh, Cause::Repair);
        let mut suspects = [bad, edited].concat();
        suspects.sort_unstable();
        suspects.dedup();
        (causes, faults(tracked, &criteria, max_deviation, suspects))
    }

    /// Starts the back-off of a block whose tracking failed: it stays exact for some steps, twice as many if it fails again soon.
    fn back_off(&self, state: &mut State, block: u32) {
        let entry = state.back_offs.entry(block).or_default();
        if entry.until > self.step {
            return;
        }
        let again = entry.length > 0 && entry.until + entry.length + MIN_EXACT_STEPS >= self.step;
        entry.length =
            if again { (2 * entry.length).min(MAX_BACK_OFF) } else { MIN_EXACT_STEPS + 1 };
        entry.until = self.step + entry.length;
    }

    /// The state for a retry after some blocks have changed.
    fn retry(&self, before: Moved, fresh: BTreeSet<Vertex>, changed: BTreeSet<u32>) -> Retry {
        let [near, wide] = [1, 2].map(|rings| self.grid.marked(changed.iter().copied(), rings));
        Retry { before, fresh, near, wide }
    }
}
