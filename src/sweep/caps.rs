//! Caps stay outside the volume.
//!
//! A cap closes the mesh in the layer around the volume, at a distance from the border that falls
//! to zero where the field falls to the isovalue. Rounded to the border itself, a cap could not be
//! told from the isosurface proper; so its vertices keep a small distance.

use glam::Vec3;

use crate::kernels::field::Field;
use crate::mesh::{Mesh, Vertex};

/// Least distance of a cap's own vertices from the border, voxels.
const LIFT: f32 = 0.002;

/// Lifts the vertices that belong to caps only off the border of the volume.
pub(crate) fn lift_caps(
    mesh: &Mesh,
    field: &Field,
    vertices: &[Vertex],
    positions: &mut [[f32; 3]],
) {
    let dims = field.volume().dims();
    let top = Vec3::new((dims[0] - 1) as f32, (dims[1] - 1) as f32, (dims[2] - 1) as f32)
        * field.cell_size();
    for (&v, p) in vertices.iter().zip(positions) {
        if mesh.border(v) != 0 || !mesh.is_cap(mesh.face(mesh.outgoing(v))) {
            continue;
        }
        for a in 0..3 {
            if (-LIFT..LIFT).contains(&p[a]) {
                p[a] = -LIFT;
            } else if (-LIFT..LIFT).contains(&(p[a] - top[a])) {
                p[a] = top[a] + LIFT;
            }
        }
    }
}
