//! VTP: VTK PolyData in XML, followed by appended raw little-endian arrays, each preceded by its length.

use std::io::{self, Write};

use super::color_data::ColorData;
use super::world_mesh::WorldMesh;

/// A data array: its XML attributes and its bytes.
struct Array {
    attributes: String,
    bytes: Vec<u8>,
}

impl Array {
    fn new(kind: &str, name: &str, components: usize, bytes: Vec<u8>) -> Self {
        let attributes =
            format!("type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        Array { attributes, bytes }
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
    world_mesh: &WorldMesh,
    colors: Option<&ColorData>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mesh = &world_mesh.mesh;
    let positions = if world_mesh.is_far {
        let numbers = world_mesh.positions().flatten().flat_map(f64::to_le_bytes);
        Array::new("Float64", "Points", 3, numbers.collect())
    } else {
        Array::floats("Points", 3, world_mesh.positions_f32().flatten())
    };
    let mut point_data = vec![Array::floats("Normals", 3, mesh.normals.iter().copied().flatten())];
    let mut cell_data = Vec::new();
    if let Some(colors) = colors {
        let ColorData { name, vertex_values, triangle_values, .. } = colors;
        match triangle_values {
            Some(values) => cell_data.push(Array::floats(name, 1, values.iter().copied())),
            None => point_data.push(Array::floats(name, 1, vertex_values.iter().copied())),
        }
        let colors = colors.srgb().flatten().collect();
        point_data.push(Array::new("UInt8", "color", 3, colors));
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
        (world_mesh.unit_comment().into_iter())
            .chain(world_mesh.space_comment())
            .map(|comment| format!(", {comment}"))
            .collect::<String>(),
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    let mut offset = 0;
    let mut write_element = |writer: &mut dyn Write, element: &str, arrays: &[Array]| {
        let name = element.split(' ').next().unwrap_or_default();
        writeln!(writer, "<{element}>")?;
        for Array { attributes, bytes } in arrays {
            writeln!(writer, "<DataArray {attributes} format=\"appended\" offset=\"{offset}\"/>")?;
            offset += 8 + bytes.len();
        }
        writeln!(writer, "</{name}>")
    };
    let positions = [positions];
    write_element(writer, "PointData Normals=\"Normals\"", &point_data)?;
    write_element(writer, "CellData", &cell_data)?;
    write_element(writer, "Points", &positions)?;
    write_element(writer, "Polys", &polygons)?;
    write!(writer, "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_")?;
    let arrays = point_data.iter().chain(&cell_data).chain(&positions).chain(&polygons);
    for Array { bytes, .. } in arrays {
        writer.write_all(&(bytes.len() as u64).to_le_bytes())?;
        writer.write_all(bytes)?;
    }
    writer.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}
