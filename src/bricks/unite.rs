//! Joins parts to the spectrum of the whole volume.

use std::collections::HashMap;

use super::{Opened, Part, Plan};
use crate::error::{Error, Result};
use crate::spectrum::{Event, Knot, Patch, Spectrum, SpectrumBuilder, Triangle};
use crate::sweep::{Counts, tell_shares, told};
use crate::topology::blocks::joined;

/// Under this name the parameters of a spectrum tell of how many bricks it is made.
const NAME: &str = "bricks";

/// The spectrum of a plan's volume from all parts, in the order of their numbers.
///
/// # Errors
///
/// [`Error::Input`] if parts are missing, do not fit each other, or are too many for one spectrum; [`Error::Internal`] where their events contradict each other.
pub fn merge(plan: &Plan, parts: Vec<Part>, volume: &Opened) -> Result<Spectrum> {
    let recipe = &plan.recipe;
    let is_all = parts.iter().map(|p| p.head.number).eq(0..recipe.bricks.len());
    if !is_all {
        let (found, n) = (parts.len(), recipe.bricks.len());
        return Err(Error::input(format!("{found} parts, expected {n}, by their numbers")));
    }
    let mut parts = parts;
    let range = recipe.parameters.range.unwrap_or(recipe.volume.range);
    let inside = |e: &Event| range.0 <= e.isovalue && e.isovalue <= range.1;
    let blocks = parts.iter_mut().map(|p| std::mem::take(&mut p.topology)).collect();
    let around = (recipe.volume.dims, recipe.volume.outside);
    let topology = joined(blocks, around, |first, end| volume.block(first, end))?;
    let mut counts = Counts { arcs: topology.n_arcs_in(range) as u64, ..Counts::default() };
    let events = topology.events.into_iter().filter(inside).collect();
    let mut areas: Vec<[f64; 2]> = Vec::new();
    let mut backends: Vec<String> = Vec::new();
    for head in parts.iter().map(|p| &p.head) {
        counts.add(&head.counts);
        areas.resize(areas.len().max(head.areas.len()), [0.0; 2]);
        for (all, own) in areas.iter_mut().zip(&head.areas) {
            *all = [all[0] + own[0], all[1] + own[1]];
        }
        if !backends.contains(&head.backend) {
            backends.push(head.backend.clone());
        }
    }
    let mut parameters = told(&recipe.parameters, &backends.join(", "), &counts);
    parameters[NAME] = serde_json::json!({ "side": recipe.side, "n": recipe.bricks.len() });
    let mut builder = SpectrumBuilder::new();
    builder.push_patch(united(parts)?);
    let tolerance = recipe.parameters.error;
    let info = recipe.volume.clone();
    let mut spectrum = builder.finish(info, range, tolerance, parameters, events)?;
    tell_shares(&mut spectrum, &areas);
    for (name, what) in &recipe.told {
        spectrum.parameters[name] = what.clone();
    }
    if let Opened::Whole(prepared) = volume {
        prepared.cap(&mut spectrum);
    }
    Ok(spectrum)
}

/// All parts as one patch: the vertices of one lattice edge are one.
fn united(parts: Vec<Part>) -> Result<Patch> {
    let mut whole = Patch { first_knot: vec![0], ..Patch::default() };
    whole.isovalues = parts.iter().flat_map(|p| p.patch.isovalues.iter().copied()).collect();
    whole.isovalues.sort_unstable_by(f64::total_cmp);
    whole.isovalues.dedup();
    let mut seam: HashMap<u64, u32> = HashMap::new();
    for part in parts {
        append(&mut whole, &part, &mut seam)?;
        // Before the next one is appended: the parts go as the whole grows.
        drop(part);
    }
    Ok(whole)
}

fn append(whole: &mut Patch, part: &Part, seam: &mut HashMap<u64, u32>) -> Result<()> {
    let Part { patch, shared, head, .. } = part;
    let table = &whole.isovalues;
    let ranks: Vec<u32> =
        patch.isovalues.iter().map(|&x| table.partition_point(|&c| c < x) as u32).collect();
    let n = patch.first_knot.len() - 1;
    let mut numbers: Vec<u32> = Vec::with_capacity(n);
    let mut shared = shared.iter().peekable();
    for v in 0..n as u32 {
        let [from, to] = [v, v + 1].map(|v| patch.first_knot[v as usize] as usize);
        let own = patch.knots[from..to].iter();
        let knots: Vec<Knot> = own.map(|k| Knot { rank: ranks[k.rank as usize], ..*k }).collect();
        let edge = shared.next_if(|s| s.0 == v).map(|s| s.1);
        if let Some(&known) = edge.and_then(|e| seam.get(&e)) {
            widen(whole, known, &knots).ok_or_else(|| unlike(head.number, &knots))?;
            numbers.push(known);
            continue;
        }
        let number = whole.first_knot.len() as u32 - 1;
        whole.knots.extend(knots);
        let end = u32::try_from(whole.knots.len());
        whole.first_knot.push(end.map_err(|_| Error::input("2^32 knots or more in all parts"))?);
        seam.extend(edge.map(|e| (e, number)));
        numbers.push(number);
    }
    whole.triangles.extend(patch.triangles.iter().map(|t| Triangle {
        vertices: t.vertices.map(|v| numbers[v as usize]),
        birth: ranks[t.birth as usize],
        death: ranks[t.death as usize],
        cap: t.cap,
    }));
    Ok(())
}

/// Lets a vertex that is there already live as long as the same one of another part, which is where it is; not if it is not. Lives
/// may reach a trace beyond the samples between which a vertex moves, where it rests.
fn widen(whole: &mut Patch, v: u32, knots: &[Knot]) -> Option<()> {
    let first = whole.first_knot[v as usize] as usize;
    let [from, to] = whole.knots.get_mut(first..first + 2)? else { return None };
    let [other_from, other_to] = knots else { return None };
    let is_same = from.position == other_from.position && to.position == other_to.position;
    from.rank = from.rank.min(other_from.rank);
    to.rank = to.rank.max(other_to.rank);
    is_same.then_some(())
}

fn unlike(number: usize, knots: &[Knot]) -> Error {
    let place = knots.first().map(|k| k.position).unwrap_or_default();
    Error::input(format!(
        "part {number} has another vertex at {place:?} than the part beside it, expected parts of one volume"
    ))
}
