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

/// Most triangles that meetings add, as a share of all triangles of the spectrum. A tracked mesh has about one for each lattice edge
/// that the isosurface crosses.
const MAX_MEETING_SHARE: f64 = 0.05;

/// Fewest triangles of a stretch: with fewer, a sweep takes a few seconds.
const MIN_TRIANGLES: f64 = 300_000.0;

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
    let requested = sweep.parameters.starts.map(|n| divided(sweep, calendar, n).0);
    let stretches = requested.unwrap_or_else(|| affordable(sweep, calendar));
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
    let most = (forecast.triangles / MIN_TRIANGLES).min(MAX_STRETCHES as f64) as usize;
    let most = if is_smooth { most } else { 1 };
    let several = (2..=most)
        .rev()
        .map(|n| divided(sweep, calendar, n))
        .find(|(_, n_crossings)| *n_crossings as f64 <= MAX_MEETING_SHARE * forecast.triangles);
    several.unwrap_or_else(|| divided(sweep, calendar, 1)).0
}

/// The range divided for `n` starts, and the number of crossings at all meetings. A start that has no meeting with the one before is
/// left out: of a few sample values, several starts may be the same.
fn divided(sweep: &Sweep, calendar: &Calendar, n: usize) -> (Vec<Stretch>, u64) {
    let (low, high) = sweep.range;
    let starts = starts(sweep, calendar, n);
    let (mut all, mut n_all) = (vec![Stretch { low, start: starts[0], high }], 0);
    for (&start, meeting) in starts[1..].iter().zip(meetings(sweep, calendar, &starts)) {
        if let Some(Meeting { isovalue, n_crossings }) = meeting {
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

/// The meetings of stretches: between each two starts, the isovalue with the fewest crossings. `None` where no isovalue is
/// between them.
fn meetings(sweep: &Sweep, calendar: &Calendar, starts: &[f64]) -> Vec<Option<Meeting>> {
    let n = starts.len();
    if n == 1 {
        return Vec::new();
    }
    let candidates: Vec<f64> =
        (1..n).flat_map(|i| candidates(sweep, calendar, i as f64 / n as f64, n)).collect();
    let crossings = crossings(sweep, &candidates);
    let groups = candidates.chunks(N_CANDIDATES).zip(crossings.chunks(N_CANDIDATES));
    let from_middle = |j: &usize| j.abs_diff(N_CANDIDATES / 2);
    let fewest = |((isovalues, crossings), pair): ((&[f64], &[u64]), &[f64])| {
        let inside =
            (0..isovalues.len()).filter(|&j| pair[0] < isovalues[j] && isovalues[j] < pair[1]);
        let best = inside.min_by_key(|j| (crossings[*j], from_middle(j)));
        best.map(|j| Meeting { isovalue: isovalues[j], n_crossings: crossings[j] })
    };
    groups.zip(starts.windows(2)).map(fewest).collect()
}

/// The number of lattice edges that the isosurface crosses at each of some ascending isovalues.
fn crossings(sweep: &Sweep, isovalues: &[f64]) -> Vec<u64> {
    let field = &sweep.exact;
    let dims = field.dims();
    // The number of isovalues below a sample.
    let n_below = |v: u32| isovalues.partition_point(|&c| c < field.sample(v));
    let of_sample = |mut changes: Vec<i64>, v: u32| {
        let own = n_below(v);
        let is_inner = |&axis: &usize| field.position(v)[axis] + 2 < dims[axis] as i64;
        for other in (0..3).filter(is_inner).map(|axis| n_below(v + field.strides()[axis])) {
            changes[own.min(other)] += 1;
            changes[own.max(other)] -= 1;
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
