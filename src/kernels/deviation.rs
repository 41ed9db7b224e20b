//! Distances of all face barycentres from the isosurface: the CPU twin of `shaders/deviation.wgsl`.

use super::cpu::for_each;
use crate::field::{Field, face_deviation};
use crate::mesh::Connectivity;
use glam::Vec3;

/// The distance of each face's barycentre from the isosurface of the field's value `isovalue`, voxels.
pub fn deviation(
    field: &Field,
    connectivity: &Connectivity,
    positions: &[Vec3],
    isovalue: f32,
    reach: f32,
) -> Vec<f32> {
    let faces = &connectivity.faces;
    let mut distances = vec![0.0; faces.len()];
    for_each(&mut distances, |f, distance| {
        let [a, b, c] = faces[f].map(|v| positions[v as usize]);
        *distance = face_deviation(field, a, b, c, isovalue, reach);
    });
    distances
}
