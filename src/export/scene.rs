//! Several meshes in one file: their appearance and their arrangement in time.

use super::color_data::ColorData;
use super::world_mesh::WorldMesh;
use crate::color::{Attribute, Map};
use crate::spectrum::Mesh;

/// The isovalue and the material of one of several surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceStyle {
    /// The isovalue.
    pub isovalue: f64,
    /// Linear red, green and blue if no colours show a value.
    pub color: [f32; 3],
    /// Opacity, 0 to 1.
    pub opacity: f32,
}

/// How several meshes are arranged in one file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrangement {
    /// All of them visible at the same time.
    Together,
    /// An animation that shows one after the other.
    Sweep {
        /// Duration of the animation, more than 0.
        seconds: f64,
    },
}

/// One of several meshes, voxel frame. Its caps are exported as they are.
#[derive(Clone, Debug)]
pub struct SceneMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Its isovalue and material.
    pub style: SurfaceStyle,
    /// Values of its vertices or triangles, and their colour map.
    pub colors: Option<(Attribute, Map)>,
}

/// A [`SceneMesh`] in the world frame, ready to be written.
pub(super) struct WorldSceneMesh {
    pub(super) mesh: WorldMesh,
    pub(super) colors: Option<ColorData>,
    pub(super) style: SurfaceStyle,
}
