//! How long a step is.

use super::state::{March, State};
use crate::sweep::calendar::{Calendar, Passage};
use crate::sweep::context::Sweep;
use crate::sweep::parameters::Parameters;
use crate::sweep::region::Region;
use crate::sweep::transport::{Moved, Step, typical_slope};

/// How far all but one in ten places move in a step, voxels.
const STEP_LENGTH: f32 = 0.25;

/// Where no more blocks are exact than this share of those that hold some of the mesh, a step may be so many times longer.
const CALM: f64 = 0.02;
pub(super) const LONGER: f64 = 2.0;

/// Where samples are integers, steps become longer by this factor at most, each time, after one that was too long: by a grey
/// level, else, which would be tried every time.
pub(super) const REGROWTH: f64 = 1.2;

/// A step is taken shorter where what is critical in it is in or near more than this share of the blocks that hold some of
/// the mesh, and less than this share of that in its first half.
const FAR: f64 = 0.25;

/// A step is taken shorter where more than this share of the faces cannot follow it.
const TOO_LONG_SHARE: f64 = 0.03;

/// The shortest step, as a share of the range; and of a grey level.
const SHORTEST: f64 = 1e-4;
const SHORTEST_OF_LEVEL: f64 = 0.125;

/// The isovalue that a sweep starts from: with half of the work on either side of it; between two samples' values where
/// samples are integers.
pub(super) fn start(sweep: &Sweep, calendar: &Calendar) -> f64 {
    let (low, high) = sweep.range;
    let (mut below, mut above) = (low, high);
    // Halves do not overflow.
    while 0.5 * above - 0.5 * below > SHORTEST * (0.5 * high - 0.5 * low) {
        let middle = 0.5 * below + 0.5 * above;
        // Where numbers are farther apart than that.
        if middle <= below || middle >= above {
            break;
        }
        if calendar.work(sweep.range, [low, middle]) < 0.5 {
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
    /// From one isovalue at which samples may be passed to the next: a grey level, or nothing.
    pub(super) fn level(&self) -> f64 {
        if self.exact().volume().samples().is_integer() { 1.0 } else { 0.0 }
    }

    /// The distance between sampling isovalues that is asked for.
    pub(super) fn fixed(&self) -> Option<f64> {
        let (low, high) = self.sweep.range;
        let &Parameters { step, samples, .. } = self.parameters();
        step.or_else(|| samples.map(|n| (high - low) / n.max(1) as f64))
    }

    /// A first guess of the step's length, from the exact extraction.
    pub(super) fn first_step(&self, start: f64) -> f64 {
        if let Some(fixed) = self.fixed() {
            return fixed;
        }
        let whole = crate::extract::extract(self.exact(), start);
        let own = whole.positions.iter().map(|&p| p.into());
        let slope = typical_slope(self.field(), own).unwrap_or(1.0);
        self.length_for(slope)
    }

    pub(super) fn length_for(&self, slope: f32) -> f64 {
        let (low, high) = self.sweep.range;
        let length = f64::from(STEP_LENGTH * slope) / self.field().scale();
        let shortest = (SHORTEST * (high - low)).max(SHORTEST_OF_LEVEL * self.level());
        length.clamp(shortest, (high - low) / 4.0)
    }

    /// The next sampling isovalue.
    pub(super) fn next(&self, at: f64, last: f64, length: f64) -> f64 {
        let left = (last - at).abs();
        let sign = (last - at).signum();
        // So near to the last one, the step goes there.
        let (next, near) = match self.fixed() {
            Some(fixed) => (self.next_multiple(at, sign, fixed, length), 1.0),
            None => (self.next_free(at, sign, length), 0.8),
        };
        // Where numbers are farther apart than steps are long.
        let next = if next == at { neighbour(at, last) } else { next };
        if (next - at).abs() >= near * left { last } else { next }
    }

    /// The next multiple of a distance from the low end of the range, unless that is too far.
    fn next_multiple(&self, at: f64, sign: f64, fixed: f64, length: f64) -> f64 {
        let low = self.sweep.range.0;
        let multiple = sign * ((sign * (at - low) / fixed + 1e-6).floor() + 1.0);
        let whole = low + multiple * fixed;
        if (whole - at).abs() <= 1.001 * length { whole } else { at + sign * length }
    }

    /// As far as a step is long; where samples are integers, between two of them if the step is as long as that, and never at one.
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

    /// Whether nearly all of the surface is tracked with a region.
    pub(super) fn is_calm(&self, state: &State, region: &Region) -> bool {
        let n_tracked = self.tracked_blocks(state).len() as f64;
        region.blocks().len() as f64 <= CALM * n_tracked
    }

    /// Whether most of the mesh would become exact for what comes at the end of a step.
    pub(super) fn is_before_events(&self, state: &State, step: Step) -> bool {
        if self.is_short(step) || self.fixed().is_some() {
            return false;
        }
        let n_busy = |to: f64| self.busy(Passage::between(self.exact(), step.at, to)).len() as f64;
        let n_all = n_busy(step.next);
        // Blocks are counted last: that looks at the whole mesh.
        n_busy(0.5 * (step.at + step.next)) < FAR * n_all
            && n_all > FAR * self.tracked_blocks(state).len() as f64
    }

    /// Whether a step is as short as may be.
    pub(super) fn is_short(&self, step: Step) -> bool {
        let (low, high) = self.sweep.range;
        // Between two grey levels nothing is passed, but the surface comes near the samples of either.
        (step.next - step.at).abs() <= self.level().max(SHORTEST * (high - low))
            || step.next == neighbour(step.at, step.next)
    }

    /// Whether too much of the mesh cannot follow a step.
    pub(super) fn is_too_long(&self, state: &State, step: Step, moved: &Moved) -> bool {
        let most = TOO_LONG_SHARE * state.tracked.mesh.n_faces() as f64;
        !self.is_short(step) && moved.places.len() as f64 > most.max(20.0)
    }
}

/// The number beside one, on the way to another.
fn neighbour(at: f64, to: f64) -> f64 {
    if to > at { at.next_up() } else { at.next_down() }
}
