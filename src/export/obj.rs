//! Wavefront OBJ: text with positions and normals; counts from one.

use std::io::{self, Write};

use super::ply::unit_of;
use super::{Painted, Placed};

/// Writes a mesh. Numbers are the shortest that read back as the same f32, or f64 where floats are too far apart.
/// Colours stand behind the position, as Blender, MeshLab and others read them: sRGB, 0 to 1.
pub(super) fn write(
    placed: &Placed,
    painted: Option<&Painted>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    writeln!(writer, "# isospectrum {}", env!("CARGO_PKG_VERSION"))?;
    for said in placed.space().into_iter().chain(unit_of(placed)) {
        writeln!(writer, "# {said}")?;
    }
    let mut colors = painted.into_iter().flat_map(Painted::srgb);
    for position in placed.positions() {
        let color = colors.next().map(|color| color.map(|byte| f32::from(byte) / 255.0));
        let color = color.map(|[r, g, b]| format!(" {r} {g} {b}")).unwrap_or_default();
        let [x, y, z] = position;
        if placed.is_far {
            writeln!(writer, "v {x} {y} {z}{color}")?;
        } else {
            let [x, y, z] = position.map(|x| x as f32);
            writeln!(writer, "v {x} {y} {z}{color}")?;
        }
    }
    for [x, y, z] in &placed.mesh.normals {
        writeln!(writer, "vn {x} {y} {z}")?;
    }
    for triangle in &placed.mesh.triangles {
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        writeln!(writer, "f {a}//{a} {b}//{b} {c}//{c}")?;
    }
    Ok(())
}
