//! PLY, binary little endian: positions as float32 or, far from the origin, float64; normals as float32; triangles as lists.

use std::io::{self, Write};

use super::color_data::ColorData;
use super::world_mesh::WorldMesh;

/// Writes a mesh.
pub(super) fn write(
    world_mesh: &WorldMesh,
    colors: Option<&ColorData>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mesh = &world_mesh.mesh;
    let comments = world_mesh.space_comment().into_iter().chain(world_mesh.unit_comment());
    let comments: String = comments.map(|text| format!("comment {text}\n")).collect();
    let number = if world_mesh.is_far { "double" } else { "float" };
    let name = colors.map_or("", |colors| &colors.name);
    let vertex_properties = match colors {
        Some(_) => format!(
            "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float {name}\n"
        ),
        None => String::new(),
    };
    let triangle_values = colors.and_then(|colors| colors.triangle_values.as_ref());
    let face_properties =
        triangle_values.map_or_else(String::new, |_| format!("property float {name}\n"));
    write!(
        writer,
        "ply\nformat binary_little_endian 1.0\ncomment isospectrum {}\n{comments}\
         element vertex {}\n\
         property {number} x\nproperty {number} y\nproperty {number} z\n\
         property float nx\nproperty float ny\nproperty float nz\n{vertex_properties}\
         element face {}\n\
         property list uchar int vertex_indices\n{face_properties}end_header\n",
        env!("CARGO_PKG_VERSION"),
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    let mut colors = colors.into_iter().flat_map(|c| c.srgb().zip(&c.vertex_values));
    for (position, normal) in world_mesh.positions().zip(&mesh.normals) {
        let mut row = Vec::with_capacity(36);
        for x in position {
            if world_mesh.is_far {
                row.extend(x.to_le_bytes());
            } else {
                row.extend((x as f32).to_le_bytes());
            }
        }
        row.extend(normal.iter().flat_map(|x| x.to_le_bytes()));
        if let Some((color, value)) = colors.next() {
            row.extend(color);
            row.extend(value.to_le_bytes());
        }
        writer.write_all(&row)?;
    }
    let mut values = triangle_values.into_iter().flatten();
    for triangle in &mesh.triangles {
        let mut row = [3; 13];
        for (bytes, v) in row[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&v.to_le_bytes());
        }
        writer.write_all(&row)?;
        if let Some(value) = values.next() {
            writer.write_all(&value.to_le_bytes())?;
        }
    }
    Ok(())
}
