//! USDA, Universal Scene Description as text, for Blender, Houdini, Omniverse and `usdview`: one mesh, several, or one whose
//! points and triangles change with time.
//!
//! As in GLB, positions are relative to the origin of the volume, which is the translation of the root in 64-bit floats. Time
//! codes count frames from 0; the attribute `isovalue` gives the isovalue of each. The number of points changes from frame to
//! frame, so readers hold each frame until the next instead of interpolating.

use std::fmt::Display;
use std::io::{self, Write};

use super::color_data::ColorData;
use super::scene::{Arrangement, SurfaceStyle, WorldSceneMesh};
use super::world_mesh::WorldMesh;
use crate::volume::{Placement, Unit};

/// Name of the root prim.
const ROOT: &str = "isosurface";

/// Writes a mesh.
pub(super) fn write(
    mesh: &WorldMesh,
    colors: Option<&ColorData>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    write_header(&mesh.placement, None, writer)?;
    write_mesh("mesh", &[Sample { mesh, colors, style: None }], writer)?;
    writeln!(writer, "}}")
}

/// Writes several meshes, visible together or one after the other.
pub(super) fn write_scene<'a>(
    frames: &'a [WorldSceneMesh],
    arrangement: Arrangement,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let Some(first) = frames.first() else { return Ok(()) };
    let sample = |WorldSceneMesh { mesh, colors, style }: &'a WorldSceneMesh| Sample {
        mesh,
        colors: colors.as_ref(),
        style: Some(*style),
    };
    let samples: Vec<Sample<'_>> = frames.iter().map(sample).collect();
    match arrangement {
        Arrangement::Sweep { seconds } => {
            write_header(&first.mesh.placement, Some((frames.len(), seconds)), writer)?;
            write_mesh("mesh", &samples, writer)?;
        }
        Arrangement::Together => {
            write_header(&first.mesh.placement, None, writer)?;
            for (i, sample) in samples.iter().enumerate() {
                write_mesh(&format!("mesh_{}", i + 1), std::slice::from_ref(sample), writer)?;
            }
        }
    }
    writeln!(writer, "}}")
}

/// Writes the metadata and opens the root prim; `sweep` is the number of frames and their total seconds.
fn write_header(
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

/// Metres per unit; `None` for the unknown unit.
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

/// A mesh prim at one time.
struct Sample<'a> {
    mesh: &'a WorldMesh,
    colors: Option<&'a ColorData>,
    style: Option<SurfaceStyle>,
}

/// Writes a mesh prim, time-sampled if there are several samples.
fn write_mesh(name: &str, samples: &[Sample<'_>], writer: &mut dyn Write) -> io::Result<()> {
    writeln!(writer, "    def Mesh \"{name}\"\n    {{")?;
    writeln!(writer, "        uniform token subdivisionScheme = \"none\"")?;
    writeln!(writer, "        uniform bool doubleSided = 1")?;
    let mut attribute =
        |declaration: &str, is_per_vertex, value: &dyn Fn(&Sample<'_>) -> String| {
            write_attribute(samples, declaration, is_per_vertex, value, writer)
        };
    attribute("float3[] extent", false, &|s| extent(&s.mesh.positions_around_origin()))?;
    attribute("int[] faceVertexCounts", false, &|s| list(s.mesh.mesh.triangles.iter().map(|_| 3)))?;
    attribute("int[] faceVertexIndices", false, &|s| list(s.mesh.mesh.triangles.iter().flatten()))?;
    attribute("point3f[] points", false, &|s| vectors(s.mesh.positions_around_origin()))?;
    attribute("normal3f[] normals", true, &|s| vectors(s.mesh.mesh.normals.iter().copied()))?;
    let colors: Option<Vec<&ColorData>> = samples.iter().map(|sample| sample.colors).collect();
    if let Some(first) = colors.as_ref().and_then(|colors| colors.first()) {
        attribute("color3f[] primvars:displayColor", true, &|s| {
            vectors(s.colors.iter().flat_map(|colors| colors.linear.iter().copied()))
        })?;
        attribute(&format!("float[] primvars:{}", first.name), true, &|s| {
            // USDA has no portable NaN.
            let values = s.colors.iter().flat_map(|colors| colors.vertex_values.iter());
            list(values.map(|&x| if x.is_finite() { x } else { 0.0 }))
        })?;
    }
    let styles: Option<Vec<SurfaceStyle>> = samples.iter().map(|sample| sample.style).collect();
    if styles.is_some() {
        attribute("custom double isovalue", false, &|s| {
            s.style.map_or_else(String::new, |style| style.isovalue.to_string())
        })?;
    }
    if let (None, Some([SurfaceStyle { color: [r, g, b], opacity, .. }])) =
        (&colors, styles.as_deref())
    {
        writeln!(writer, "        color3f[] primvars:displayColor = [({r}, {g}, {b})]")?;
        writeln!(writer, "        float[] primvars:displayOpacity = [{opacity}]")?;
    }
    writeln!(writer, "    }}")
}

/// Writes an attribute of a mesh, with a value for each time if there are several samples.
fn write_attribute(
    samples: &[Sample<'_>],
    declaration: &str,
    is_per_vertex: bool,
    value: &dyn Fn(&Sample<'_>) -> String,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let metadata = match is_per_vertex {
        true => " (\n            interpolation = \"vertex\"\n        )",
        false => "",
    };
    if let [sample] = samples {
        return writeln!(writer, "        {declaration} = {}{metadata}", value(sample));
    }
    // Metadata belongs to the declaration, not to the time samples.
    if is_per_vertex {
        writeln!(writer, "        {declaration}{metadata}")?;
    }
    writeln!(writer, "        {declaration}.timeSamples = {{")?;
    for (time, sample) in samples.iter().enumerate() {
        writeln!(writer, "            {time}: {},", value(sample))?;
    }
    writeln!(writer, "        }}")
}

/// A list in brackets.
fn list(items: impl Iterator<Item = impl Display>) -> String {
    let items: Vec<String> = items.map(|item| item.to_string()).collect();
    format!("[{}]", items.join(", "))
}

/// A list of tuples of three.
fn vectors(rows: impl IntoIterator<Item = [f32; 3]>) -> String {
    list(rows.into_iter().map(|[x, y, z]| format!("({x}, {y}, {z})")))
}

/// Minimum and maximum corner of the bounding box of points; zero for no points.
fn extent(points: &[[f32; 3]]) -> String {
    let bound = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
        let points = points.iter().copied();
        points.reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i]))).unwrap_or_default()
    };
    vectors([bound(f32::min), bound(f32::max)])
}
