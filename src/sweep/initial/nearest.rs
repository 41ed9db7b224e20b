//! The vertices of an extraction by lattice cell, to find the nearest one to a point.

use glam::{IVec3, Vec3};

use crate::extract::Extraction;

/// The vertices of an extraction, sorted by the lattice cell that they lie in.
pub(super) struct ExtractionVertices<'a> {
    extraction: &'a Extraction,
    inverse_cell_size: Vec3,
    /// Cell and vertex, ascending.
    by_cell: Vec<([i32; 3], u32)>,
    /// Per vertex: its component.
    components: Vec<u32>,
}

impl<'a> ExtractionVertices<'a> {
    /// Sorts the vertices; `inverse_cell_size` is in cells per voxel.
    pub(super) fn new(extraction: &'a Extraction, inverse_cell_size: Vec3) -> Self {
        let mut components = vec![0; extraction.positions.len()];
        for (face, &component) in extraction.faces.iter().zip(&extraction.components) {
            face.iter().for_each(|&v| components[v as usize] = component);
        }
        let cell =
            |p: &[f32; 3]| (Vec3::from(*p) * inverse_cell_size).floor().as_ivec3().to_array();
        let mut by_cell: Vec<_> =
            extraction.positions.iter().enumerate().map(|(v, p)| (cell(p), v as u32)).collect();
        by_cell.sort_unstable();
        ExtractionVertices { extraction, inverse_cell_size, by_cell, components }
    }

    /// The component of the vertex nearest to a point (voxel frame) among those in its cell and
    /// the 26 around it: where the isosurface is in a cell, it has vertices on the cell's edges.
    pub(super) fn component_near(&self, p: Vec3) -> Option<u32> {
        let cell = (p * self.inverse_cell_size).floor().as_ivec3();
        let mut nearest = (f32::INFINITY, None);
        for n in 0..27 {
            let at = (cell + IVec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)).to_array();
            let start = self.by_cell.partition_point(|entry| entry.0 < at);
            for &(_, v) in self.by_cell[start..].iter().take_while(|entry| entry.0 == at) {
                let distance = p.distance_squared(self.extraction.positions[v as usize].into());
                if distance < nearest.0 {
                    nearest = (distance, Some(self.components[v as usize]));
                }
            }
        }
        nearest.1
    }
}
