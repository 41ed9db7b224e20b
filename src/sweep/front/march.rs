//! One march over the sampling isovalues for the whole isosurface: plan, exchange (`march/exchanges.rs`), move, check,
//! slide (`march/slide.rs`), remesh, record.

mod exchanges;
mod slide;

use std::collections::{BTreeSet, HashMap};

use glam::Vec3;
use rayon::prelude::*;

use super::calendar::{Calendar, Passage};
use super::exact::Shown;
use super::mend::{Shape, mend, mend_faults};
use super::record::Recorder;
use super::region::{Grid, Region};
use super::remesh::remesh;
use super::tracked::{Tracked, place_on};
use super::transport::{
    Again, MOST_OFF, MOST_OFF_REFINED, Moved, Step, Transport, faults, typical_slope,
};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::kernels::field::Field;
use crate::mesh::{Face, Vertex};
use crate::sweep::criteria::Criteria;
use crate::sweep::{Counts, Parameters, Sweep};
use crate::topology::critical::Place;
use crate::topology::exact::ExactField;

/// How far all but one in ten places move in a step, voxels.
const STEP_LENGTH: f32 = 0.25;

/// Where no more blocks are exact than this share of those that hold some of the mesh, a step may be so many times longer.
const CALM: f64 = 0.02;
const LONGER: f64 = 2.0;

/// Boxes of so many blocks along a side are exact as a whole where more than this share of the blocks in them is that the
/// surface is in.
const BOX: usize = 8;
const CROWDED: f64 = 0.6;

/// A step is taken shorter where what is critical in it is in or near more than this share of the blocks that hold some of
/// the mesh, and less than this share of that in its first half.
const FAR: f64 = 0.25;

/// A step is taken shorter where more than this share of the faces cannot follow it.
const TOO_LONG_SHARE: f64 = 0.03;

/// The shortest step, as a share of the range; and of a grey level.
const SHORTEST: f64 = 1e-4;
const SHORTEST_OF_LEVEL: f64 = 0.125;

/// Steps for which a block stays exact after the last reason for it.
const HOLD: u32 = 1;

/// Blocks that are exact stay so where something critical comes within so many steps; and where the sample value that
/// comes next does within so many, and they have flat squares of it: there the isosurface jumps.
const LOOK_AHEAD: f64 = 1.0;
const FLATS_AHEAD: f64 = 4.0;

/// The longest that a block stays exact that cannot be tracked, steps.
const LONGEST_HOLD: u32 = 32;

/// A step is tried so often with more cells exact before it is taken as it is.
const MOST_ROUNDS: usize = 6;

/// So often faces that fold are mended before their cells become exact.
const MOST_MENDED: usize = 3;

/// After so many rounds the blocks around those named become exact as well.
const NAMED_ALONE: usize = 3;

/// What happened.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    pub(super) steps: usize,
    pub(super) rounds: usize,
    pub(super) exchanges: usize,
    pub(super) refused_exchanges: usize,
    pub(super) passed: usize,
    pub(super) stuck: usize,
    pub(super) too_long: usize,
    pub(super) faults: usize,
    pub(super) unresolved: usize,
    pub(super) given_up: usize,
}

impl Tally {
    /// What a spectrum keeps of it.
    pub(super) fn tell(&self, counts: &mut Counts) {
        let taken = self.steps - self.too_long;
        counts.steps = taken as u64;
        counts.repeated = (self.rounds - taken) as u64;
        counts.exchanges = self.exchanges as u64;
        counts.exchanges_refused = self.refused_exchanges as u64;
    }
}

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

/// See the module.
pub(super) struct March<'s, 'a> {
    sweep: &'s Sweep<'a>,
    calendar: Calendar<'s>,
    grid: Grid,
    pub(super) record: Recorder,
    pub(super) shown: Vec<Shown>,
    pub(super) tally: Tally,
    step: u32,
    /// Share of the work that is done.
    done: f64,
}

impl<'s, 'a> March<'s, 'a> {
    pub(super) fn new(sweep: &'s Sweep<'a>) -> Self {
        let exact = &sweep.exact;
        let grid = Grid::of(exact);
        March {
            sweep,
            calendar: Calendar::new(exact, &sweep.topology),
            grid,
            record: Recorder::default(),
            shown: Vec::new(),
            tally: Tally::default(),
            step: 0,
            done: 0.0,
        }
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

    /// Goes up and down from the start.
    pub(super) fn run(&mut self, start: f64, kernels: &mut dyn Kernels) -> Result<()> {
        let (low, high) = self.sweep.range;
        let length = self.first_step(start);
        let mut state = State {
            tracked: Tracked::default(),
            region: Region::closed(
                self.grid,
                self.calendar.blocks(self.grid, Passage::between(self.exact(), start, start)),
            ),
            since: HashMap::new(),
            reasons: HashMap::new(),
            at: start,
        };
        state.since = state.region.blocks().iter().map(|&b| (b, start)).collect();
        self.step = HOLD + 1;
        let around = [(start - length).max(low), (start + length).min(high)];
        let region = self.plan(&mut state, around);
        let passage = Passage::between(self.exact(), around[0], around[1]);
        self.exchange(&mut state, region, passage, kernels)?;
        let snapshot = self.record.snapshot();
        let begun = state.clone();
        self.go(&mut state, high, length, kernels)?;
        self.record.restore(snapshot);
        state = begun;
        self.go(&mut state, low, length, kernels)?;
        self.sweep.progress.report(1.0, "tracking");
        Ok(())
    }

    /// From one isovalue at which samples may be passed to the next: a grey level, or nothing.
    fn level(&self) -> f64 {
        if self.exact().volume().samples().is_integer() { 1.0 } else { 0.0 }
    }

    /// The distance between sampling isovalues that is asked for.
    fn fixed(&self) -> Option<f64> {
        let (low, high) = self.sweep.range;
        let &Parameters { step, samples, .. } = self.parameters();
        step.or_else(|| samples.map(|n| (high - low) / n.max(1) as f64))
    }

    /// A first guess of the step's length, from the exact extraction.
    fn first_step(&self, start: f64) -> f64 {
        if let Some(fixed) = self.fixed() {
            return fixed;
        }
        let whole = crate::extract::extract(self.exact(), start);
        let own = whole.positions.iter().map(|&p| p.into());
        let slope = typical_slope(self.field(), own).unwrap_or(1.0);
        self.length_for(slope)
    }

    fn length_for(&self, slope: f32) -> f64 {
        let (low, high) = self.sweep.range;
        let length = f64::from(STEP_LENGTH * slope) / self.field().scale();
        let shortest = (SHORTEST * (high - low)).max(SHORTEST_OF_LEVEL * self.level());
        length.clamp(shortest, (high - low) / 4.0)
    }

    /// The next sampling isovalue.
    fn next(&self, at: f64, last: f64, length: f64) -> f64 {
        let sign = (last - at).signum();
        let left = (last - at).abs();
        let mut next = at + sign * length;
        if let Some(fixed) = self.fixed() {
            // Multiples of it from the low end, unless that is too far.
            let low = self.sweep.range.0;
            let multiple = sign * ((sign * (at - low) / fixed + 1e-6).floor() + 1.0);
            let whole = low + multiple * fixed;
            next = if (whole - at).abs() <= 1.001 * length { whole } else { next };
            return if (next - at).abs() >= left { last } else { next };
        }
        if self.exact().volume().samples().is_integer() {
            // Not where samples are passed: between them, if the step is as long as that.
            let half = next.floor() + 0.5;
            let is_long = length >= 1.0 && (half - at) * sign >= 0.5 * length;
            next = if is_long {
                half
            } else if next == next.floor() {
                next + 0.1
            } else {
                next
            };
        }
        if (next - at).abs() >= 0.8 * left { last } else { next }
    }

    /// Marches to an isovalue.
    fn go(
        &mut self,
        state: &mut State,
        last: f64,
        mut length: f64,
        kernels: &mut dyn Kernels,
    ) -> Result<()> {
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
            self.tell_progress(step);
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

    /// Tells that a step is done: by the way along the range, and by the samples passed, half each.
    fn tell_progress(&mut self, step: Step) {
        let (low, high) = self.sweep.range;
        let n = |a: f64, b: f64| {
            self.calendar.samples(Passage::between(self.exact(), a, b)).len() as f64
        };
        let samples = n(step.at, step.next) / n(low, high).max(1.0);
        self.done += 0.5 * ((step.next - step.at).abs() / (high - low) + samples);
        self.sweep.progress.report(self.done.min(1.0), "tracking");
    }

    /// Whether nearly all of the surface is tracked with a region.
    fn is_calm(&self, state: &State, region: &Region) -> bool {
        let n_tracked = self.tracked_blocks(state).len() as f64;
        region.blocks().len() as f64 <= CALM * n_tracked
    }

    /// Writes down that a block was exact between two isovalues.
    fn show(&mut self, block: u32, a: f64, b: f64) {
        if a != b {
            let cells = self.grid.cells_of(block);
            self.shown.extend(cells.map(|cell| (cell, a.min(b), a.max(b))));
        }
    }

    /// Which blocks are exact in a step: those with something critical in or near it, those for which there was a reason
    /// shortly before, and what the seam asks for.
    fn plan(&mut self, state: &mut State, [from, to]: [f64; 2]) -> Region {
        let margin = to - from;
        let passage = Passage::between(self.exact(), from - 0.1 * margin, to + 0.1 * margin);
        let busy = self.busy(passage);
        let ahead = |steps: f64| Passage::between(self.exact(), from, to + steps * margin);
        let now = Passage::between(self.exact(), from, to);
        let mut soon = self.busy(ahead(LOOK_AHEAD));
        let next_value = self.calendar.up_to_next_value(now, ahead(FLATS_AHEAD));
        soon.extend(self.calendar.flats(next_value));
        for &b in &busy {
            let reason = state.reasons.entry(b).or_default();
            reason.until = reason.until.max(self.step + HOLD);
        }
        let mut region = Region::open(self.grid);
        for &b in soon.iter().filter(|b| state.region.blocks().contains(b)) {
            region.add(b);
        }
        for (b, _) in sorted(state.reasons.clone()).into_iter().filter(|r| r.1.until >= self.step) {
            region.add(b);
        }
        let n_reasons = region.blocks().len();
        self.calendar.close(&mut region, Passage::between(self.exact(), from, to));
        let crowded = self.crowded(state, &region);
        for &b in &crowded {
            region.add(b);
        }
        self.calendar.close_around(&mut region, Passage::between(self.exact(), from, to), &crowded);
        log::debug!(
            "{from} to {to}: {} blocks busy, {n_reasons} with reasons, {} crowded, {} exact; {} faces tracked",
            busy.len(),
            crowded.len(),
            region.blocks().len(),
            state.tracked.mesh.n_faces()
        );
        region
    }

    /// The blocks that are to be exact because most around them are: what is tracked there would be seam all over, which
    /// costs most and gains least.
    fn crowded(&self, state: &State, region: &Region) -> Vec<u32> {
        // What is exact now may be tracked next: its blocks hold no vertices but those of the seam.
        let others: BTreeSet<u32> = self
            .tracked_blocks(state)
            .into_iter()
            .chain(state.region.blocks().iter().copied())
            .collect();
        // By box: how many blocks are exact, and the others that the surface is in, or was.
        let mut boxes: HashMap<[usize; 3], (usize, Vec<u32>)> = HashMap::new();
        let around = |b: u32| self.grid.block_position(b).map(|x| x / BOX);
        for &b in others.iter().filter(|b| !region.holds(**b)) {
            boxes.entry(around(b)).or_default().1.push(b);
        }
        for &b in region.blocks() {
            boxes.entry(around(b)).or_default().0 += 1;
        }
        let is_crowded =
            |(n, others): &(usize, Vec<u32>)| *n as f64 > CROWDED * (n + others.len()) as f64;
        let mut crowded: Vec<u32> =
            boxes.into_values().filter(is_crowded).flat_map(|b| b.1).collect();
        crowded.sort_unstable();
        crowded
    }

    /// The blocks that hold vertices of the mesh, ascending.
    fn tracked_blocks(&self, state: &State) -> Vec<u32> {
        let mesh = &state.tracked.mesh;
        let vertices = (0..mesh.vertex_slots() as u32).into_par_iter().map(Vertex);
        let mut blocks: Vec<u32> = vertices
            .filter(|&v| mesh.has_vertex(v))
            .filter_map(|v| self.block_at(mesh.position(v)))
            .collect();
        blocks.par_sort_unstable();
        blocks.dedup();
        blocks
    }

    /// The blocks near something critical in a passage.
    fn busy(&self, passage: Passage) -> BTreeSet<u32> {
        let mut busy = BTreeSet::new();
        for place in self.calendar.critical(passage) {
            match place {
                Place::Vertex(v) => {
                    let octants = (0..8).map(|o| self.grid.octant(v, o));
                    busy.extend(octants.filter_map(|c| self.grid.block_of_cell(c)));
                }
                Place::Face { corner, axis } => {
                    let cells = [corner, corner - self.grid.strides[axis as usize]];
                    busy.extend(cells.into_iter().filter_map(|c| self.grid.block_of_cell(c)));
                }
                Place::Cell(cell) => busy.extend(self.grid.block_of_cell(cell)),
                Place::Layer => {}
            }
        }
        busy
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
        self.tally.steps += 1;
        if self.is_before_events(state, step) {
            self.tally.too_long += 1;
            return Ok(false);
        }
        let region = self.plan(state, [step.at, step.next]);
        if is_long && !self.is_calm(state, &region) {
            self.tally.too_long += 1;
            return Ok(false);
        }
        let passage = Passage::between(self.exact(), step.at, step.next);
        self.exchange(state, region, passage, kernels)?;
        let mut again: Option<Again> = None;
        let (mut mended, mut round) = (0, 0);
        loop {
            self.tally.rounds += 1;
            let moved = self.moved(state, step, again.as_ref(), kernels)?;
            if again.is_none() && self.is_too_long(state, step, &moved) {
                log::debug!("{} to {} is too long: {:?}", step.at, step.next, moved.named);
                self.tally.too_long += 1;
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
                self.tally.unresolved += moved.places.len();
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
        self.tally.faults += faults.len();
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

    /// Whether most of the mesh would become exact for what comes at the end of a step.
    fn is_before_events(&self, state: &State, step: Step) -> bool {
        if self.is_short(step) || self.fixed().is_some() {
            return false;
        }
        let n_busy = |to: f64| self.busy(Passage::between(self.exact(), step.at, to)).len() as f64;
        let n_all = n_busy(step.next);
        n_all > FAR * self.tracked_blocks(state).len() as f64
            && n_busy(0.5 * (step.at + step.next)) < FAR * n_all
    }

    /// Whether a step is as short as may be.
    fn is_short(&self, step: Step) -> bool {
        let (low, high) = self.sweep.range;
        // Between two grey levels nothing is passed, but the surface comes near the samples of either.
        (step.next - step.at).abs() <= self.level().max(SHORTEST * (high - low))
    }

    /// Whether too much of the mesh cannot follow a step.
    fn is_too_long(&self, state: &State, step: Step, moved: &Moved) -> bool {
        let most = TOO_LONG_SHARE * state.tracked.mesh.n_faces() as f64;
        !self.is_short(step) && moved.places.len() as f64 > most.max(20.0)
    }

    /// The blocks of what could not be tracked.
    fn named_blocks(&mut self, moved: &Moved, stuck: Option<BTreeSet<u32>>) -> BTreeSet<u32> {
        let Some(stuck) = stuck else {
            return moved.places.iter().filter_map(|&p| self.block_at(p)).collect();
        };
        self.tally.stuck += 1;
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
