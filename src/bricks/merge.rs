//! Merges the parts of a plan to the spectrum of the whole volume.
//!
//! Parts are read twice: first all borders, from which the events of the whole are joined, then one part after the other in full. At
//! most one part is in memory at a time, in addition to the merged spectrum.

use super::head::PartHead;
use super::parts::Parts;
use super::plan::Plan;
use super::source::OpenVolume;
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::spectrum::{About, Event, Joiner, Metadata, Patch, Spectrum, VertexMismatch};
use crate::sweep::{Counts, insert_area_shares, metadata};
use crate::topology::blocks::join_blocks;

/// Key in the spectrum's metadata under which the side and the number of bricks are recorded.
const METADATA_KEY: &str = "bricks";

/// The result of joining all borders.
pub(super) struct JoinedBorders {
    /// Spectrum of the whole with all events and metadata, but without trajectories and triangles.
    pub(super) whole: Spectrum,
    /// Heads of all parts, by number.
    pub(super) heads: Vec<PartHead>,
}

/// Merges all parts, in the order of their numbers, to the spectrum of the plan's volume.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if parts are missing or damaged, contradict each other, or exceed the size of one spectrum;
/// [`Error::Internal`] if their events contradict each other; [`Error::Interrupted`].
pub fn merge(parts: &Parts, volume: &OpenVolume, progress: &dyn Progress) -> Result<Spectrum> {
    let JoinedBorders { whole, heads } = join_borders(parts, volume, progress)?;
    let size = |i: usize| heads.iter().map(|h| h.size()[i]).sum::<u64>() as usize;
    let mut joiner = Joiner::for_size([0, 1, 2].map(size));
    for number in 0..parts.n() {
        report(progress, number, parts.n())?;
        let part = parts.part(number)?;
        joiner.append(&part.patch, &part.shared())?.map_err(|at| seam_mismatch(number, at))?;
    }
    let mut spectrum = Spectrum::from_patch(whole.into_parts().0, joiner.finish())?;
    if let OpenVolume::Whole(prepared) = volume {
        prepared.cap(&mut spectrum);
    }
    Ok(spectrum)
}

/// Joins the borders of all parts: events and metadata of the whole.
///
/// # Errors
///
/// As [`merge`].
pub(super) fn join_borders(
    parts: &Parts,
    volume: &OpenVolume,
    progress: &dyn Progress,
) -> Result<JoinedBorders> {
    parts.check_complete()?;
    let recipe = &parts.plan().recipe;
    let range = recipe.parameters.range.unwrap_or(recipe.volume.range);
    let is_inside = |e: &Event| range.0 <= e.isovalue && e.isovalue <= range.1;
    let mut heads = Vec::with_capacity(parts.n());
    let mut blocks = Vec::with_capacity(parts.n());
    for number in 0..parts.n() {
        check_cancelled(progress)?;
        let border = parts.border(number)?;
        heads.push(border.head);
        blocks.push(border.topology);
    }
    let around = (recipe.volume.dims, recipe.volume.outside);
    let topology = join_blocks(blocks, around, |first, end| volume.block(first, end))?;
    let arcs = topology.n_arcs_in(range) as u64;
    let events: Vec<Event> = topology.events.into_iter().filter(is_inside).collect();
    let (parameters, areas) = parameters(parts.plan(), &heads, arcs);
    let tolerance = recipe.parameters.error;
    let about = About {
        parameters: Metadata::from_value(parameters),
        events,
        ..About::new(recipe.volume.clone(), range, tolerance)
    };
    let mut whole = Spectrum::from_patch(about, Patch::empty())?;
    insert_area_shares(&mut whole, &areas);
    for (key, value) in &recipe.metadata {
        whole.about_mut().parameters.insert(key, value.clone());
    }
    Ok(JoinedBorders { whole, heads })
}

/// Reports how many parts have been merged; [`Error::Interrupted`] if the caller wants to stop.
pub(super) fn report(progress: &dyn Progress, number: usize, n: usize) -> Result<()> {
    progress.report(number as f64 / n as f64, &format!("merging {number} of {n} parts"));
    check_cancelled(progress)
}

fn check_cancelled(progress: &dyn Progress) -> Result<()> {
    if progress.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
}

/// The metadata of the spectrum that describes its computation, and the sums of the areas of all parts.
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
    parameters[METADATA_KEY] = serde_json::json!({ "side": recipe.side, "n": recipe.bricks.len() });
    (parameters, areas)
}

pub(super) fn seam_mismatch(number: usize, VertexMismatch(place): VertexMismatch) -> Error {
    Error::input(format!(
        "part {number} has another vertex at {place:?} than its neighbour, expected parts of one volume"
    ))
}
