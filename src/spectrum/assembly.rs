//! Builds a mesh from triangles of a spectrum: renumbers vertices, interpolates positions, computes normals.
//!
//! # Invariants
//!
//! Saved meshes and rendered pictures have the same normals: both are computed here.

use rayon::prelude::*;

use super::data::Spectrum;
use super::index_set::IndexSet;
use super::mesh::Mesh;
use super::normals;

/// Vertices per task: about a millisecond, far more than starting a task takes.
const VERTICES_PER_TASK: usize = 1 << 13;

/// Renumbers vertices. Its arrays are reused for the next mesh, and no array of the spectrum's size is
/// ever cleared.
#[derive(Clone, Debug)]
pub(crate) struct Assembly {
    /// The vertices of the mesh that is being built.
    used: IndexSet,
    /// By vertex of the spectrum, its index in the mesh.
    indices: Vec<u32>,
    /// By vertex of the last mesh, its number in the spectrum.
    vertices: Vec<u32>,
}

impl Assembly {
    /// For meshes of one spectrum.
    pub(crate) fn new(spectrum: &Spectrum) -> Self {
        let n_vertices = spectrum.n_vertices();
        Assembly {
            used: IndexSet::new(n_vertices),
            indices: vec![0; n_vertices],
            vertices: Vec::new(),
        }
    }

    /// By vertex of the last mesh, its number in the spectrum.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Writes the mesh of some triangles, each with whether it is a cap. Its vertices are sorted by their number in the spectrum;
    /// `position` returns their positions.
    pub(crate) fn assemble(
        &mut self,
        triangles: impl Iterator<Item = ([u32; 3], bool)>,
        position: impl Fn(u32) -> [f32; 3] + Sync,
        mesh: &mut Mesh,
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
        // All elements are overwritten.
        mesh.positions.resize(self.vertices.len(), [0.0; 3]);
        let write_positions = |(vertices, positions): (&[u32], &mut [_])| {
            for (&v, p) in vertices.iter().zip(positions) {
                *p = position(v);
            }
        };
        if self.vertices.len() <= VERTICES_PER_TASK {
            write_positions((&self.vertices, &mut mesh.positions));
        } else {
            (self.vertices.par_chunks(VERTICES_PER_TASK))
                .zip(mesh.positions.par_chunks_mut(VERTICES_PER_TASK))
                .for_each(write_positions);
        }
        normals::of_mesh(&mesh.positions, &mesh.triangles, &mesh.caps, &mut mesh.normals);
    }
}
