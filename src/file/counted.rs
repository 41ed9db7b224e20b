//! What a walk along all chunks of a file has read, each chunk once: lifetimes, and what the size of the whole follows from.

use std::collections::HashSet;

use super::container::{FileTables, check_size};
use super::tree_walk::Walked;
use crate::error::Result;
use crate::spectrum::{Size, check_collapses};

/// The chunks that were read so far.
pub(super) struct Counted {
    /// By tree and rank of it, the rank in the whole.
    ranks: Vec<Vec<u32>>,
    /// By chunk of the file.
    is_counted: Vec<bool>,
    /// By rank of the whole, births minus deaths.
    changes: Vec<i64>,
    /// Of shared vertices.
    keys: HashSet<u64>,
    /// Vertices of a tree of which another tree was counted before.
    n_repeated: u64,
}

/// The isovalues of all trees.
pub(super) fn all_isovalues(tables: &FileTables) -> Vec<f64> {
    let mut all = tables.isovalues.concat();
    // A single table is sorted.
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

impl Counted {
    /// Nothing yet.
    pub(super) fn new(tables: &FileTables) -> Self {
        let isovalues = all_isovalues(tables);
        let rank = |&c: &f64| isovalues.partition_point(|&x| x < c) as u32;
        Counted {
            ranks: tables.isovalues.iter().map(|table| table.iter().map(rank).collect()).collect(),
            is_counted: vec![false; tables.index.sizes().len()],
            changes: vec![0; isovalues.len()],
            keys: HashSet::new(),
            n_repeated: 0,
        }
    }

    /// Counts the chunks of a tree, and calls `take` with birth and death of each triangle, as ranks of the whole. Chunks that are counted already
    /// are left out.
    pub(super) fn add(
        &mut self,
        tables: &FileTables,
        (tree, walked): (usize, &Walked),
        take: &mut dyn FnMut(u32, u32),
    ) {
        let ranks = &self.ranks[tree];
        let mut rest = &walked.tree.patch.triangles[..];
        let mut shared = walked.tree.shared.iter().peekable();
        let mut end_vertex = 0;
        for &chunk in &walked.chunks {
            let size = tables.index.sizes()[chunk];
            let (own, after) = rest.split_at(size.triangles as usize);
            rest = after;
            end_vertex += size.vertices;
            let is_known = std::mem::replace(&mut self.is_counted[chunk], true);
            while let Some((_, key)) = shared.next_if(|(v, _)| u64::from(*v) < end_vertex) {
                let is_new = is_known || self.keys.insert(*key);
                self.n_repeated += u64::from(!is_new);
            }
            for t in own.iter().filter(|_| !is_known) {
                let [birth, death] = [t.birth, t.death].map(|rank| ranks[rank as usize]);
                self.changes[birth as usize] += 1;
                self.changes[death as usize] -= 1;
                take(birth, death);
            }
        }
    }

    /// Checks that the size of the whole, of which all chunks are counted, is as declared, and the collapses.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input).
    pub(super) fn check(&self, tables: &FileTables) -> Result<()> {
        let mut size = Size::default();
        for of_chunk in tables.index.sizes() {
            size.trajectories += of_chunk.vertices;
            size.knots += of_chunk.knots;
            size.triangles += of_chunk.triangles;
        }
        size.trajectories = size.trajectories.saturating_sub(self.n_repeated);
        size.knots = size.knots.saturating_sub(2 * self.n_repeated);
        size.isovalues = self.changes.len() as u64;
        size.collapses = tables.collapses.len() as u64;
        let mut alive = 0;
        for change in &self.changes {
            alive += change;
            size.most_triangles = size.most_triangles.max(alive.max(0) as u64);
        }
        check_size(&tables.size, &size)?;
        check_collapses(&tables.collapses, size.trajectories, self.changes.len())
    }
}
