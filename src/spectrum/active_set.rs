//! The triangles alive at one rank, kept up to date as the rank moves.
//!
//! A jump asks the interval tree. A small move instead reads two lists of all triangles, sorted by
//! birth and by death, only between the old and the new rank (design: tracking, active-set query).
//! Either way the result is the list of active triangles by index, so what a query returns depends
//! on the isovalue alone, never on the queries before it.

use super::Triangle;
use super::interval_tree::IntervalTree;

/// The active triangles of a spectrum.
#[derive(Clone, Debug)]
pub struct ActiveSet {
    tree: IntervalTree,
    /// (birth, triangle), increasing.
    births: Vec<(u32, u32)>,
    /// (death, triangle), increasing.
    deaths: Vec<(u32, u32)>,
    rank: Option<u32>,
    triangles: Vec<u32>,
    appearing: Vec<u32>,
    merged: Vec<u32>,
    /// One bit per triangle, all clear between calls.
    bits: Vec<u64>,
}

impl ActiveSet {
    /// The set of `triangles`, still empty.
    pub fn new(triangles: &[Triangle]) -> Self {
        let lifetimes: Vec<(u32, u32)> = triangles.iter().map(|t| (t.birth, t.death)).collect();
        let sorted = |rank_of: fn(&Triangle) -> u32| {
            let mut list: Vec<(u32, u32)> =
                triangles.iter().zip(0..).map(|(t, i)| (rank_of(t), i)).collect();
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
            bits: vec![0; triangles.len().div_ceil(64)],
        }
    }

    /// Moves to `rank` and returns the indices of the triangles alive there, increasing.
    /// `triangles` must be those the set was made for.
    pub fn move_to(&mut self, triangles: &[Triangle], rank: u32) -> &[u32] {
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
            let t = &triangles[i as usize];
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
            sort(&mut self.triangles, &mut self.bits);
        }
        self.rank = Some(rank);
        &self.triangles
    }
}

/// Sorts a list of different triangles: by way of one bit each unless they are so few that looking
/// at all bits would cost more than comparing.
fn sort(triangles: &mut Vec<u32>, bits: &mut [u64]) {
    if bits.len() > 8 * triangles.len() {
        triangles.sort_unstable();
        return;
    }
    for &i in triangles.iter() {
        bits[i as usize / 64] |= 1 << (i % 64);
    }
    triangles.clear();
    for (word, base) in bits.iter_mut().zip((0u32..).step_by(64)) {
        while *word != 0 {
            triangles.push(base + word.trailing_zeros());
            *word &= *word - 1;
        }
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
