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
    self, ChunkName, INDEX, Index, IndexedChunk, IndexedPart, PART, WHOLE, Written, chunk_name,
    key_in_part, living, seam_bytes, seam_name,
};
use crate::progress::Progress;
use crate::spectrum::{About, Event, Joiner, Knot, Patch, Spectrum, Told, Triangle, cuts};

/// What a part takes of memory while it is written, bytes per triangle (measured: 120 to 150 of `bonsai`).
const BYTES_PER_TRIANGLE: f64 = 150.0;

/// Fewest triangles that a chunk is cut off for: less than a file's own costs are not worth one.
const LEAST_OF_CHUNK: usize = 4096;

/// How many times as many triangles as live across its end are born in a chunk.
const TIMES_ACROSS: usize = 8;

/// Writes all parts, what is known of the whole and the index into a folder that is there, and nobody else writes to; as many
/// parts at a time as there are threads, and as fit into `memory`, bytes, where that is limited.
///
/// # Errors
///
/// As [`merge`](super::merge).
pub fn merge_to_folder(
    parts: &Parts,
    volume: &Opened,
    folder: &Path,
    memory: Option<f64>,
    progress: &dyn Progress,
) -> Result<Index> {
    let Joined { whole, heads } = join_borders(parts, volume, progress)?;
    let plan = parts.plan();
    let grid = Grid::of(plan);
    let n_events = grid.n_events(&whole);
    let one = |number: usize| {
        report(progress, number, parts.n())?;
        write_part((parts, volume), (number, &grid.beside(number)), folder, n_events[number])
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
    (parts, volume): (&Parts, &Opened),
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
    let (info, flags) = (plan.recipe.volume.clone(), &plan.recipe.parameters);
    let about = About::new(info, flags.range.unwrap_or(plan.recipe.volume.range), flags.error);
    let mut spectrum = Spectrum::from_patch(about, joiner.finish().0)?;
    if let Opened::Whole(prepared) = volume {
        // Where triangles pass a mask is told by isovalues of the part's table: within the same piece of a lifetime as in a file.
        prepared.cap(&mut spectrum);
    }
    let size = [spectrum.n_vertices(), spectrum.knots().len(), spectrum.triangles().len()];
    let size = size.map(|n| n as u64);
    let chunks = write_chunks(plan, number, spectrum, shared, folder)?;
    let n_others = is_others.iter().filter(|&&is| is).count() as u64;
    let own = [size[0] - n_others, size[1] - 2 * n_others, size[2]];
    let brick = plan.recipe.bricks[number];
    let part = IndexedPart { first: brick.first, end: brick.end, size, events, chunks };
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

/// Writes the chunks of a part.
fn write_chunks(
    plan: &Plan,
    number: usize,
    spectrum: Spectrum,
    shared: Vec<(u32, u64)>,
    folder: &Path,
) -> Result<Vec<IndexedChunk>> {
    let (about, patch) = spectrum.into_parts();
    let cuts = cuts(&patch, LEAST_OF_CHUNK, TIMES_ACROSS);
    let common = common(&patch, &cuts);
    let edges: HashMap<u32, u64> = shared.iter().copied().collect();
    let all: Vec<(u32, u64)> = (0..common.len() as u32).map(|v| (v, u64::from(v))).collect();
    // Vertices of several chunks, numbered as they are written first: then numbers ascend in files, and take little.
    let mut named: HashMap<u32, u64> = HashMap::new();
    let mut chunk = |(chunk, ends): (usize, &[u32])| {
        let lives = |t: &Triangle| t.birth < ends[1] && ends[0] < t.death;
        // With what each vertex was in the part.
        let (own, in_part) = living(&patch, &all, lives);
        let n_triangles = own.triangles.len() as u64;
        let name = ChunkName { plan: plan.hash().to_owned(), number, chunk };
        let parameters = Told::of_value(serde_json::json!({ PART: name }));
        let own = Spectrum::from_patch(About { parameters, ..about.clone() }, own)?;
        let Written { bytes, order, .. } = file::into_bytes(own)?;
        let mut key_of = |v: u32| {
            let next = named.len() as u32;
            let in_part = || *named.entry(v).or_insert_with(|| key_in_part(number, next));
            edges.get(&v).copied().or_else(|| common[v as usize].then(in_part))
        };
        let in_order = order.iter().map(|&v| in_part[v as usize].1 as u32).zip(0u32..);
        let seam: Vec<(u32, u64)> =
            in_order.filter_map(|(v, new)| key_of(v).map(|key| (new, key))).collect();
        let seam = seam_bytes(number, &seam);
        put(folder, &chunk_name((number, chunk)), &bytes)?;
        put(folder, &seam_name((number, chunk)), &seam)?;
        let interval = (patch.isovalues[ends[0] as usize], patch.isovalues[ends[1] as usize]);
        Ok(IndexedChunk::new(interval, n_triangles, (bytes.len() + seam.len()) as u64))
    };
    cuts.windows(2).enumerate().map(&mut chunk).collect()
}

/// Which vertices several chunks have.
fn common(patch: &Patch, cuts: &[u32]) -> Vec<bool> {
    // The first and the last chunk that has each.
    let mut chunks = vec![(usize::MAX, 0); patch.first_knot.len() - 1];
    for t in &patch.triangles {
        let first = cuts.partition_point(|&c| c <= t.birth) - 1;
        let last = cuts.partition_point(|&c| c < t.death) - 1;
        for v in t.vertices {
            let (from, to) = &mut chunks[v as usize];
            (*from, *to) = ((*from).min(first), (*to).max(last));
        }
    }
    chunks.iter().map(|&(from, to)| from < to).collect()
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
