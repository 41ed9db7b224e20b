//! STL, binary: separate triangles, each with the normal of its plane.

use std::io::{self, Write};

use super::weld::{Welded, weld};
use super::world_mesh::WorldMesh;
use super::written::Written;
use crate::spectrum::Mesh;

/// Writes a mesh such that a reader that welds equal corners gets the same mesh again ([`weld`]). STL has no shared vertices
/// and one normal per triangle, so the mesh's own normals are left out.
pub(super) fn write(world_mesh: WorldMesh, writer: &mut dyn Write) -> io::Result<Written> {
    if world_mesh.is_far {
        log::warn!(
            "the 32-bit floats of STL are too coarse at {:?} for voxels of {:e}; PLY, OBJ and GLB keep the shape",
            world_mesh.placement.origin,
            world_mesh.placement.voxel()
        );
    }
    let positions = world_mesh.positions_f32().collect();
    let space = world_mesh.space_comment();
    let mesh = Mesh { positions, ..world_mesh.mesh };
    let Welded { triangles, n_vertices, n_degenerate, n_coincident } = weld(&mesh);
    let written = Written { n_vertices, n_triangles: triangles.len() };
    if n_degenerate + n_coincident > 0 {
        log::warn!(
            "STL identifies corners by their positions: {n_degenerate} triangles without area and {n_coincident} coincident vertices remain; PLY, OBJ and GLB keep the mesh unchanged"
        );
    }
    let mut header = [b' '; 80];
    // It must not start with "solid", as the text variant does.
    let mut title = concat!("binary STL by isospectrum ", env!("CARGO_PKG_VERSION")).to_owned();
    if let Some(space) = space {
        title += &format!(". {space}");
    }
    header[..title.len()].copy_from_slice(title.as_bytes());
    writer.write_all(&header)?;
    writer.write_all(&(triangles.len() as u32).to_le_bytes())?;
    for corners in triangles {
        let mut row = [0; 50];
        let numbers = plane_normal(corners).into_iter().chain(corners.into_iter().flatten());
        for (bytes, x) in row.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&x.to_le_bytes());
        }
        writer.write_all(&row)?;
    }
    Ok(written)
}

/// The unit normal of a triangle; zero, as the format allows, where it has no area.
fn plane_normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| glam::DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
}
