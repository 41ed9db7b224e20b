//! Projection of vertices onto the isosurface of the next isovalue (thesis section 3.4).
//! Twin: `shaders/project.wgsl`. The rule itself is [`super::step`].

use super::Status;
use super::field::Field;
use super::step::onto_isosurface;
use glam::Vec3;

/// Where a held vertex at `p` is after a share of its way to `end`.
#[inline]
pub fn held(p: Vec3, end: Vec3, share: f32) -> Vec3 {
    // Not by the difference: the share of one is the end itself.
    p * (1.0 - share) + end * share
}

/// Moves one point (voxel frame) onto the isosurface of the field's value `isovalue` within
/// `reach` voxels, along the normal `n` (towards lower values; any length), else along the gradient. `None` where the rule finds no way.
pub fn project_point(field: &Field, p: Vec3, n: Vec3, isovalue: f32, reach: f32) -> Option<Vec3> {
    match onto_isosurface(field, p, n, isovalue, reach) {
        (_, Status::Failed) => None,
        (q, _) => Some(q),
    }
}
