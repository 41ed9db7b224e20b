//! The triangles of which a part of the mesh is rebuilt: its remaining faces, and those of released cells.

use std::collections::{BTreeMap, HashMap};

use super::super::fans::split_fans;
use super::super::part::MeshPart;
use super::super::region::{LatticeEdge, PaddedGrid};
use super::super::tracked::{Tracked, place_on};
use crate::extract::extract_cell;
use crate::mesh::{Face, Vertex};
use crate::topology::exact::ExactField;

/// Triangles to build a mesh of.
#[derive(Default)]
pub(super) struct Pieces {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The vertices bound to lattice edges.
    pub(super) bound: HashMap<u32, LatticeEdge>,
    /// By vertex (missing at the end): its vertex of the whole mesh.
    pub(super) origin: Vec<Option<Vertex>>,
    /// By vertex (missing at the end): whether it is on the part's rim.
    pub(super) rim: Vec<bool>,
    /// By triangle (missing at the end): the face of the whole mesh that it was.
    pub(super) was: Vec<Option<Face>>,
}

impl Pieces {
    /// What is left of a part, which has been cut, without removed faces.
    pub(super) fn left(part: &MeshPart, cut: &Tracked, removed: &[bool]) -> Pieces {
        let mesh = &cut.mesh;
        let slots = (0..mesh.vertex_slots() as u32).map(Vertex);
        let is_left = |f: &Face| !mesh.is_cap(*f) && !removed[f.0 as usize];
        let left: Vec<Face> = mesh.faces().filter(is_left).collect();
        Pieces {
            positions: slots.map(|v| mesh.position(v).to_array()).collect(),
            triangles: left.iter().map(|&f| mesh.face_vertices(f).map(|v| v.0)).collect(),
            origin: part.origin.clone(),
            rim: part.is_rim.clone(),
            was: left.iter().map(|f| part.faces.get(f.0 as usize).copied()).collect(),
            ..Pieces::default()
        }
    }

    /// Duplicates vertices at which fans of triangles meet without a common edge, so that each fan has its own.
    pub(super) fn split_pinched(&mut self) {
        for v in split_fans(&mut self.triangles, self.positions.len()) {
            let copy = self.positions.len() as u32;
            self.positions.push(self.positions[v as usize]);
            if let Some(&e) = self.bound.get(&v) {
                self.bound.insert(copy, e);
            }
            let rim = self.is_rim(v);
            self.origin.resize(copy as usize, None);
            self.origin.push(self.origin[v as usize].filter(|_| rim));
            self.rim.resize(copy as usize, false);
            self.rim.push(rim);
        }
    }

    /// The lattice edge that a vertex is bound to, or was in the mesh before.
    pub(super) fn bound_by(&self, before: &Tracked, v: u32) -> Option<LatticeEdge> {
        self.bound.get(&v).copied().or_else(|| before.key(Vertex(v)))
    }

    pub(super) fn is_rim(&self, v: u32) -> bool {
        self.rim.get(v as usize).copied().unwrap_or(false)
    }
}

/// Adds the exact extraction's triangles in the cells that are no longer exact, and binds their vertices.
pub(super) fn release(
    nodes: &BTreeMap<LatticeEdge, u32>,
    released: &[u32],
    field: &ExactField,
    isovalue: f64,
    pieces: &mut Pieces,
) {
    let grid = PaddedGrid::of(field);
    let mut made: HashMap<LatticeEdge, u32> = HashMap::new();
    let level = field.isovalue_level(isovalue);
    for block in released {
        for cell in grid.cells_of(*block) {
            let offsets = field.cell_offsets();
            let levels = field.levels_at(cell, offsets);
            let above = levels.iter().filter(|&&l| l > level).count();
            if above == 0 || above == 8 {
                continue;
            }
            let surface = extract_cell(field, cell, isovalue);
            let numbers: Vec<u32> = surface
                .crossings
                .iter()
                .zip(&surface.positions)
                .map(|(crossing, &position)| {
                    let Some(ends) = crossing else {
                        pieces.positions.push(position);
                        return pieces.positions.len() as u32 - 1;
                    };
                    let e = grid.edge_between(*ends);
                    let v = nodes.get(&e).copied().unwrap_or_else(|| {
                        *made.entry(e).or_insert_with(|| {
                            pieces.positions.push(place_on(field, e, isovalue).to_array());
                            pieces.positions.len() as u32 - 1
                        })
                    });
                    pieces.bound.insert(v, e);
                    v
                })
                .collect();
            pieces.triangles.extend(surface.faces.iter().map(|f| f.map(|v| numbers[v as usize])));
        }
    }
}
