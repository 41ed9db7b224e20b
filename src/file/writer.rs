//! Writes a spectrum file: of one spectrum, or of the spectra of bricks, one after the other.
//!
//! # Invariants
//!
//! The bytes depend on the spectra and their order alone.

use std::io::Write;

use super::column::Content;
use super::container::{ContainerWriter, PackedChunk, TableContents};
use super::encode::{Encoded, UNKNOWN, encode};
use super::header::write_info;
use super::tables;
use super::tree::Tree;
use super::units::Units;
use crate::error::{Error, Result};
use crate::spectrum::{Size, Spectrum};

/// A vertex of a brick that other bricks contain, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shared {
    /// Its number in the brick's spectrum. It has two knots.
    pub(crate) vertex: u32,
    /// Its lattice edge in the whole volume: equal for the same vertex of all bricks.
    pub(crate) key: u64,
    /// Whether an earlier brick contains it.
    pub(crate) is_repeated: bool,
}

/// A spectrum as a tree of chunks.
pub(crate) struct PackedTree {
    tree: Tree,
    chunks: Vec<PackedChunk>,
    isovalues: Vec<f64>,
    /// By isovalue, births of triangles minus deaths.
    changes: Vec<i64>,
}

/// A spectrum as a tree of chunks, and the spectrum in the order of the file.
pub(super) struct Packed {
    pub(super) tree: PackedTree,
    pub(super) spectrum: Spectrum,
    /// By vertex, its number in the original spectrum.
    pub(super) order: Vec<u32>,
}

impl PackedTree {
    /// Packs the spectrum of a brick: the only one with triangles, or one of several, with its shared vertices, ascending.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
    pub(crate) fn of_brick(spectrum: Spectrum, shared: Option<&[Shared]>) -> Result<PackedTree> {
        spectrum.check()?;
        let of = if shared.is_some() { Tree::of_brick } else { Tree::of };
        let tree = of(spectrum.triangles(), spectrum.isovalues().len() as u32);
        packed(tree, spectrum, shared).map(|packed| packed.tree)
    }
}

/// Packs a spectrum that passes [`Spectrum::check`]; one of several with its shared vertices.
pub(super) fn packed(tree: Tree, spectrum: Spectrum, shared: Option<&[Shared]>) -> Result<Packed> {
    let units = Units::of_file(spectrum.tolerance());
    let mut changes = vec![0; spectrum.isovalues().len()];
    for t in spectrum.triangles() {
        changes[t.birth as usize] += 1;
        changes[t.death as usize] -= 1;
    }
    let n_chunks = if shared.is_some() { UNKNOWN } else { tree.chunks().len() };
    let Encoded { spectrum, order, chunks } = encode(spectrum, &tree, n_chunks, units)?;
    let mut first = 0;
    let mut packed = Vec::with_capacity(chunks.len());
    for mut contents in chunks {
        let end = first + contents.size.vertices as usize;
        let of_chunk = shared.map(|shared| of_chunk(shared, &order[first..end]));
        first = end;
        if let Some((_, n_repeated)) = of_chunk {
            contents.size.repeated = n_repeated;
        }
        let keys = of_chunk.as_ref().map(|(keys, _)| &keys[..]);
        packed.push(PackedChunk::new(contents, keys));
    }
    let isovalues = spectrum.isovalues().to_vec();
    let tree = PackedTree { tree, chunks: packed, isovalues, changes };
    Ok(Packed { tree, spectrum, order })
}

/// The shared vertices of a chunk by number, with their keys, and how many of them are repeated. `order` has the vertices of the chunk.
fn of_chunk(shared: &[Shared], order: &[u32]) -> (Vec<(u32, u64)>, u64) {
    let find = |v: u32| shared.binary_search_by_key(&v, |s| s.vertex).ok().map(|i| shared[i]);
    let found = (0..).zip(order).filter_map(|(number, &v)| Some((number, find(v)?)));
    let (mut keys, mut n_repeated) = (Vec::new(), 0);
    for (number, s) in found {
        keys.push((number, s.key));
        n_repeated += u64::from(s.is_repeated);
    }
    (keys, n_repeated)
}

/// Writes a file tree by tree.
pub(crate) struct TreeWriter<'a> {
    container: ContainerWriter<'a>,
    /// The content of section `ISOV`.
    isovalues: Vec<u8>,
    /// Births minus deaths by isovalue, of all trees.
    changes: Vec<(f64, i64)>,
    /// Without isovalues, most triangles and collapses.
    size: Size,
    is_empty: bool,
}

impl<'a> TreeWriter<'a> {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] without a path.
    pub(crate) fn new(out: &'a mut dyn Write) -> Result<Self> {
        Ok(TreeWriter {
            container: ContainerWriter::new(out).map_err(no_path)?,
            isovalues: Vec::new(),
            changes: Vec::new(),
            size: Size::default(),
            is_empty: true,
        })
    }

    /// Appends a tree.
    ///
    /// # Errors
    ///
    /// As [`TreeWriter::new`].
    pub(crate) fn push(&mut self, packed: PackedTree) -> Result<()> {
        let PackedTree { tree, chunks, isovalues, changes } = packed;
        for chunk in &chunks {
            let size = chunk.size;
            self.size.trajectories += size.vertices - size.repeated;
            self.size.knots += size.knots - 2 * size.repeated;
            self.size.triangles += size.triangles;
        }
        tables::write_isovalues(&mut self.isovalues, &isovalues);
        self.changes.extend(isovalues.into_iter().zip(changes));
        self.is_empty = false;
        self.container.push(tree, chunks).map_err(no_path)
    }

    /// Ends the file with the description, the events and the collapses of the whole, which need not have triangles. Returns its size.
    ///
    /// # Errors
    ///
    /// As [`TreeWriter::new`]; [`Error::Input`] if the description is too long.
    pub(crate) fn end(mut self, whole: &Spectrum) -> Result<Size> {
        if self.is_empty {
            self.push(packed(Tree::single(0), whole.clone(), None)?.tree)?;
        }
        let (isovalues, most_triangles) = counts(self.changes);
        let collapses = whole.collapses().len() as u64;
        let size = Size { isovalues, most_triangles, collapses, ..self.size };
        let tables = TableContents {
            info: Content::Plain(write_info(whole, size)?.into()),
            events: Content::Plain(tables::write_events(whole.events()).into()),
            isovalues: Content::Plain(self.isovalues.into()),
            collapses: Content::Plain(tables::write_collapses(whole.collapses()).into()),
        };
        self.container.end(&tables).map_err(no_path)?;
        Ok(size)
    }
}

/// How many isovalues there are, and the most triangles that are alive at one of them.
fn counts(mut changes: Vec<(f64, i64)>) -> (u64, u64) {
    changes.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (mut n, mut alive, mut most) = (0, 0i64, 0i64);
    for same in changes.chunk_by(|a, b| a.0 == b.0) {
        n += 1;
        alive += same.iter().map(|change| change.1).sum::<i64>();
        most = most.max(alive);
    }
    (n, most as u64)
}

fn no_path(error: std::io::Error) -> Error {
    Error::io("", error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_at_equal_isovalues_of_several_trees_are_added() {
        let changes = vec![(0.0, 3), (1.0, -1), (2.0, -2), (1.0, 4), (3.0, -4), (1.5, 0)];
        assert_eq!(counts(changes), (5, 6));
        assert_eq!(counts(Vec::new()), (0, 0));
    }
}
