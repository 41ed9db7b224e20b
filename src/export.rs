//! Meshes for other programs: one module per format, chosen by the file's extension.
//!
//! Everything inside the library is in the voxel frame; what leaves it is in the world frame of the
//! volume, in 64-bit floats until a format rounds them. Writers are small enough to be written by hand and tested by
//! reading their bytes back.
//!
//! | format | where a position is | unit and space |
//! |---|---|---|
//! | PLY | 32-bit floats; 64-bit where those lose more than a spectrum does | comments `SPACE=` and `unit` |
//! | OBJ | text of the same | comments `SPACE=` and `unit` |
//! | STL | 32-bit floats; a warning where they lose | `SPACE=` in the head |
//! | VTP | 32-bit floats; 64-bit where those lose more than a spectrum does | a comment |
//! | 3MF | text, in millimetres where the unit is known | `millimeter` |
//! | GLB | 32-bit floats around the origin, which is the node's translation | `extras` of the node |
//! | USDA | text of 32-bit floats around the origin, which is the translation of the mesh | `metersPerUnit` |
//!
//! `SPACE=` is read by 3D Slicer, which takes millimetres: those that a volume of a patient's space is in.

mod glb;
mod morph;
mod nearest;
mod obj;
mod ply;
mod stl;
#[cfg(feature = "zip")]
mod three_mf;
mod usda;
mod vtp;
mod weld;

use std::io::{self, Write};
use std::path::Path;

pub use morph::{MOST_TARGETS, Morph, Shape, write_morph_to};

pub use crate::ply_reader::{PlyMesh, parse_ply, read_ply};

use crate::atomic_file::write_atomically;
use crate::color::{Attribute, Map, Per, to_srgb};
use crate::error::{Error, Result};
use crate::spectrum::{FINEST_QUANTUM, SurfaceMesh};
use crate::volume::{Placement, Space};

/// A mesh format that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Binary little-endian PLY with normals.
    Ply,
    /// Binary STL.
    Stl,
    /// Wavefront OBJ with normals.
    Obj,
    /// Binary glTF 2.0.
    Glb,
    /// VTK's polygons, XML with raw numbers behind it.
    Vtp,
    /// 3MF for printing, in millimetres.
    ThreeMf,
    /// Universal Scene Description, as text.
    Usda,
}

/// What is said where colours are asked of a format that has none.
pub const NO_COLORS: &str = "STL and 3MF have no colours here; .ply, .obj, .glb, .vtp and .usda do";

impl Format {
    /// Whether files of the format can hold colours.
    pub fn has_colors(self) -> bool {
        !matches!(self, Format::Stl | Format::ThreeMf)
    }

    /// Whether one file of the format can hold several meshes, [`write_all_to`].
    pub fn has_scenes(self) -> bool {
        matches!(self, Format::Glb | Format::Usda)
    }

    /// The format of a path by its extension, in either case.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if the extension is none of `.ply`, `.stl`, `.obj`, `.glb`, `.vtp`, `.3mf`, `.usda`.
    pub fn of_path(path: &Path) -> Result<Format> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "ply" => Ok(Format::Ply),
            "stl" => Ok(Format::Stl),
            "obj" => Ok(Format::Obj),
            "glb" => Ok(Format::Glb),
            "vtp" => Ok(Format::Vtp),
            "3mf" if cfg!(feature = "zip") => Ok(Format::ThreeMf),
            "3mf" => Err(Error::Usage(format!(
                "{}: this build cannot write it: built without the feature `zip`",
                path.display()
            ))),
            "usda" => Ok(Format::Usda),
            _ => Err(Error::Usage(format!(
                "{}: unknown mesh format, expected a name that ends in .ply, .stl, .obj, .glb, .vtp, .3mf or .usda",
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
    write_atomically(path, |writer| encode(mesh, None, format, writer))
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
    encode(mesh, None, format, writer).and_then(|()| writer.flush()).map_err(|e| Error::io("-", e))
}

/// Numbers of a mesh and the map that shows them.
#[derive(Clone, Copy, Debug)]
pub struct Colors<'a> {
    /// Of the vertices or triangles of the mesh that is written.
    pub attribute: &'a Attribute,
    /// The map.
    pub map: Map,
}

/// As [`write_to`], with colours and the numbers that they show: PLY has both per vertex, and the numbers of triangles by
/// triangle; VTP and GLB likewise, GLB per vertex alone; OBJ has colours.
///
/// # Errors
///
/// As [`write_to`]; [`Error::Usage`] for STL, which has no colours, and for numbers of another mesh.
pub fn write_colored_to(
    mesh: &SurfaceMesh,
    placement: &Placement,
    colors: Colors<'_>,
    format: Format,
    writer: &mut dyn Write,
) -> Result<()> {
    if !format.has_colors() {
        return Err(Error::Usage(NO_COLORS.to_owned()));
    }
    let Attribute { per, values, .. } = colors.attribute;
    let expected = if *per == Per::Vertex { mesh.positions.len() } else { mesh.triangles.len() };
    if values.len() != expected {
        return Err(Error::Usage(format!(
            "{} numbers to colour by, expected {expected}",
            values.len()
        )));
    }
    let painted = Painted::new(colors, mesh);
    let mesh = prepared(mesh, placement, Border::Closed, format)?;
    encode(mesh, Some(painted), format, writer)
        .and_then(|()| writer.flush())
        .map_err(|e| Error::io("-", e))
}

/// How one of several surfaces looks, and what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Its isovalue.
    pub isovalue: f64,
    /// Linear red, green and blue where no colours show something.
    pub color: [f32; 3],
    /// How much of what lies behind it hides, 0 to 1.
    pub opacity: f32,
}

/// How several meshes are in one file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrangement {
    /// Beside each other.
    Together,
    /// One after the other, all of them in so many seconds.
    Sweep {
        /// How long it takes, more than 0.
        seconds: f64,
    },
}

/// A mesh of the voxel frame among several, without its caps where they are not wanted, and what its colours show.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The mesh.
    pub mesh: SurfaceMesh,
    /// What it is and how it looks.
    pub look: Look,
    /// Numbers of its vertices or triangles, and the map that shows them.
    pub shown: Option<(Attribute, Map)>,
}

/// Writes several meshes of the voxel frame into one file, in the world frame.
///
/// # Errors
///
/// [`Error::Usage`] for a format that holds one mesh a file ([`Format::has_scenes`]), and for no mesh; else as [`write_to`].
pub fn write_all_to(
    frames: Vec<Frame>,
    arrangement: Arrangement,
    placement: &Placement,
    format: Format,
    writer: &mut dyn Write,
) -> Result<()> {
    if !format.has_scenes() || frames.is_empty() {
        return Err(Error::Usage("several meshes in one file, expected .glb or .usda".to_owned()));
    }
    let mut prepared_frames = Vec::new();
    for Frame { mesh, look, shown } in frames {
        let painted = shown
            .map(|(attribute, map)| Painted::new(Colors { attribute: &attribute, map }, &mesh));
        prepared_frames.push((prepared(&mesh, placement, Border::Closed, format)?, painted, look));
    }
    let written = match format {
        Format::Glb => glb::write_all(&prepared_frames, arrangement, writer),
        _ => usda::write_all(&prepared_frames, arrangement, writer),
    };
    written.and_then(|()| writer.flush()).map_err(|e| Error::io("-", e))
}

/// Numbers and colours as formats hold them.
struct Painted {
    /// The name as files spell it.
    name: String,
    /// By vertex.
    numbers: Vec<f32>,
    /// By triangle, where they belong to triangles.
    of_triangles: Option<Vec<f32>>,
    /// Linear red, green and blue, by vertex.
    linear: Vec<[f32; 3]>,
}

impl Painted {
    fn new(Colors { attribute, map }: Colors<'_>, mesh: &SurfaceMesh) -> Self {
        let numbers = attribute.by_vertex(mesh);
        Painted {
            name: attribute.identifier(),
            linear: numbers.iter().map(|&x| attribute.color_of(x, map)).collect(),
            of_triangles: (attribute.per == Per::Triangle).then(|| attribute.values.clone()),
            numbers,
        }
    }

    /// As they are seen, by vertex.
    fn srgb(&self) -> impl Iterator<Item = [u8; 3]> + '_ {
        self.linear.iter().map(|color| color.map(to_srgb))
    }
}

/// A mesh as it leaves: its triangles and normals are those of the world, its positions are asked for.
struct Placed {
    mesh: SurfaceMesh,
    placement: Placement,
    /// Whether 32-bit floats are so far apart here that they lose what a spectrum tells of a position.
    is_far: bool,
}

impl Placed {
    fn new(mut mesh: SurfaceMesh, placement: &Placement) -> Self {
        to_world_sides(&mut mesh, placement);
        let farthest = |at: &dyn Fn([f32; 3]) -> [f64; 3]| {
            let positions = mesh.positions.iter().flat_map(|&p| at(p));
            positions.fold(0.0, |most: f64, x| most.max(x.abs()))
        };
        let step = f64::from(f32::EPSILON) * farthest(&|p| placement.world_of_voxel(p));
        // Where the volume alone is that large, 64 bits tell no more than its own 32.
        let own = f64::from(f32::EPSILON) * farthest(&|p| placement.around_origin(p));
        let is_far = step > 2.0 * own && step > placement.voxel() * FINEST_QUANTUM;
        Placed { mesh, placement: *placement, is_far }
    }

    /// World positions of all vertices.
    fn positions(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.mesh.positions.iter().map(|&p| self.placement.world_of_voxel(p))
    }

    /// The same as the nearest 32-bit floats.
    fn narrow_positions(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.positions().map(|p| p.map(|x| x as f32))
    }

    /// What tells 3D Slicer and those who follow it what the axes of the world mean; they take millimetres.
    fn space(&self) -> Option<String> {
        (self.placement.space != Space::Unknown).then(|| format!("SPACE={}", self.placement.space))
    }
}

/// The mesh as it leaves, and checked against the format's limits.
fn prepared(
    mesh: &SurfaceMesh,
    placement: &Placement,
    border: Border,
    format: Format,
) -> Result<Placed> {
    let mesh = match border {
        Border::Closed => mesh.clone(),
        Border::Open => without_caps(mesh),
    };
    let largest = match format {
        // Vertex indices are 32-bit signed in PLY as most programs read it.
        // So in 3MF and USD, by their rules.
        Format::Ply | Format::Vtp | Format::ThreeMf | Format::Usda => i32::MAX as usize,
        Format::Stl | Format::Obj => u32::MAX as usize,
        // The length of a GLB file is 32 bits; a vertex takes 36 bytes, a triangle 12.
        Format::Glb => (u32::MAX as usize - (1 << 16)) / 48,
    };
    if mesh.positions.len().max(mesh.triangles.len()) > largest {
        return Err(Error::input(format!(
            "{} vertices and {} triangles, expected at most {largest} in this format",
            mesh.positions.len(),
            mesh.triangles.len()
        )));
    }
    let placed = Placed::new(mesh, placement);
    // Other programs hold 32-bit floats, and the world may lie beyond them.
    let beyond = |row: &[f32; 3]| row.iter().any(|x| !x.is_finite());
    let position = placed.narrow_positions().enumerate().find(|(_, row)| beyond(row));
    let normal = placed.mesh.normals.iter().copied().enumerate().find(|(_, row)| beyond(row));
    for (what, found) in [("position", position), ("normal", normal)] {
        if let Some((v, row)) = found {
            return Err(Error::input(format!(
                "vertex {v} has the {what} {row:?} in the world, expected numbers that 32-bit floats hold"
            )));
        }
    }
    Ok(placed)
}

fn encode(
    placed: Placed,
    painted: Option<Painted>,
    format: Format,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let painted = painted.as_ref();
    match format {
        Format::Ply => ply::write(&placed, painted, writer),
        Format::Stl => stl::write(placed, writer),
        Format::Obj => obj::write(&placed, painted, writer),
        Format::Glb => glb::write(placed, painted, writer),
        Format::Vtp => vtp::write(&placed, painted, writer),
        #[cfg(feature = "zip")]
        Format::ThreeMf => three_mf::write(&placed, writer),
        #[cfg(not(feature = "zip"))]
        Format::ThreeMf => Err(io::Error::other("3MF: built without the feature `zip`")),
        Format::Usda => usda::write(&placed, painted, writer),
    }
}

/// Moves a mesh from the voxel frame to the axes and the unit of the world, around the origin: direction *
/// (smallest spacing * p), to which the origin of the placement is left to be added, as 32-bit floats lose the shape of
/// what lies far away. Areas and volumes are those of the world. Where the axes of the volume are left-handed in the world,
/// triangles are turned around, so that they stay counter-clockwise seen from lower values.
pub fn place_in_world(mut mesh: SurfaceMesh, placement: &Placement) -> SurfaceMesh {
    for p in &mut mesh.positions {
        *p = placement.around_origin(*p).map(|x| x as f32);
    }
    to_world_sides(&mut mesh, placement);
    mesh
}

/// Turns normals, and triangles around where the axes are left-handed.
fn to_world_sides(mesh: &mut SurfaceMesh, placement: &Placement) {
    let turned = placement.normals();
    for n in &mut mesh.normals {
        *n = turned(*n);
    }
    if placement.span() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// The mesh without its caps and without the vertices that only caps use.
pub fn without_caps(mesh: &SurfaceMesh) -> SurfaceMesh {
    mesh.with_triangles(|t| !mesh.caps[t])
}
