//! The tree of chunks: which triangles of a spectrum are stored together.
//!
//! # Theory
//!
//! An interval tree (Edelsbrunner 1980) over the lifetimes of triangles. A chunk without children has all triangles that live and die in its
//! span of ranks. Any other chunk has a *pivot*: it has the triangles of its span that are alive at the pivot; those that die before are in the
//! chunks of its first child, those born later in those of its second. So each triangle is stored once, and the mesh at a rank needs only the chunks
//! from the root to the child at the end that contains the rank. A vertex is stored in the lowest chunk above all of its triangles.
//!
//! # Invariants
//!
//! Chunks are in pre-order: a chunk, its first child with all below it, its second child. Children have at least one rank each.

use std::ops::{Range, RangeInclusive};

use crate::error::{Error, Result};
use crate::spectrum::Triangle;

/// Most triangles in a chunk that is not split further: reading one takes some 40 ms. Half as many make
/// files 2 % larger.
const MIN_TRIANGLES: usize = 200_000;

/// The same for a brick.
const MIN_OF_BRICK: usize = 25_000;

/// A chunk without children has at most one in so many of all triangles, unless it has at most [`MIN_TRIANGLES`]. Limits the number of chunks.
const MAX_SHARES: usize = 32;

/// Each child has at least this share of the triangles that are not alive at the pivot, so the tree is not deep. With .3, four times as much is read for
/// a mesh of a volume with noise.
const MIN_CHILD: f64 = 0.1;

/// A chunk is not split if more than this share of its triangles would be alive at the pivot: they are read for every rank of the chunk,
/// and take some 20 % more bytes than in a child.
const MAX_ALIVE: f64 = 0.15;

/// Most chunks between the root and any other.
const MAX_DEPTH: usize = 64;

/// Directions from a pivot: triangles end at their death upwards, and at their birth downwards.
pub(super) const UPWARDS: usize = 0;
pub(super) const DOWNWARDS: usize = 1;

/// The rank at which a triangle ends in a direction.
pub(super) fn end_of(triangle: &Triangle, direction: usize) -> u32 {
    [triangle.death, triangle.birth][direction]
}

/// A chunk in the tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Chunk {
    /// The ranks at which its triangles, and those of the chunks below it, are born or die.
    pub(super) span: Range<u32>,
    /// The rank at which all of its triangles are alive, if it has children: `span.start <= pivot`, `pivot + 1 < span.end`.
    pub(super) pivot: Option<u32>,
    /// The number of the first chunk that is not below it.
    pub(super) end: usize,
}

impl Chunk {
    /// The ranks of the span at which triangles end in a direction from a pivot, nearest first.
    pub(super) fn ranks_from(&self, pivot: u32, direction: usize) -> Box<dyn Iterator<Item = u32>> {
        match direction {
            UPWARDS => Box::new(pivot + 1..self.span.end),
            _ => Box::new((self.span.start..=pivot).rev()),
        }
    }
}

/// All chunks, in pre-order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Tree(Vec<Chunk>);

impl Tree {
    /// A single chunk.
    pub(super) fn single(n_ranks: u32) -> Tree {
        Tree(vec![Chunk { span: 0..n_ranks, pivot: None, end: 1 }])
    }

    /// The tree for the lifetimes of triangles, the same for any order of them.
    pub(super) fn of(triangles: &[Triangle], n_ranks: u32) -> Tree {
        Tree::with_chunks_of(MIN_TRIANGLES.max(triangles.len() / MAX_SHARES), triangles, n_ranks)
    }

    /// The tree for one of several bricks, whose chunks are smaller: those of all bricks at an isovalue are read together.
    pub(super) fn of_brick(triangles: &[Triangle], n_ranks: u32) -> Tree {
        Tree::with_chunks_of(MIN_OF_BRICK.max(triangles.len() / MAX_SHARES), triangles, n_ranks)
    }

    /// The tree whose chunks are split if they have more triangles than `most`.
    pub(super) fn with_chunks_of(most: usize, triangles: &[Triangle], n_ranks: u32) -> Tree {
        let lives = triangles.iter().map(|t| (t.birth, t.death)).collect();
        let mut tree = Tree(Vec::new());
        tree.split(lives, 0..n_ranks, most);
        tree
    }

    /// Appends the chunks of these lifetimes, which are in a span.
    fn split(&mut self, lives: Vec<(u32, u32)>, span: Range<u32>, most: usize) {
        let at = self.0.len();
        let pivot = if lives.len() > most { pivot(&lives, &span) } else { None };
        self.0.push(Chunk { span: span.clone(), pivot, end: 0 });
        if let Some(pivot) = pivot {
            let (before, rest): (Vec<_>, Vec<_>) =
                lives.into_iter().partition(|&(_, death)| death <= pivot);
            let after = rest.into_iter().filter(|&(birth, _)| birth > pivot).collect();
            self.split(before, span.start..pivot + 1, most);
            self.split(after, pivot + 1..span.end, most);
        }
        self.0[at].end = self.0.len();
    }

    pub(super) fn chunks(&self) -> &[Chunk] {
        &self.0
    }

    /// The chunks with triangles that are alive at some of these ranks. The root is always among them.
    pub(super) fn at(&self, ranks: RangeInclusive<u32>) -> impl Iterator<Item = usize> {
        let is_at = move |(i, chunk): (usize, &Chunk)| {
            let meets = chunk.span.start <= *ranks.end() && *ranks.start() < chunk.span.end;
            (meets || i == 0).then_some(i)
        };
        self.0.iter().enumerate().filter_map(is_at)
    }

    /// The chunks above a chunk, from the root on.
    pub(super) fn above(&self, chunk: usize) -> impl Iterator<Item = usize> {
        let is_above = move |&i: &usize| chunk < self.0[i].end;
        (0..chunk).filter(is_above)
    }

    /// The ranks that need the same chunks as a rank: the span of a chunk without children.
    pub(super) fn span_at(&self, rank: u32) -> Range<u32> {
        let mut chunk = 0;
        while let Some(pivot) = self.0[chunk].pivot {
            chunk = self.children(chunk)[usize::from(rank > pivot)];
        }
        self.0[chunk].span.clone()
    }

    /// The children of a chunk with a pivot.
    pub(super) fn children(&self, chunk: usize) -> [usize; 2] {
        [chunk + 1, self.0[chunk + 1].end]
    }

    /// The chunk of a triangle.
    pub(super) fn chunk_of(&self, triangle: &Triangle) -> u32 {
        let mut at = 0;
        while let Some(pivot) = self.0[at].pivot {
            at = match (triangle.death <= pivot, triangle.birth <= pivot) {
                (true, _) => at + 1,
                (false, true) => break,
                (false, false) => self.0[at + 1].end,
            };
        }
        at as u32
    }

    /// The lowest chunk that is, or is above, both.
    pub(super) fn common(&self, a: u32, b: u32) -> u32 {
        let (low, high) = (a.min(b), a.max(b) as usize);
        let is_above = |chunk: &u32| high < self.0[*chunk as usize].end;
        let mut chunk = low;
        while !is_above(&chunk) {
            chunk = self.parent(chunk);
        }
        chunk
    }

    /// The parent of a chunk that is not the root.
    fn parent(&self, chunk: u32) -> u32 {
        // The chunk before it is its parent or the last one below its sibling.
        let mut before = chunk - 1;
        while self.0[before as usize].end <= chunk as usize {
            before -= 1;
        }
        before
    }

    /// The tree of the first of these chunks, of which each has the rank of its pivot, if it has one.
    pub(super) fn read(pivots: &[Option<u64>], n_ranks: u32) -> Result<Tree> {
        let mut tree = Tree(Vec::new());
        tree.take(pivots, 0..n_ranks, 0)?;
        Ok(tree)
    }

    /// Appends the chunk whose pivot is next, and those below it.
    fn take(&mut self, pivots: &[Option<u64>], span: Range<u32>, depth: usize) -> Result<()> {
        let at = self.0.len();
        let pivot = *pivots.get(at).ok_or_else(|| Error::input("chunks are missing"))?;
        let is_inside = |pivot: u64| {
            pivot >= span.start.into() && pivot + 1 < span.end.into() && depth < MAX_DEPTH
        };
        if let Some(pivot) = pivot.filter(|&pivot| !is_inside(pivot)) {
            return Err(Error::input(format!(
                "chunk {at} has its pivot at rank {pivot}, expected one inside {span:?} and a depth of at most {MAX_DEPTH}"
            )));
        }
        let pivot = pivot.map(|pivot| pivot as u32);
        self.0.push(Chunk { span: span.clone(), pivot, end: 0 });
        if let Some(pivot) = pivot {
            self.take(pivots, span.start..pivot + 1, depth + 1)?;
            self.take(pivots, pivot + 1..span.end, depth + 1)?;
        }
        self.0[at].end = self.0.len();
        Ok(())
    }
}

/// The pivot at which the fewest of these lifetimes are alive; none if they are better left in one chunk.
fn pivot(lives: &[(u32, u32)], span: &Range<u32>) -> Option<u32> {
    let mut deaths = vec![0u64; span.len()];
    let mut births = deaths.clone();
    for &(birth, death) in lives {
        births[(birth - span.start) as usize] += 1;
        deaths[(death - span.start) as usize] += 1;
    }
    let n = lives.len() as u64;
    let (mut born, mut died) = (0, 0);
    let mut best: Option<(u64, u32)> = None;
    // Not the last rank: both children have ranks.
    let ranks = span.clone().take(span.len().saturating_sub(1));
    for (rank, (births, deaths)) in ranks.zip(births.iter().zip(&deaths)) {
        born += births;
        died += deaths;
        let (alive, smaller) = (born - died, died.min(n - born));
        let is_useful = alive as f64 <= MAX_ALIVE * n as f64
            && smaller as f64 >= MIN_CHILD * (n - alive) as f64;
        if is_useful && best.is_none_or(|(least, _)| alive < least) {
            best = Some((alive, rank));
        }
    }
    best.map(|(_, rank)| rank)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle((birth, death): (u32, u32)) -> Triangle {
        Triangle { vertices: [0, 1, 2], birth, death, cap: false }
    }

    /// Chunks of lifetimes of 20 ranks, one born at each rank.
    fn tree(n: u32, most: usize) -> (Tree, Vec<Triangle>) {
        let lives: Vec<(u32, u32)> = (0..n).map(|birth| (birth, birth + 20)).collect();
        let mut tree = Tree(Vec::new());
        tree.split(lives.clone(), 0..n + 21, most);
        (tree, lives.into_iter().map(triangle).collect())
    }

    #[test]
    fn each_triangle_is_in_a_chunk_above_all_ranks_at_which_it_is_alive() {
        let (tree, triangles) = tree(1000, 200);
        assert!(tree.0.len() > 10, "{} chunks", tree.0.len());
        let mut counts = vec![0; tree.0.len()];
        for t in &triangles {
            let i = tree.chunk_of(t) as usize;
            let chunk = &tree.0[i];
            assert!(chunk.span.contains(&t.birth) && chunk.span.contains(&t.death));
            assert!(chunk.pivot.is_none_or(|pivot| t.birth <= pivot && pivot < t.death));
            counts[i] += 1;
        }
        let of_leaves = tree.0.iter().zip(&counts).filter(|(chunk, _)| chunk.pivot.is_none());
        assert!(of_leaves.clone().all(|(_, &n)| n <= 200));
        let spans: u32 = of_leaves.map(|(chunk, _)| chunk.span.len() as u32).sum();
        assert_eq!(spans, 1021, "every rank is in one chunk without children");
    }

    #[test]
    fn the_common_chunk_is_above_both() {
        let (tree, _) = tree(1500, 100);
        let n = tree.0.len() as u32;
        let is_above =
            |a: u32, b: u32| (a as usize..tree.0[a as usize].end).contains(&(b as usize));
        for a in 0..n {
            for b in 0..n {
                let common = tree.common(a, b);
                assert!(is_above(common, a) && is_above(common, b));
                let is_lower = |c: u32| c > common && is_above(c, a) && is_above(c, b);
                assert!(!(0..n).any(is_lower), "{common} above {a} and {b}");
            }
        }
    }
}
