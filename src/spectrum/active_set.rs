//! The triangles alive at one rank, kept up to date as the rank moves.
//!
//! A jump asks the interval tree. A small move instead reads two lists of all triangles, sorted by
//! birth and by death, only between the old and the new rank (design: tracking, active-set query).
//! Either way the result is the list of active triangles by index, so what a query returns depends
//! on the isovalue alone, never on the queries before it.

use super::interval_tree::IntervalTree;
use super::{Spectrum, Triangle};

/// The active triangles of a spectrum.
#[derive(Clone, Debug)]
pub(super) struct ActiveSet {
    tree: IntervalTree,
    /// (birth, triangle), increasing.
    births: Vec<(u32, u32)>,
    /// (death, triangle), increasing.
    deaths: Vec<(u32, u32)>,
    rank: Option<u32>,
    triangles: Vec<u32>,
    appearing: Vec<u32>,
    merged: Vec<u32>,
}

impl ActiveSet {
    /// The set of `spectrum`, still empty.
    pub(super) fn new(spectrum: &Spectrum) -> Self {
        let lifetimes: Vec<(u32, u32)> =
            spectrum.triangles.iter().map(|t| (t.birth, t.death)).collect();
        let sorted = |rank_of: fn(&Triangle) -> u32| {
            let mut list: Vec<(u32, u32)> =
                spectrum.triangles.iter().zip(0..).map(|(t, i)| (rank_of(t), i)).collect();
            list.sort_unstable();
            list
        };
        ActiveSet {
            tree: IntervalTree::new(&lifetimes),
            births: sorted(|t| t.birth),
            deaths: sorted(|t| t.death),
            rank: None,
            triangles: Vec::new(),
            appearing: Vec::new(),
            merged: Vec::new(),
        }
    }

    /// Moves to `rank` and returns the indices of the triangles alive there, increasing.
    /// `spectrum` must be the one the set was made for.
    pub(super) fn move_to(&mut self, spectrum: &Spectrum, rank: u32) -> &[u32] {
        let between = |list: &[(u32, u32)], low: u32, high: u32| {
            list.partition_point(|&(r, _)| r <= low)..list.partition_point(|&(r, _)| r <= high)
        };
        let changes = match self.rank {
            Some(old) if old == rank => return &self.triangles,
            Some(old) if old < rank => &self.births[between(&self.births, old, rank)],
            Some(old) => &self.deaths[between(&self.deaths, rank, old)],
            None => &self.births[..],
        };
        let alive = |i: u32| {
            let t = &spectrum.triangles[i as usize];
            t.birth <= rank && rank < t.death
        };
        if self.rank.is_some() && changes.len() <= self.triangles.len() / 4 {
            self.appearing.clear();
            self.appearing.extend(changes.iter().map(|&(_, i)| i).filter(|&i| alive(i)));
            self.appearing.sort_unstable();
            self.triangles.retain(|&i| alive(i));
            merge(&self.triangles, &self.appearing, &mut self.merged);
            std::mem::swap(&mut self.triangles, &mut self.merged);
        } else {
            self.triangles.clear();
            self.tree.stab(rank, |i| self.triangles.push(i));
            self.triangles.sort_unstable();
        }
        self.rank = Some(rank);
        &self.triangles
    }
}

/// Merges two increasing lists without common elements.
fn merge(a: &[u32], b: &[u32], merged: &mut Vec<u32>) {
    merged.clear();
    let mut a = a.iter().copied().peekable();
    for &next in b {
        while let Some(i) = a.next_if(|&i| i < next) {
            merged.push(i);
        }
        merged.push(next);
    }
    merged.extend(a);
}
