//! One step: the mesh goes to the next isovalue, and what of it cannot becomes exact cells.

use std::collections::BTreeSet;

use glam::Vec3;

use super::state::{HOLD, LONGEST_HOLD, March, State};
use crate::error::Result;
use crate::extract::count::count_parts;
use crate::kernels::Kernels;
use crate::mesh::{Face, Vertex};
use crate::sweep::calendar::Passage;
use crate::sweep::mend::{Shape, mend, mend_faults};
use crate::sweep::remesh::criteria::Criteria;
use crate::sweep::remesh::remesh;
use crate::sweep::tracked::{Tracked, place_on};
use crate::sweep::transport::{Again, MOST_OFF, Moved, Step, Transport, faults};

/// A step is tried so often with more cells exact before it is taken as it is, but for its seam, which may ask as often once
/// more.
const MOST_ROUNDS: usize = 6;

impl March<'_, '_> {
    /// Takes one step; does not where it is too long for too much of the mesh.
    pub(super) fn take(
        &mut self,
        state: &mut State,
        step: Step,
        is_long: bool,
        kernels: &mut dyn Kernels,
    ) -> Result<bool> {
        self.step += 1;
        let is_taken =
            !self.is_before_events(state, step) && self.pass(state, step, is_long, kernels)?;
        if is_taken {
            self.counts.steps += 1;
            self.arrive(state, step.next);
        } else {
            self.counts.too_long += 1;
        }
        Ok(is_taken)
    }

    /// Takes the mesh to the end of a step; again and again, with more cells exact where places could not be tracked.
    fn pass(
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
        let mut again: Option<Again> = None;
        let (mut is_mended, mut round, mut n_exact) = (false, 0, 0);
        loop {
            self.counts.repeated += u64::from(again.is_some());
            let moved = self.moved(state, step, again.as_ref(), kernels)?;
            if again.is_none() && self.is_too_long(state, step, &moved) {
                return Ok(false);
            }
            // What folds is mended before its cells become exact; and again after that, as cuts leave slivers.
            if !is_mended {
                is_mended = true;
                if let Some(near) = self.mend_folded(state, step, &moved) {
                    again = Some(self.again(moved, BTreeSet::new(), near));
                    continue;
                }
            }
            let mut named = BTreeSet::new();
            if round < MOST_ROUNDS {
                named = self.blocks_at(&moved.places);
            }
            // What asks in vain is not heard again.
            let n_before = std::mem::replace(&mut n_exact, state.region.blocks().len());
            let asks = round < MOST_ROUNDS || round < 2 * MOST_ROUNDS && n_exact != n_before;
            let named = match self.slide(state, step, passage, &moved, named, asks) {
                Ok(()) => return Ok(true),
                Err(named) => named,
            };
            log::debug!(
                "{} to {}: {:?} named, {} faces, {} exact blocks",
                step.at,
                step.next,
                moved.named,
                state.tracked.mesh.n_faces(),
                state.region.blocks().len()
            );
            again = Some(self.give_way(state, named, passage, moved, kernels)?);
            (is_mended, round) = (false, round + 1);
        }
    }

    /// What is done at the end of a step: better triangles, and exact cells in the next one where some are not good enough.
    fn arrive(&mut self, state: &mut State, isovalue: f64) {
        state.at = isovalue;
        let criteria = Criteria::new(self.field(), isovalue, self.parameters());
        self.mend_and_remesh(state, &criteria);
        let faults = faults(&state.tracked, &criteria, self.parameters());
        self.record.changed_all(&state.tracked, isovalue);
        self.counts.faults += faults.len() as u64;
        let middle = |f: Face| state.tracked.mesh.corners(f).iter().sum::<Vec3>() / 3.0;
        let places: Vec<Vec3> = faults.into_iter().map(middle).collect();
        for b in self.blocks_at(&places) {
            self.back_off(state, b);
        }
        if log::log_enabled!(log::Level::Debug) {
            self.tell_share(state);
        }
    }

    /// Tells which share of the isosurface is tracked, for those who look on.
    fn tell_share(&self, State { tracked, region, at, .. }: &State) {
        let n = |is_in: &dyn Fn(u32) -> bool| count_parts(self.exact(), *at, is_in).crossings.len();
        let (own, all) = (n(&|cell| !region.is_exact(cell)), n(&|_| true));
        log::debug!("at {at} {own} of {all} crossings tracked; {} faces", tracked.mesh.n_faces());
    }

    /// Where the mesh is at the end of a step.
    fn moved(
        &self,
        state: &State,
        step: Step,
        again: Option<&Again>,
        kernels: &mut dyn Kernels,
    ) -> Result<Moved> {
        let transport = Transport {
            tracked: &state.tracked,
            region: &state.region,
            exact: self.exact(),
            field: self.field(),
            parameters: self.parameters(),
            step,
            again,
        };
        transport.moved(kernels)
    }

    /// Blocks become exact for a while, where they are that already, those around them; the step is to be taken again.
    fn give_way(
        &mut self,
        state: &mut State,
        named: BTreeSet<u32>,
        passage: Passage,
        before: Moved,
        kernels: &mut dyn Kernels,
    ) -> Result<Again> {
        let mut region = state.region.clone();
        for b in named {
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
        self.calendar.close_around(&mut region, passage, &added);
        let fresh = self.exchange(state, region, passage, kernels)?;
        let near = old.symmetric_difference(state.region.blocks()).copied().collect();
        Ok(self.again(before, fresh, near))
    }

    /// Mends faces that fold on the way, most of them where the seam runs into the mesh. Returns the blocks of what changes,
    /// if anything does.
    fn mend_folded(
        &mut self,
        state: &mut State,
        step: Step,
        moved: &Moved,
    ) -> Option<BTreeSet<u32>> {
        let (exact, error) = (self.exact(), self.parameters().error as f32);
        let start = |tracked: &Tracked, v: Vertex| tracked.mesh.position(v);
        let end = |tracked: &Tracked, v: Vertex| {
            let free = || moved.end(v).map_or(tracked.mesh.position(v), Vec3::from);
            tracked.key(v).map_or_else(free, |e| place_on(exact, e, step.next))
        };
        let criteria = |c: f64| Criteria::new(self.field(), c, self.parameters());
        let shapes = [
            Shape { criteria: criteria(step.at), most: MOST_OFF * error, place: &start },
            Shape { criteria: criteria(step.next), most: 2.0 * MOST_OFF * error, place: &end },
        ];
        let corners = moved.folded.iter().flat_map(|f| state.tracked.mesh.corners(*f));
        let places: Vec<Vec3> = corners.collect();
        let mended = mend(&mut state.tracked, &state.region, &shapes, &moved.folded);
        log::debug!("{} edits for {} folded faces", mended.corners.len(), moved.folded.len());
        if mended.corners.is_empty() {
            return None;
        }
        self.record.changed_all(&state.tracked, state.at);
        Some(self.blocks_at(&places))
    }

    /// Better triangles at the end of a step: what fails is mended before remeshing, which would not, and after it.
    fn mend_and_remesh(&self, State { tracked, region, .. }: &mut State, criteria: &Criteria) {
        mend_faults(tracked, region, criteria, self.parameters());
        remesh(&mut tracked.mesh, criteria);
        mend_faults(tracked, region, criteria, self.parameters());
    }

    /// A block could not be tracked: it stays exact for a while, which doubles where it was tracked again in vain.
    fn back_off(&self, state: &mut State, block: u32) {
        let reason = state.reasons.entry(block).or_default();
        if reason.until > self.step {
            return;
        }
        let again = reason.held > 0 && reason.until + reason.held + HOLD >= self.step;
        reason.held = if again { (2 * reason.held).min(LONGEST_HOLD) } else { HOLD + 1 };
        reason.until = self.step + reason.held;
    }

    /// To take a step again after some blocks have changed.
    fn again(&self, before: Moved, fresh: BTreeSet<Vertex>, changed: BTreeSet<u32>) -> Again {
        let grid = self.grid;
        let marked =
            |rings| grid.marked(changed.iter().flat_map(|&b| grid.blocks_within(b, rings)));
        let [near, wide] = [1, 2].map(marked);
        Again { before, fresh, near, wide }
    }
}
