//! Distances of face barycentres from the isosurface: the CPU twin of `shaders/deviation.wgsl`.

use crate::field::{Field, face_deviation};
use crate::mesh::Connectivity;
use glam::Vec3;

/// The distance of the barycentre of face `f` from the isosurface of the field's value `isovalue`, voxels.
pub fn deviation(
    field: &Field,
    connectivity: &Connectivity,
    positions: &[Vec3],
    f: usize,
    isovalue: f32,
    reach: f32,
) -> f32 {
    let [a, b, c] = connectivity.faces[f].map(|v| positions[v as usize]);
    face_deviation(field, a, b, c, isovalue, reach)
}
