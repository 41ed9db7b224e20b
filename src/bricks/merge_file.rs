//! Merges the parts of a plan to a spectrum file, part by part. Only a few parts and the joined borders are in memory at a time.
//!
//! # Theory
//!
//! A part depends on others in two ways: the events are joined from all borders, and the lifetime of a vertex on a shared plane
//! depends on the borders of the neighbours. So each part can be written on its own once the borders are known: as a tree of chunks.

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;

use rayon::prelude::*;

use super::head::SharedVertex;
use super::merge::{JoinedBorders, join_borders, report, seam_mismatch};
use super::part::Part;
use super::parts::Parts;
use super::plan::Plan;
use super::source::OpenVolume;
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::file::{PackedTree, Shared, TreeWriter};
use crate::progress::Progress;
use crate::spectrum::{About, Joiner, Knot, Patch, Size, Spectrum};

/// Memory for writing a part, bytes per triangle (measured: 120 to 150 for `bonsai`).
const BYTES_PER_TRIANGLE: f64 = 150.0;

/// A spectrum that was written part by part.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Merged {
    /// The whole without triangles: its description and events.
    pub whole: Spectrum,
    /// The size of the whole.
    pub size: Size,
    /// The number of parts with triangles, each of which is a tree of chunks of the file.
    pub n_trees: usize,
}

/// Writes the spectrum file of all parts, in the order of their numbers.
/// Works on as many parts at a time as there are threads and as fit into `memory`, bytes, if that is limited.
///
/// # Errors
///
/// As [`merge`](super::merge()); [`Error::Io`](crate::Error::Io) without a path if `out` fails.
pub fn merge_to_file(
    parts: &Parts,
    volume: &OpenVolume,
    out: &mut dyn Write,
    memory: Option<f64>,
    progress: &dyn Progress,
) -> Result<Merged> {
    let JoinedBorders { whole, heads } = join_borders(parts, volume, progress)?;
    let with_triangles: Vec<usize> =
        (0..parts.n()).filter(|&number| heads[number].size()[2] > 0).collect();
    let grid = BrickGrid::of(parts.plan());
    let packer = PartPacker { parts, volume, grid: &grid, is_only: with_triangles.len() == 1 };
    let pack = |&number: &usize| {
        report(progress, number, parts.n())?;
        packer.pack(number)
    };
    let largest = heads.iter().map(|h| h.size()[2]).max().unwrap_or(0).max(1) as f64;
    let fit = memory.map_or(f64::INFINITY, |memory| memory / (BYTES_PER_TRIANGLE * largest));
    let at_once = rayon::current_num_threads().min(fit as usize).max(1);
    let mut writer = TreeWriter::new(out)?;
    for batch in with_triangles.chunks(at_once) {
        let packed: Vec<Result<PackedTree>> = batch.par_iter().map(pack).collect();
        packed.into_iter().try_for_each(|tree| writer.push(tree?))?;
    }
    let size = writer.end(&whole)?;
    Ok(Merged { whole, size, n_trees: with_triangles.len() })
}

/// As [`merge_to_file`], to a file at `path`, which replaces one that was there.
///
/// # Errors
///
/// As [`merge_to_file`], with the path; what was at `path` is then unchanged.
pub fn merge_to_path(
    parts: &Parts,
    volume: &OpenVolume,
    path: &Path,
    memory: Option<f64>,
    progress: &dyn Progress,
) -> Result<Merged> {
    let mut merged = None;
    let written = write_atomically(path, |out| {
        let result = merge_to_file(parts, volume, out, memory, progress);
        let is_merged = result.is_ok();
        merged = Some(result);
        // The error itself is in `merged`.
        if is_merged { Ok(()) } else { Err(io::ErrorKind::Other.into()) }
    });
    match merged {
        Some(Err(Error::Io { source, path: of })) if of.as_os_str().is_empty() => {
            Err(Error::io(path, source))
        }
        Some(Err(error)) => Err(error),
        Some(Ok(merged)) => written.map(|()| merged),
        None => Err(written.err().unwrap_or(Error::Interrupted)),
    }
}

/// Packs the parts of a plan.
struct PartPacker<'a> {
    parts: &'a Parts<'a>,
    volume: &'a OpenVolume,
    grid: &'a BrickGrid,
    /// Whether only one part has triangles.
    is_only: bool,
}

impl PartPacker<'_> {
    fn pack(&self, number: usize) -> Result<PackedTree> {
        let plan = self.parts.plan();
        let part = self.parts.part(number)?;
        let (patch, shared) = self.widened(number, &part)?;
        let (info, flags) = (plan.recipe.volume.clone(), &plan.recipe.parameters);
        let about = About::new(info, flags.range.unwrap_or(plan.recipe.volume.range), flags.error);
        let mut spectrum = Spectrum::from_patch(about, patch)?;
        if let OpenVolume::Whole(prepared) = self.volume {
            // Lifetimes are split at a mask by the isovalues of the part's own table, so a split is within the same interval
            // as in one sweep.
            prepared.cap(&mut spectrum);
        }
        PackedTree::of_brick(spectrum, (!self.is_only).then_some(&shared))
    }

    /// The patch of a part, in which shared vertices live as long as in the neighbours, and these vertices.
    fn widened(&self, number: usize, part: &Part) -> Result<(Patch, Vec<Shared>)> {
        let keys = part.shared();
        let places: HashMap<u64, usize> = keys.iter().map(|s| s.1).zip(0..).collect();
        let shared = |&(vertex, key): &(u32, u64)| Shared { vertex, key, is_repeated: false };
        let mut shared: Vec<Shared> = keys.iter().map(shared).collect();
        let mut joiner = Joiner::default();
        joiner.append(&part.patch, &keys)?.map_err(|at| seam_mismatch(number, at))?;
        for other in self.grid.neighbours(number) {
            let border = self.parts.border(other)?;
            let common = border.shared.iter().filter(|s| places.contains_key(&s.edge));
            let common: Vec<SharedVertex> = common.copied().collect();
            if other < number {
                common.iter().for_each(|s| shared[places[&s.edge]].is_repeated = true);
            }
            let (patch, keys) = patch_of(&common);
            joiner.append(&patch, &keys)?.map_err(|at| seam_mismatch(other, at))?;
        }
        Ok((joiner.finish(), shared))
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
}
