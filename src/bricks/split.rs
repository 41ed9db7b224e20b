//! Joins parts to a folder of parts (`.ispt`): no more is in memory than a few parts and what is known of the whole.
//!
//! # Theory
//!
//! Two things of a part depend on others: the events, which are joined from all borders, and how long a vertex on a shared plane
//! lives, which its neighbours' borders tell. So each part is written by itself, and in the end fits every other.

use std::collections::HashMap;
use std::path::Path;

use rayon::prelude::*;

use super::part::SharedVertex;
use super::unite::{Joined, join_borders, report, unlike};
use super::{Opened, Parts, Plan};
use crate::error::{Error, Result};
use crate::file::{
    self, INDEX, Index, IndexedPart, PART, PartName, WHOLE, Written, part_name, seam_bytes,
    seam_name,
};
use crate::spectrum::{About, Event, Joiner, Knot, Patch, Spectrum, SpectrumBuilder, Told};
use crate::sweep::Progress;

/// What a part takes of memory while it is written, bytes per triangle (measured: 120 to 150 of `bonsai`).
const BYTES_PER_TRIANGLE: f64 = 150.0;

/// Writes all parts, what is known of the whole and the index into a folder that is there, and nobody else writes to; as many
/// parts at a time as there are threads, and as fit into `memory`, bytes, where that is limited.
///
/// # Errors
///
/// As [`merge`](super::merge); [`Error::Usage`] for a volume with a mask: where triangles end by it is told by all isovalues of the
/// whole.
pub fn merge_to_folder(
    parts: &Parts,
    volume: &Opened,
    folder: &Path,
    memory: Option<f64>,
    progress: &dyn Progress,
) -> Result<Index> {
    if let Opened::Whole(prepared) = volume
        && prepared.volume().mask().is_some()
    {
        let what = "a volume with a mask is no folder of parts, expected a name that ends in .isp";
        return Err(Error::Usage(what.to_owned()));
    }
    let Joined { whole, heads } = join_borders(parts, volume, progress)?;
    let plan = parts.plan();
    let grid = Grid::of(plan);
    let n_events = grid.n_events(&whole);
    let one = |number: usize| {
        report(progress, number, parts.n())?;
        write_part(parts, (number, &grid.beside(number)), folder, n_events[number])
    };
    let largest = heads.iter().map(|h| h.size()[2]).max().unwrap_or(0).max(1) as f64;
    let fit = memory.map_or(f64::INFINITY, |memory| memory / (BYTES_PER_TRIANGLE * largest));
    let at_once = rayon::current_num_threads().min(fit as usize).max(1);
    let mut written = Vec::with_capacity(parts.n());
    for first in (0..parts.n()).step_by(at_once) {
        let some = first..parts.n().min(first + at_once);
        written.extend(some.into_par_iter().map(one).collect::<Result<Vec<_>>>()?);
    }
    let size = [0, 1, 2].map(|i| written.iter().map(|w| w.own[i]).sum());
    let index = Index::new(plan.hash(), size, written.into_iter().map(|w| w.part).collect());
    put(folder, WHOLE, &file::into_bytes(whole)?.bytes)?;
    let json = serde_json::to_vec(&index).map_err(|e| Error::internal(e.to_string()))?;
    put(folder, INDEX, &json)?;
    Ok(index)
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> Result<()> {
    let path = folder.join(name);
    std::fs::write(&path, bytes).map_err(|e| Error::io(&path, e))
}

/// A part that was written.
struct WrittenPart {
    part: IndexedPart,
    /// Its trajectories, knots and triangles, without what a part of a lower number has too.
    own: [u64; 3],
}

fn write_part(
    parts: &Parts,
    (number, beside): (usize, &[usize]),
    folder: &Path,
    events: usize,
) -> Result<WrittenPart> {
    let plan = parts.plan();
    let part = parts.part(number)?;
    let shared = part.shared();
    let own_edges: HashMap<u64, u32> = shared.iter().map(|&(v, edge)| (edge, v)).collect();
    let mut is_others = vec![false; shared.len()];
    let mut joiner = Joiner::default();
    joiner.append(&part.patch, &shared)?.map_err(|at| unlike(number, at))?;
    for &other in beside {
        let border = parts.border(other)?;
        let common = border.shared.iter().filter(|s| own_edges.contains_key(&s.edge));
        let common: Vec<SharedVertex> = common.copied().collect();
        if other < number {
            for s in &common {
                let at = shared.binary_search_by_key(&own_edges[&s.edge], |s| s.0);
                at.into_iter().for_each(|i| is_others[i] = true);
            }
        }
        let (patch, keys) = alone(&common);
        joiner.append(&patch, &keys)?.map_err(|at| unlike(other, at))?;
    }
    let mut builder = SpectrumBuilder::new();
    builder.push_patch(joiner.finish().0);
    let name = PartName { plan: plan.hash().to_owned(), number };
    let (info, flags) = (plan.recipe.volume.clone(), &plan.recipe.parameters);
    let range = flags.range.unwrap_or(info.range);
    let parameters = Told::of_value(serde_json::json!({ PART: name }));
    let spectrum = builder.finish(About { parameters, ..About::new(info, range, flags.error) })?;
    let size = [spectrum.n_vertices(), spectrum.knots().len(), spectrum.triangles().len()];
    let size = size.map(|n| n as u64);
    let lives = lives(&spectrum);
    let mut bytes = 0;
    if lives.is_some() {
        let Written { bytes: file, order, .. } = file::into_bytes(spectrum)?;
        let keys: HashMap<u32, u64> = shared.iter().copied().collect();
        let in_order = order.iter().zip(0u32..);
        let seam: Vec<(u32, u64)> =
            in_order.filter_map(|(v, new)| keys.get(v).map(|&key| (new, key))).collect();
        let seam = seam_bytes(&seam);
        bytes = (file.len() + seam.len()) as u64;
        put(folder, &part_name(number), &file)?;
        put(folder, &seam_name(number), &seam)?;
    }
    let n_others = is_others.iter().filter(|&&is| is).count() as u64;
    let own = [size[0] - n_others, size[1] - 2 * n_others, size[2]];
    let brick = plan.recipe.bricks[number];
    let part = IndexedPart { first: brick.first, end: brick.end, size, lives, events, bytes };
    Ok(WrittenPart { part, own })
}

/// Shared vertices as a patch without triangles, and their keys.
fn alone(shared: &[SharedVertex]) -> (Patch, Vec<(u32, u64)>) {
    let isovalues: Vec<f64> = shared.iter().flat_map(|s| s.knots.map(|k| k.0)).collect();
    // One behind the other: what joins patches does not ask that a table ascends.
    let knots = shared.iter().flat_map(|s| s.knots).zip(0..);
    let knots = knots.map(|((_, position), rank)| Knot { rank, position }).collect();
    let n = shared.len() as u32;
    let first_knot = (0..=n).map(|i| 2 * i).collect();
    let keys = (0..n).zip(shared).map(|(v, s)| (v, s.edge)).collect();
    (Patch { isovalues, first_knot, knots, ..Patch::default() }, keys)
}

/// The lowest birth and the highest death; none without triangles.
fn lives(spectrum: &Spectrum) -> Option<(f64, f64)> {
    let birth = spectrum.triangles().iter().map(|t| t.birth).min()?;
    let death = spectrum.triangles().iter().map(|t| t.death).max()?;
    Some((spectrum.isovalues()[birth as usize], spectrum.isovalues()[death as usize]))
}

/// How the bricks of a plan lie: their first samples along x, y, z.
struct Grid([Vec<usize>; 3]);

impl Grid {
    fn of(plan: &Plan) -> Grid {
        Grid([0, 1, 2].map(|a| {
            let mut starts: Vec<usize> = plan.recipe.bricks.iter().map(|b| b.first[a]).collect();
            starts.sort_unstable();
            starts.dedup();
            starts
        }))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        let [nx, ny] = [self.0[0].len(), self.0[1].len()];
        x + nx * (y + ny * z)
    }

    /// The bricks that have samples in common with one, ascending.
    fn beside(&self, number: usize) -> Vec<usize> {
        let [nx, ny] = [self.0[0].len(), self.0[1].len()];
        let at = [number % nx, number / nx % ny, number / (nx * ny)];
        let around = |a: usize| at[a].saturating_sub(1)..(at[a] + 2).min(self.0[a].len());
        let rows = around(2).flat_map(|z| around(1).map(move |y| (y, z)));
        let all = rows.flat_map(|(y, z)| around(0).map(move |x| [x, y, z]));
        all.map(|p| self.number(p)).filter(|&other| other != number).collect()
    }

    /// How many events lie in each brick; those on a shared plane in the upper one.
    fn n_events(&self, whole: &Spectrum) -> Vec<usize> {
        let voxel = whole.volume().placement.voxel();
        let size = whole.volume().placement.spacing.map(|s| s / voxel);
        let brick_of = |event: &Event| {
            self.number([0, 1, 2].map(|a| {
                let at = event.position[a] / size[a];
                self.0[a].partition_point(|&s| s as f64 <= at).saturating_sub(1)
            }))
        };
        let mut n = vec![0; self.0.iter().map(Vec::len).product()];
        whole.events().iter().for_each(|event| n[brick_of(event)] += 1);
        n
    }
}
