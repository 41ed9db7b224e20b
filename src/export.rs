//! Export of meshes: one module per file format, chosen by the file's extension.
//!
//! The library works in the voxel frame; exported files are in the world frame of the volume. World positions are computed in
//! 64-bit floats and rounded only by the format. The writers are small, written by hand, and tested by reading their bytes
//! back.
//!
//! | format | positions | unit and space |
//! |---|---|---|
//! | PLY | 32-bit floats; 64-bit where 32 bits lose precision | comments `SPACE=` and `unit` |
//! | OBJ | text, same precision | comments `SPACE=` and `unit` |
//! | STL | 32-bit floats; a warning where they lose precision | `SPACE=` in the header |
//! | VTP | 32-bit floats; 64-bit where 32 bits lose precision | a comment |
//! | 3MF | text, in millimetres where the unit is known | `millimeter` |
//! | GLB | 32-bit floats relative to the origin, which is the node's translation | `extras` of the node |
//! | USDA | text, 32-bit floats relative to the origin, which is the translation of the mesh | `metersPerUnit` |
//!
//! 3D Slicer reads `SPACE=` and assumes millimetres, which volumes in a patient's space use.

mod color_data;
mod format;
mod glb;
mod morph;
mod nearest;
mod obj;
mod ply;
mod scene;
mod stl;
#[cfg(feature = "zip")]
mod three_mf;
mod usda;
mod vtp;
mod weld;
mod world_mesh;
mod written;

use std::io::{self, Write};
use std::path::Path;

use color_data::ColorData;
use world_mesh::WorldMesh;

pub use crate::ply_reader::{PlyMesh, parse_ply, read_ply};
pub use color_data::Colors;
pub use format::{Format, NO_COLORS};
pub use morph::{Morph, MorphTarget, write_morph_to};
pub use scene::{Arrangement, SceneMesh, SurfaceStyle};
pub use world_mesh::{Border, place_in_world, without_caps};
pub use written::Written;

use crate::atomic_file::write_atomically;
use crate::color::Per;
use crate::error::{Error, Result};
use crate::spectrum::Mesh;
use crate::volume::Placement;

/// Writes a mesh of the voxel frame to `path`, in the world frame and in the format of the extension. The file is complete
/// under its name, or not written at all.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown extension; [`Error::Io`]; [`Error::Input`] if the mesh is too large for the format, or
/// has coordinates that overflow 32-bit floats.
pub fn write(
    mesh: &Mesh,
    placement: &Placement,
    border: Border,
    path: impl AsRef<Path>,
) -> Result<()> {
    let path = path.as_ref();
    let format = Format::of_path(path)?;
    let mesh = WorldMesh::new(mesh, placement, border, format)?;
    write_atomically(path, |writer| encode(mesh, None, format, writer).map(|_| ()))
}

/// As [`write()`], to any writer, for example the standard output. Returns what the file has.
///
/// # Errors
///
/// [`Error::Io`] with the path `-`; [`Error::Input`] if the mesh is too large for the format, or has coordinates that
/// overflow 32-bit floats.
pub fn write_to(
    mesh: &Mesh,
    placement: &Placement,
    border: Border,
    format: Format,
    writer: &mut dyn Write,
) -> Result<Written> {
    let mesh = WorldMesh::new(mesh, placement, border, format)?;
    flushed(encode(mesh, None, format, writer), writer)
}

/// As [`write_to`], with colours and the values they show. PLY and VTP store values per vertex or per triangle, GLB and USDA
/// per vertex; OBJ stores colours only.
///
/// # Errors
///
/// As [`write_to`]; [`Error::Usage`] for a format without colours, and for a number of values that does not fit the mesh.
pub fn write_colored_to(
    mesh: &Mesh,
    placement: &Placement,
    colors: Colors<'_>,
    format: Format,
    writer: &mut dyn Write,
) -> Result<Written> {
    if !format.supports_colors() {
        return Err(Error::Usage(NO_COLORS.to_owned()));
    }
    let n_values = colors.attribute.values.len();
    let expected = match colors.attribute.per {
        Per::Vertex => mesh.positions.len(),
        Per::Triangle => mesh.triangles.len(),
    };
    if n_values != expected {
        return Err(Error::Usage(format!("{n_values} values to colour by, expected {expected}")));
    }
    let colors = ColorData::new(colors, mesh);
    let mesh = WorldMesh::new(mesh, placement, Border::Closed, format)?;
    flushed(encode(mesh, Some(colors), format, writer), writer)
}

/// Writes several meshes of the voxel frame into one file, in the world frame.
///
/// # Errors
///
/// [`Error::Usage`] for a format that holds one mesh per file ([`Format::supports_scenes`]), and for an empty list; otherwise
/// as [`write_to`].
pub fn write_scene_to(
    meshes: Vec<SceneMesh>,
    arrangement: Arrangement,
    placement: &Placement,
    format: Format,
    writer: &mut dyn Write,
) -> Result<()> {
    if !format.supports_scenes() || meshes.is_empty() {
        return Err(Error::Usage("several meshes in one file, expected .glb or .usda".to_owned()));
    }
    let mut frames = Vec::new();
    for SceneMesh { mesh, style, colors } in meshes {
        let colors = colors
            .map(|(attribute, map)| ColorData::new(Colors { attribute: &attribute, map }, &mesh));
        let mesh = WorldMesh::new(&mesh, placement, Border::Closed, format)?;
        frames.push(scene::WorldSceneMesh { mesh, colors, style });
    }
    let written = match format {
        Format::Glb => glb::write_scene(&frames, arrangement, writer),
        _ => usda::write_scene(&frames, arrangement, writer),
    };
    flushed(written, writer)
}

fn encode(
    mesh: WorldMesh,
    colors: Option<ColorData>,
    format: Format,
    writer: &mut dyn Write,
) -> io::Result<Written> {
    let colors = colors.as_ref();
    let whole = Written::of(&mesh.mesh);
    let written = match format {
        Format::Ply => ply::write(&mesh, colors, writer),
        Format::Stl => return stl::write(mesh, writer),
        Format::Obj => obj::write(&mesh, colors, writer),
        Format::Glb => glb::write(mesh, colors, writer),
        Format::Vtp => vtp::write(&mesh, colors, writer),
        #[cfg(feature = "zip")]
        Format::ThreeMf => three_mf::write(&mesh, writer),
        #[cfg(not(feature = "zip"))]
        Format::ThreeMf => Err(io::Error::other("3MF: built without the feature `zip`")),
        Format::Usda => usda::write(&mesh, colors, writer),
    };
    written.map(|()| whole)
}

/// Flushes the writer after a successful write; errors carry the path `-`.
fn flushed<T>(written: io::Result<T>, writer: &mut dyn Write) -> Result<T> {
    written.and_then(|value| writer.flush().map(|()| value)).map_err(|e| Error::io("-", e))
}
