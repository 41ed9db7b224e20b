//! Meshes in the world frame.

use super::format::Format;
use crate::error::{Error, Result};
use crate::spectrum::{FINEST_QUANTUM, Mesh};
use crate::volume::{Placement, Space, Unit};

/// Whether a mesh is exported with its caps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Border {
    /// With caps: the mesh is closed at the border of the volume.
    #[default]
    Closed,
    /// Without caps: the mesh ends at the border of the volume, as with other extractors.
    Open,
}

/// A mesh ready to be written: triangles and normals are those of the world frame; positions stay in the voxel frame and are
/// transformed when they are written.
pub(super) struct WorldMesh {
    pub(super) mesh: Mesh,
    pub(super) placement: Placement,
    /// Whether the mesh is so far from the world's origin that 32-bit floats lose precision that a spectrum has.
    pub(super) is_far: bool,
}

impl WorldMesh {
    /// Transforms a mesh and checks it against the limits of the format.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the mesh is too large for the format, or has coordinates that overflow 32-bit floats.
    pub(super) fn new(
        mesh: &Mesh,
        placement: &Placement,
        border: Border,
        format: Format,
    ) -> Result<Self> {
        let mut mesh = match border {
            Border::Closed => mesh.clone(),
            Border::Open => without_caps(mesh),
        };
        let max = format.max_elements();
        let (n_vertices, n_triangles) = (mesh.positions.len(), mesh.triangles.len());
        if n_vertices.max(n_triangles) > max {
            return Err(Error::input(format!(
                "{n_vertices} vertices and {n_triangles} triangles, expected at most {max} in this format"
            )));
        }
        orient_in_world(&mut mesh, placement);
        let is_far = is_far(&mesh, placement);
        let mesh = WorldMesh { mesh, placement: *placement, is_far };
        mesh.check_finite()?;
        Ok(mesh)
    }

    /// Other programs hold 32-bit floats, which a world position may overflow.
    fn check_finite(&self) -> Result<()> {
        let overflows = |row: &[f32; 3]| row.iter().any(|x| !x.is_finite());
        let position = self.positions_f32().enumerate().find(|(_, row)| overflows(row));
        let normal = self.mesh.normals.iter().copied().enumerate().find(|(_, row)| overflows(row));
        for (what, found) in [("position", position), ("normal", normal)] {
            if let Some((v, row)) = found {
                return Err(Error::input(format!(
                    "vertex {v} has the {what} {row:?} in the world, expected numbers that 32-bit floats hold"
                )));
            }
        }
        Ok(())
    }

    /// World positions of all vertices.
    pub(super) fn positions(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.mesh.positions.iter().map(|&p| self.placement.world_of_voxel(p))
    }

    /// World positions of all vertices, rounded to 32-bit floats.
    pub(super) fn positions_f32(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.positions().map(|p| p.map(|x| x as f32))
    }

    /// World positions of all vertices relative to the origin of the placement.
    pub(super) fn positions_around_origin(&self) -> Vec<[f32; 3]> {
        let around = |&p: &[f32; 3]| self.placement.around_origin(p).map(|x| x as f32);
        self.mesh.positions.iter().map(around).collect()
    }

    /// `SPACE=LPS` or similar, by which 3D Slicer and compatible programs know the axes of the world; they assume
    /// millimetres.
    pub(super) fn space_comment(&self) -> Option<String> {
        let space = self.placement.space;
        (space != Space::Unknown).then(|| format!("SPACE={space}"))
    }

    /// The unit, for human readers.
    pub(super) fn unit_comment(&self) -> Option<String> {
        let unit = self.placement.unit;
        (unit != Unit::Unknown).then(|| format!("unit {unit}"))
    }
}

fn is_far(mesh: &Mesh, placement: &Placement) -> bool {
    let largest = |at: &dyn Fn([f32; 3]) -> [f64; 3]| {
        let coordinates = mesh.positions.iter().flat_map(|&p| at(p));
        coordinates.fold(0.0, |largest: f64, x| largest.max(x.abs()))
    };
    let step = f64::from(f32::EPSILON) * largest(&|p| placement.world_of_voxel(p));
    // Where the volume alone is that large, its own 32-bit positions are no more precise.
    let own_step = f64::from(f32::EPSILON) * largest(&|p| placement.around_origin(p));
    step > 2.0 * own_step && step > placement.voxel() * FINEST_QUANTUM
}

/// Transforms a mesh from the voxel frame to the axes and the unit of the world, relative to the origin of the placement:
/// direction * (smallest spacing * p). The origin is left to be added, because 32-bit floats lose the shape of a mesh that is
/// far from the world's origin. Areas and volumes are those of the world. Where the axes of the volume are left-handed in the
/// world, the winding of the triangles is reversed, so that they stay counter-clockwise seen from the same side.
pub fn place_in_world(mut mesh: Mesh, placement: &Placement) -> Mesh {
    for p in &mut mesh.positions {
        *p = placement.around_origin(*p).map(|x| x as f32);
    }
    orient_in_world(&mut mesh, placement);
    mesh
}

/// Transforms the normals, and reverses the winding of the triangles where the axes are left-handed.
fn orient_in_world(mesh: &mut Mesh, placement: &Placement) {
    let transform = placement.normals();
    for n in &mut mesh.normals {
        *n = transform(*n);
    }
    if placement.span() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// The mesh without its caps and without the vertices that only caps use.
pub fn without_caps(mesh: &Mesh) -> Mesh {
    mesh.with_triangles(|t| !mesh.caps[t])
}
