//! The stretches of a sweep: parts of the range, each of which is marched by itself from a start in it.
//!
//! # Theory
//!
//! Marches depend on each other only by their first mesh, so with K starts there are 2 K marches that need not wait for each other.
//! At a meeting of two stretches one mesh ends and the other begins, both within the tolerance of the same isosurface. Exact cells
//! have the same vertices and triangles on either side, so they are not stored twice. A meeting costs the tracked triangles that
//! live there. So the number of stretches follows from the size of the spectrum and of the isosurface, never from the machine, and
//! meetings lie where the isosurface is small.

use std::ops::RangeInclusive;

use super::length::isovalue_at_share;
use crate::forecast::{Forecast, crossings};
use crate::sweep::calendar::{Calendar, Passage};
use crate::sweep::context::Sweep;

/// Most triangles that meetings add, as a share of all triangles of the spectrum. A tracked mesh has about one for each lattice edge
/// that the isosurface crosses.
const MAX_MEETING_SHARE: f64 = 0.05;

/// Fewest triangles of a stretch: with fewer, a sweep takes a few seconds.
const MIN_TRIANGLES: f64 = 300_000.0;

/// Samples that the isosurface passes in a stretch at least, for each lattice edge that it crosses on average. It crosses 1.5 edges per
/// square voxel, on average over all directions, so it moves by 8 voxels. Over a shorter distance many triangles live from one end to
/// the other, and a meeting costs more than the forecast expects. `bonsai` 60:80 moves by half a voxel; three starts make it half as
/// large again.
const MIN_PASSED_PER_CROSSING: f64 = 8.0 / 1.5;

/// Fewest lattice edges that the isosurface crosses at a start, as a share of their mean over the range. From a smaller isosurface there is
/// little to march, and none of it is tracked before it has grown.
const MIN_START_SHARE: f64 = 0.05;

/// Most stretches of a sweep whose number follows from the forecast.
const MAX_STRETCHES: usize = 16;

/// Isovalues among which a meeting is chosen.
const N_CANDIDATES: usize = 17;

/// Most arcs of the contour tree for each lattice edge that the isosurface crosses on average, for more than one start. In scans,
/// which have more, each start has to find out anew what can be tracked: a second one costs up to a fifth more bytes and time.
const MAX_ARCS_PER_CROSSING: f64 = 0.1;

/// A part of the range, with the isovalue at which its marches start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) low: f64,
    pub(super) start: f64,
    pub(super) high: f64,
}

/// The stretches of a sweep, ascending: as many as requested, else as many as the forecast allows.
pub(super) fn stretches(sweep: &Sweep, calendar: &Calendar) -> Vec<Stretch> {
    let (low, high) = sweep.range;
    if let Some(start) = sweep.parameters.start {
        return vec![Stretch { low, start, high }];
    }
    let requested = |n: usize| {
        divided(sweep, calendar, &Crossings::at_candidates(sweep, calendar, n..=n), n, 0.0).0
    };
    let stretches = sweep.parameters.starts.map_or_else(|| affordable(sweep, calendar), requested);
    log::debug!("stretches: {stretches:?}");
    stretches
}

/// Where two stretches meet, and the number of lattice edges that the isosurface crosses there.
struct Meeting {
    isovalue: f64,
    n_crossings: u64,
}

/// The largest number of stretches whose meetings are affordable.
fn affordable(sweep: &Sweep, calendar: &Calendar) -> Vec<Stretch> {
    let forecast = Forecast::of(&sweep.exact, &sweep.topology, sweep.range, sweep.parameters.error);
    let n_arcs = sweep.topology.n_arcs_in(sweep.range) as f64;
    let is_smooth = n_arcs <= MAX_ARCS_PER_CROSSING * forecast.crossings;
    let passage = Passage::between(&sweep.exact, sweep.range.0, sweep.range.1);
    let n_passed = calendar.samples(passage).len() as f64;
    let passed = n_passed / forecast.crossings;
    let most = (forecast.triangles / MIN_TRIANGLES).min(passed / MIN_PASSED_PER_CROSSING);
    let most = most.min(MAX_STRETCHES as f64) as usize;
    let most = if is_smooth { most } else { 1 };
    let crossings = Crossings::at_candidates(sweep, calendar, 1..=most.max(1));
    let least = MIN_START_SHARE * forecast.crossings;
    let several = (2..=most)
        .rev()
        .map(|n| divided(sweep, calendar, &crossings, n, least))
        .find(|(_, n_crossings)| *n_crossings as f64 <= MAX_MEETING_SHARE * forecast.triangles);
    several.unwrap_or_else(|| divided(sweep, calendar, &crossings, 1, 0.0)).0
}

/// The range divided for `n` starts, and the number of crossings at all meetings. Starts with fewer than `least` crossings are left out,
/// and one that has no meeting with the one before: of a few sample values, several starts may be the same.
fn divided(
    sweep: &Sweep,
    calendar: &Calendar,
    crossings: &Crossings,
    n: usize,
    least: f64,
) -> (Vec<Stretch>, u64) {
    let (low, high) = sweep.range;
    let all_starts = starts(sweep, calendar, n);
    let mut starts: Vec<(usize, f64)> = all_starts.iter().copied().enumerate().collect();
    starts.retain(|&(_, start)| crossings.at(start) as f64 >= least);
    let first = starts.first().map_or(all_starts[0], |&(_, start)| start);
    let (mut all, mut n_all) = (vec![Stretch { low, start: first, high }], 0);
    for pair in starts.windows(2) {
        let [(_, before), (i, start)] = [pair[0], pair[1]];
        let candidates = candidates(sweep, calendar, i as f64 / n as f64, n);
        if let Some(Meeting { isovalue, n_crossings }) =
            crossings.fewest(&candidates, [before, start])
        {
            let last = all.last_mut().expect("one at least");
            last.high = isovalue;
            all.push(Stretch { low: isovalue, start, high });
            n_all += n_crossings;
        }
    }
    (all, n_all)
}

/// The starts of `n` stretches, each in the middle of the same share of the work.
fn starts(sweep: &Sweep, calendar: &Calendar, n: usize) -> Vec<f64> {
    (0..n).map(|i| isovalue_at_share(sweep, calendar, (i as f64 + 0.5) / n as f64)).collect()
}

/// Isovalues around a share of the work, at most a quarter of a stretch from it, ascending.
fn candidates(sweep: &Sweep, calendar: &Calendar, share: f64, n: usize) -> Vec<f64> {
    let offset = |j: usize| 0.5 * (j as f64 / (N_CANDIDATES - 1) as f64 - 0.5);
    let at = |j| isovalue_at_share(sweep, calendar, share + offset(j) / n as f64);
    (0..N_CANDIDATES).map(at).collect()
}

/// The number of lattice edges that the isosurface crosses at some isovalues, ascending.
struct Crossings(Vec<(f64, u64)>);

impl Crossings {
    /// Those at the starts of some numbers of stretches, and at all candidates for their meetings.
    fn at_candidates(sweep: &Sweep, calendar: &Calendar, numbers: RangeInclusive<usize>) -> Self {
        let of_meeting = |i: usize, n: usize| candidates(sweep, calendar, i as f64 / n as f64, n);
        let of_meetings = |n: usize| (1..n).flat_map(move |i| of_meeting(i, n));
        let mut isovalues: Vec<f64> =
            numbers.flat_map(|n| of_meetings(n).chain(starts(sweep, calendar, n))).collect();
        isovalues.sort_unstable_by(f64::total_cmp);
        isovalues.dedup();
        let counts = crossings(&sweep.exact, &isovalues, false);
        Crossings(isovalues.into_iter().zip(counts).collect())
    }

    /// The number at an isovalue, which must be one of them.
    fn at(&self, isovalue: f64) -> u64 {
        let found = self.0.binary_search_by(|(c, _)| c.total_cmp(&isovalue));
        self.0[found.expect("a candidate")].1
    }

    /// Of some candidates, ascending, the one with the fewest crossings between two starts; `None` if none is between them.
    fn fewest(&self, candidates: &[f64], starts: [f64; 2]) -> Option<Meeting> {
        let inside = (0..candidates.len())
            .filter(|&j| starts[0] < candidates[j] && candidates[j] < starts[1]);
        let from_middle = |j: &usize| j.abs_diff(N_CANDIDATES / 2);
        let best = inside.min_by_key(|j| (self.at(candidates[*j]), from_middle(j)));
        best.map(|j| Meeting { isovalue: candidates[j], n_crossings: self.at(candidates[j]) })
    }
}
