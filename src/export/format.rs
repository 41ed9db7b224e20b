//! The file formats of meshes, and what each can hold.

use std::path::Path;

use crate::error::{Error, Result};

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
    /// VTK PolyData: XML with appended raw arrays.
    Vtp,
    /// 3MF for printing, in millimetres.
    ThreeMf,
    /// Universal Scene Description, as text.
    Usda,
}

/// The message of the error for colours in a format that has none.
pub const NO_COLORS: &str = "STL and 3MF have no colours here; .ply, .obj, .glb, .vtp and .usda do";

impl Format {
    /// Whether files of the format can hold colours.
    pub fn supports_colors(self) -> bool {
        !matches!(self, Format::Stl | Format::ThreeMf)
    }

    /// Whether one file of the format can hold several meshes ([`write_scene_to`](super::write_scene_to)).
    pub fn supports_scenes(self) -> bool {
        matches!(self, Format::Glb | Format::Usda)
    }

    /// The format of a path by its extension, in upper or lower case.
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

    /// The largest number of vertices or triangles that a file can hold.
    pub(super) fn max_elements(self) -> usize {
        match self {
            // 3MF and USD define vertex indices as 32-bit signed integers; most programs read those of PLY so, too.
            Format::Ply | Format::Vtp | Format::ThreeMf | Format::Usda => i32::MAX as usize,
            Format::Stl | Format::Obj => u32::MAX as usize,
            // The length of a GLB file is 32 bits; a vertex takes 36 bytes, a triangle 12.
            Format::Glb => (u32::MAX as usize - (1 << 16)) / 48,
        }
    }
}
