//! The rule by which one vertex gets onto an isosurface. Twin: `shaders/step.wgsl`.
//!
//! # Theory
//!
//! From a vertex with value f0 to the isovalue c: uphill where f0 < c, downhill else, along the mesh
//! normal (thesis section 3.4). The thesis takes the nearest hit on either side; that jumps to
//! another sheet in 0.5 to 10 % of steps even on smooth fields. Here the field along the step must
//! stay between f0 and c until it first reaches c: if there is no critical value between them, the
//! component of {f0 <= f <= c} that holds the vertex is a thickened surface, and whatever path stays
//! inside it ends on the continuation of the vertex's own sheet.
//!
//! Where the normal fails both ways (rough normals near creases of the trilinear field), short
//! steps follow the gradient of the cell at hand under the same rule. Where the gradients of two
//! neighbouring cells both point into their common face, the path slides along the face, which is
//! Filippov's solution of that flow.

use super::Status;
use super::field::{Field, interpolate, slope};
use super::ray::{Slab, Walk, exit_of, steps, walk};
use glam::{IVec3, Vec3};

/// Steps along the gradient before giving up.
pub const MAX_GRADIENT_STEPS: u32 = 16;

/// Longest step along the gradient, voxels: a quarter of a cell, since the gradient turns inside it.
pub const GRADIENT_STEP: f32 = 0.25;

/// How far a gradient step goes past a face, voxels, so that the next one starts in the next cell.
pub const NUDGE: f32 = 1e-3;

/// A direction shorter than this has no direction: its square still is a normal number.
pub const ZERO_LENGTH: f32 = 1e-15;

/// The unit vector along `v`, or zero where `v` has no direction.
#[inline]
pub(crate) fn unit(v: Vec3) -> Vec3 {
    let length = v.length();
    if length > ZERO_LENGTH { v / length } else { Vec3::ZERO }
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
    let place = field.locate(p);
    let values = field.corners(place.cell).map(|v| v - isovalue);
    let difference = interpolate(&values, place.local);
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
            if let Walk::Reached(t) = walk(field, p, direction, slab, reach) {
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
    // The way in which the last steps crossed a face, zero where they did not.
    let mut crossed = Vec3::ZERO;
    for _ in 0..MAX_GRADIENT_STEPS {
        let place = field.locate(q);
        let gradient = slope(&field.corners(place.cell), place.local) * field.inverse_cell_size();
        let uphill = gradient * slab.sign;
        let back = uphill * crossed;
        let slides = back.cmplt(Vec3::ZERO);
        let direction = unit(Vec3::select(slides, Vec3::ZERO, uphill));
        if direction == Vec3::ZERO {
            return None;
        }
        let d = direction * field.inverse_cell_size();
        let (axis, exit) = exit_of(place.local, d, steps(d), IVec3::ZERO);
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
