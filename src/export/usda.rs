//! USDA: Universal Scene Description as text: a mesh, several beside each other, or one whose points and triangles change with
//! time, for Blender, Houdini, Omniverse and `usdview`.
//!
//! As in GLB, positions are around the origin of the volume, to which the mesh is moved in 64-bit floats. A time is the number
//! of a picture, from 0; `isovalue` tells what it shows. Between two times meshes have not as many points, so nothing is
//! interpolated: each is held until the next.

use std::fmt::Display;
use std::io::{self, Write};

use super::{Arrangement, Look, Painted, Placed};
use crate::volume::{Placement, Unit};

/// Name of what holds the meshes.
const ROOT: &str = "isosurface";

/// Writes a mesh.
pub(super) fn write(
    placed: &Placed,
    painted: Option<&Painted>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    head(&placed.placement, None, writer)?;
    mesh("mesh", &[(placed, painted, None)], writer)?;
    writeln!(writer, "}}")
}

/// Writes several meshes, beside each other or one after the other.
pub(super) fn write_all(
    frames: &[(Placed, Option<Painted>, Look)],
    arrangement: Arrangement,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let Some((first, ..)) = frames.first() else { return Ok(()) };
    let shown =
        frames.iter().map(|(placed, painted, look)| (placed, painted.as_ref(), Some(*look)));
    let shown: Vec<Shown<'_>> = shown.collect();
    match arrangement {
        Arrangement::Sweep { seconds } => {
            head(&first.placement, Some((frames.len(), seconds)), writer)?;
            mesh("mesh", &shown, writer)?;
        }
        Arrangement::Together => {
            head(&first.placement, None, writer)?;
            for (i, one) in shown.iter().enumerate() {
                mesh(&format!("mesh_{}", i + 1), std::slice::from_ref(one), writer)?;
            }
        }
    }
    writeln!(writer, "}}")
}

/// What the file says of itself, and where its meshes lie; `sweep` is how many pictures in how many seconds.
fn head(
    placement: &Placement,
    sweep: Option<(usize, f64)>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    writeln!(writer, "#usda 1.0\n(\n    defaultPrim = \"{ROOT}\"")?;
    writeln!(writer, "    doc = \"isospectrum {}\"", env!("CARGO_PKG_VERSION"))?;
    if let Some(meters) = meters(placement.unit) {
        writeln!(writer, "    metersPerUnit = {meters:e}")?;
    }
    if let Some((n, seconds)) = sweep {
        writeln!(writer, "    startTimeCode = 0\n    endTimeCode = {}", n - 1)?;
        writeln!(writer, "    timeCodesPerSecond = {}", n as f64 / seconds)?;
    }
    writeln!(writer, "    upAxis = \"Z\"\n)\n\ndef Xform \"{ROOT}\"\n{{")?;
    let [x, y, z] = placement.origin;
    writeln!(writer, "    double3 xformOp:translate = ({x}, {y}, {z})")?;
    writeln!(writer, "    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n")
}

/// Metres of a unit; none where it is not known.
fn meters(unit: Unit) -> Option<f64> {
    match unit {
        Unit::Unknown => None,
        Unit::M => Some(1.0),
        Unit::Cm => Some(1e-2),
        Unit::Mm => Some(1e-3),
        Unit::Um => Some(1e-6),
        Unit::Nm => Some(1e-9),
        Unit::Angstrom => Some(1e-10),
    }
}

/// One of the meshes that a mesh is in turn, with what is known of it.
type Shown<'a> = (&'a Placed, Option<&'a Painted>, Option<Look>);

/// A mesh, which changes with time where there are several of it.
fn mesh(name: &str, shown: &[Shown<'_>], writer: &mut dyn Write) -> io::Result<()> {
    writeln!(writer, "    def Mesh \"{name}\"\n    {{")?;
    writeln!(writer, "        uniform token subdivisionScheme = \"none\"")?;
    writeln!(writer, "        uniform bool doubleSided = 1")?;
    let mut put = |about: &str, is_of_vertices: bool, of: &dyn Fn(&Shown<'_>) -> String| {
        attribute(shown, about, is_of_vertices, of, writer)
    };
    put("float3[] extent", false, &|(placed, ..)| extent(&around(placed)))?;
    put("int[] faceVertexCounts", false, &|(placed, ..)| {
        listed(placed.mesh.triangles.iter().map(|_| 3))
    })?;
    put("int[] faceVertexIndices", false, &|(placed, ..)| {
        listed(placed.mesh.triangles.iter().flatten())
    })?;
    put("point3f[] points", false, &|(placed, ..)| rows(around(placed)))?;
    put("normal3f[] normals", true, &|(placed, ..)| rows(placed.mesh.normals.iter().copied()))?;
    let painted: Option<Vec<&Painted>> = shown.iter().map(|(_, painted, _)| *painted).collect();
    if let Some(first) = painted.as_ref().and_then(|painted| painted.first()) {
        put("color3f[] primvars:displayColor", true, &|(_, painted, _)| {
            rows(painted.iter().flat_map(|painted| painted.linear.iter().copied()))
        })?;
        put(&format!("float[] primvars:{}", first.name), true, &|(_, painted, _)| {
            // A number that is none is none here, either.
            let numbers = painted.iter().flat_map(|painted| painted.numbers.iter());
            listed(numbers.map(|&x| if x.is_finite() { x } else { 0.0 }))
        })?;
    }
    let looks: Option<Vec<Look>> = shown.iter().map(|(.., look)| *look).collect();
    if looks.is_some() {
        put("custom double isovalue", false, &|(.., look)| {
            look.map_or_else(String::new, |look| look.isovalue.to_string())
        })?;
    }
    if let (None, Some([Look { color: [r, g, b], opacity, .. }])) = (&painted, looks.as_deref()) {
        writeln!(writer, "        color3f[] primvars:displayColor = [({r}, {g}, {b})]")?;
        writeln!(writer, "        float[] primvars:displayOpacity = [{opacity}]")?;
    }
    writeln!(writer, "    }}")
}

/// An attribute, of each time where there are several; of the vertices, or of the mesh.
fn attribute(
    shown: &[Shown<'_>],
    about: &str,
    is_of_vertices: bool,
    of: &dyn Fn(&Shown<'_>) -> String,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let rest = match is_of_vertices {
        true => " (\n            interpolation = \"vertex\"\n        )",
        false => "",
    };
    if let [one] = shown {
        return writeln!(writer, "        {about} = {}{rest}", of(one));
    }
    // What is said of an attribute stands at its own name.
    if is_of_vertices {
        writeln!(writer, "        {about}{rest}")?;
    }
    writeln!(writer, "        {about}.timeSamples = {{")?;
    for (time, shown) in shown.iter().enumerate() {
        writeln!(writer, "            {time}: {},", of(shown))?;
    }
    writeln!(writer, "        }}")
}

/// Positions around the origin, along the axes of the world.
fn around(placed: &Placed) -> Vec<[f32; 3]> {
    let around = |&p: &[f32; 3]| placed.placement.around_origin(p).map(|x| x as f32);
    placed.mesh.positions.iter().map(around).collect()
}

/// A list in brackets.
fn listed(items: impl Iterator<Item = impl Display>) -> String {
    let items: Vec<String> = items.map(|item| item.to_string()).collect();
    format!("[{}]", items.join(", "))
}

/// A list of rows of three.
fn rows(rows: impl IntoIterator<Item = [f32; 3]>) -> String {
    listed(rows.into_iter().map(|[x, y, z]| format!("({x}, {y}, {z})")))
}

/// Least and largest corner of the box around points; of none a box of nothing.
fn extent(points: &[[f32; 3]]) -> String {
    let bound = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
        let points = points.iter().copied();
        points.reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i]))).unwrap_or_default()
    };
    rows([bound(f32::min), bound(f32::max)])
}
