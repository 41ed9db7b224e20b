//! The triangles alive at one rank, as a list of which a move touches only what changes.
//!
//! Two cursors stand in two lists of all triangles, sorted by birth and by death; a move of the
//! rank takes them over the triangles that are born and die on the way (Shen et al. 1996,
//! "Isosurfacing in span space", sweep). A triangle that dies leaves its place to the last of the
//! list. So a small move costs what it changes, however many are alive; where more is passed over
//! than is alive, the interval tree is asked instead.
//!
//! The order of the list depends on the moves before. For drawing that is no matter; where the
//! order is seen, an [`ActiveSet`](super::ActiveSet) keeps it.
//!
//! # Invariants
//!
//! `places[t]` is where triangle `t` stands in `triangles`, or [`ABSENT`]; `born` and `dead` are the
//! numbers of entries of `births` and `deaths` at or below the rank.

use super::Triangle;
use super::interval_tree::IntervalTree;

/// Place of a triangle that is not alive.
const ABSENT: u32 = u32::MAX;

/// The living triangles of a spectrum, in no particular order.
#[derive(Clone, Debug)]
pub struct LiveList {
    tree: IntervalTree,
    /// (birth, death, triangle) by birth.
    births: Vec<(u32, u32, u32)>,
    /// (death, birth, triangle) by death.
    deaths: Vec<(u32, u32, u32)>,
    born: usize,
    dead: usize,
    rank: Option<u32>,
    triangles: Vec<u32>,
    places: Vec<u32>,
}

impl LiveList {
    /// The list of `triangles`, still empty.
    pub fn new(triangles: &[Triangle]) -> Self {
        let lifetimes: Vec<(u32, u32)> = triangles.iter().map(|t| (t.birth, t.death)).collect();
        let sorted = |entry: fn(&Triangle, u32) -> (u32, u32, u32)| {
            let mut list: Vec<_> = triangles.iter().zip(0..).map(|(t, i)| entry(t, i)).collect();
            list.sort_unstable();
            list
        };
        LiveList {
            tree: IntervalTree::new(&lifetimes),
            births: sorted(|t, i| (t.birth, t.death, i)),
            deaths: sorted(|t, i| (t.death, t.birth, i)),
            born: 0,
            dead: 0,
            rank: None,
            triangles: Vec::new(),
            places: vec![ABSENT; triangles.len()],
        }
    }

    /// Moves to `rank` and returns the indices of the triangles alive there.
    pub fn move_to(&mut self, rank: u32) -> &[u32] {
        if self.rank == Some(rank) {
            return &self.triangles;
        }
        let born = self.births.partition_point(|&(birth, ..)| birth <= rank);
        let dead = self.deaths.partition_point(|&(death, ..)| death <= rank);
        let passed = born.abs_diff(self.born) + dead.abs_diff(self.dead);
        match self.rank {
            Some(old) if passed <= self.triangles.len() => {
                if old < rank {
                    self.go_up(born, dead, rank);
                } else {
                    self.go_down(born, dead, rank);
                }
            }
            _ => self.jump(rank),
        }
        (self.born, self.dead, self.rank) = (born, dead, Some(rank));
        &self.triangles
    }

    fn go_up(&mut self, born: usize, dead: usize, rank: u32) {
        // The dying leave first, so that the list stays as short as it can.
        for at in self.dead..dead {
            self.remove(self.deaths[at].2);
        }
        for at in self.born..born {
            let (_, death, triangle) = self.births[at];
            if death > rank {
                self.add(triangle);
            }
        }
    }

    fn go_down(&mut self, born: usize, dead: usize, rank: u32) {
        for at in born..self.born {
            self.remove(self.births[at].2);
        }
        for at in dead..self.dead {
            let (_, birth, triangle) = self.deaths[at];
            if birth <= rank {
                self.add(triangle);
            }
        }
    }

    fn jump(&mut self, rank: u32) {
        for &triangle in &self.triangles {
            self.places[triangle as usize] = ABSENT;
        }
        self.triangles.clear();
        self.tree.stab(rank, |triangle| self.triangles.push(triangle));
        for (&triangle, place) in self.triangles.iter().zip(0..) {
            self.places[triangle as usize] = place;
        }
    }

    fn add(&mut self, triangle: u32) {
        self.places[triangle as usize] = self.triangles.len() as u32;
        self.triangles.push(triangle);
    }

    /// Takes a triangle out, if it is in: one that was born and dies within a move never was.
    fn remove(&mut self, triangle: u32) {
        let place = std::mem::replace(&mut self.places[triangle as usize], ABSENT);
        if place == ABSENT {
            return;
        }
        self.triangles.swap_remove(place as usize);
        if let Some(&moved) = self.triangles.get(place as usize) {
            self.places[moved as usize] = place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever the moves, the list holds exactly the triangles whose lifetime holds the rank.
        #[test]
        fn any_moves_lead_to_the_triangles_alive(
            lifetimes in prop::collection::vec((0u32..60, 1u32..30), 0..200),
            ranks in prop::collection::vec(0u32..100, 1..30),
        ) {
            let triangles: Vec<Triangle> = lifetimes
                .iter()
                .map(|&(birth, length)| Triangle {
                    vertices: [0, 1, 2],
                    birth,
                    death: birth + length,
                    cap: false,
                })
                .collect();
            let mut list = LiveList::new(&triangles);
            for rank in ranks {
                let mut found = list.move_to(rank).to_vec();
                found.sort_unstable();
                let expected: Vec<u32> = (0..)
                    .zip(&triangles)
                    .filter(|(_, t)| t.birth <= rank && rank < t.death)
                    .map(|(i, _)| i)
                    .collect();
                prop_assert_eq!(found, expected);
            }
        }
    }
}
