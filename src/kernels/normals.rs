//! Area-weighted vertex normals. Twin: `shaders/normals.wgsl`.
//!
//! # Theory
//!
//! The sum of the cross products of successive spokes of the one-ring is twice the sum of the
//! adjacent faces' areas times their normals (thesis section 3.4). Faces are counter-clockwise seen
//! from lower values, so normals point to lower values.

use crate::field::step::unit;
use crate::mesh::Connectivity;
use glam::Vec3;

/// The one-ring of vertex `v`: neighbours counter-clockwise.
#[inline]
pub(crate) fn one_ring(connectivity: &Connectivity, v: usize) -> &[u32] {
    let [start, end] = [connectivity.ring_offsets[v], connectivity.ring_offsets[v + 1]];
    &connectivity.ring[start as usize..end as usize]
}

/// The unit normal of vertex `v`; zero where its faces have no area.
#[inline]
pub fn normal(connectivity: &Connectivity, positions: &[Vec3], v: usize) -> Vec3 {
    let ring = one_ring(connectivity, v);
    let Some(&last) = ring.last() else { return Vec3::ZERO };
    let p = positions[v];
    // Spokes are taken relative to the vertex: no large coordinates are multiplied.
    let mut previous = positions[last as usize] - p;
    let mut sum = Vec3::ZERO;
    for &neighbour in ring {
        let spoke = positions[neighbour as usize] - p;
        sum += previous.cross(spoke);
        previous = spoke;
    }
    unit(sum)
}
