//! STL, binary: each triangle by itself with the normal of its plane.

use std::io::{self, Write};

use super::Placed;
use super::weld::{Welded, weld};
use crate::spectrum::SurfaceMesh;

/// Writes a mesh so that whoever welds equal corners has a mesh like it again ([`weld`]). STL has no
/// shared vertices and one normal per triangle, so the mesh's own normals are left out.
pub(super) fn write(placed: Placed, writer: &mut dyn Write) -> io::Result<()> {
    if placed.is_far {
        log::warn!(
            "STL has 32-bit floats, which are too far apart at {:?} for voxels of {:e}; PLY, OBJ and GLB keep the shape",
            placed.placement.origin,
            placed.placement.voxel()
        );
    }
    let positions = placed.narrow_positions().collect();
    let space = placed.space();
    let mesh = SurfaceMesh { positions, ..placed.mesh };
    let Welded { triangles, n_flat, n_same } = weld(&mesh);
    if n_flat + n_same > 0 {
        log::warn!(
            "STL knows corners by their positions only: {n_flat} triangles without area and {n_same} vertices in the place of others are left; PLY, OBJ and GLB hold the mesh as it is"
        );
    }
    let mut head = [b' '; 80];
    // Not "solid": that is how the text variant starts.
    let mut title = concat!("binary STL by isospectrum ", env!("CARGO_PKG_VERSION")).to_owned();
    if let Some(space) = space {
        title += &format!(". {space}");
    }
    head[..title.len()].copy_from_slice(title.as_bytes());
    writer.write_all(&head)?;
    writer.write_all(&(triangles.len() as u32).to_le_bytes())?;
    for corners in triangles {
        let mut row = [0; 50];
        let numbers = plane_normal(corners).into_iter().chain(corners.into_iter().flatten());
        for (bytes, x) in row.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&x.to_le_bytes());
        }
        writer.write_all(&row)?;
    }
    Ok(())
}

/// The unit normal of a triangle; zero, as the format allows, where it has no area.
fn plane_normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| glam::DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
}
