//! A set of vertices, one bit for each vertex that exists.

const BITS: u64 = u64::BITS as u64;

/// A set of vertices by number.
#[derive(Clone, Debug)]
pub(super) struct VertexSet(Vec<u64>);

impl VertexSet {
    /// The empty set of numbers below `n`.
    pub(super) fn new(n: u64) -> Self {
        VertexSet(vec![0; n.div_ceil(BITS) as usize])
    }

    pub(super) fn insert(&mut self, vertex: u64) {
        self.0[(vertex / BITS) as usize] |= 1 << (vertex % BITS);
    }

    pub(super) fn len(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// The number of vertices that are in both.
    pub(super) fn n_common(&self, other: &VertexSet) -> u64 {
        self.0.iter().zip(&other.0).map(|(a, b)| u64::from((a & b).count_ones())).sum()
    }
}
