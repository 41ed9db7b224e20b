//! Meshes for the tests of several modules.

use glam::Vec3;

use super::half_edge::HalfEdgeMesh;

/// An octahedron, counter-clockwise seen from outside, with vertices at `radius` from its middle in
/// both directions along each axis.
pub(crate) fn octahedron(middle: Vec3, radius: f32) -> HalfEdgeMesh {
    let positions = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z]
        .map(|p| (middle + radius * p).to_array());
    let triangles =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    HalfEdgeMesh::from_triangles(&positions, &[false; 6], &triangles, &[false; 8]).expect("closed")
}
