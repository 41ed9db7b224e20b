//! The length of a step.

use rayon::prelude::*;

use super::state::{March, State};
use crate::sweep::calendar::{Calendar, Passage};
use crate::sweep::context::Sweep;
use crate::sweep::parameters::Parameters;
use crate::sweep::region::Region;
use crate::sweep::transport::{Moved, Step, typical_slope};

/// How far nine of ten vertices move in a step at most, voxels.
const STEP_LENGTH: f32 = 0.25;

/// If the exact blocks are no more than [`CALM_SHARE`] of the blocks with tracked mesh, a step is [`CALM_FACTOR`] times as long.
const CALM_SHARE: f64 = 0.02;
pub(super) const CALM_FACTOR: f64 = 2.0;

/// A step is shortened if its critical points are near more than this share of the blocks with tracked mesh, and less than this
/// share of these blocks are critical in its first half.
const MAJOR_SHARE: f64 = 0.25;

/// A step is shortened if more failures occur than this share of the number of faces.
const TOO_LONG_SHARE: f64 = 0.03;

/// Length of the shortest step, as a share of the range of the samples, and in grey levels for integer samples. It does not follow
/// from the range of the sweep: a part of a range must not take more steps than the whole.
const MIN_STEP_SHARE: f64 = 1e-4;
const MIN_STEP_LEVELS: f64 = 0.125;

/// Number of shortest steps in a range at least, for samples with an outlier far beyond the range.
const MIN_SHORT_STEPS: f64 = 64.0;

/// The isovalue below which a share of the work is. For integer samples it is between two integers.
pub(super) fn isovalue_at_share(sweep: &Sweep, calendar: &Calendar, share: f64) -> f64 {
    let (low, high) = sweep.range;
    let (mut below, mut above) = (low, high);
    // Halves do not overflow.
    while 0.5 * above - 0.5 * below > MIN_STEP_SHARE * (0.5 * high - 0.5 * low) {
        let middle = 0.5 * below + 0.5 * above;
        // Neighbouring floating point numbers may be farther apart.
        if middle <= below || middle >= above {
            break;
        }
        if calendar.work(sweep.range, [low, middle]) < share {
            below = middle;
        } else {
            above = middle;
        }
    }
    let between = below.floor() + 0.5;
    let integer = sweep.exact.volume().samples().is_integer();
    if integer && low < between && between < high { between } else { below }
}

impl March<'_, '_> {
    /// Distance between two sample values: 1 for integers, 0 for others.
    pub(super) fn level(&self) -> f64 {
        if self.exact().volume().samples().is_integer() { 1.0 } else { 0.0 }
    }

    /// The distance between sampling isovalues, if the parameters fix it.
    pub(super) fn fixed(&self) -> Option<f64> {
        let (low, high) = self.sweep.range;
        let &Parameters { step, samples, .. } = self.parameters();
        step.or_else(|| samples.map(|n| (high - low) / n.max(1) as f64))
    }

    /// Length of the first step, from the slopes at the exact extraction.
    pub(super) fn first_step(&self, start: f64) -> f64 {
        if let Some(fixed) = self.fixed() {
            return fixed;
        }
        let whole = crate::extract::extract(self.exact(), start);
        let own = whole.positions.par_iter().map(|&p| p.into());
        let slope = typical_slope(self.field(), own).unwrap_or(1.0);
        self.length_for(slope)
    }

    pub(super) fn length_for(&self, slope: f32) -> f64 {
        let (least, largest) = self.exact().volume().range();
        let length = f64::from(STEP_LENGTH * slope) / self.field().scale();
        let shortest = self.shortest_step().max(MIN_STEP_LEVELS * self.level());
        // A quarter of all values may be less than half a grey level.
        let longest = (largest - least) / 4.0;
        length.clamp(shortest.min(longest), longest)
    }

    /// Length of the shortest step, whatever the type of the samples.
    fn shortest_step(&self) -> f64 {
        let (low, high) = self.sweep.range;
        let (least, largest) = self.exact().volume().range();
        let share = MIN_STEP_SHARE * (largest - least);
        share.min((high - low) / MIN_SHORT_STEPS).max(MIN_STEP_SHARE * (high - low))
    }

    /// The next sampling isovalue.
    pub(super) fn next(&self, at: f64, last: f64, length: f64) -> f64 {
        let remaining = (last - at).abs();
        let sign = (last - at).signum();
        // A step that would end nearly at the last isovalue ends there.
        let (next, near) = match self.fixed() {
            Some(fixed) => (self.next_multiple(at, sign, fixed, length), 1.0),
            None => (self.next_free(at, sign, length), 0.8),
        };
        // Neighbouring floating point numbers may be farther apart than the step is long.
        let next = if next == at { neighbour(at, last) } else { next };
        if (next - at).abs() >= near * remaining { last } else { next }
    }

    /// The next isovalue that is a multiple of a distance from the low end of the range, unless it is too far.
    fn next_multiple(&self, at: f64, sign: f64, fixed: f64, length: f64) -> f64 {
        let low = self.sweep.range.0;
        let multiple = sign * ((sign * (at - low) / fixed + 1e-6).floor() + 1.0);
        let whole = low + multiple * fixed;
        if (whole - at).abs() <= 1.001 * length { whole } else { at + sign * length }
    }

    /// The isovalue one step length ahead. For integer samples it is half-way between two integers if the step is long
    /// enough, and never an integer.
    fn next_free(&self, at: f64, sign: f64, length: f64) -> f64 {
        let next = at + sign * length;
        if !self.exact().volume().samples().is_integer() {
            return next;
        }
        let half = next.floor() + 0.5;
        let is_long = length >= 1.0 && (half - at) * sign >= 0.5 * length;
        if is_long {
            half
        } else if next == next.floor() {
            next + 0.1
        } else {
            next
        }
    }

    /// Whether nearly all of the surface is tracked if a region is exact.
    pub(super) fn is_calm(&self, state: &State, region: &Region) -> bool {
        let n_tracked = self.tracked_blocks(state).len() as f64;
        region.blocks().len() as f64 <= CALM_SHARE * n_tracked
    }

    /// Whether much of the mesh would become exact for critical points in the second half of a step.
    pub(super) fn is_before_events(&self, state: &State, step: Step) -> bool {
        if self.is_short(step) || self.fixed().is_some() {
            return false;
        }
        let n_busy = |to: f64| self.busy(Passage::between(self.exact(), step.at, to)).len() as f64;
        let n_all = n_busy(step.next);
        // Blocks are counted last, as that visits the whole mesh.
        n_busy(0.5 * (step.at + step.next)) < MAJOR_SHARE * n_all
            && n_all > MAJOR_SHARE * self.tracked_blocks(state).len() as f64
    }

    /// Whether a step must not be shortened.
    pub(super) fn is_short(&self, step: Step) -> bool {
        // Within a grey level no sample is crossed, but the surface comes near samples of both levels.
        (step.next - step.at).abs() <= self.level().max(self.shortest_step())
            || Self::is_shortest(step)
    }

    /// Whether a step is one between neighbouring floating point numbers, so that none is shorter.
    pub(super) fn is_shortest(step: Step) -> bool {
        step.next == neighbour(step.at, step.next)
    }

    /// Whether a step fails for too much of the mesh.
    pub(super) fn is_too_long(&self, state: &State, step: Step, moved: &Moved) -> bool {
        let most = TOO_LONG_SHARE * state.tracked.mesh.n_faces() as f64;
        !self.is_short(step) && moved.places.len() as f64 > most.max(20.0)
    }
}

/// The next floating point number towards another.
fn neighbour(at: f64, to: f64) -> f64 {
    if to > at { at.next_up() } else { at.next_down() }
}
