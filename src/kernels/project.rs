//! Projection of all vertices onto the isosurface of the next isovalue (thesis section 3.4).
//! Twin: `shaders/project.wgsl`. A free vertex moves by [`crate::field::step`], a constrained one as here.

use glam::Vec3;

/// Where a constrained vertex at `p` is after a share of its way to `end`.
#[inline]
pub fn constrained_at(p: Vec3, end: Vec3, share: f32) -> Vec3 {
    // Not p + share * (end - p): a share of one must give the end itself.
    p * (1.0 - share) + end * share
}
