//! Wavefront OBJ: text with positions and normals; counts from one.

use std::io::{self, Write};

use super::Placed;
use super::ply::unit_of;

/// Writes a mesh. Numbers are the shortest that read back as the same f32, or f64 where floats are too far apart.
pub(super) fn write(placed: &Placed, writer: &mut dyn Write) -> io::Result<()> {
    writeln!(writer, "# isospectrum {}", env!("CARGO_PKG_VERSION"))?;
    for said in placed.space().into_iter().chain(unit_of(placed)) {
        writeln!(writer, "# {said}")?;
    }
    for position in placed.positions() {
        let [x, y, z] = position;
        if placed.is_far {
            writeln!(writer, "v {x} {y} {z}")?;
        } else {
            let [x, y, z] = position.map(|x| x as f32);
            writeln!(writer, "v {x} {y} {z}")?;
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
