//! Wavefront OBJ: text with positions and normals; indices start at one.

use std::io::{self, Write};

use super::color_data::ColorData;
use super::world_mesh::WorldMesh;

/// Writes a mesh. Numbers are the shortest that read back as the same f32, or f64 far from the origin. Colours follow the
/// position, as Blender, MeshLab and others read them: sRGB, 0 to 1.
pub(super) fn write(
    world_mesh: &WorldMesh,
    colors: Option<&ColorData>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    writeln!(writer, "# isospectrum {}", env!("CARGO_PKG_VERSION"))?;
    for comment in world_mesh.space_comment().into_iter().chain(world_mesh.unit_comment()) {
        writeln!(writer, "# {comment}")?;
    }
    let mut colors = colors.into_iter().flat_map(ColorData::srgb);
    for position in world_mesh.positions() {
        let color = colors.next().map(|color| color.map(|byte| f32::from(byte) / 255.0));
        let color = color.map(|[r, g, b]| format!(" {r} {g} {b}")).unwrap_or_default();
        let [x, y, z] = position;
        if world_mesh.is_far {
            writeln!(writer, "v {x} {y} {z}{color}")?;
        } else {
            let [x, y, z] = position.map(|x| x as f32);
            writeln!(writer, "v {x} {y} {z}{color}")?;
        }
    }
    for [x, y, z] in &world_mesh.mesh.normals {
        writeln!(writer, "vn {x} {y} {z}")?;
    }
    for triangle in &world_mesh.mesh.triangles {
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        writeln!(writer, "f {a}//{a} {b}//{b} {c}//{c}")?;
    }
    Ok(())
}
