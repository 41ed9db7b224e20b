//! A part of a spectrum's range, so that no more is published than is wanted.

use crate::error::{Error, Result};
use crate::spectrum::{About, Event, Knot, Patch, Spectrum, Triangle};

/// The spectrum between two isovalues: its isosurfaces there are those of `spectrum`, and nothing
/// of the others is left but the parts of trajectories that reach to the next knot.
///
/// # Errors
///
/// [`Error::Range`] if an end lies outside the spectrum's range, [`Error::Usage`] if the higher one
/// does not come second.
pub fn part(spectrum: &Spectrum, (low, high): (f64, f64)) -> Result<Spectrum> {
    [low, high].into_iter().try_for_each(|end| spectrum.check_isovalue(end))?;
    if low >= high {
        return Err(Error::Usage(format!("range {low}:{high}, expected the lower isovalue first")));
    }
    let mut patch = Patch { isovalues: spectrum.isovalues().to_vec(), ..Patch::default() };
    // The ranks at and below the low end, and above the high one.
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
            cut(spectrum, *v, first, last, &mut patch.knots);
            patch.first_knot.push(patch.knots.len() as u32);
        }
        *v = *new;
    }
    let inside = |e: &&Event| low <= e.isovalue && e.isovalue <= high;
    let events = spectrum.events().iter().filter(inside).copied().collect();
    Spectrum::from_patch(About { range: (low, high), events, ..spectrum.about().clone() }, patch)
}

/// Appends the knots of vertex `v` between two ranks; where a step of the trajectory crosses one of
/// them, it is cut there.
fn cut(spectrum: &Spectrum, v: u32, first: u32, last: u32, knots: &mut Vec<Knot>) {
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
