//! One march over the sampling isovalues for the whole isosurface, up and down from one, by steps (`march/step.rs`) of some length
//! (`march/length.rs`): plan (`march/plan.rs`), exchange (`march/exchanges.rs`), move, check, slide (`march/slide.rs`), remesh, record.

mod exchanges;
mod length;
mod plan;
mod slide;
mod step;

use std::collections::{BTreeSet, HashMap};
use std::sync::{Mutex, PoisonError};

use glam::Vec3;

use super::calendar::{Calendar, Passage};
use super::exact::Shown;
use super::initial::InitialMesh;
use super::record::Recorder;
use super::region::{Grid, Region};
use super::tracked::Tracked;
use super::transport::{Step, typical_slope};
use crate::error::{Error, Result};
use crate::kernels::field::Field;
use crate::kernels::{DeviceWork, Kernels};
use crate::sweep::{Counts, Parameters, Progress, Sweep};
use crate::topology::exact::ExactField;
use length::{LONGER, REGROWTH, start};

/// Steps for which a block stays exact after the last reason for it.
const HOLD: u32 = 1;

/// The longest that a block stays exact that cannot be tracked, steps.
const LONGEST_HOLD: u32 = 32;

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
    let calendar = Calendar::new(&sweep.exact, &sweep.topology, sweep.range);
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
            let tracked = Tracked::of(positions, triangles, |_| None);
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
        let (mut usual, mut most) = (length, f64::INFINITY);
        while state.at != last {
            self.sweep.cancelled()?;
            let step = Step { at: state.at, next: self.next(state.at, last, length) };
            // Half-way between the two lengths, as steps end between grey levels.
            let is_long = (step.next - step.at).abs() > 0.5 * (1.0 + LONGER) * usual;
            if !self.take(state, step, is_long, kernels)? {
                length = 0.5 * (step.next - step.at).abs();
                if self.level() > 0.0 {
                    most = length;
                }
                continue;
            }
            most *= REGROWTH;
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
                length = (times * usual).clamp(0.5 * length, 1.6 * length).min(most);
            }
        }
        self.count(kernels.device_work());
        self.record.finish(last);
        for (block, since) in sorted(std::mem::take(&mut state.since)) {
            self.show(block, since, last);
        }
        Ok(())
    }

    fn count(&mut self, DeviceWork { submissions, read_backs }: DeviceWork) {
        self.counts.submissions += submissions;
        self.counts.read_backs += read_backs;
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

    /// The blocks around places of the voxel frame.
    fn blocks_at(&self, places: &[Vec3]) -> BTreeSet<u32> {
        places.iter().map(|&p| self.block_at(p)).collect()
    }

    /// The blocks around samples.
    fn blocks_at_samples(&self, samples: impl IntoIterator<Item = u32>) -> BTreeSet<u32> {
        let samples = samples.into_iter().filter(|&s| self.is_sample(s));
        let octants = samples.flat_map(|s| (0..8).map(move |o| (s, o)));
        octants.filter_map(|(s, o)| self.grid.block_of_cell(self.grid.octant(s, o))).collect()
    }

    /// The block around a place of the voxel frame.
    fn block_at(&self, p: Vec3) -> u32 {
        self.grid.block_at(p * self.field().inverse_cell_size())
    }
}

/// The entries of a map by key.
fn sorted<V>(map: HashMap<u32, V>) -> Vec<(u32, V)> {
    let mut all: Vec<(u32, V)> = map.into_iter().collect();
    all.sort_unstable_by_key(|e| e.0);
    all
}
