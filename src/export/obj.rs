//! Wavefront OBJ: text with positions and normals; counts from one.

use std::io::{self, Write};

use crate::spectrum::SurfaceMesh;

/// Writes a mesh as it is. Numbers are the shortest that read back as the same f32.
pub(super) fn write(mesh: &SurfaceMesh, writer: &mut dyn Write) -> io::Result<()> {
    writeln!(writer, "# isospectrum {}", env!("CARGO_PKG_VERSION"))?;
    for [x, y, z] in &mesh.positions {
        writeln!(writer, "v {x} {y} {z}")?;
    }
    for [x, y, z] in &mesh.normals {
        writeln!(writer, "vn {x} {y} {z}")?;
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
        writeln!(writer, "f {a}//{a} {b}//{b} {c}//{c}")?;
    }
    Ok(())
}
