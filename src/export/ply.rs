//! PLY, binary little endian: positions as float32 or, far from the origin, float64, normals as float32, triangles as
//! lists.

use std::io::{self, Write};

use super::Placed;
use crate::volume::Unit;

/// Writes a mesh.
pub(super) fn write(placed: &Placed, writer: &mut dyn Write) -> io::Result<()> {
    let mesh = &placed.mesh;
    let comments = placed.space().into_iter().chain(unit_of(placed));
    let comments: String = comments.map(|said| format!("comment {said}\n")).collect();
    let number = if placed.is_far { "double" } else { "float" };
    write!(
        writer,
        "ply\nformat binary_little_endian 1.0\ncomment isospectrum {}\n{comments}\
         element vertex {}\n\
         property {number} x\nproperty {number} y\nproperty {number} z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        env!("CARGO_PKG_VERSION"),
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    for (position, normal) in placed.positions().zip(&mesh.normals) {
        let mut row = Vec::with_capacity(36);
        for x in position {
            if placed.is_far {
                row.extend(x.to_le_bytes());
            } else {
                row.extend((x as f32).to_le_bytes());
            }
        }
        row.extend(normal.iter().flat_map(|x| x.to_le_bytes()));
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

/// The unit, for people.
pub(super) fn unit_of(placed: &Placed) -> Option<String> {
    let unit = placed.placement.unit;
    (unit != Unit::Unknown).then(|| format!("unit {unit}"))
}
