//! PLY, binary little endian: positions and normals as float32, triangles as lists.

use std::io::{self, Write};

use crate::spectrum::SurfaceMesh;

/// Writes a mesh as it is.
pub(super) fn write(mesh: &SurfaceMesh, writer: &mut dyn Write) -> io::Result<()> {
    write!(
        writer,
        "ply\nformat binary_little_endian 1.0\ncomment isospectrum {}\n\
         element vertex {}\n\
         property float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        env!("CARGO_PKG_VERSION"),
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let mut row = [0; 24];
        for (bytes, x) in row.chunks_exact_mut(4).zip(position.iter().chain(normal)) {
            bytes.copy_from_slice(&x.to_le_bytes());
        }
        writer.write_all(&row)?;
    }
    for triangle in &mesh.triangles {
        let mut row = [3; 13];
        for (bytes, v) in row[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&v.to_le_bytes());
        }
        writer.write_all(&row)?;
    }
    Ok(())
}
