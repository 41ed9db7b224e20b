//! The index of a file, section `INDX`: its trees of chunks, and what each chunk contains.
//!
//! # Theory
//!
//! A spectrum of one sweep is one tree. One that was computed in bricks has a tree for each brick with triangles, so it is written brick by brick.
//! A tree has its own table of isovalues, and vertices that several trees contain have keys ([`super::seam`]).
//!
//! # Invariants
//!
//! Chunks are numbered tree after tree, in pre-order. There is at least one tree.

use std::ops::{Range, RangeInclusive};

use super::column::{Column, Columns, Content, write_column};
use super::tree::{Chunk, Tree};
use crate::error::{Error, Result};

/// The work of reading one chunk grows with all chunks above it. The sum over all chunks is at most this many times the whole, plus [`FREE_WORK`].
const MAX_WORK: u64 = 128;
const FREE_WORK: u64 = 1 << 20;

/// What the index says about the content of a chunk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ChunkSize {
    pub(super) vertices: u64,
    pub(super) knots: u64,
    pub(super) triangles: u64,
    /// Bytes of its sections, and their CRC-32.
    pub(super) bytes: u64,
    pub(super) crc: u32,
    /// Vertices that an earlier tree contains, too. They have two knots each.
    pub(super) repeated: u64,
}

impl ChunkSize {
    /// Adds the vertices, knots and triangles of another chunk.
    pub(super) fn add(&mut self, other: &ChunkSize) {
        self.vertices = self.vertices.saturating_add(other.vertices);
        self.knots = self.knots.saturating_add(other.knots);
        self.triangles = self.triangles.saturating_add(other.triangles);
    }

    /// Checks that a sum of chunks fits a patch.
    pub(super) fn check_sum(&self) -> Result<()> {
        let &ChunkSize { vertices, knots, triangles, .. } = self;
        if vertices.max(knots).max(triangles) >= u64::from(u32::MAX) {
            return Err(Error::input(format!(
                "{vertices} vertices, {knots} knots and {triangles} triangles, expected fewer than 2^32 - 1"
            )));
        }
        Ok(())
    }
}

/// A tree of the index.
#[derive(Clone, Copy, Debug)]
pub(super) struct IndexedTree<'a> {
    pub(super) number: usize,
    pub(super) tree: &'a Tree,
    /// The number of its first chunk in the file.
    pub(super) first: usize,
    /// By chunk of the tree.
    pub(super) sizes: &'a [ChunkSize],
}

/// The trees of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Index {
    trees: Vec<Tree>,
    /// By chunk of the file.
    sizes: Vec<ChunkSize>,
}

impl Index {
    /// Appends a tree.
    pub(super) fn push(&mut self, tree: Tree, sizes: Vec<ChunkSize>) {
        self.trees.push(tree);
        self.sizes.extend(sizes);
    }

    pub(super) fn sizes(&self) -> &[ChunkSize] {
        &self.sizes
    }

    pub(super) fn n_trees(&self) -> usize {
        self.trees.len()
    }

    pub(super) fn trees(&self) -> impl Iterator<Item = IndexedTree<'_>> {
        let mut first = 0;
        self.trees.iter().enumerate().map(move |(number, tree)| {
            let sizes = &self.sizes[first..first + tree.chunks().len()];
            let indexed = IndexedTree { number, tree, first, sizes };
            first += sizes.len();
            indexed
        })
    }

    /// The content of section `INDX`.
    pub(super) fn write(&self) -> Vec<u8> {
        let mut bytes = (self.sizes.len() as u64).to_le_bytes().to_vec();
        let chunks = self.trees.iter().flat_map(Tree::chunks);
        let pivot = |chunk: &Chunk| chunk.pivot.map_or(0, |pivot| u64::from(pivot) + 1);
        write_column(&mut bytes, &chunks.map(pivot).collect::<Vec<u64>>());
        let mut column = |of: fn(&ChunkSize) -> u64| {
            write_column(&mut bytes, &self.sizes.iter().map(of).collect::<Vec<u64>>());
        };
        column(|size| size.vertices);
        column(|size| size.knots);
        column(|size| size.triangles);
        column(|size| size.bytes);
        column(|size| size.crc.into());
        if self.trees.len() > 1 {
            column(|size| size.repeated);
        }
        bytes
    }

    /// Reads section `INDX` of a file whose trees have so many isovalues.
    pub(super) fn read(content: &Content, n_ranks: &[u32]) -> Result<Index> {
        let mut columns = content.columns();
        let n = columns.count()?;
        let pivots = columns.column(n, 33)?;
        let sizes = read_sizes(&mut columns, n, n_ranks.len() > 1)?;
        columns.end()?;
        let pivots = (0..n).map(|i| Ok(pivots.get(i)?.checked_sub(1)));
        let pivots = pivots.collect::<Result<Vec<Option<u64>>>>()?;
        let (mut trees, mut rest) = (Vec::with_capacity(n_ranks.len()), &pivots[..]);
        for &n_ranks in n_ranks {
            let tree = Tree::read(rest, n_ranks)?;
            rest = &rest[tree.chunks().len()..];
            trees.push(tree);
        }
        if !rest.is_empty() {
            return Err(Error::input(format!("{n} chunks, expected {}", n - rest.len())));
        }
        let index = Index { trees, sizes };
        index.check_work()?;
        Ok(index)
    }

    /// Checks that no chunk has much more above it than the whole is large: a small file could make a reader slow.
    fn check_work(&self) -> Result<()> {
        let size = |size: &ChunkSize| size.vertices + size.knots + size.triangles;
        let whole: u64 = self.sizes.iter().map(size).sum();
        // What is in a chunk is looked at again for each chunk below it.
        let work = self.trees().flat_map(|IndexedTree { tree, sizes, .. }| {
            let below = tree.chunks().iter().enumerate().map(|(i, chunk)| (chunk.end - i) as u64);
            sizes.iter().zip(below).map(move |(of, n)| size(of).saturating_mul(n))
        });
        if work.fold(0u64, u64::saturating_add) > FREE_WORK + MAX_WORK.saturating_mul(whole) {
            let n = self.sizes.len();
            return Err(Error::input(format!("{n} chunks, too many for what is above them")));
        }
        Ok(())
    }
}

impl IndexedTree<'_> {
    /// The chunks with triangles that are alive at some of these ranks of the tree: numbers in the file.
    pub(super) fn chunks_at(self, ranks: RangeInclusive<u32>) -> impl Iterator<Item = usize> {
        self.tree.at(ranks).map(move |i| self.first + i)
    }

    /// The numbers of its chunks in the file.
    pub(super) fn chunks(self) -> Range<usize> {
        self.first..self.first + self.sizes.len()
    }
}

fn read_sizes(columns: &mut Columns, n: usize, has_repeated: bool) -> Result<Vec<ChunkSize>> {
    let mut next = |bits: u32| columns.column(n, bits).map(Column::into_owned);
    let (vertices, knots, triangles) = (next(32)?, next(32)?, next(32)?);
    let (bytes, crc) = (next(62)?, next(32)?);
    let repeated = if has_repeated { Some(next(32)?) } else { None };
    let mut sizes = Vec::with_capacity(n);
    for i in 0..n {
        let size = ChunkSize {
            vertices: vertices.get(i)?,
            knots: knots.get(i)?,
            triangles: triangles.get(i)?,
            bytes: bytes.get(i)?,
            crc: crc.get(i)? as u32,
            repeated: repeated.as_ref().map_or(Ok(0), |repeated| repeated.get(i))?,
        };
        if size.repeated > size.vertices || 2 * size.repeated > size.knots {
            return Err(Error::input(format!("chunk {i} repeats more vertices than it has")));
        }
        sizes.push(size);
    }
    Ok(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::Triangle;

    /// A tree of lifetimes of 20 ranks, one born at each rank.
    fn tree(n: u32, most: usize) -> Tree {
        let one = |birth| Triangle { vertices: [0, 1, 2], birth, death: birth + 20, cap: false };
        let triangles: Vec<Triangle> = (0..n).map(one).collect();
        Tree::with_chunks_of(most, &triangles, n + 21)
    }

    fn index(trees: Vec<Tree>) -> Index {
        let mut index = Index::default();
        let is_one = trees.len() == 1;
        for tree in trees {
            let size = |i: u64| ChunkSize {
                vertices: i,
                knots: 3 * i,
                triangles: 2 * i,
                bytes: 100 + i,
                crc: 7,
                repeated: if is_one { 0 } else { i / 2 },
            };
            let sizes = (0..tree.chunks().len() as u64).map(size).collect();
            index.push(tree, sizes);
        }
        index
    }

    fn read(bytes: Vec<u8>, n_ranks: &[u32]) -> Result<Index> {
        Index::read(&Content::Plain(bytes.into()), n_ranks)
    }

    #[test]
    fn what_is_written_is_read() {
        for (trees, n_ranks) in [
            (vec![tree(1500, 100)], vec![1521]),
            (vec![tree(300, 40), tree(50, 40), tree(700, 40)], vec![321, 71, 721]),
        ] {
            let index = index(trees);
            assert!(read(index.write(), &n_ranks).expect("as written") == index);
            let firsts: Vec<usize> = index.trees().map(|tree| tree.first).collect();
            assert_eq!((firsts[0], firsts.len()), (0, n_ranks.len()));
        }
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let refused = |bytes: Vec<u8>, n_ranks: &[u32]| {
            read(bytes, n_ranks).expect_err("no trees").to_string()
        };
        let one = index(vec![tree(1500, 100)]);
        let outside = refused(one.write(), &[40]);
        assert!(outside.contains("pivot at rank"), "{outside}");
        let two = index(vec![tree(300, 40), tree(50, 40)]);
        let missing = refused(two.write(), &[321, 71, 71]);
        assert!(missing.contains("missing"), "{missing}");
        // As a file with one tree it has a column too many.
        refused(two.write(), &[321]);
        let mut doubled = two.clone();
        doubled.push(tree(50, 40), vec![ChunkSize::default(); tree(50, 40).chunks().len()]);
        let doubled = refused(doubled.write(), &[321, 71]);
        assert!(doubled.contains("chunks, expected"), "{doubled}");
        let mut repeated = two;
        repeated.sizes[1].repeated = 2;
        let repeated = refused(repeated.write(), &[321, 71]);
        assert!(repeated.contains("chunk 1 repeats"), "{repeated}");
    }

    #[test]
    fn many_chunks_below_a_large_one_are_refused() {
        // A chain below a root that has everything.
        let n = |n_chunks: u64| {
            let pivots: Vec<Option<u64>> =
                (0..n_chunks).map(|i| (i % 2 == 0 && i + 1 < n_chunks).then_some(i / 2)).collect();
            let tree = Tree::read(&pivots, 100).expect("a chain");
            let mut sizes = vec![ChunkSize::default(); tree.chunks().len()];
            sizes[0].knots = 1 << 31;
            let mut index = Index::default();
            index.push(tree, sizes);
            read(index.write(), &[100])
        };
        n(61).expect("61 times the whole");
        assert!(n(129).is_err());
    }
}
