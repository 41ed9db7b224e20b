//! An interval tree: finds the half-open intervals of ranks that contain a given rank (thesis section 4.1).
//!
//! # Theory
//!
//! Each node has a centre and the intervals that contain it, sorted once by birth and once by death;
//! intervals wholly before or after the centre go to the children (Cignoni et al. 1997, "Speeding
//! up isosurface extraction using interval trees"). The centre halves the range of ranks, as in the
//! thesis, so the depth is at most the number of bits of a rank and a query costs
//! O(log n + reported).
//!
//! # Invariants
//!
//! `births` and `deaths` hold every interval exactly once; a node's intervals are the same range
//! of both.

/// No child.
const NONE: u32 = u32::MAX;

/// An interval tree over half-open intervals [birth, death) of ranks.
#[derive(Clone, Debug, Default)]
pub struct IntervalTree {
    nodes: Vec<Node>,
    /// (birth, interval) by node, birth increasing within a node.
    births: Vec<(u32, u32)>,
    /// (death, interval) by node, death decreasing within a node.
    deaths: Vec<(u32, u32)>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    centre: u32,
    start: u32,
    end: u32,
    before: u32,
    after: u32,
}

impl IntervalTree {
    /// The tree of intervals (birth, death) with `birth < death`; intervals are identified by their
    /// index in the slice.
    pub fn new(intervals: &[(u32, u32)]) -> Self {
        assert!(intervals.iter().all(|&(birth, death)| birth < death));
        let mut tree = IntervalTree {
            nodes: Vec::new(),
            births: Vec::with_capacity(intervals.len()),
            deaths: Vec::with_capacity(intervals.len()),
        };
        let end = intervals.iter().map(|&(_, death)| death).max().unwrap_or(0);
        tree.build(intervals, (0..intervals.len() as u32).collect(), 0, end);
        tree
    }

    /// Builds the subtree of the intervals `members`, all within [start, end).
    /// The recursion is as deep as the tree, at most 32 levels.
    fn build(&mut self, intervals: &[(u32, u32)], members: Vec<u32>, start: u32, end: u32) -> u32 {
        if members.is_empty() {
            return NONE;
        }
        let centre = start + (end - start) / 2;
        let (mut before, mut after) = (Vec::new(), Vec::new());
        let first = self.births.len();
        for member in members {
            let (birth, death) = intervals[member as usize];
            if death <= centre {
                before.push(member);
            } else if birth > centre {
                after.push(member);
            } else {
                self.births.push((birth, member));
                self.deaths.push((death, member));
            }
        }
        self.births[first..].sort_unstable();
        self.deaths[first..].sort_unstable_by(|a, b| b.cmp(a));
        let node = self.nodes.len();
        self.nodes.push(Node {
            centre,
            start: first as u32,
            end: self.births.len() as u32,
            before: NONE,
            after: NONE,
        });
        let before = self.build(intervals, before, start, centre);
        let after = self.build(intervals, after, centre + 1, end);
        self.nodes[node].before = before;
        self.nodes[node].after = after;
        node as u32
    }

    /// Calls `report` for every interval that contains `rank`, in an order that depends on the tree
    /// and on `rank` only.
    pub fn stab(&self, rank: u32, mut report: impl FnMut(u32)) {
        let mut next = if self.nodes.is_empty() { NONE } else { 0 };
        while next != NONE {
            let node = self.nodes[next as usize];
            let members = node.start as usize..node.end as usize;
            if rank < node.centre {
                let births = self.births[members].iter();
                births.take_while(|&&(birth, _)| birth <= rank).for_each(|&(_, i)| report(i));
                next = node.before;
            } else {
                let deaths = self.deaths[members].iter();
                deaths.take_while(|&&(death, _)| death > rank).for_each(|&(_, i)| report(i));
                next = if rank == node.centre { NONE } else { node.after };
            }
        }
    }
}
