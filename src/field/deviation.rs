//! Distance of face barycentres from the isosurface (thesis section 3.7).

use super::grid::{Field, interpolate, slope};
use super::ray::{Slab, Walk, walk_knowing};
use super::step::unit;
use glam::Vec3;

/// The distance (voxels) from the barycentre of the face `a b c` to the isosurface of the field's
/// value `isovalue`, along the face's normal to the nearer side; `reach` where there is none within
/// `reach`. A face without area has no normal: the gradient is used instead.
pub fn face_deviation(field: &Field, a: Vec3, b: Vec3, c: Vec3, isovalue: f32, reach: f32) -> f32 {
    let (ab, ac) = (b - a, c - a);
    let barycentre = a + (ab + ac) / 3.0;
    if !barycentre.is_finite() {
        return reach;
    }
    let point = field.locate(barycentre);
    let values = field.corners(point.cell).map(|v| v - isovalue);
    let difference = interpolate(&values, point.local);
    if difference.abs() <= field.value_noise() {
        return 0.0;
    }
    let mut direction = unit(ab.cross(ac));
    if direction == Vec3::ZERO {
        direction = unit(slope(&values, point.local) * field.inverse_cell_size());
    }
    if direction == Vec3::ZERO {
        return reach;
    }
    // Any excursion is allowed: the distance is that of the nearest sheet, whichever it is.
    let sign = if difference < 0.0 { 1.0 } else { -1.0 };
    let slab = Slab { isovalue, sign, lowest: f32::MIN };
    let mut nearest = reach;
    for direction in [direction * -sign, direction * sign] {
        let known = Some((point.cell, &values));
        if let Walk::Reached(t) = walk_knowing(field, barycentre, direction, slab, nearest, known) {
            nearest = nearest.min(t);
        }
    }
    nearest
}
