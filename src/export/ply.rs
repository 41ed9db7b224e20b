//! PLY, binary little endian: positions as float32 or, far from the origin, float64, normals as float32, triangles as
//! lists.

use std::io::{self, Write};

use super::{Painted, Placed};
use crate::volume::Unit;

/// Writes a mesh.
pub(super) fn write(
    placed: &Placed,
    painted: Option<&Painted>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mesh = &placed.mesh;
    let comments = placed.space().into_iter().chain(unit_of(placed));
    let comments: String = comments.map(|said| format!("comment {said}\n")).collect();
    let number = if placed.is_far { "double" } else { "float" };
    let of_vertices = painted.map_or_else(String::new, |painted| {
        let name = &painted.name;
        format!(
            "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float {name}\n"
        )
    });
    let of_triangles =
        painted.and_then(|painted| painted.of_triangles.as_ref().map(|of| (&painted.name, of)));
    let of_faces =
        of_triangles.map(|(name, _)| format!("property float {name}\n")).unwrap_or_default();
    write!(
        writer,
        "ply\nformat binary_little_endian 1.0\ncomment isospectrum {}\n{comments}\
         element vertex {}\n\
         property {number} x\nproperty {number} y\nproperty {number} z\n\
         property float nx\nproperty float ny\nproperty float nz\n{of_vertices}\
         element face {}\n\
         property list uchar int vertex_indices\n{of_faces}end_header\n",
        env!("CARGO_PKG_VERSION"),
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    let mut colors = painted.into_iter().flat_map(|p| p.srgb().zip(&p.numbers));
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
        if let Some((color, number)) = colors.next() {
            row.extend(color);
            row.extend(number.to_le_bytes());
        }
        writer.write_all(&row)?;
    }
    let mut numbers = of_triangles.into_iter().flat_map(|(_, numbers)| numbers);
    for triangle in &mesh.triangles {
        let mut row = [3; 13];
        for (bytes, v) in row[1..].chunks_exact_mut(4).zip(triangle) {
            bytes.copy_from_slice(&v.to_le_bytes());
        }
        writer.write_all(&row)?;
        if let Some(number) = numbers.next() {
            writer.write_all(&number.to_le_bytes())?;
        }
    }
    Ok(())
}

/// The unit, for people.
pub(super) fn unit_of(placed: &Placed) -> Option<String> {
    let unit = placed.placement.unit;
    (unit != Unit::Unknown).then(|| format!("unit {unit}"))
}
