//! How one vertex reaches an isosurface. Twin: `shaders/step.wgsl`.
//!
//! # Theory
//!
//! A vertex with value f0 moves to the isovalue c along the mesh normal (thesis section 3.4): uphill if f0 < c, else
//! downhill. The thesis takes the nearest hit on either side; that jumps to another sheet in 0.5 to 10 % of steps even on
//! smooth fields. Here the field along the step must stay between f0 and c until it first reaches c: if there is no critical
//! value between them, the component of {f0 <= f <= c} that contains the vertex is a thickened surface, and every path inside
//! it ends on the continuation of the vertex's own sheet.
//!
//! Where the normal fails in both directions (normals are rough near creases of the trilinear field), short
//! steps follow the gradient of the current cell under the same rule. Where the gradients of two
//! neighbouring cells both point into their common face, the path slides along the face, which is
//! Filippov's solution of that flow.

use super::grid::{Field, interpolate, slope};
use super::ray::{Slab, Walk, exit_of, steps, walk, walk_knowing};
use glam::{IVec3, Vec3};

/// Number of steps along the gradient at most.
pub const MAX_GRADIENT_STEPS: u32 = 16;

/// Longest step along the gradient, voxels: a quarter of a cell, since the gradient turns inside it.
pub const GRADIENT_STEP: f32 = 0.25;

/// Length by which a gradient step overshoots a face, voxels, so that the next one starts in the next cell.
pub const NUDGE: f32 = 1e-3;

/// A shorter vector has no direction. The square of this length is still a normal number.
pub const ZERO_LENGTH: f32 = 1e-15;

/// Result of a projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Status {
    /// The vertex reached its isosurface along its normal, or is constrained.
    Reached = 0,
    /// It reached it along the gradient.
    ReachedByGradient = 1,
    /// No path within the rules reaches it; the vertex has not moved.
    Failed = 2,
}

/// The unit vector along `v`, or zero where `v` has no direction.
#[inline]
pub(crate) fn unit(v: Vec3) -> Vec3 {
    let length = v.length();
    if length > ZERO_LENGTH { v / length } else { Vec3::ZERO }
}

/// Moves one point (voxel frame) onto the isosurface of the field's value `isovalue` within
/// `reach` voxels, along the normal `n` (towards lower values; any length), else along the gradient. `None` if
/// neither reaches it.
pub fn project_point(field: &Field, p: Vec3, n: Vec3, isovalue: f32, reach: f32) -> Option<Vec3> {
    match onto_isosurface(field, p, n, isovalue, reach) {
        (_, Status::Failed) => None,
        (q, _) => Some(q),
    }
}

/// Moves `p` (voxel frame) onto the isosurface of the field's value `isovalue`, at most `reach`
/// voxels, first along the normal `n`, then along the gradient. Returns the new position, or the old one with [`Status::Failed`].
pub fn onto_isosurface(
    field: &Field,
    p: Vec3,
    n: Vec3,
    isovalue: f32,
    reach: f32,
) -> (Vec3, Status) {
    if !(p.is_finite() && n.is_finite()) {
        return (p, Status::Failed);
    }
    let point = field.locate(p);
    let values = field.corners(point.cell).map(|v| v - isovalue);
    let difference = interpolate(&values, point.local);
    if difference.abs() <= field.value_noise() {
        return (p, Status::Reached);
    }
    let sign = if difference < 0.0 { 1.0 } else { -1.0 };
    let lowest = -difference.abs() - field.slab_tolerance();
    let slab = Slab { isovalue, sign, lowest };
    // Normals point to lower values, so uphill is against them.
    let along = unit(n) * -sign;
    if along != Vec3::ZERO {
        for direction in [along, -along] {
            let known = Some((point.cell, &values));
            if let Walk::Reached(t) = walk_knowing(field, p, direction, slab, reach, known) {
                return (p + direction * t, Status::Reached);
            }
        }
    }
    match along_gradient(field, p, slab, reach) {
        Some(q) => (q, Status::ReachedByGradient),
        None => (p, Status::Failed),
    }
}

/// Follows the gradient from `p` in short steps until the isovalue, for at most `reach` voxels.
fn along_gradient(field: &Field, p: Vec3, slab: Slab, reach: f32) -> Option<Vec3> {
    let mut q = p;
    let mut left = reach;
    // Per axis, the direction in which the last steps crossed a face; zero where they did not.
    let mut crossed = Vec3::ZERO;
    for _ in 0..MAX_GRADIENT_STEPS {
        let point = field.locate(q);
        let gradient = slope(&field.corners(point.cell), point.local) * field.inverse_cell_size();
        let uphill = gradient * slab.sign;
        let back = uphill * crossed;
        let slides = back.cmplt(Vec3::ZERO);
        let direction = unit(Vec3::select(slides, Vec3::ZERO, uphill));
        if direction == Vec3::ZERO {
            return None;
        }
        let d = direction * field.inverse_cell_size();
        let (axis, exit) = exit_of(point.local, d, steps(d), IVec3::ZERO);
        let past = exit.max(0.0) + NUDGE;
        let length = past.min(GRADIENT_STEP).min(left);
        match walk(field, q, direction, slab, length) {
            Walk::Reached(t) => return Some(q + direction * t),
            Walk::Left => return None,
            Walk::Ended => {}
        }
        q += direction * length;
        left -= length;
        if left <= 0.0 {
            return None;
        }
        crossed = Vec3::select(slides, crossed, Vec3::ZERO);
        if past <= length {
            crossed[axis] = direction[axis];
        }
    }
    None
}
