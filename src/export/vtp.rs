//! VTP: polygons of VTK in XML, with raw little-endian numbers behind it, each array after its length.

use std::io::{self, Write};

use super::ply::unit_of;
use super::{Painted, Placed};

/// An array of the file: how it is described, and its bytes.
struct Array {
    about: String,
    bytes: Vec<u8>,
}

impl Array {
    fn new(kind: &str, name: &str, components: usize, bytes: Vec<u8>) -> Self {
        let about = format!("type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        Array { about, bytes }
    }

    fn floats(name: &str, components: usize, numbers: impl Iterator<Item = f32>) -> Self {
        Self::new("Float32", name, components, numbers.flat_map(f32::to_le_bytes).collect())
    }

    fn integers(name: &str, numbers: impl Iterator<Item = i32>) -> Self {
        Self::new("Int32", name, 1, numbers.flat_map(i32::to_le_bytes).collect())
    }
}

/// Writes a mesh.
pub(super) fn write(
    placed: &Placed,
    painted: Option<&Painted>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mesh = &placed.mesh;
    let positions = if placed.is_far {
        let numbers = placed.positions().flatten().flat_map(f64::to_le_bytes);
        Array::new("Float64", "Points", 3, numbers.collect())
    } else {
        Array::floats("Points", 3, placed.narrow_positions().flatten())
    };
    let mut of_points = vec![Array::floats("Normals", 3, mesh.normals.iter().copied().flatten())];
    let mut of_cells = Vec::new();
    if let Some(painted) = painted {
        let Painted { name, numbers, of_triangles, .. } = painted;
        match of_triangles {
            Some(numbers) => of_cells.push(Array::floats(name, 1, numbers.iter().copied())),
            None => of_points.push(Array::floats(name, 1, numbers.iter().copied())),
        }
        let colors = painted.srgb().flatten().collect();
        of_points.push(Array::new("UInt8", "color", 3, colors));
    }
    let corners = mesh.triangles.iter().flatten().map(|&v| v as i32);
    let polygons = [
        Array::integers("connectivity", corners),
        Array::integers("offsets", (1..=mesh.triangles.len() as i32).map(|i| 3 * i)),
    ];

    write!(
        writer,
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <!-- isospectrum {}{} -->\n\
         <PolyData>\n\
         <Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
        env!("CARGO_PKG_VERSION"),
        unit_of(placed)
            .into_iter()
            .chain(placed.space())
            .map(|said| format!(", {said}"))
            .collect::<String>(),
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    let mut at = 0;
    let mut list = |writer: &mut dyn Write, element: &str, arrays: &[Array]| {
        let name = element.split(' ').next().unwrap_or_default();
        writeln!(writer, "<{element}>")?;
        for Array { about, bytes } in arrays {
            writeln!(writer, "<DataArray {about} format=\"appended\" offset=\"{at}\"/>")?;
            at += 8 + bytes.len();
        }
        writeln!(writer, "</{name}>")
    };
    let positions = [positions];
    list(writer, "PointData Normals=\"Normals\"", &of_points)?;
    list(writer, "CellData", &of_cells)?;
    list(writer, "Points", &positions)?;
    list(writer, "Polys", &polygons)?;
    write!(writer, "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_")?;
    for Array { bytes, .. } in of_points.iter().chain(&of_cells).chain(&positions).chain(&polygons)
    {
        writer.write_all(&(bytes.len() as u64).to_le_bytes())?;
        writer.write_all(bytes)?;
    }
    writer.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}
