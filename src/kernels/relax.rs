//! Tangential relaxation (thesis section 3.5). Twin: `shaders/relax.wgsl`.
//!
//! # Theory
//!
//! The umbrella operator L is the mean of a vertex' spokes; only its tangential part
//! T = L - <L, n> n moves the vertex, so that the mesh does not shrink (Wood et al. 2000). A move
//! still leaves a curved isosurface, so each one ends with a projection by the rule of
//! [`crate::field::step`]. Two guards keep a vertex on its own sheet: no move is longer than half its
//! shortest edge, and at the new position the field must fall along the vertex' own normal, because the
//! nearest wrong sheet always faces the other way. A vertex that fails either keeps its position.

use super::normals::one_ring;
use crate::field::step::{onto_isosurface, unit};
use crate::field::{Field, Status};
use crate::mesh::Connectivity;
use glam::Vec3;

/// Longest move of one iteration, as a multiple of the vertex' shortest edge.
pub const MAX_MOVE: f32 = 0.5;

/// The tangential force on a vertex, and the length of its shortest edge, voxels.
#[inline]
pub fn force(
    connectivity: &Connectivity,
    positions: &[Vec3],
    normal: Vec3,
    v: usize,
) -> (Vec3, f32) {
    let p = positions[v];
    let ring = one_ring(connectivity, v);
    if connectivity.constrained[v] != 0 || ring.is_empty() {
        return (Vec3::ZERO, 0.0);
    }
    let mut sum = Vec3::ZERO;
    let mut shortest = f32::MAX;
    for &neighbour in ring {
        let spoke = positions[neighbour as usize] - p;
        shortest = shortest.min(spoke.length());
        sum += spoke;
    }
    let n = unit(normal);
    let umbrella = sum / ring.len() as f32;
    (umbrella - n * umbrella.dot(n), shortest)
}

/// The position of a vertex after one iteration, and the length of the force on it before, voxels.
pub fn relaxed(
    field: &Field,
    connectivity: &Connectivity,
    positions: &[Vec3],
    normal: Vec3,
    v: usize,
    isovalue: f32,
    strength: f32,
) -> (Vec3, f32) {
    let p = positions[v];
    let (tangential, shortest) = force(connectivity, positions, normal, v);
    let size = tangential.length();
    let move_length = (strength * size).min(MAX_MOVE * shortest);
    if !(move_length > 0.0 && shortest < f32::MAX) {
        return (p, size);
    }
    let off = p + tangential * (move_length / size);
    let (q, status) = onto_isosurface(field, off, normal, isovalue, shortest);
    let point = field.locate(q);
    let faces_along = field.gradient_in(point).dot(normal) <= 0.0;
    if status == Status::Failed || !faces_along { (p, size) } else { (q, size) }
}
