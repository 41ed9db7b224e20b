//! The stretches of a sweep: parts of the range, each of which is marched by itself from a start in it.
//!
//! # Theory
//!
//! Marches depend on each other only by their first mesh, so with K starts there are 2 K marches that need not wait for each other.
//! At a meeting of two stretches one mesh ends and the other begins, both within the tolerance of the same isosurface. Exact cells
//! have the same vertices and triangles on either side, so they are not stored twice. A meeting costs the tracked triangles that
//! live there. So the number of stretches follows from the size of the spectrum and of the isosurface, never from the machine, and
//! meetings lie where the isosurface is small.

use rayon::prelude::*;

use super::length::isovalue_at_share;
use crate::forecast::Forecast;
use crate::sweep::calendar::{Calendar, inner_samples};
use crate::sweep::context::Sweep;

/// Most triangles that meetings add, as a share of all triangles of the spectrum.
const MAX_MEETING_SHARE: f64 = 0.05;

/// Fewest triangles of a stretch: with fewer, a sweep takes only seconds.
const MIN_TRIANGLES: f64 = 100_000.0;

/// Most stretches of a sweep whose number follows from the forecast.
const MAX_STRETCHES: usize = 16;

/// Isovalues among which a meeting is chosen, in the middle half between two starts.
const N_CANDIDATES: usize = 17;

/// Tracked triangles for each lattice edge that the isosurface crosses.
const TRIANGLES_PER_CROSSING: f64 = 1.0;

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
    let n = sweep.parameters.starts;
    let best = n.map_or_else(
        || affordable(sweep, calendar),
        |n| divided(n, &meetings(sweep, calendar, n), sweep, calendar),
    );
    log::debug!("stretches: {best:?}");
    best
}

/// Where two stretches meet, and the number of lattice edges that the isosurface crosses there.
struct Meeting {
    isovalue: f64,
    n_crossings: u64,
}

/// The largest number of stretches whose meetings are affordable.
fn affordable(sweep: &Sweep, calendar: &Calendar) -> Vec<Stretch> {
    let forecast = Forecast::of(&sweep.exact, &sweep.topology, sweep.range, sweep.parameters.error);
    let most = (forecast.triangles / MIN_TRIANGLES).min(MAX_STRETCHES as f64) as usize;
    let is_affordable = |meetings: &[Meeting]| {
        let n: u64 = meetings.iter().map(|meeting| meeting.n_crossings).sum();
        n as f64 * TRIANGLES_PER_CROSSING <= MAX_MEETING_SHARE * forecast.triangles
    };
    let mut n = most;
    while n > 1 {
        let meetings = meetings(sweep, calendar, n);
        if is_affordable(&meetings) {
            return divided(n, &meetings, sweep, calendar);
        }
        n -= 1;
    }
    divided(1, &[], sweep, calendar)
}

/// The range divided at meetings, with a start in the middle of the work of each part.
fn divided(n: usize, meetings: &[Meeting], sweep: &Sweep, calendar: &Calendar) -> Vec<Stretch> {
    let (low, high) = sweep.range;
    let inner = meetings.iter().map(|meeting| meeting.isovalue);
    let mut ends: Vec<f64> = std::iter::once(low).chain(inner).chain([high]).collect();
    ends.dedup();
    let start = |i: usize| isovalue_at_share(sweep, calendar, (i as f64 + 0.5) / n as f64);
    let starts: Vec<f64> = (0..n).map(start).collect();
    let stretch = |pair: &[f64]| {
        let is_inside = |start: &&f64| pair[0] <= **start && **start < pair[1];
        starts.iter().find(is_inside).map(|&start| Stretch { low: pair[0], start, high: pair[1] })
    };
    let all: Option<Vec<Stretch>> = ends.windows(2).map(stretch).collect();
    // Of a few sample values, several starts may be the same.
    all.unwrap_or_else(|| {
        vec![Stretch { low, start: isovalue_at_share(sweep, calendar, 0.5), high }]
    })
}

/// The meetings of `n` stretches: between each two starts, the isovalue with the fewest crossings.
fn meetings(sweep: &Sweep, calendar: &Calendar, n: usize) -> Vec<Meeting> {
    let between = |i: usize, j: usize| {
        let offset = 0.5 * (j as f64 / (N_CANDIDATES - 1) as f64 - 0.5);
        isovalue_at_share(sweep, calendar, (i as f64 + offset) / n as f64)
    };
    let candidates: Vec<f64> = (1..n)
        .flat_map(|i| (0..N_CANDIDATES).map(move |j| (i, j)))
        .map(|(i, j)| between(i, j))
        .collect();
    let crossings = crossings(sweep, &candidates);
    let groups = candidates.chunks(N_CANDIDATES).zip(crossings.chunks(N_CANDIDATES));
    let fewest = |(isovalues, crossings): (&[f64], &[u64])| {
        let middle = |j: usize| j.abs_diff(N_CANDIDATES / 2);
        let best = (0..isovalues.len()).min_by_key(|&j| (crossings[j], middle(j)));
        best.map(|j| Meeting { isovalue: isovalues[j], n_crossings: crossings[j] })
    };
    groups.filter_map(fewest).collect()
}

/// The number of lattice edges that the isosurface crosses at each of some ascending isovalues.
fn crossings(sweep: &Sweep, isovalues: &[f64]) -> Vec<u64> {
    let field = &sweep.exact;
    let dims = field.dims();
    // The number of isovalues below a sample.
    let n_below = |v: u32| isovalues.partition_point(|&c| c < field.sample(v));
    let of_sample = |mut changes: Vec<i64>, v: u32| {
        let own = n_below(v);
        for axis in 0..3 {
            if field.position(v)[axis] + 2 < dims[axis] as i64 {
                let other = n_below(v + field.strides()[axis]);
                changes[own.min(other)] += 1;
                changes[own.max(other)] -= 1;
            }
        }
        changes
    };
    let none = || vec![0i64; isovalues.len() + 1];
    let sum = |mut a: Vec<i64>, b: Vec<i64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let changes = inner_samples(field).fold(none, of_sample).reduce(none, sum);
    let counts = changes.iter().scan(0i64, |n, change| {
        *n += change;
        Some(*n as u64)
    });
    counts.take(isovalues.len()).collect()
}
