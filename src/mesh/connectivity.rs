//! A mesh as arrays, for kernels.

/// The connectivity of a closed mesh, constant while kernels run.
#[derive(Clone, Debug, Default)]
pub struct Connectivity {
    /// Vertices of each face, counter-clockwise seen from lower values.
    pub faces: Vec<[u32; 3]>,
    /// Start of each vertex's one-ring in `ring`, and the end: one more than there are vertices.
    pub ring_offsets: Vec<u32>,
    /// Neighbours of each vertex, counter-clockwise, so that `(ring[i], ring[i + 1])` and the vertex
    /// form a face.
    pub ring: Vec<u32>,
    /// Per vertex: not 0 if it is constrained, that is neither projected nor relaxed.
    pub constrained: Vec<u8>,
}

impl Connectivity {
    /// Appends another mesh, its vertices numbered after those of this one.
    pub(crate) fn append(&mut self, other: &Connectivity) {
        let n = self.constrained.len() as u32;
        if self.ring_offsets.is_empty() {
            self.ring_offsets.push(0);
        }
        let n_ring = self.ring.len() as u32;
        self.faces.extend(other.faces.iter().map(|f| f.map(|v| v + n)));
        self.ring_offsets.extend(other.ring_offsets.iter().skip(1).map(|o| o + n_ring));
        self.ring.extend(other.ring.iter().map(|r| r + n));
        self.constrained.extend(&other.constrained);
    }
}
