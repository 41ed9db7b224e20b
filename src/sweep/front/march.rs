//! One march over the sampling isovalues for the whole isosurface: plan, exchange, move, check, slide, remesh, record.

use std::collections::{BTreeSet, HashMap};

use glam::Vec3;
use rayon::prelude::*;

use super::calendar::{Calendar, Passage};
use super::check::{open_seam, unlike_parts};
use super::clusters::{Cluster, clusters};
use super::exact::Shown;
use super::exchange::{Exchanged, Refused, exchange};
use super::improve::Improvement;
use super::mend::{Shape, mend};
use super::part::join;
use super::record::Recorder;
use super::region::{Grid, Link, Region};
use super::remesh::remesh;
use super::tracked::{Changes, Tracked, place_of, place_on};
use super::transport::{
    Again, MOST_OFF, MOST_OFF_REFINED, Moved, Step, Transport, faults, typical_slope,
};
use crate::error::Result;
use crate::kernels::Kernels;
use crate::kernels::field::Field;
use crate::mesh::{Face, Mesh, Vertex, bounds};
use crate::sweep::criteria::Criteria;
use crate::sweep::{Parameters, Sweep};
use crate::topology::critical::Place;
use crate::topology::exact::ExactField;

/// How far all but one in ten places move in a step, voxels.
const STEP_LENGTH: f32 = 0.25;

/// A step is taken shorter where more than this share of the faces cannot follow it, unless it is as short as the second
/// share of the range.
const TOO_LONG_SHARE: f64 = 0.03;
const SHORTEST: f64 = 1e-3;

/// Steps for which a block stays exact after the last reason for it.
const HOLD: u32 = 1;

/// Blocks that are exact stay so where there is a reason for it within so many steps.
const LOOK_AHEAD: f64 = 4.0;

/// The longest that a block stays exact that cannot be tracked, steps.
const LONGEST_HOLD: u32 = 32;

/// A step is tried so often with more cells exact before it is taken as it is.
const MOST_ROUNDS: usize = 6;

/// So often faces that fold are mended before their cells become exact.
const MOST_MENDED: usize = 3;

/// After so many rounds the blocks around those named become exact as well.
const NAMED_ALONE: usize = 3;

/// An exchange is tried so often before blocks that should be released there stay exact; before whole components of the
/// mesh become exact; and before everything does.
const MOST_RELEASES: usize = 3;
const MOST_NEARBY: usize = 8;
const MOST_EXCHANGES: usize = 24;

/// More samples than these are no place: what was refused is too large to tell.
const MOST_NAMED: usize = 64;

/// An exchange changes faces this near to its blocks at most, voxels; as much farther in every further attempt.
const NEAR: f32 = 1.0;
const MOST_WIDER: usize = 4;

/// Where an exchange is refused, so many blocks around the place are made exact at most.
const MOST_NEAR: usize = 1000;

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
        self.go(&mut state, low, length, kernels)
    }

    /// A first guess of the step's length, from the exact extraction.
    fn first_step(&self, start: f64) -> f64 {
        let whole = crate::extract::extract(self.exact(), start);
        let own = whole.positions.iter().map(|&p| p.into());
        let slope = typical_slope(self.field(), own).unwrap_or(1.0);
        self.length_for(slope)
    }

    fn length_for(&self, slope: f32) -> f64 {
        let unit = f64::from(self.field().isovalue(1.0) - self.field().isovalue(0.0)).max(1e-12);
        let (low, high) = self.sweep.range;

        let length = f64::from(STEP_LENGTH * slope) / unit;
        length.clamp((high - low) / 2000.0, (high - low) / 4.0)
    }

    /// The next sampling isovalue.
    fn next(&self, at: f64, last: f64, length: f64) -> f64 {
        let sign = (last - at).signum();
        let left = (last - at).abs();
        let mut next = at + sign * length;
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
        while state.at != last {
            self.sweep.cancelled()?;
            let step = Step { at: state.at, next: self.next(state.at, last, length) };
            if !self.take(state, step, kernels)? {
                length = 0.5 * (step.next - step.at).abs();
                continue;
            }
            let positions =
                state.tracked.mesh.vertices().filter(|&v| !state.tracked.mesh.is_fixed(v));
            let slope =
                typical_slope(self.field(), positions.map(|v| state.tracked.mesh.position(v)));
            if let Some(slope) = slope {
                length = self.length_for(slope).clamp(0.5 * length, 1.6 * length);
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

    /// Which blocks are exact in a step: those with something critical in or near it, those for which there was a reason
    /// shortly before, and what the seam asks for.
    fn plan(&mut self, state: &mut State, [from, to]: [f64; 2]) -> Region {
        let margin = to - from;
        let passage = Passage::between(self.exact(), from - 0.1 * margin, to + 0.1 * margin);
        let busy = self.busy(passage);
        let ahead = Passage::between(self.exact(), from, to + LOOK_AHEAD * margin);
        let soon = self.busy(ahead);
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
        log::debug!(
            "{from} to {to}: {} blocks busy, {n_reasons} with reasons, {} exact; {} faces tracked",
            busy.len(),
            region.blocks().len(),
            state.tracked.mesh.n_faces()
        );
        region
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

    /// Makes the mesh that of another region, or of a larger one: cluster by cluster, each as soon as it can be. Returns the
    /// vertices that have come or gone.
    fn exchange(
        &mut self,
        state: &mut State,
        mut target: Region,
        passage: Passage,
        kernels: &mut dyn Kernels,
    ) -> Result<BTreeSet<Vertex>> {
        if state.region.is_closed() {
            let blocks = state.region.blocks().clone();
            state.region = Region::open(self.grid);
            for b in blocks {
                state.region.add(b);
            }
        }
        let mut new: BTreeSet<Vertex> = BTreeSet::new();
        for attempt in 0usize.. {
            if target.is_closed() {
                self.drop_all(state, target);
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
            self.tally.exchanges += clusters.len();
            let refused = self.commit(state, &target, &clusters, made, &mut new);
            self.tally.refused_exchanges += refused.len();
            log::debug!(
                "{} of {} clusters refused: {:?}",
                refused.len(),
                clusters.len(),
                refused.iter().take(8).map(|r| (r.1.why, r.1.samples.len())).collect::<Vec<_>>()
            );
            if refused.is_empty() {
                break;
            }
            self.widen(&mut target, state, &clusters, refused, passage, attempt);
        }
        let improved = self.improve(state, &new, kernels)?;
        new.extend(improved);
        Ok(new)
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
        for &b in closed.blocks() {
            state.since.entry(b).or_insert(state.at);
        }
        state.region = closed;
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
                } else if let Some(since) = state.since.remove(&b) {
                    self.show(b, since, state.at);
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
            let is_stubborn = attempt >= MOST_RELEASES || samples.len() > MOST_NAMED;
            if is_stubborn && blocks.iter().any(is_released) {
                added.extend(blocks.iter().copied().filter(is_released));
            } else if attempt > MOST_NEARBY {
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
        if !around.is_empty() || attempt >= MOST_EXCHANGES {
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
            let samples: Vec<u32> =
                samples.iter().copied().filter(|&s| self.is_sample(s)).collect();
            let mut grown = false;
            for &s in &samples {
                grown |= target.add_around(s);
            }
            if !grown {
                for &s in &samples {
                    let block = self.grid.block_of_cell(self.grid.octant(s, 0));
                    self.add_ring(target, block);
                }
            }
        }
        let added: Vec<u32> = target.blocks().difference(&before).copied().collect();
        if added.is_empty() || attempt >= MOST_EXCHANGES {
            log::debug!("given up");
            self.tally.given_up += 1;
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

    /// Samples around which the mesh is not watertight with the exact cells, or not like the isosurface.
    fn unlike(&self, State { tracked, region, .. }: &State, isovalue: f64) -> Vec<u32> {
        let open = open_seam(tracked, region, self.exact(), isovalue);
        if !open.is_empty() {
            log::debug!(
                "{isovalue}: open at {} samples: {:?}",
                open.len(),
                open.iter().take(4).map(|&v| self.grid.position(v)).collect::<Vec<_>>()
            );
            return open.into_iter().collect();
        }
        let places = unlike_parts(tracked, region, self.exact(), isovalue);
        if !places.is_empty() {
            log::debug!("{isovalue}: unlike at {} places: {:?}", places.len(), places[0]);
        }
        places.into_iter().map(|p| self.sample_at(p)).collect()
    }

    /// The lowest sample of the cell around a place of the voxel frame.
    fn sample_at(&self, p: Vec3) -> u32 {
        self.grid.cell_at(p * self.field().inverse_cell_size())
    }

    /// Makes blocks around one exact, farther and farther away until one was not; whether there was one.
    fn add_ring(&self, region: &mut Region, block: Option<u32>) -> bool {
        let mut near: BTreeSet<u32> = block.into_iter().collect();
        while near.len() < MOST_NEAR {
            let around = near.iter().flat_map(|&b| self.grid.blocks_around(b));
            let wider: BTreeSet<u32> = around.collect();
            let grown = wider.iter().fold(false, |any, &b| region.add(b) | any);
            if grown || wider.len() == near.len() {
                return grown;
            }
            near = wider;
        }
        false
    }

    fn is_sample(&self, v: u32) -> bool {
        (v as usize) < self.grid.dims.iter().product() && {
            let p = self.grid.position(v);
            (0..3).all(|a| p[a] >= 1 && p[a] + 1 < self.grid.dims[a])
        }
    }

    /// Takes one step; does not where it is too long for too much of the mesh.
    fn take(&mut self, state: &mut State, step: Step, kernels: &mut dyn Kernels) -> Result<bool> {
        self.step += 1;
        self.tally.steps += 1;
        let region = self.plan(state, [step.at, step.next]);
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
                    again = Some(Again { before: moved, fresh: BTreeSet::new(), near });
                    continue;
                }
            }
            let mut stuck = None;
            if moved.places.is_empty() || round >= MOST_ROUNDS {
                self.tally.unresolved += moved.places.len();
                stuck = self.slide(state, step, passage, &moved).err();
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
        self.mend_faults(state, &criteria);
        remesh(&mut state.tracked.mesh, &criteria);
        let faults = self.mend_faults(state, &criteria);
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

    /// Whether too much of the mesh cannot follow a step.
    fn is_too_long(&self, state: &State, step: Step, moved: &Moved) -> bool {
        let (low, high) = self.sweep.range;
        let is_short = (step.next - step.at).abs() < SHORTEST * (high - low);
        let most = TOO_LONG_SHARE * state.tracked.mesh.n_faces() as f64;
        !is_short && moved.places.len() as f64 > most.max(20.0)
    }

    /// The blocks of what could not be tracked.
    fn named_blocks(&mut self, moved: &Moved, stuck: Option<Vec<u32>>) -> BTreeSet<u32> {
        let Some(samples) = stuck else {
            return moved.places.iter().filter_map(|&p| self.block_at(p)).collect();
        };
        self.tally.stuck += 1;
        let octants = samples
            .into_iter()
            .filter(|&s| self.is_sample(s))
            .flat_map(|s| (0..8).map(move |o| (s, o)));
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
        let near = self.beside(old.symmetric_difference(state.region.blocks()).copied());
        Ok(Again { before, fresh, near })
    }

    /// Mends faces that fold on the way, most of them where the seam runs into the mesh. Returns the blocks near changes,
    /// if there are any.
    fn mend_folded(&mut self, state: &mut State, step: Step, moved: &Moved) -> Option<Vec<bool>> {
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
        Some(self.beside(places.into_iter().filter_map(|p| self.block_at(p))))
    }

    /// Mends faces that cannot stay as they are at the present isovalue; returns those that could not be.
    fn mend_faults(&self, state: &mut State, criteria: &Criteria) -> Vec<Face> {
        let bad = faults(&state.tracked, criteria, self.parameters());
        if bad.is_empty() {
            return bad;
        }
        let most = MOST_OFF_REFINED * self.parameters().error as f32;
        let place = |tracked: &Tracked, v: Vertex| tracked.mesh.position(v);
        let shapes = [Shape { criteria: *criteria, most, place: &place }];
        let n = mend(&mut state.tracked, &state.region, &shapes, &bad);
        let left = faults(&state.tracked, criteria, self.parameters());
        log::debug!("{n} edits for {} faults leave {}", bad.len(), left.len());
        left
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

    /// By block, whether it is one of some or beside one.
    fn beside(&self, blocks: impl Iterator<Item = u32>) -> Vec<bool> {
        self.grid.marked(blocks.flat_map(|b| self.grid.blocks_around(b)))
    }

    /// The block around a place of the voxel frame.
    fn block_at(&self, p: Vec3) -> Option<u32> {
        self.grid.block_at(p * self.field().inverse_cell_size())
    }

    /// The seam goes over all samples that are passed, and every vertex to where it is at the end of the step.
    fn slide(
        &mut self,
        state: &mut State,
        step: Step,
        passage: Passage,
        moved: &Moved,
    ) -> std::result::Result<(), Vec<u32>> {
        let exact = self.exact();
        let before = state.tracked.clone();
        let mark = self.record.mark();
        let mut ends: HashMap<Vertex, Vec3> =
            moved.vertices.iter().copied().zip(moved.positions.iter().map(|&p| p.into())).collect();
        let mut samples: Vec<u32> = self.calendar.samples(passage).to_vec();
        if step.next < step.at {
            samples.reverse();
        }
        let criteria = Criteria::new(self.field(), step.next, self.parameters());
        for sample in samples {
            if !matches!(state.region.link(sample), Link::Cycle(..)) {
                continue;
            }
            let value = exact.sample(sample).clamp(step.at.min(step.next), step.at.max(step.next));
            let share = ((value - step.at) / (step.next - step.at)) as f32;
            let at = |mesh: &Mesh, v: Vertex| {
                let p = mesh.position(v);
                ends.get(&v).map_or(p, |&q| p.lerp(q, share))
            };
            let mut changes = Changes::default();
            let place = place_of(exact, sample);
            let passed = state.tracked.pass(&state.region, sample, place, &at, &mut changes);
            if let Err(stuck) = passed {
                state.tracked = before;
                self.record.roll_back(mark);
                return Err(vec![stuck.0]);
            }
            self.tally.passed += 1;
            self.record.changed(&state.tracked, changes.faces.iter().copied(), value);
            for (v, between) in changes.born {
                let [p, q] = between.map(|v| {
                    let own = ends.get(&v).copied();
                    own.unwrap_or_else(|| state.tracked.mesh.position(v))
                });
                let n = state.tracked.mesh.vertex_normal(v);
                let middle = 0.5 * (p + q);
                let reach = 0.5 * p.distance(q) + 0.1;
                let end = crate::kernels::project::project_point(
                    self.field(),
                    middle,
                    n,
                    0,
                    criteria.isovalue,
                    reach,
                );
                // Its way so far is that of the edge's middle; so that it is there at the sample's value, its place
                // at the start of the step is as if it had always moved evenly.
                let now = state.tracked.mesh.position(v);
                let end = end.unwrap_or(middle);
                if share < 1.0 {
                    state.tracked.mesh.set_position(v, (now - share * end) / (1.0 - share));
                }
                ends.insert(v, end);
            }
        }
        let bad = self.unlike(state, step.next);
        if !bad.is_empty() {
            state.tracked = before;
            self.record.roll_back(mark);
            return Err(bad);
        }
        let normals: HashMap<Vertex, [f32; 3]> =
            moved.vertices.iter().copied().zip(moved.normals.iter().copied()).collect();
        let vertices: Vec<Vertex> = state.tracked.mesh.vertices().collect();
        for v in vertices {
            if let Some(e) = state.tracked.key(v) {
                state.tracked.mesh.set_position(v, place_on(exact, e, step.next));
            } else if let Some(&end) = ends.get(&v) {
                state.tracked.mesh.set_position(v, end);
                let n = normals.get(&v).map_or(Vec3::ZERO, |&n| n.into());
                self.record.knot(v, step.next, end, n);
            }
        }
        Ok(())
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

/// The entries of a map by key.
fn sorted<V>(map: HashMap<u32, V>) -> Vec<(u32, V)> {
    let mut all: Vec<(u32, V)> = map.into_iter().collect();
    all.sort_unstable_by_key(|e| e.0);
    all
}
