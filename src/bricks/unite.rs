//! Joins parts to the spectrum of the whole volume.
//!
//! Parts are read twice: their borders, of which the events of the whole are joined, then one after the other in full. No more
//! than one is in memory at a time beside what they become.

use super::part::PartHead;
use super::{Opened, Parts, Plan};
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::spectrum::{About, Event, Joiner, Spectrum, Told, Unlike};
use crate::sweep::{Counts, insert_area_shares, metadata};
use crate::topology::blocks::joined;

/// Under this name the parameters of a spectrum tell of how many bricks it is made.
const NAME: &str = "bricks";

/// What is known of the whole once all borders are: a spectrum without triangles, and how large its parts are.
pub(super) struct Joined {
    /// Of the whole, without a trajectory.
    pub(super) whole: Spectrum,
    /// What each part says of itself.
    pub(super) heads: Vec<PartHead>,
}

/// The spectrum of a plan's volume from all parts, in the order of their numbers.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if parts are missing or damaged, do not fit each other, or are too many for one spectrum;
/// [`Error::Internal`] where their events contradict each other; [`Error::Interrupted`].
pub fn merge(parts: &Parts, volume: &Opened, progress: &dyn Progress) -> Result<Spectrum> {
    let Joined { whole, heads } = join_borders(parts, volume, progress)?;
    let size = |i: usize| heads.iter().map(|h| h.size()[i]).sum::<u64>() as usize;
    let mut joiner = Joiner::for_size([0, 1, 2].map(size));
    for number in 0..parts.n() {
        report(progress, number, parts.n())?;
        let part = parts.part(number)?;
        joiner.append(&part.patch, &part.shared())?.map_err(|at| unlike(number, at))?;
    }
    let mut spectrum = Spectrum::from_patch(whole.into_parts().0, joiner.finish().0)?;
    if let Opened::Whole(prepared) = volume {
        prepared.cap(&mut spectrum);
    }
    Ok(spectrum)
}

/// All that the borders of the parts tell.
///
/// # Errors
///
/// As [`merge`].
pub(super) fn join_borders(
    parts: &Parts,
    volume: &Opened,
    progress: &dyn Progress,
) -> Result<Joined> {
    parts.check_all_there()?;
    let recipe = &parts.plan().recipe;
    let range = recipe.parameters.range.unwrap_or(recipe.volume.range);
    let inside = |e: &Event| range.0 <= e.isovalue && e.isovalue <= range.1;
    let mut heads = Vec::with_capacity(parts.n());
    let mut blocks = Vec::with_capacity(parts.n());
    for number in 0..parts.n() {
        stop(progress)?;
        let border = parts.border(number)?;
        heads.push(border.head);
        blocks.push(border.topology);
    }
    let around = (recipe.volume.dims, recipe.volume.outside);
    let topology = joined(blocks, around, |first, end| volume.block(first, end))?;
    let arcs = topology.n_arcs_in(range) as u64;
    let events: Vec<Event> = topology.events.into_iter().filter(inside).collect();
    let (parameters, areas) = parameters(parts.plan(), &heads, arcs);
    let tolerance = recipe.parameters.error;
    let about = About {
        parameters: Told::of_value(parameters),
        events,
        ..About::new(recipe.volume.clone(), range, tolerance)
    };
    let mut whole = Spectrum::from_patch(about, Joiner::default().finish().0)?;
    insert_area_shares(&mut whole, &areas);
    for (name, what) in &recipe.told {
        whole.about_mut().parameters.tell(name, what.clone());
    }
    Ok(Joined { whole, heads })
}

/// Tells how many parts have been taken in, and stops where that is asked for.
pub(super) fn report(progress: &dyn Progress, number: usize, n: usize) -> Result<()> {
    progress.report(number as f64 / n as f64, &format!("merging {number} of {n} parts"));
    stop(progress)
}

fn stop(progress: &dyn Progress) -> Result<()> {
    if progress.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
}

/// What the spectrum tells of how it was computed, and the areas of all parts.
fn parameters(plan: &Plan, heads: &[PartHead], arcs: u64) -> (serde_json::Value, Vec<[f64; 2]>) {
    let recipe = &plan.recipe;
    let mut counts = Counts { arcs, ..Counts::default() };
    let mut areas: Vec<[f64; 2]> = Vec::new();
    let mut backends: Vec<String> = Vec::new();
    for head in heads {
        counts.add(&head.counts);
        areas.resize(areas.len().max(head.areas.len()), [0.0; 2]);
        for (all, own) in areas.iter_mut().zip(&head.areas) {
            *all = [all[0] + own[0], all[1] + own[1]];
        }
        if !backends.contains(&head.backend) {
            backends.push(head.backend.clone());
        }
    }
    let mut parameters = metadata(&recipe.parameters, &backends.join(", "), &counts);
    parameters[NAME] = serde_json::json!({ "side": recipe.side, "n": recipe.bricks.len() });
    (parameters, areas)
}

pub(super) fn unlike(number: usize, Unlike(place): Unlike) -> Error {
    Error::input(format!(
        "part {number} has another vertex at {place:?} than the part beside it, expected parts of one volume"
    ))
}
