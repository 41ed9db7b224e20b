//! A mesh of its own out of triangles of a spectrum: vertices numbered anew, placed, with normals.
//!
//! # Invariants
//!
//! What meshes are saved with and what pictures are shaded with are the same normals: both come from here.

use rayon::prelude::*;

use super::numbers::Numbers;
use super::{Spectrum, SurfaceMesh, normals};

/// Vertices that one thread places at a time: about a millisecond, which starting another one does not come
/// near to.
const VERTICES_PER_TASK: usize = 1 << 13;

/// Numbers vertices anew. What one mesh leaves behind is used again by the next, so nothing of the spectrum's size is
/// ever cleared.
#[derive(Clone, Debug)]
pub(crate) struct Assembly {
    /// The vertices of the mesh in the making.
    used: Numbers,
    /// Of each of them, its index in the mesh.
    indices: Vec<u32>,
    /// The vertices of the last mesh, by their index in it.
    vertices: Vec<u32>,
}

impl Assembly {
    /// For meshes of one spectrum.
    pub(crate) fn new(spectrum: &Spectrum) -> Self {
        let n_vertices = spectrum.n_vertices();
        Assembly {
            used: Numbers::new(n_vertices),
            indices: vec![0; n_vertices],
            vertices: Vec::new(),
        }
    }

    /// The vertices of the last mesh, by their index in it: which of the spectrum's they are.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Writes triangles, each with whether it is a cap, to `mesh`: its vertices are theirs by number, where `place`
    /// puts them.
    pub(crate) fn assemble(
        &mut self,
        triangles: impl Iterator<Item = ([u32; 3], bool)>,
        place: impl Fn(u32) -> [f32; 3] + Sync,
        mesh: &mut SurfaceMesh,
    ) {
        mesh.triangles.clear();
        mesh.caps.clear();
        for (corners, is_cap) in triangles {
            corners.iter().for_each(|&v| self.used.insert(v));
            mesh.triangles.push(corners);
            mesh.caps.push(is_cap);
        }
        self.vertices.clear();
        self.used.drain(|v| {
            self.indices[v as usize] = self.vertices.len() as u32;
            self.vertices.push(v);
        });
        for triangle in &mut mesh.triangles {
            *triangle = triangle.map(|v| self.indices[v as usize]);
        }
        // Not cleared before: all of it is written.
        mesh.positions.resize(self.vertices.len(), [0.0; 3]);
        let place_some = |(vertices, positions): (&[u32], &mut [_])| {
            for (&v, position) in vertices.iter().zip(positions) {
                *position = place(v);
            }
        };
        if self.vertices.len() <= VERTICES_PER_TASK {
            place_some((&self.vertices, &mut mesh.positions));
        } else {
            (self.vertices.par_chunks(VERTICES_PER_TASK))
                .zip(mesh.positions.par_chunks_mut(VERTICES_PER_TASK))
                .for_each(place_some);
        }
        normals::of_mesh(&mesh.positions, &mesh.triangles, &mesh.caps, &mut mesh.normals);
    }
}
