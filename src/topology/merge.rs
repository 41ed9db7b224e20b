//! Join and split tree: how the components of {f <= c} and of {f > c} merge along the isovalue.
//!
//! # Theory
//!
//! The components of {f <= c} change at two kinds of critical points only: a minimum starts one, a
//! saddle of index 1 may join two (Morse theory; the field is generic). So a sweep needs no
//! sorted samples: every sample belongs, from its own value on, to the component of the minimum
//! at which a walk along falling lattice edges ends, and every saddle has one sample in each of
//! the regions that meet in it. The sweep is a union-find over the minima, one step per saddle.
//! The components of {f > c} are the same for -f, swept downwards.
//!
//! The *representative* of a component is its first node in sweep order: its lowest minimum, or its
//! highest maximum. When two components merge, the elder representative remains (elder rule).
//!
//! Nodes are indices into the ascending list of all critical points, including the layer around the
//! volume as one point (see `critical`). "At time t" means: nodes 0..t are below the isovalue.
//!
//! # Invariants
//!
//! Along a chain of parents the times of absorption ascend in sweep order; `next` of a node follows
//! it in sweep order; exactly one node (the last) has no `next`.

use super::critical::CriticalPoint;
use crate::disjoint_sets::DisjointSets;
use crate::error::{Error, Result};

/// No node.
pub(super) const NONE: u32 = u32::MAX;

/// The direction of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    /// Ascending: components of {f <= c}.
    Up,
    /// Descending: components of {f > c}.
    Down,
}

impl Direction {
    /// The index of the critical points that start a component, and of those that may join two.
    fn indices(self) -> (u8, u8) {
        match self {
            Direction::Up => (0, 1),
            Direction::Down => (3, 2),
        }
    }

    /// Whether a component starts at a critical point.
    pub(super) fn starts_at(self, point: &CriticalPoint) -> bool {
        point.index == self.indices().0
    }

    /// The sample of a point at which a component starts.
    pub(super) fn own_sample(self, point: &CriticalPoint) -> u32 {
        self.sectors(point)[0]
    }

    /// Whether node `a` comes before node `b`.
    fn before(self, a: u32, b: u32) -> bool {
        match self {
            Direction::Up => a < b,
            Direction::Down => a > b,
        }
    }

    /// The samples next to a critical point on the side that has been swept.
    fn sectors(self, point: &CriticalPoint) -> [u32; 2] {
        match self {
            Direction::Up => point.low,
            Direction::Down => point.high,
        }
    }
}

/// The history of the components of one side.
#[derive(Clone, Debug)]
pub(super) struct MergeTree {
    direction: Direction,
    /// Per sample of the padded grid: the extremum (node) at which its walk ends.
    extremum: Vec<u32>,
    /// Per extremum: the representative that absorbed it, or [`NONE`].
    parent: Vec<u32>,
    /// Per extremum: the node at which it was absorbed, or [`NONE`].
    absorbed_at: Vec<u32>,
    /// Per node: the representative of its component after the sweep has passed it.
    pub(super) representative: Vec<u32>,
    /// Per node: the next node, in sweep order, of its component.
    pub(super) next: Vec<u32>,
    /// Per node: number of components that meet in it.
    pub(super) n_children: Vec<u8>,
    /// Nodes by representative, ascending: those of `r` are `members[first[r]..first[r + 1]]`.
    members: Vec<u32>,
    first: Vec<u32>,
}

impl MergeTree {
    /// Sweeps over all nodes. `walk` holds, per sample of the padded grid, a neighbour that comes
    /// before it in sweep order, or the sample itself where it is an extremum.
    ///
    /// # Errors
    ///
    /// [`Error::Internal`] for a walk without an end, and for components that do not merge.
    pub(super) fn sweep(
        direction: Direction,
        points: &[CriticalPoint],
        walk: Vec<u32>,
    ) -> Result<Self> {
        let extremum = extremum_of_each_sample(direction, points, walk)?;
        Self::of_extrema(direction, points, extremum)
    }

    /// Sweeps over nodes whose samples are already replaced by the nodes of the extrema at which their walks end.
    pub(super) fn of_nodes(direction: Direction, points: &[CriticalPoint]) -> Result<Self> {
        Self::of_extrema(direction, points, (0..points.len() as u32).collect())
    }

    fn of_extrema(
        direction: Direction,
        points: &[CriticalPoint],
        extremum: Vec<u32>,
    ) -> Result<Self> {
        let n = points.len();
        let mut tree = MergeTree {
            direction,
            extremum,
            parent: vec![NONE; n],
            absorbed_at: vec![NONE; n],
            representative: vec![NONE; n],
            next: vec![NONE; n],
            n_children: vec![0; n],
            members: Vec::new(),
            first: Vec::new(),
        };
        tree.run(points)?;
        tree.group_by_representative();
        Ok(tree)
    }

    fn run(&mut self, points: &[CriticalPoint]) -> Result<()> {
        let n = points.len() as u32;
        let (start, join) = self.direction.indices();
        // The elder of two nodes represents both.
        let mut union = DisjointSets::new(points.len());
        let mut latest = vec![NONE; points.len()];
        let mut n_components = 0u32;
        for step in 0..n {
            let i = if self.direction == Direction::Up { step } else { n - 1 - step };
            let point = &points[i as usize];
            let mut elder = i;
            if point.index == start {
                n_components += 1;
            } else {
                let [a, b] = self.direction.sectors(point);
                elder = union.find(self.extremum[a as usize]);
                let other =
                    if point.index == join { union.find(self.extremum[b as usize]) } else { elder };
                self.connect(&latest, elder, i)?;
                if other != elder {
                    self.connect(&latest, other, i)?;
                    let younger = if self.direction.before(elder, other) { other } else { elder };
                    elder = elder ^ other ^ younger;
                    self.parent[younger as usize] = elder;
                    self.absorbed_at[younger as usize] = i;
                    union.absorb(elder, younger);
                    n_components -= 1;
                }
            }
            self.representative[i as usize] = elder;
            latest[elder as usize] = i;
        }
        if n_components != 1 {
            return Err(Error::internal(format!(
                "{n_components} components are left after the {:?} sweep, expected 1",
                self.direction
            )));
        }
        Ok(())
    }

    /// Connects the component of `representative` to node `i`.
    fn connect(&mut self, latest: &[u32], representative: u32, i: u32) -> Result<()> {
        let previous = latest[representative as usize];
        if previous == NONE {
            return Err(Error::internal(format!(
                "node {i} touches a component that the {:?} sweep has not met",
                self.direction
            )));
        }
        self.next[previous as usize] = i;
        self.n_children[i as usize] += 1;
        Ok(())
    }

    /// Counting sort of the nodes by representative; stable, so nodes stay ascending.
    fn group_by_representative(&mut self) {
        let n = self.representative.len();
        let mut first = vec![0u32; n + 1];
        for &r in &self.representative {
            first[r as usize + 1] += 1;
        }
        for i in 0..n {
            first[i + 1] += first[i];
        }
        let mut fill = first.clone();
        let mut members = vec![0u32; n];
        for (i, &r) in self.representative.iter().enumerate() {
            members[fill[r as usize] as usize] = i as u32;
            fill[r as usize] += 1;
        }
        self.first = first;
        self.members = members;
    }

    /// The representative, at time `t`, of the component that contains `sample` (padded grid).
    /// The sample must be on the side of the sweep: below the isovalue (Up), or above it (Down).
    pub(super) fn representative_at(&self, sample: u32, t: u32) -> u32 {
        let mut r = self.extremum[sample as usize];
        while self.parent[r as usize] != NONE && self.has_happened(self.absorbed_at[r as usize], t)
        {
            r = self.parent[r as usize];
        }
        r
    }

    /// The node at which an extremum was absorbed by an older one; none for the oldest and for
    /// other nodes.
    pub(super) fn absorbed_at(&self, extremum: u32) -> Option<u32> {
        let node = self.absorbed_at[extremum as usize];
        (node != NONE).then_some(node)
    }

    /// Whether the sweep has passed `node` at time `t`.
    fn has_happened(&self, node: u32, t: u32) -> bool {
        match self.direction {
            Direction::Up => node < t,
            Direction::Down => node >= t,
        }
    }

    /// The last node of the component of `representative` at time `t`.
    pub(super) fn latest_node(&self, representative: u32, t: u32) -> Option<u32> {
        let range = self.first[representative as usize] as usize
            ..self.first[representative as usize + 1] as usize;
        let members = &self.members[range];
        let n_below = members.partition_point(|&m| m < t);
        match self.direction {
            Direction::Up => members[..n_below].last().copied(),
            Direction::Down => members[n_below..].first().copied(),
        }
    }
}

/// Follows every walk to its end. The top bit marks nodes of extrema during this.
fn extremum_of_each_sample(
    direction: Direction,
    points: &[CriticalPoint],
    mut walk: Vec<u32>,
) -> Result<Vec<u32>> {
    const NODE: u32 = 1 << 31;
    let endless = || Error::internal("a walk along the lattice does not end at an extremum");
    for (i, point) in points.iter().enumerate() {
        if point.index == direction.indices().0 {
            let [sample, _] = direction.sectors(point);
            walk[sample as usize] = NODE | i as u32;
        }
    }
    let mut path = Vec::new();
    for sample in 0..walk.len() {
        let mut s = sample;
        while walk[s] & NODE == 0 {
            if walk[s] as usize == s {
                return Err(endless());
            }
            path.push(s);
            s = walk[s] as usize;
        }
        let end = walk[s];
        for s in path.drain(..) {
            walk[s] = end;
        }
    }
    for end in &mut walk {
        *end &= !NODE;
    }
    Ok(walk)
}
