//! What a file of a mesh has.

use crate::spectrum::Mesh;

/// The numbers of vertices and triangles in a file, which are fewer than those of the mesh where STL welds vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Written {
    /// The number of vertices with different positions in STL, else of the mesh.
    pub n_vertices: usize,
    /// The number of triangles.
    pub n_triangles: usize,
}

impl Written {
    /// All of a mesh.
    pub(super) fn of(mesh: &Mesh) -> Self {
        Written { n_vertices: mesh.positions.len(), n_triangles: mesh.triangles.len() }
    }
}
