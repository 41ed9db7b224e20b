//! Meshes for other programs: one module per format, chosen by the file's extension.
//!
//! Everything inside the library is in the voxel frame; what leaves it is in the world frame of the
//! volume ([`place_in_world`]). Writers are small enough to be written by hand and tested by
//! reading their bytes back.

mod glb;
mod obj;
mod ply;
mod ply_read;
mod stl;
mod weld;

use std::io::{self, Write};
use std::path::Path;

pub use ply_read::{PlyMesh, parse_ply, read_ply};

use crate::error::{Error, Result};
use crate::file::write_beside;
use crate::spectrum::SurfaceMesh;
use crate::volume::Placement;

/// A mesh format that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Binary little-endian PLY with normals.
    Ply,
    /// Binary STL.
    Stl,
    /// Wavefront OBJ with normals.
    Obj,
    /// Binary glTF 2.0.
    Glb,
}

impl Format {
    /// The format of a path by its extension, in either case.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if the extension is none of `.ply`, `.stl`, `.obj`, `.glb`.
    pub fn of_path(path: &Path) -> Result<Format> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "ply" => Ok(Format::Ply),
            "stl" => Ok(Format::Stl),
            "obj" => Ok(Format::Obj),
            "glb" => Ok(Format::Glb),
            _ => Err(Error::Usage(format!(
                "{}: unknown mesh format, expected a name that ends in .ply, .stl, .obj or .glb",
                path.display()
            ))),
        }
    }
}

/// Which triangles leave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Border {
    /// All: the mesh is closed at the border of the volume.
    #[default]
    Closed,
    /// No caps: the mesh ends at the border of the volume, as other extractors' do.
    Open,
}

/// Writes a mesh of the voxel frame to `path`, in the world frame and in the format of the
/// extension; beside it first, then renamed.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown extension; [`Error::Io`]; [`Error::Input`] if the mesh is too
/// large for the format, or lies where 32-bit floats do not reach.
pub fn write(
    mesh: &SurfaceMesh,
    placement: &Placement,
    border: Border,
    path: impl AsRef<Path>,
) -> Result<()> {
    let path = path.as_ref();
    let format = Format::of_path(path)?;
    let mesh = prepared(mesh, placement, border, format)?;
    write_beside(path, |writer| encode(&mesh, format, writer))
}

/// As [`write()`], to any writer: the program's standard output for one.
///
/// # Errors
///
/// [`Error::Io`] with the path `-`; [`Error::Input`] if the mesh is too large for the format, or lies where 32-bit floats
/// do not reach.
pub fn write_to(
    mesh: &SurfaceMesh,
    placement: &Placement,
    border: Border,
    format: Format,
    writer: &mut dyn Write,
) -> Result<()> {
    let mesh = prepared(mesh, placement, border, format)?;
    encode(&mesh, format, writer).and_then(|()| writer.flush()).map_err(|e| Error::io("-", e))
}

/// The mesh as it leaves, and checked against the format's limits.
fn prepared(
    mesh: &SurfaceMesh,
    placement: &Placement,
    border: Border,
    format: Format,
) -> Result<SurfaceMesh> {
    let mesh = match border {
        Border::Closed => place_in_world(mesh.clone(), placement),
        Border::Open => place_in_world(without_caps(mesh), placement),
    };
    let largest = match format {
        // Vertex indices are 32-bit signed in PLY as most programs read it.
        Format::Ply => i32::MAX as usize,
        Format::Stl | Format::Obj => u32::MAX as usize,
        // The length of a GLB file is 32 bits; a vertex takes 24 bytes, a triangle 12.
        Format::Glb => (u32::MAX as usize - (1 << 16)) / 36,
    };
    if mesh.positions.len().max(mesh.triangles.len()) > largest {
        return Err(Error::input(format!(
            "{} vertices and {} triangles, expected at most {largest} in this format",
            mesh.positions.len(),
            mesh.triangles.len()
        )));
    }
    // Every format holds 32-bit floats, and the world may lie beyond them.
    for (what, rows) in [("position", &mesh.positions), ("normal", &mesh.normals)] {
        let beyond = |row: &[f32; 3]| row.iter().any(|x| !x.is_finite());
        if let Some(v) = rows.iter().position(beyond) {
            return Err(Error::input(format!(
                "vertex {v} has the {what} {:?} in the world, expected numbers that 32-bit floats hold",
                rows[v]
            )));
        }
    }
    Ok(mesh)
}

fn encode(mesh: &SurfaceMesh, format: Format, writer: &mut dyn Write) -> io::Result<()> {
    match format {
        Format::Ply => ply::write(mesh, writer),
        Format::Stl => stl::write(mesh, writer),
        Format::Obj => obj::write(mesh, writer),
        Format::Glb => glb::write(mesh, writer),
    }
}

/// Moves a mesh from the voxel frame to the world: origin + direction * (smallest spacing * p).
/// Normals are turned likewise. Where the axes of the volume are left-handed in the world,
/// triangles are turned around, so that they stay counter-clockwise seen from lower values.
pub fn place_in_world(mut mesh: SurfaceMesh, placement: &Placement) -> SurfaceMesh {
    let Placement { origin, spacing, direction } = placement;
    let unit = spacing[0].min(spacing[1]).min(spacing[2]);
    let turned = |p: [f32; 3], scale: f64, origin: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| {
            let along = |a: usize| direction[a][i] * (scale * f64::from(p[a]));
            origin[i] + (along(0) + along(1) + along(2))
        })
    };
    for p in &mut mesh.positions {
        *p = turned(*p, unit, *origin).map(|x| x as f32);
    }
    for n in &mut mesh.normals {
        let turned = turned(*n, 1.0, [0.0; 3]);
        let length = turned.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 {
            *n = turned.map(|x| (x / length) as f32);
        }
    }
    if determinant(direction) < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    mesh
}

/// The mesh without its caps and without the vertices that only caps use.
pub fn without_caps(mesh: &SurfaceMesh) -> SurfaceMesh {
    mesh.with_triangles(|t| !mesh.caps[t])
}

fn determinant([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}
