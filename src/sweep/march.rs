//! One march over the sampling isovalues for the whole isosurface, up and down from one, by steps of some length (`march/length.rs`): plan
//! (`march/plan.rs`), exchange (`march/exchanges.rs`), move, check, slide (`march/slide.rs`), remesh, record.

mod exchanges;
mod length;
mod plan;
mod slide;

use std::collections::{BTreeSet, HashMap};
use std::sync::{Mutex, PoisonError};

use glam::Vec3;

use super::calendar::{Calendar, Passage};
use super::exact::Shown;
use super::initial::InitialMesh;
use super::mend::{Shape, mend, mend_faults};
use super::record::Recorder;
use super::region::{Grid, Region};
use super::remesh::remesh;
use super::tracked::{Tracked, place_on};
use super::transport::{
    Again, MOST_OFF, MOST_OFF_REFINED, Moved, Step, Transport, faults, typical_slope,
};
use crate::error::{Error, Result};
use crate::kernels::Kernels;
use crate::kernels::field::Field;
use crate::mesh::{Face, Vertex};
use crate::sweep::remesh::criteria::Criteria;
use crate::sweep::{Counts, Parameters, Progress, Sweep};
use crate::topology::exact::ExactField;
use length::{LONGER, start};

/// Steps for which a block stays exact after the last reason for it.
const HOLD: u32 = 1;

/// The longest that a block stays exact that cannot be tracked, steps.
const LONGEST_HOLD: u32 = 32;

/// A step is tried so often with more cells exact before it is taken as it is.
const MOST_ROUNDS: usize = 6;

/// So often faces that fold are mended before their cells become exact.
const MOST_MENDED: usize = 3;

/// After so many rounds the blocks around those named become exact as well.
const NAMED_ALONE: usize = 3;

/// Why a block is exact: until which step, and for how long it was held the last time that it could not be tracked.
#[derive(Clone, Copy, Debug, Default)]
struct Reason {
    until: u32,
    held: u32,
}

/// What a march goes on with.
#[derive(Clone)]
struct State {
    tracked: Tracked,
    region: Region,
    /// Since when blocks are exact.
    since: HashMap<u32, f64>,
    /// By block, the last reason to be exact.
    reasons: HashMap<u32, Reason>,
    at: f64,
}

/// How much of the work is done.
struct Done<'s> {
    share: Mutex<f64>,
    progress: &'s dyn Progress,
}

impl Done<'_> {
    /// Tells that more of it is.
    fn tell(&self, share: f64) {
        let mut done = self.share.lock().unwrap_or_else(PoisonError::into_inner);
        *done += share;
        self.progress.report(done.min(1.0), "tracking");
    }
}

/// What both directions have written down.
pub(super) struct Marched {
    pub(super) record: Recorder,
    pub(super) shown: Vec<Shown>,
    pub(super) counts: Counts,
}

/// Goes up and down from the start, both at once.
pub(super) fn march(sweep: &Sweep, initial: Option<InitialMesh>) -> Result<Marched> {
    let calendar = Calendar::new(&sweep.exact, &sweep.topology);
    let start = sweep.parameters.start.unwrap_or_else(|| start(sweep, &calendar));
    let done = Done { share: Mutex::new(0.0), progress: sweep.progress };
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    let (low, high) = sweep.range;
    let (mut up, mut state) = March::begun(sweep, &calendar, &done, (start, initial))?;
    let length = up.first_step(start);
    let around = [(start - length).max(low), (start + length).min(high)];
    let region = up.plan(&mut state, around);
    let passage = Passage::between(&sweep.exact, around[0], around[1]);
    up.exchange(&mut state, region, passage, &mut *kernels)?;
    let mut down = up.other();
    let n_common = down.record.knots.len();
    let begun = state.clone();
    let (went_up, went_down) = rayon::join(
        || up.go(state, high, length, &mut *kernels),
        || down.go(begun, low, length, &mut *sweep.backend.kernels(&sweep.field)?),
    );
    went_up.and(went_down)?;
    let March { mut record, mut shown, mut counts, .. } = up;
    record.join(down.record, n_common);
    shown.extend(down.shown);
    counts.add(&down.counts);
    sweep.progress.report(1.0, "tracking");
    Ok(Marched { record, shown, counts })
}

/// A march in one direction.
struct March<'s, 'a> {
    sweep: &'s Sweep<'a>,
    calendar: &'s Calendar<'s>,
    grid: Grid,
    record: Recorder,
    shown: Vec<Shown>,
    counts: Counts,
    step: u32,
    done: &'s Done<'s>,
}

impl<'s, 'a> March<'s, 'a> {
    /// Begins: everything is exact; or, with a mesh from outside, nothing is.
    fn begun(
        sweep: &'s Sweep<'a>,
        calendar: &'s Calendar<'s>,
        done: &'s Done<'s>,
        (start, initial): (f64, Option<InitialMesh>),
    ) -> Result<(March<'s, 'a>, State)> {
        let grid = Grid::of(&sweep.exact);
        let (region, tracked) = if let Some(InitialMesh { positions, triangles }) = initial {
            // A closed mesh has no boundary that could be bound.
            let tracked = Tracked::of(positions, triangles, |_| None, &mut Vec::new());
            let tracked = tracked.map_err(|at| Error::internal(format!("initial mesh at {at}")))?;
            (Region::open(grid), tracked)
        } else {
            let passage = Passage::between(&sweep.exact, start, start);
            (Region::closed(grid, calendar.blocks(grid, passage)), Tracked::default())
        };
        let mut record = Recorder::default();
        record.changed_all(&tracked, start);
        let (shown, counts, step) = (Vec::new(), Counts::default(), HOLD + 1);
        let march = March { sweep, calendar, grid, record, shown, counts, step, done };
        let since = region.blocks().iter().map(|&b| (b, start)).collect();
        Ok((march, State { tracked, region, since, reasons: HashMap::new(), at: start }))
    }

    /// The same march, to go on otherwise from where it is: with nothing counted and shown.
    fn other(&self) -> Self {
        let March { sweep, calendar, grid, step, done, .. } = *self;
        let (shown, counts) = (Vec::new(), Counts::default());
        March { sweep, calendar, grid, record: self.record.clone(), shown, counts, step, done }
    }

    fn exact(&self) -> &'s ExactField<'a> {
        &self.sweep.exact
    }

    fn field(&self) -> &'s Field {
        &self.sweep.field
    }

    fn parameters(&self) -> &'s Parameters {
        self.sweep.parameters
    }

    /// Marches to an isovalue.
    fn go(
        &mut self,
        mut state: State,
        last: f64,
        mut length: f64,
        kernels: &mut dyn Kernels,
    ) -> Result<()> {
        let state = &mut state;
        let mut usual = length;
        while state.at != last {
            self.sweep.cancelled()?;
            let step = Step { at: state.at, next: self.next(state.at, last, length) };
            // Half-way between the two lengths, as steps end between grey levels.
            let is_long = (step.next - step.at).abs() > 0.5 * (1.0 + LONGER) * usual;
            if !self.take(state, step, is_long, kernels)? {
                length = 0.5 * (step.next - step.at).abs();
                continue;
            }
            self.done.tell(self.calendar.work(self.sweep.range, [step.at, step.next]));
            if let Some(fixed) = self.fixed() {
                (usual, length) = (fixed, fixed);
                continue;
            }
            let positions =
                state.tracked.mesh.vertices().filter(|&v| !state.tracked.mesh.is_fixed(v));
            let slope =
                typical_slope(self.field(), positions.map(|v| state.tracked.mesh.position(v)));
            if let Some(slope) = slope {
                usual = self.length_for(slope);
                let times = if self.is_calm(state, &state.region) { LONGER } else { 1.0 };
                length = (times * usual).clamp(0.5 * length, 1.6 * length);
            }
        }
        self.record.finish(last);
        for (block, since) in sorted(std::mem::take(&mut state.since)) {
            self.show(block, since, last);
        }
        Ok(())
    }

    /// Writes down that a block was exact between two isovalues.
    fn show(&mut self, block: u32, a: f64, b: f64) {
        if a != b {
            let cells = self.grid.cells_of(block);
            self.shown.extend(cells.map(|cell| (cell, a.min(b), a.max(b))));
        }
    }

    /// The lowest sample of the cell around a place of the voxel frame.
    fn sample_at(&self, p: Vec3) -> u32 {
        self.grid.cell_at(p * self.field().inverse_cell_size())
    }

    fn is_sample(&self, v: u32) -> bool {
        (v as usize) < self.grid.dims.iter().product() && {
            let p = self.grid.position(v);
            (0..3).all(|a| p[a] >= 1 && p[a] + 1 < self.grid.dims[a])
        }
    }

    /// Takes one step; does not where it is too long for too much of the mesh.
    fn take(
        &mut self,
        state: &mut State,
        step: Step,
        is_long: bool,
        kernels: &mut dyn Kernels,
    ) -> Result<bool> {
        self.step += 1;
        if self.is_before_events(state, step) {
            self.counts.too_long += 1;
            return Ok(false);
        }
        let region = self.plan(state, [step.at, step.next]);
        if is_long && !self.is_calm(state, &region) {
            self.counts.too_long += 1;
            return Ok(false);
        }
        let passage = Passage::between(self.exact(), step.at, step.next);
        self.exchange(state, region, passage, kernels)?;
        let mut again: Option<Again> = None;
        let (mut mended, mut round) = (0, 0);
        loop {
            self.counts.repeated += u64::from(again.is_some());
            let moved = self.moved(state, step, again.as_ref(), kernels)?;
            if again.is_none() && self.is_too_long(state, step, &moved) {
                log::debug!("{} to {} is too long: {:?}", step.at, step.next, moved.named);
                self.counts.too_long += 1;
                return Ok(false);
            }
            if mended < MOST_MENDED {
                mended += 1;
                if let Some(near) = self.mend_folded(state, step, &moved) {
                    again = Some(self.again(moved, BTreeSet::new(), near));
                    continue;
                }
            }
            let mut stuck = None;
            if moved.places.is_empty() || round >= MOST_ROUNDS {
                stuck = self.slide(state, step, passage, &moved, round < 2 * MOST_ROUNDS).err();
                if stuck.is_none() {
                    break;
                }
            }
            log::debug!(
                "{} to {}: {:?} named, {} faces, {} exact blocks, {stuck:?}",
                step.at,
                step.next,
                moved.named,
                state.tracked.mesh.n_faces(),
                state.region.blocks().len()
            );
            let named = self.named_blocks(&moved, stuck);
            again = Some(self.give_way(state, named, round, passage, moved, kernels)?);
            round += 1;
        }
        self.counts.steps += 1;
        state.at = step.next;
        let criteria = Criteria::new(self.field(), state.at, self.parameters());
        self.mend_and_remesh(state, &criteria);
        let faults = faults(&state.tracked, &criteria, self.parameters());
        self.record.changed_all(&state.tracked, state.at);
        if log::log_enabled!(log::Level::Debug) {
            let all = crate::extract::count::count_parts(self.exact(), state.at, |_| true);
            let own = crate::extract::count::count_parts(self.exact(), state.at, |c| {
                !state.region.is_exact(c)
            });
            log::debug!(
                "share tracked {:.3} of {} crossings; {} faces",
                own.crossings.len() as f64 / all.crossings.len().max(1) as f64,
                all.crossings.len(),
                state.tracked.mesh.n_faces()
            );
        }
        self.counts.faults += faults.len() as u64;
        let middle = |f: Face| state.tracked.mesh.corners(f).iter().sum::<Vec3>() / 3.0;
        let places: Vec<Vec3> = faults.into_iter().map(middle).collect();
        for b in places.into_iter().filter_map(|p| self.block_at(p)) {
            self.back_off(state, b);
        }
        Ok(true)
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

    /// The blocks of what could not be tracked.
    fn named_blocks(&mut self, moved: &Moved, stuck: Option<BTreeSet<u32>>) -> BTreeSet<u32> {
        let Some(stuck) = stuck else {
            return moved.places.iter().filter_map(|&p| self.block_at(p)).collect();
        };
        stuck
    }

    /// The blocks around samples.
    fn blocks_at_samples(&self, samples: impl IntoIterator<Item = u32>) -> BTreeSet<u32> {
        let samples = samples.into_iter().filter(|&s| self.is_sample(s));
        let octants = samples.flat_map(|s| (0..8).map(move |o| (s, o)));
        octants.filter_map(|(s, o)| self.grid.block_of_cell(self.grid.octant(s, o))).collect()
    }

    /// Blocks become exact for a while, where they are that already, or after a few rounds, those around them; the step
    /// is to be taken again.
    fn give_way(
        &mut self,
        state: &mut State,
        named: BTreeSet<u32>,
        round: usize,
        passage: Passage,
        before: Moved,
        kernels: &mut dyn Kernels,
    ) -> Result<Again> {
        let mut region = state.region.clone();
        for b in named {
            self.back_off(state, b);
            if !region.add(b) || round >= NAMED_ALONE {
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
    fn mend_folded(&mut self, state: &mut State, step: Step, moved: &Moved) -> Option<Vec<u32>> {
        let (exact, error) = (self.exact(), self.parameters().error as f32);
        let start = |tracked: &Tracked, v: Vertex| tracked.mesh.position(v);
        let end = |tracked: &Tracked, v: Vertex| {
            let free = || moved.end(v).map_or(tracked.mesh.position(v), Vec3::from);
            tracked.key(v).map_or_else(free, |e| place_on(exact, e, step.next))
        };
        let criteria = |c: f64| Criteria::new(self.field(), c, self.parameters());
        let shapes = [
            Shape { criteria: criteria(step.at), most: MOST_OFF_REFINED * error, place: &start },
            Shape { criteria: criteria(step.next), most: MOST_OFF * error, place: &end },
        ];
        let corners = moved.folded.iter().flat_map(|f| state.tracked.mesh.corners(*f));
        let places: Vec<Vec3> = corners.collect();
        let n = mend(&mut state.tracked, &state.region, &shapes, &moved.folded);
        log::debug!("{n} edits for {} folded faces", moved.folded.len());
        if n == 0 {
            return None;
        }
        self.record.changed_all(&state.tracked, state.at);
        Some(places.into_iter().filter_map(|p| self.block_at(p)).collect())
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
    fn again(&self, before: Moved, fresh: BTreeSet<Vertex>, changed: Vec<u32>) -> Again {
        let grid = self.grid;
        let marked =
            |rings| grid.marked(changed.iter().flat_map(|&b| grid.blocks_within(b, rings)));
        let [near, wide] = [1, 2].map(marked);
        Again { before, fresh, near, wide }
    }

    /// The block around a place of the voxel frame.
    fn block_at(&self, p: Vec3) -> Option<u32> {
        self.grid.block_at(p * self.field().inverse_cell_size())
    }
}

/// The entries of a map by key.
fn sorted<V>(map: HashMap<u32, V>) -> Vec<(u32, V)> {
    let mut all: Vec<(u32, V)> = map.into_iter().collect();
    all.sort_unstable_by_key(|e| e.0);
    all
}
