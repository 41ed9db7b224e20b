//! The elements of a spectrum: knots, triangles, collapses, and a patch of them.

/// One knot of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Rank of the isovalue in [`Spectrum::isovalues`](super::Spectrum::isovalues).
    pub rank: u32,
    /// Position, voxel frame.
    pub position: [f32; 3],
}

/// One triangle: counter-clockwise seen from the outer side ([`Outside`](crate::volume::Outside)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Indices into the trajectories.
    pub vertices: [u32; 3],
    /// Rank of the isovalue from which the triangle is part of the mesh.
    pub birth: u32,
    /// Rank of the isovalue from which it no longer is; `birth < death`.
    pub death: u32,
    /// Whether the triangle only closes the mesh at the border of the volume, or is outside its mask.
    pub cap: bool,
}

/// One edge collapse: the vertex that replaces one that ends (thesis section 4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Collapse {
    /// The vertex that ends.
    pub vertex: u32,
    /// The vertex that replaces it.
    pub target: u32,
    /// Rank of the isovalue of the collapse.
    pub rank: u32,
    /// Whether the target replaces it towards higher isovalues (else towards lower ones).
    pub upward: bool,
}

/// Trajectories, triangles and collapses with a table of isovalues: the geometry of a spectrum, or of a part of one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    /// Isovalues that the ranks of this patch refer to, strictly increasing.
    pub isovalues: Vec<f64>,
    /// Start of each vertex's knots in `knots`, and the end: one more than there are vertices.
    pub first_knot: Vec<u32>,
    /// Knots by vertex; ranks refer to `isovalues` of this patch.
    pub knots: Vec<Knot>,
    /// Triangles; vertices and ranks are those of this patch.
    pub triangles: Vec<Triangle>,
    /// Collapses; vertices and ranks are those of this patch.
    pub collapses: Vec<Collapse>,
}

impl Patch {
    /// No isovalues, vertices and triangles.
    pub fn empty() -> Patch {
        Patch { first_knot: vec![0], ..Patch::default() }
    }
}
