//! The block of every vertex of the mesh, so that what concerns some blocks looks at the mesh near them only.
//!
//! # Invariants
//!
//! Positions of the mesh change at the end of a step, when all is found anew, and in exchanges. In between, edits may make faces larger.

use glam::Vec3;
use rayon::prelude::*;

use super::region::{BLOCK, PaddedGrid};
use super::tracked::Tracked;
use crate::mesh::{Face, HalfEdgeMesh, Vertex, bounds};

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Places {
    grid: PaddedGrid,
    /// Cells per voxel.
    scale: Vec3,
    /// By vertex slot.
    blocks: Vec<u32>,
    /// The largest extent of a face along an axis, at least; cells.
    extent: f32,
}

impl Places {
    /// Those of a mesh.
    pub(super) fn of(tracked: &Tracked, grid: PaddedGrid, scale: Vec3) -> Places {
        let mesh = &tracked.mesh;
        let slots = (0..mesh.vertex_slots() as u32).into_par_iter().with_min_len(1024).map(Vertex);
        let blocks = slots.map(|v| grid.block_at(mesh.position(v) * scale)).collect();
        let faces = mesh.par_faces().filter(|&f| !mesh.is_cap(f));
        let extent = faces.map(|f| extent(mesh, scale, f)).reduce(|| 0.0, f32::max);
        Places { grid, scale, blocks, extent }
    }

    /// Vertices have moved or come, and faces have come or changed.
    pub(super) fn update(
        &mut self,
        tracked: &Tracked,
        vertices: impl IntoIterator<Item = Vertex>,
        faces: impl IntoIterator<Item = Face>,
    ) {
        let mesh = &tracked.mesh;
        self.blocks.resize(mesh.vertex_slots(), 0);
        for v in vertices {
            self.blocks[v.0 as usize] = self.grid.block_at(mesh.position(v) * self.scale);
        }
        for f in faces.into_iter().filter(|&f| mesh.has_face(f) && !mesh.is_cap(f)) {
            self.extent = self.extent.max(extent(mesh, self.scale, f));
        }
    }

    /// The block of a vertex.
    pub(super) fn block(&self, v: Vertex) -> u32 {
        self.blocks[v.0 as usize]
    }

    /// The faces with a vertex in one of some blocks, ascending and without caps.
    pub(super) fn faces_in(&self, tracked: &Tracked, is_in: &[bool]) -> Vec<Face> {
        let mesh = &tracked.mesh;
        let inside = mesh.vertices().filter(|v| is_in[self.block(*v) as usize]);
        let around = inside.flat_map(|v| mesh.spokes(v).map(|h| mesh.face(h)));
        let mut faces: Vec<Face> = around.filter(|&f| !mesh.is_cap(f)).collect();
        faces.par_sort_unstable();
        faces.dedup();
        faces
    }

    /// In how many rings of blocks around a block a face within `distance` cells of it has all its vertices.
    pub(super) fn rings(&self, distance: f32) -> usize {
        // Rounding must not matter.
        (1.001 * (self.extent + distance) / BLOCK as f32) as usize + 1
    }
}

/// The largest extent of a face along an axis, cells.
fn extent(mesh: &HalfEdgeMesh, scale: Vec3, f: Face) -> f32 {
    let (low, high) = bounds(mesh.corners(f));
    ((high - low) * scale).max_element()
}
