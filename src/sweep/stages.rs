//! Progress of a sweep, whose stages take different shares of its time.
//!
//! The topology takes time for each sample of the volume, tracking and what follows for each sample in the range of
//! isovalues. The factor between them was measured: on `hydrogen:64` (all isovalues) topology, tracking and the rest took
//! 7 s, 56 s and 20 s, on 103 to 107 of a tooth of 1.6 million samples 37 s, 10 s and 18 s.

use rayon::iter::ParallelIterator as _;

use super::calendar::inner_samples;
use crate::progress::Progress;
use crate::topology::exact::ExactField;

/// How many times longer a sample in the range takes than a sample in the topology.
const COST_IN_RANGE: f64 = 20.0;

/// Share of tracking in the time after the topology.
const TRACKING: f64 = 0.7;

/// The ends of the stages, as fractions of the whole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stages {
    topology: f64,
    tracking: f64,
}

impl Stages {
    /// Estimates the stages of a sweep over a range.
    pub(super) fn of(field: &ExactField, (low, high): (f64, f64)) -> Stages {
        let is_in_range = |v: &u32| (low..=high).contains(&field.sample(*v));
        let (n, n_in_range) =
            (inner_samples(field).count() as f64, inner_samples(field).filter(is_in_range).count());
        let topology = n / (n + COST_IN_RANGE * n_in_range as f64);
        Stages { topology, tracking: topology + TRACKING * (1.0 - topology) }
    }

    pub(super) fn topology<'a>(&self, progress: &'a dyn Progress) -> Stage<'a> {
        Stage { progress, from: 0.0, to: self.topology, message: "topology" }
    }

    pub(super) fn tracking<'a>(&self, progress: &'a dyn Progress) -> Stage<'a> {
        Stage { progress, from: self.topology, to: self.tracking, message: "tracking" }
    }

    /// The stage after tracking: exact cells, and the thinning of trajectories.
    pub(super) fn finishing<'a>(&self, progress: &'a dyn Progress) -> Stage<'a> {
        Stage { progress, from: self.tracking, to: 1.0, message: "finishing" }
    }
}

/// The progress of one stage.
pub(super) struct Stage<'a> {
    progress: &'a dyn Progress,
    from: f64,
    to: f64,
    message: &'static str,
}

impl Stage<'_> {
    /// Reports the fraction of the stage that is done.
    pub(super) fn report(&self, done: f64) {
        let done = self.from + done.clamp(0.0, 1.0) * (self.to - self.from);
        self.progress.report(done, self.message);
    }
}
