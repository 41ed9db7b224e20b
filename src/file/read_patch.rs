//! Reads the vertices and triangles that some isovalues need, from all trees of a file.

use std::borrow::Cow;
use std::ops::{Range, RangeInclusive};

use rayon::prelude::*;

use super::container::FileTables;
use super::decode::{DecodedTree, Decoder};
use super::index::IndexedTree;
use super::samples::Samples;
use super::source::Source;
use super::units::Units;
use crate::error::{Error, Result};
use crate::spectrum::{Joiner, Patch};

/// The vertices and triangles of the chunks that some isovalues need, without collapses.
///
/// # Errors
///
/// [`Error::Input`] if a chunk is damaged, or trees contradict each other.
pub(super) fn read_patch(
    tables: &FileTables,
    source: &dyn Source,
    isovalues: RangeInclusive<f64>,
) -> Result<Patch> {
    let chunks = Chunks::new(tables, source);
    let n_trees = tables.index.n_trees();
    let decode = |(tree, ranks): &(IndexedTree, RangeInclusive<u32>)| {
        chunks.with_decoder(*tree, |decoder| decoder.decode(ranks.clone()))
    };
    let wanted: Vec<(IndexedTree, RangeInclusive<u32>)> = wanted(tables, &isovalues).collect();
    if let ([tree], 1) = (&wanted[..], n_trees) {
        return Ok(decode(tree)?.patch);
    }
    let mut joiner = Joiner::default();
    // Trees are joined in their order; as many as there are threads are in memory twice.
    for wanted in wanted.chunks(rayon::current_num_threads()) {
        let decoded: Vec<Result<DecodedTree>> = wanted.par_iter().map(decode).collect();
        for (decoded, (tree, _)) in decoded.into_iter().zip(wanted) {
            let DecodedTree { patch, shared } = decoded?;
            append(&mut joiner, (&patch, &shared), &tree.chunks())?;
        }
    }
    Ok(joiner.finish())
}

/// Appends the vertices and triangles of some chunks of a tree, and returns the number of each vertex in the whole.
///
/// # Errors
///
/// [`Error::Input`] if a shared vertex differs from that of another tree, or the whole is too large.
pub(super) fn append(
    joiner: &mut Joiner,
    (patch, shared): (&Patch, &[(u32, u64)]),
    chunks: &Range<usize>,
) -> Result<Vec<u32>> {
    joiner.append(patch, shared)?.map_err(|at| {
        Error::input(format!(
            "chunks {} to {}: the vertex at {:?} differs from that of another tree",
            chunks.start,
            chunks.end - 1,
            at.0
        ))
    })
}

/// The chunks of a file, to be decoded.
pub(super) struct Chunks<'a> {
    tables: &'a FileTables,
    source: &'a dyn Source,
    units: Units,
    samples: Samples,
}

impl<'a> Chunks<'a> {
    pub(super) fn new(tables: &'a FileTables, source: &'a dyn Source) -> Self {
        let units = Units::of_file(tables.about.tolerance);
        Chunks { tables, source, units, samples: Samples::new(&tables.about.volume, units) }
    }

    /// The result of `of` for the decoder of a tree.
    pub(super) fn with_decoder<R>(&self, tree: IndexedTree, of: impl FnOnce(&Decoder) -> R) -> R {
        of(&Decoder {
            tree,
            n_chunks: self.tables.index.sizes().len(),
            has_seam: self.tables.index.n_trees() > 1,
            isovalues: &self.tables.isovalues[tree.number],
            samples: &self.samples,
            units: self.units,
            bytes: &|i| chunk_bytes(self.tables, self.source, i),
        })
    }
}

/// The bytes of a chunk, whose checksum is that of the index.
fn chunk_bytes<'a>(tables: &FileTables, source: &'a dyn Source, i: usize) -> Result<Cow<'a, [u8]>> {
    let place = &tables.places[i];
    let bytes = source.bytes(place.start, place.end - place.start)?;
    if crc32fast::hash(&bytes) == tables.index.sizes()[i].crc {
        return Ok(bytes);
    }
    Err(Error::input("damaged: its checksum is wrong"))
}

/// The chunks that are read for some isovalues, by number.
pub(super) fn chunks_at<'a>(
    tables: &'a FileTables,
    isovalues: &RangeInclusive<f64>,
) -> impl Iterator<Item = usize> + 'a {
    wanted(tables, isovalues).flat_map(|(tree, ranks)| tree.chunks_at(ranks))
}

/// The isovalues that need the same chunks as one.
pub(super) fn same_chunks(tables: &FileTables, isovalue: f64) -> Range<f64> {
    let all = f64::NEG_INFINITY..f64::INFINITY;
    tables.index.trees().fold(all, |same, tree| {
        let isovalues = &tables.isovalues[tree.number];
        let span = tree.tree.span_at(rank_of(isovalues, isovalue));
        // Below the first isovalue the first chunk is read, if any; so is the last one above the last isovalue.
        let (Some(&first), Some(&last)) = (isovalues.first(), isovalues.last()) else {
            return same;
        };
        let start = isovalues.get(span.start as usize).filter(|_| span.start > 0);
        let end = isovalues.get(span.end as usize);
        let [mut low, mut high] =
            [start.copied().unwrap_or(same.start), end.copied().unwrap_or(same.end)];
        if isovalue < first {
            high = first;
        } else if isovalue > last {
            low = last.next_up();
        } else if tables.index.n_trees() > 1 {
            (low, high) = (low.max(first), high.min(last.next_up()));
        }
        same.start.max(low)..same.end.min(high)
    })
}

/// The trees with triangles at some isovalues, and their ranks. A single tree is always read.
pub(super) fn wanted<'a>(
    tables: &'a FileTables,
    isovalues: &RangeInclusive<f64>,
) -> impl Iterator<Item = (IndexedTree<'a>, RangeInclusive<u32>)> + 'a {
    let (low, high) = (*isovalues.start(), *isovalues.end());
    let is_single = tables.index.n_trees() == 1;
    tables.index.trees().filter_map(move |tree| {
        let isovalues = &tables.isovalues[tree.number];
        let meets = || Some(high >= *isovalues.first()? && low <= *isovalues.last()?);
        let ranks = rank_of(isovalues, low)..=rank_of(isovalues, high);
        (is_single || meets() == Some(true)).then_some((tree, ranks))
    })
}

/// The largest rank whose isovalue is at most `isovalue`; the first one below all.
fn rank_of(isovalues: &[f64], isovalue: f64) -> u32 {
    isovalues.partition_point(|&c| c <= isovalue).saturating_sub(1) as u32
}
