//! How crowded with faces a mesh is, and what follows from it.
//!
//! A smooth isosurface takes 0.6 faces per square voxel at the usual tolerance, marching cubes 2.2. Where samples
//! of few bits make terraces, or noise makes dents in every cell, no mesh of good triangles keeps within the
//! tolerance: each step refines it, and it ends denser than the exact extraction and no nearer to the isosurface.
//! So the tolerance grows with what a mesh takes: a crowded one refines less and steps farther, and goes on as
//! a coarser one. Where even that takes too many faces it is given up, and the exact extraction shows.

use crate::mesh::Mesh;

/// Up to so many faces per square voxel a mesh keeps its tolerance.
const UNCROWDED: f32 = 1.0;

/// The tolerance grows by so many of its own for each face per square voxel beyond that.
const GROWTH: f32 = 2.15;

/// The most by which it grows.
const MOST: f32 = 4.0;

/// A mesh with more faces per square voxel is too dense: its tolerance is 2.3 times the one that was asked for, and
/// the exact extraction has hardly worse triangles than it would have with a larger one.
const TOO_DENSE: f32 = 1.6;

/// More faces per square voxel than this are too many for a fresh mesh. It keeps the tolerance, and has fewer
/// once it is under way.
const TOO_DENSE_AT_FIRST: f32 = 2.3;

/// Meshes of up to so many faces take as many as they need; up to the second number their crowding counts in
/// part.
const SMALL: (usize, usize) = (2_500, 5_000);

/// By how much the tolerance of a mesh grows, 1 to [`MOST`].
pub(super) fn coarseness(mesh: &Mesh) -> f32 {
    let size = (mesh.n_faces() as f32 - SMALL.0 as f32) / (SMALL.1 - SMALL.0) as f32;
    if size <= 0.0 {
        return 1.0;
    }
    coarseness_of(mesh.n_faces() as f32 / mesh.area().max(1e-6), size)
}

/// The same of a mesh of so many faces per square voxel, whose crowding counts by a share of at most 1.
fn coarseness_of(density: f32, share: f32) -> f32 {
    1.0 + share.min(1.0) * (GROWTH * (density - UNCROWDED)).clamp(0.0, MOST - 1.0)
}

/// Whether a mesh on its way takes too many faces.
pub(super) fn is_too_dense(mesh: &Mesh) -> bool {
    has_more_faces(mesh, TOO_DENSE)
}

/// Whether a mesh has so many faces from the beginning that it will not come far.
pub(super) fn begins_too_dense(mesh: &Mesh) -> bool {
    has_more_faces(mesh, TOO_DENSE_AT_FIRST)
}

/// Whether so many faces are too many for any mesh but one with fewer before: smaller ones may have as many as they
/// need.
pub(super) fn is_small(n_faces: usize) -> bool {
    n_faces <= SMALL.1
}

/// Whether a mesh, if it is not small, has more faces per square voxel.
fn has_more_faces(mesh: &Mesh, per_area: f32) -> bool {
    !is_small(mesh.n_faces()) && mesh.n_faces() as f32 > per_area * mesh.area()
}
