//! The state of a march, and what its stages share.

use std::collections::{BTreeSet, HashMap};
use std::sync::{Mutex, PoisonError};

use glam::Vec3;

use crate::error::{Error, Result};
use crate::field::Field;
use crate::sweep::calendar::{Calendar, Passage};
use crate::sweep::cause::{Cause, Ended};
use crate::sweep::context::Sweep;
use crate::sweep::counts::Counts;
use crate::sweep::exact::ExactInterval;
use crate::sweep::initial::InitialMesh;
use crate::sweep::parameters::Parameters;
use crate::sweep::places::Places;
use crate::sweep::record::Recorder;
use crate::sweep::region::{PaddedGrid, Region};
use crate::sweep::stages::Stage;
use crate::sweep::tracked::Tracked;
use crate::topology::exact::ExactField;

/// Number of steps for which a block stays exact after a critical point.
pub(super) const MIN_EXACT_STEPS: u32 = 1;

/// Attempts of a step, and of an exchange, in which every failure makes the cells around it exact. After these only failures of seam
/// and topology count, and what an exchange cannot change is made exact as a whole.
pub(super) const MAX_ATTEMPTS: usize = 6;

/// Longest back-off of a block whose tracking failed, steps.
pub(super) const MAX_BACK_OFF: u32 = 32;

/// How long a block stays exact: until which step, and the length in steps of its last back-off.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BackOff {
    pub(super) until: u32,
    pub(super) length: u32,
}

/// The state of a march in one direction.
#[derive(Clone)]
pub(super) struct State {
    pub(super) tracked: Tracked,
    pub(super) places: Places,
    pub(super) region: Region,
    /// By block, the isovalue since which it is exact.
    pub(super) since: HashMap<u32, f64>,
    /// By block, how long it stays exact.
    pub(super) back_offs: HashMap<u32, BackOff>,
    pub(super) at: f64,
}

/// Progress of both directions.
pub(super) struct WorkDone<'s> {
    pub(super) share: Mutex<f64>,
    pub(super) stage: Stage<'s>,
}

impl WorkDone<'_> {
    /// Adds a share of the work and reports the sum.
    pub(super) fn add(&self, share: f64) {
        let mut done = self.share.lock().unwrap_or_else(PoisonError::into_inner);
        *done += share;
        self.stage.report(*done);
    }
}

/// A march in one direction.
pub(super) struct March<'s, 'a> {
    pub(super) sweep: &'s Sweep<'a>,
    pub(super) calendar: &'s Calendar<'s>,
    pub(super) grid: PaddedGrid,
    pub(super) record: Recorder,
    pub(super) exact_intervals: Vec<ExactInterval>,
    pub(super) counts: Counts,
    pub(super) step: u32,
    pub(super) done: &'s WorkDone<'s>,
}

impl<'s, 'a> March<'s, 'a> {
    /// A march at its start: everything is exact; with an initial mesh, only the layer around the volume.
    pub(super) fn new(
        sweep: &'s Sweep<'a>,
        calendar: &'s Calendar<'s>,
        done: &'s WorkDone<'s>,
        start: f64,
        initial: Option<InitialMesh>,
    ) -> Result<(March<'s, 'a>, State)> {
        let grid = PaddedGrid::of(&sweep.exact);
        let (region, tracked) = if let Some(InitialMesh { positions, triangles }) = initial {
            // A closed mesh has no boundary vertices to bind.
            let tracked = Tracked::of(positions, triangles, |_| None);
            let tracked = tracked.map_err(|at| Error::internal(format!("initial mesh at {at}")))?;
            (Region::layer_exact(grid), tracked)
        } else {
            let passage = Passage::between(&sweep.exact, start, start);
            (Region::all_exact(grid, calendar.blocks(grid, passage)), Tracked::default())
        };
        let mut record = Recorder::default();
        record.changed(&tracked, tracked.mesh.faces(), start, |_| Cause::Exchange);
        let (exact_intervals, counts, step) = (Vec::new(), Counts::default(), MIN_EXACT_STEPS + 1);
        let march = March { sweep, calendar, grid, record, exact_intervals, counts, step, done };
        let since = region.blocks().iter().map(|&b| (b, start)).collect();
        let (places, back_offs) = (march.places(&tracked), HashMap::new());
        Ok((march, State { tracked, places, region, since, back_offs, at: start }))
    }

    /// A march in the other direction from the same record, with empty counts and intervals.
    pub(super) fn fork(&self) -> Self {
        let March { sweep, calendar, grid, step, done, .. } = *self;
        let (exact_intervals, counts) = (Vec::new(), Counts::default());
        let mut record = self.record.clone();
        record.ended = Ended::default();
        March { sweep, calendar, grid, record, exact_intervals, counts, step, done }
    }

    pub(super) fn exact(&self) -> &'s ExactField<'a> {
        &self.sweep.exact
    }

    pub(super) fn field(&self) -> &'s Field {
        &self.sweep.field
    }

    pub(super) fn parameters(&self) -> &'s Parameters {
        self.sweep.parameters
    }

    /// Records that a block was exact between two isovalues.
    pub(super) fn record_exact(&mut self, block: u32, a: f64, b: f64) {
        if a != b {
            let cells = self.grid.cells_of(block);
            self.exact_intervals.extend(cells.map(|cell| ExactInterval {
                cell,
                low: a.min(b),
                high: a.max(b),
            }));
        }
    }

    /// The lowest sample of the cell around a place of the voxel frame.
    pub(super) fn sample_at(&self, p: Vec3) -> u32 {
        self.grid.cell_at(p * self.field().inverse_cell_size())
    }

    pub(super) fn is_sample(&self, v: u32) -> bool {
        (v as usize) < self.grid.dims.iter().product() && {
            let p = self.grid.position(v);
            (0..3).all(|a| p[a] >= 1 && p[a] + 1 < self.grid.dims[a])
        }
    }

    /// The blocks around places of the voxel frame.
    pub(super) fn blocks_at(&self, places: &[Vec3]) -> BTreeSet<u32> {
        places.iter().map(|&p| self.block_at(p)).collect()
    }

    /// The blocks around samples.
    pub(super) fn blocks_at_samples(
        &self,
        samples: impl IntoIterator<Item = u32>,
    ) -> BTreeSet<u32> {
        let samples = samples.into_iter().filter(|&s| self.is_sample(s));
        let octants = samples.flat_map(|s| (0..8).map(move |o| (s, o)));
        octants.filter_map(|(s, o)| self.grid.block_of_cell(self.grid.octant(s, o))).collect()
    }

    /// The blocks of a mesh's vertices.
    pub(super) fn places(&self, tracked: &Tracked) -> Places {
        Places::of(tracked, self.grid, self.field().inverse_cell_size())
    }

    /// The block around a place of the voxel frame.
    pub(super) fn block_at(&self, p: Vec3) -> u32 {
        self.grid.block_at(p * self.field().inverse_cell_size())
    }
}

/// The entries of a map by key.
pub(super) fn sorted<V>(map: HashMap<u32, V>) -> Vec<(u32, V)> {
    let mut all: Vec<(u32, V)> = map.into_iter().collect();
    all.sort_unstable_by_key(|e| e.0);
    all
}
