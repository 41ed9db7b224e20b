//! Merges the parts of a plan to a folder of parts (`.ispt`). Only a few parts and the joined borders are in memory at a time.
//!
//! # Theory
//!
//! A part depends on others in two ways: the events are joined from all borders, and the lifetime of a vertex on a shared plane
//! depends on the borders of the neighbours. So each part can be written on its own once the borders are known.

use std::collections::HashMap;
use std::path::Path;

use rayon::prelude::*;

use super::head::SharedVertex;
use super::merge::{JoinedBorders, join_borders, report, seam_mismatch};
use super::parts::Parts;
use super::plan::Plan;
use super::source::OpenVolume;
use crate::error::{Error, Result};
use crate::file::{
    self, ChunkName, INDEX, Index, IndexedChunk, IndexedPart, PART, SpectrumFolder,
    TemporaryFolder, WHOLE, Written, chunk_name, key_in_part, own_files, seam_bytes, seam_name,
    sub_patch,
};
use crate::progress::Progress;
use crate::spectrum::{About, Event, Joiner, Knot, Metadata, Patch, Spectrum, Triangle, cuts};

/// Memory for writing a part, bytes per triangle (measured: 120 to 150 for `bonsai`).
const BYTES_PER_TRIANGLE: f64 = 150.0;

/// Name of the merged folder within the temporary folder.
const MERGED: &str = "merged";

/// Fewest triangles of a chunk: smaller ones are dominated by the fixed cost of a file.
const MIN_CHUNK_TRIANGLES: usize = 4096;

/// Ratio of the triangles born in a chunk to those that live across its end and are stored twice.
const BORN_PER_REPEATED: usize = 8;

/// Writes all parts, the spectrum of the whole without triangles, and the index into an existing folder to which nobody else writes.
/// Works on as many parts at a time as there are threads and as fit into `memory`, bytes, if that is limited.
///
/// # Errors
///
/// As [`merge`](super::merge()).
pub fn merge_to_folder(
    parts: &Parts,
    volume: &OpenVolume,
    folder: &Path,
    memory: Option<f64>,
    progress: &dyn Progress,
) -> Result<Index> {
    let JoinedBorders { whole, heads } = join_borders(parts, volume, progress)?;
    let plan = parts.plan();
    let grid = BrickGrid::of(plan);
    let n_events = grid.n_events(&whole);
    let writer = PartWriter { parts, volume, folder, grid: &grid };
    let write = |number: usize| {
        report(progress, number, parts.n())?;
        writer.write(number, n_events[number])
    };
    let largest = heads.iter().map(|h| h.size()[2]).max().unwrap_or(0).max(1) as f64;
    let fit = memory.map_or(f64::INFINITY, |memory| memory / (BYTES_PER_TRIANGLE * largest));
    let at_once = rayon::current_num_threads().min(fit as usize).max(1);
    let mut written = Vec::with_capacity(parts.n());
    for first in (0..parts.n()).step_by(at_once) {
        let batch = first..parts.n().min(first + at_once);
        written.extend(batch.into_par_iter().map(write).collect::<Result<Vec<_>>>()?);
    }
    let size = [0, 1, 2].map(|i| written.iter().map(|w| w.own[i]).sum());
    let whole = file::into_bytes(whole)?.bytes;
    let parts = written.into_iter().map(|w| w.part).collect();
    let index = Index::new(plan.hash(), size, parts, &whole)?;
    write_file(folder, WHOLE, &whole)?;
    let json = serde_json::to_vec(&index).map_err(|e| Error::internal(e.to_string()))?;
    write_file(folder, INDEX, &json)?;
    Ok(index)
}

/// Merges all parts to a folder at `path`, which replaces a folder of parts that was there, if nothing else is in it. The
/// folder is written within `work`, or a new temporary folder next to `path`; memory as for [`merge_to_folder`].
///
/// # Errors
///
/// As [`merge_to_folder`]; what was at `path` is then unchanged.
pub fn merge_to_path(
    parts: &Parts,
    volume: &OpenVolume,
    path: &Path,
    work: Option<TemporaryFolder>,
    memory: Option<f64>,
    progress: &dyn Progress,
) -> Result<SpectrumFolder> {
    let new = || TemporaryFolder::next_to_folder(path, own_files);
    let work = work.map_or_else(new, Ok)?;
    let merged = work.path().join(MERGED);
    let write = || {
        std::fs::create_dir(&merged).map_err(|e| Error::io(&merged, e))?;
        merge_to_folder(parts, volume, &merged, memory, progress)
    };
    write().map_err(|error| work.hide_in(error, path))?;
    if progress.cancelled() {
        return Err(Error::Interrupted);
    }
    work.move_folder(MERGED, path, own_files)?;
    SpectrumFolder::open(path)
}

fn write_file(folder: &Path, name: &str, bytes: &[u8]) -> Result<()> {
    let path = folder.join(name);
    file::write_synced(&path, bytes).map_err(|e| Error::io(&path, e))
}

/// A part that was written to the folder.
struct WrittenPart {
    part: IndexedPart,
    /// Numbers of its trajectories, knots and triangles, without those shared with a part of a lower number.
    own: [u64; 3],
}

/// Writes the parts of a plan into a folder.
struct PartWriter<'a> {
    parts: &'a Parts<'a>,
    volume: &'a OpenVolume,
    folder: &'a Path,
    grid: &'a BrickGrid,
}

impl PartWriter<'_> {
    /// Writes part `number`, whose brick contains `events` events.
    fn write(&self, number: usize, events: usize) -> Result<WrittenPart> {
        let plan = self.parts.plan();
        let part = self.parts.part(number)?;
        let shared = part.shared();
        let own_edges: HashMap<u64, u32> = shared.iter().map(|&(v, edge)| (edge, v)).collect();
        let mut is_of_lower_part = vec![false; shared.len()];
        let mut joiner = Joiner::default();
        joiner.append(&part.patch, &shared)?.map_err(|at| seam_mismatch(number, at))?;
        for other in self.grid.neighbours(number) {
            let border = self.parts.border(other)?;
            let common = border.shared.iter().filter(|s| own_edges.contains_key(&s.edge));
            let common: Vec<SharedVertex> = common.copied().collect();
            if other < number {
                for s in &common {
                    let at = shared.binary_search_by_key(&own_edges[&s.edge], |s| s.0);
                    at.into_iter().for_each(|i| is_of_lower_part[i] = true);
                }
            }
            let (patch, keys) = patch_of(&common);
            joiner.append(&patch, &keys)?.map_err(|at| seam_mismatch(other, at))?;
        }
        let (info, flags) = (plan.recipe.volume.clone(), &plan.recipe.parameters);
        let about = About::new(info, flags.range.unwrap_or(plan.recipe.volume.range), flags.error);
        let mut spectrum = Spectrum::from_patch(about, joiner.finish().0)?;
        if let OpenVolume::Whole(prepared) = self.volume {
            // Lifetimes are split at a mask by the isovalues of the part's own table, so a split is within the same interval
            // as in one file.
            prepared.cap(&mut spectrum);
        }
        let size = [spectrum.n_vertices(), spectrum.knots().len(), spectrum.triangles().len()];
        let size = size.map(|n| n as u64);
        let chunks = write_chunks(plan, number, spectrum, shared, self.folder)?;
        let n_repeated = is_of_lower_part.iter().filter(|&&is| is).count() as u64;
        let own = [size[0] - n_repeated, size[1] - 2 * n_repeated, size[2]];
        let brick = plan.recipe.bricks[number];
        let part = IndexedPart { first: brick.first, end: brick.end, size, events, chunks };
        Ok(WrittenPart { part, own })
    }
}

/// Shared vertices as a patch without triangles, and their keys.
fn patch_of(shared: &[SharedVertex]) -> (Patch, Vec<(u32, u64)>) {
    let isovalues: Vec<f64> = shared.iter().flat_map(|s| s.knots.map(|k| k.0)).collect();
    // Not sorted: the joiner does not require an ascending table.
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
    let cuts = cuts(&patch, MIN_CHUNK_TRIANGLES, BORN_PER_REPEATED);
    let is_repeated = is_in_several_chunks(&patch, &cuts);
    let edges: HashMap<u32, u64> = shared.iter().copied().collect();
    let all: Vec<(u32, u64)> = (0..is_repeated.len() as u32).map(|v| (v, u64::from(v))).collect();
    // Vertices of several chunks, numbered in the order of their first appearance: ascending numbers compress well.
    let mut keys: HashMap<u32, u64> = HashMap::new();
    let mut chunk = |(chunk, ends): (usize, &[u32])| {
        let lives = |t: &Triangle| t.birth < ends[1] && ends[0] < t.death;
        // With the index of each vertex in the part.
        let (own, in_part) = sub_patch(&patch, &all, lives);
        let n_triangles = own.triangles.len() as u64;
        let name = ChunkName { plan: plan.hash().to_owned(), number, chunk };
        let parameters = Metadata::from_value(serde_json::json!({ PART: name }));
        let own = Spectrum::from_patch(About { parameters, ..about.clone() }, own)?;
        let Written { bytes, order, .. } = file::into_bytes(own)?;
        let mut key_of = |v: u32| {
            let next = keys.len() as u32;
            let in_part = || *keys.entry(v).or_insert_with(|| key_in_part(number, next));
            edges.get(&v).copied().or_else(|| is_repeated[v as usize].then(in_part))
        };
        let in_order = order.iter().map(|&v| in_part[v as usize].1 as u32).zip(0u32..);
        let seam: Vec<(u32, u64)> =
            in_order.filter_map(|(v, new)| key_of(v).map(|key| (new, key))).collect();
        let seam = seam_bytes(number, &seam);
        write_file(folder, &chunk_name((number, chunk)), &bytes)?;
        write_file(folder, &seam_name((number, chunk)), &seam)?;
        let interval = (patch.isovalues[ends[0] as usize], patch.isovalues[ends[1] as usize]);
        Ok(IndexedChunk::new(interval, n_triangles, (bytes.len() + seam.len()) as u64))
    };
    cuts.windows(2).enumerate().map(&mut chunk).collect()
}

/// For each vertex, true if several chunks contain it.
fn is_in_several_chunks(patch: &Patch, cuts: &[u32]) -> Vec<bool> {
    // The first and the last chunk that contains each vertex.
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

/// The grid of bricks of a plan: the first samples of its columns along x, y, z.
struct BrickGrid([Vec<usize>; 3]);

impl BrickGrid {
    fn of(plan: &Plan) -> BrickGrid {
        BrickGrid([0, 1, 2].map(|a| {
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

    /// Numbers of the bricks that share samples with one, ascending.
    fn neighbours(&self, number: usize) -> Vec<usize> {
        let [nx, ny] = [self.0[0].len(), self.0[1].len()];
        let at = [number % nx, number / nx % ny, number / (nx * ny)];
        let around = |a: usize| at[a].saturating_sub(1)..(at[a] + 2).min(self.0[a].len());
        let rows = around(2).flat_map(|z| around(1).map(move |y| (y, z)));
        let all = rows.flat_map(|(y, z)| around(0).map(move |x| [x, y, z]));
        all.map(|p| self.number(p)).filter(|&other| other != number).collect()
    }

    /// Number of events in each brick; an event on a shared plane counts for the upper brick.
    fn n_events(&self, whole: &Spectrum) -> Vec<usize> {
        let size = whole.volume().placement.cell_size();
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
