//! Restricts a spectrum to a part of its range, so that a page contains no more than its author wants to publish.

use crate::error::{Error, Result};
use crate::spectrum::{About, Event, Knot, Patch, Spectrum, Triangle};

/// The spectrum between two isovalues.
///
/// Its isosurfaces are those of `spectrum`. Trajectories are cut at the ranks around the range.
///
/// # Errors
///
/// [`Error::Range`] if an end is outside the spectrum's range, [`Error::Usage`] if `low` is not below `high`.
pub fn with_range(spectrum: &Spectrum, (low, high): (f64, f64)) -> Result<Spectrum> {
    [low, high].into_iter().try_for_each(|end| spectrum.check_isovalue(end))?;
    if low >= high {
        return Err(Error::Usage(format!("range {low}:{high}, expected the lower isovalue first")));
    }
    let mut patch = Patch { isovalues: spectrum.isovalues().to_vec(), ..Patch::default() };
    // The last rank not above `low` and the first rank above `high`.
    let first = spectrum.rank_at(low).unwrap_or(0);
    let last = spectrum.isovalues().partition_point(|&c| c <= high);
    let last = last.min(spectrum.isovalues().len().saturating_sub(1)) as u32;
    let kept = spectrum.triangles().iter().filter(|t| t.death > first && t.birth < last);
    patch.triangles = kept
        .map(|t| Triangle { birth: t.birth.max(first), death: t.death.min(last), ..*t })
        .collect();

    let mut number = vec![u32::MAX; spectrum.n_vertices()];
    patch.first_knot.push(0);
    for v in patch.triangles.iter_mut().flat_map(|t| &mut t.vertices) {
        let new = &mut number[*v as usize];
        if *new == u32::MAX {
            *new = patch.first_knot.len() as u32 - 1;
            push_knots(spectrum, *v, first, last, &mut patch.knots);
            patch.first_knot.push(patch.knots.len() as u32);
        }
        *v = *new;
    }
    let inside = |e: &&Event| low <= e.isovalue && e.isovalue <= high;
    let events = spectrum.events().iter().filter(inside).copied().collect();
    Spectrum::from_patch(About { range: (low, high), events, ..spectrum.about().clone() }, patch)
}

/// Appends the knots of vertex `v` from rank `first` to rank `last`, with a new knot at either rank if the trajectory crosses it.
fn push_knots(spectrum: &Spectrum, v: u32, first: u32, last: u32, knots: &mut Vec<Knot>) {
    let trajectory = spectrum.trajectory(v);
    let at = |rank: u32| {
        let isovalue = spectrum.isovalues()[rank as usize];
        Knot { rank, position: spectrum.vertex_at(v, rank, isovalue) }
    };
    let has = |rank: u32| trajectory.binary_search_by_key(&rank, |k| k.rank).is_ok();
    let lives_before = trajectory.first().is_some_and(|k| k.rank < first);
    let lives_after = trajectory.last().is_some_and(|k| k.rank > last);
    if lives_before && !has(first) {
        knots.push(at(first));
    }
    knots.extend(trajectory.iter().filter(|k| (first..=last).contains(&k.rank)));
    if lives_after && !has(last) {
        knots.push(at(last));
    }
}
