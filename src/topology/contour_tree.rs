//! The contour tree: every isosurface component over the range of isovalues in which it exists.
//!
//! # Theory
//!
//! Join tree and split tree together determine the contour tree (Carr, Snoeyink, Axen,
//! "Computing contour trees in all dimensions", 2003): a node with no upward branch left and one
//! downward branch is a leaf, whose arc ends at the next node of its component of {f > c}. Remove it
//! from both trees, and repeat. Here every critical point is a node, also those where only a handle
//! opens or closes, so the Euler characteristic of a component is constant on an arc.
//!
//! At a node of index i the sum over the arcs above minus the sum over the arcs below is
//! 2 (-1)^i: the boundary of {f <= c} has twice its Euler characteristic, and a critical point
//! of index i adds (-1)^i to the latter. When a leaf is removed all its other arcs are known, so
//! this equation gives the remaining one.
//!
//! The volume is simply connected, so each component separates it, and the contour tree is a tree.
//!
//! # Invariants
//!
//! Checked: there is one arc less than nodes; the equation of the last node holds; every Euler
//! characteristic is even and at most 2.

use super::critical::CriticalPoint;
use super::merge::{Direction, MergeTree, NONE};
use crate::error::{Error, Result};

/// The contour tree, rooted at an arbitrary node. Arcs are named by the child.
#[derive(Clone, Debug)]
pub(super) struct ContourTree {
    /// Per node: its parent; [`NONE`] for the root.
    pub(super) parent: Vec<u32>,
    /// Per node: number of arcs to the root.
    pub(super) depth: Vec<u32>,
    /// Per node: the Euler characteristic of the component on the arc to its parent.
    pub(super) euler: Vec<i64>,
}

impl ContourTree {
    /// Combines the two trees.
    ///
    /// # Errors
    ///
    /// [`Error::Internal`] if an invariant of the module is violated.
    pub(super) fn combine(
        points: &[CriticalPoint],
        join: &MergeTree,
        split: &MergeTree,
    ) -> Result<Self> {
        let n = points.len();
        let mut below = Branches::new(join);
        let mut above = Branches::new(split);
        let mut tree = ContourTree { parent: vec![NONE; n], depth: vec![0; n], euler: vec![0; n] };
        let mut residual: Vec<i64> =
            points.iter().map(|p| if p.index % 2 == 0 { 2 } else { -2 }).collect();
        let mut removed = vec![false; n];
        let is_leaf = |below: &Branches, above: &Branches, i: u32| {
            below.n_children[i as usize] + above.n_children[i as usize] == 1
        };
        let mut order: Vec<u32> = Vec::with_capacity(n);
        order.extend((0..n as u32).filter(|&i| is_leaf(&below, &above, i)));
        let mut done = 0;
        while done < order.len() && done + 1 < n {
            let i = order[done];
            done += 1;
            removed[i as usize] = true;
            let upper_leaf = above.n_children[i as usize] == 0;
            let (neighbour, euler) = if upper_leaf {
                (above.next_remaining(i, &removed), -residual[i as usize])
            } else {
                (below.next_remaining(i, &removed), residual[i as usize])
            };
            if neighbour == NONE {
                return Err(Error::internal(format!(
                    "node {i} has no neighbour in the contour tree"
                )));
            }
            if euler > 2 || euler % 2 != 0 {
                return Err(Error::internal(format!(
                    "a closed surface between nodes {i} and {neighbour} has Euler characteristic {euler}"
                )));
            }
            tree.parent[i as usize] = neighbour;
            tree.euler[i as usize] = euler;
            let side = if upper_leaf { &mut above } else { &mut below };
            side.n_children[neighbour as usize] -= 1;
            residual[neighbour as usize] += if upper_leaf { -euler } else { euler };
            if is_leaf(&below, &above, neighbour) {
                order.push(neighbour);
            }
        }
        if done + 1 != n {
            return Err(Error::internal(format!(
                "the contour tree has {done} arcs, expected {}",
                n - 1
            )));
        }
        let root = (0..n).find(|&i| !removed[i]).unwrap_or(0);
        if residual[root] != 0 {
            return Err(Error::internal(format!(
                "the alternating sum of the critical points is off by {}",
                residual[root] / 2
            )));
        }
        for &i in order[..done].iter().rev() {
            tree.depth[i as usize] = tree.depth[tree.parent[i as usize] as usize] + 1;
        }
        Ok(tree)
    }

    /// Per node, the shallowest node of its component of one side after the sweep has passed it.
    pub(super) fn shallowest(&self, side: &MergeTree, direction: Direction) -> Vec<u32> {
        let n = self.parent.len();
        let mut shallowest: Vec<u32> = (0..n as u32).collect();
        for step in 0..n {
            let i = if direction == Direction::Up { step } else { n - 1 - step };
            let next = side.next[i];
            if next != NONE {
                let (mine, theirs) = (shallowest[i], shallowest[next as usize]);
                if self.depth[mine as usize] < self.depth[theirs as usize] {
                    shallowest[next as usize] = mine;
                }
            }
        }
        shallowest
    }
}

/// One of the two trees during the removal of nodes.
struct Branches {
    /// `next`, shortened past removed nodes.
    next: Vec<u32>,
    n_children: Vec<u8>,
}

impl Branches {
    fn new(side: &MergeTree) -> Self {
        Branches { next: side.next.clone(), n_children: side.n_children.clone() }
    }

    /// The next node of the component of `i` that has not been removed. Removed nodes on the way
    /// have one child each, so they can be bypassed.
    fn next_remaining(&mut self, i: u32, removed: &[bool]) -> u32 {
        let mut end = self.next[i as usize];
        while end != NONE && removed[end as usize] {
            end = self.next[end as usize];
        }
        let mut s = i;
        while s != end {
            s = std::mem::replace(&mut self.next[s as usize], end);
        }
        end
    }
}
