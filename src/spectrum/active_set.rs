//! The triangles alive at one rank, in order, kept up to date as the rank moves.
//!
//! A jump queries the interval tree. A small move instead reads two lists of all triangles, sorted by
//! birth and by death, between the old and the new rank.
//! Either way the result is the list of active triangles by index, so the result of a query depends
//! on the isovalue alone, not on the queries before it.

use super::elements::Triangle;
use super::index_set::IndexSet;
use super::interval_tree::IntervalTree;

/// The active triangles of a spectrum.
#[derive(Clone, Debug)]
pub struct ActiveSet {
    tree: IntervalTree,
    /// (birth, death, triangle), increasing.
    births: Vec<(u32, u32, u32)>,
    /// (death, birth, triangle), increasing.
    deaths: Vec<(u32, u32, u32)>,
    rank: Option<u32>,
    alive: IndexSet,
    /// The elements of `alive`.
    triangles: Vec<u32>,
}

impl ActiveSet {
    /// The set of `triangles`, still empty.
    pub fn new(triangles: &[Triangle]) -> Self {
        let lifetimes: Vec<(u32, u32)> = triangles.iter().map(|t| (t.birth, t.death)).collect();
        let sorted = |entry: fn(&Triangle, u32) -> (u32, u32, u32)| {
            let mut list: Vec<_> = triangles.iter().zip(0..).map(|(t, i)| entry(t, i)).collect();
            list.sort_unstable();
            list
        };
        ActiveSet {
            tree: IntervalTree::new(&lifetimes),
            births: sorted(|t, i| (t.birth, t.death, i)),
            deaths: sorted(|t, i| (t.death, t.birth, i)),
            rank: None,
            alive: IndexSet::new(triangles.len()),
            triangles: Vec::new(),
        }
    }

    /// The indices of the triangles alive at the last rank, increasing.
    pub fn triangles(&self) -> &[u32] {
        &self.triangles
    }

    /// Moves to `rank` and returns the indices of the triangles alive there, increasing.
    pub fn move_to(&mut self, rank: u32) -> &[u32] {
        if self.rank == Some(rank) {
            return &self.triangles;
        }
        let old = self.rank.replace(rank);
        let between = |list: &[(u32, u32, u32)], low: u32, high: u32| {
            list.partition_point(|&(r, ..)| r <= low)..list.partition_point(|&(r, ..)| r <= high)
        };
        let (low, high) = (old.unwrap_or(0).min(rank), old.unwrap_or(0).max(rank));
        let births = &self.births[between(&self.births, low, high)];
        let deaths = &self.deaths[between(&self.deaths, low, high)];
        if old.is_none() || births.len() + deaths.len() > self.triangles.len() {
            self.alive.clear();
            self.tree.stab(rank, |triangle| self.alive.insert(triangle));
        } else if rank == high {
            // A triangle that is born and dies in between is in neither of the two.
            let dying = deaths.iter().filter(|(_, birth, _)| *birth <= low);
            dying.for_each(|&(.., triangle)| self.alive.remove(triangle));
            let born = births.iter().filter(|(_, death, _)| *death > high);
            born.for_each(|&(.., triangle)| self.alive.insert(triangle));
        } else {
            let unborn = births.iter().filter(|(_, death, _)| *death > high);
            unborn.for_each(|&(.., triangle)| self.alive.remove(triangle));
            let back = deaths.iter().filter(|(_, birth, _)| *birth <= low);
            back.for_each(|&(.., triangle)| self.alive.insert(triangle));
        }
        self.triangles.clear();
        self.alive.each(|triangle| self.triangles.push(triangle));
        &self.triangles
    }
}
