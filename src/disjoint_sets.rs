//! Disjoint sets of numbers (union-find with path halving).

/// Sets of the numbers from 0, each with a representative.
#[derive(Debug)]
pub(crate) struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// `n` sets of one member.
    pub(crate) fn new(n: usize) -> Self {
        DisjointSets { parents: (0..n as u32).collect() }
    }

    /// Adds a set of one member, the next number.
    pub(crate) fn push(&mut self) {
        self.parents.push(self.parents.len() as u32);
    }

    /// The representative of a member's set.
    pub(crate) fn find(&mut self, mut x: u32) -> u32 {
        while self.parents[x as usize] != x {
            let grandparent = self.parents[self.parents[x as usize] as usize];
            self.parents[x as usize] = grandparent;
            x = grandparent;
        }
        x
    }

    /// Unites the sets of two members; the smaller of their representatives represents the union. Returns whether
    /// they were different sets. As long as only this method unites sets, the smallest member represents each.
    pub(crate) fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.absorb(a.min(b), a.max(b));
        a != b
    }

    /// Unites two sets, given by their representatives; `elder` represents the union.
    pub(crate) fn absorb(&mut self, elder: u32, younger: u32) {
        self.parents[younger as usize] = elder;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_united_once_and_the_smallest_or_the_elder_represents_them() {
        let mut sets = DisjointSets::new(4);
        sets.push();
        assert!(sets.join(3, 1) && sets.join(4, 3));
        assert!(!sets.join(1, 4), "they are in one set already");
        assert_eq!([0, 1, 2, 3, 4].map(|x| sets.find(x)), [0, 1, 2, 1, 1]);
        sets.absorb(2, 1);
        assert_eq!([0, 1, 2, 3, 4].map(|x| sets.find(x)), [0, 2, 2, 2, 2]);
    }
}
