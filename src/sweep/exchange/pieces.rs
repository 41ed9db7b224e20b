//! The triangles of which a part of the mesh is rebuilt: its remaining faces, and those of released cells.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;

use super::super::fans::{boundary, split_fans};
use super::super::part::MeshPart;
use super::super::region::{LatticeEdge, PaddedGrid};
use super::super::tracked::{Tracked, place_on};
use crate::disjoint_sets::DisjointSets;
use crate::extract::extract_cell;
use crate::mesh::{Face, Vertex, area};
use crate::topology::exact::ExactField;

/// A component that crosses no lattice edge and has a smaller area is not part of the isosurface, square voxels.
const MIN_PART_AREA: f32 = 3.0;

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

    /// Fills boundary loops that cross no lattice edge, or removes their component if it is small. Returns whether there was one.
    pub(super) fn close_loops(&mut self, nodes: &BTreeMap<LatticeEdge, u32>) -> bool {
        let Ok(next) = boundary(&self.triangles) else { return false };
        let is_node: BTreeSet<u32> = nodes.values().copied().collect();
        let mut seen: BTreeSet<u32> = BTreeSet::new();
        let mut loops: Vec<Vec<u32>> = Vec::new();
        for &first in next.keys() {
            if !seen.insert(first) {
                continue;
            }
            let (mut around, mut a) = (vec![first], next[&first]);
            while a != first {
                seen.insert(a);
                around.push(a);
                a = next[&a];
            }
            if !around.iter().any(|v| is_node.contains(v) || self.is_rim(*v)) {
                loops.push(around);
            }
        }
        if loops.is_empty() {
            return false;
        }
        let mut sets = DisjointSets::new(self.positions.len());
        for [a, b, c] in &self.triangles {
            sets.join(*a, *b);
            sets.join(*a, *c);
        }
        let at_rim: BTreeSet<u32> =
            (0..self.rim.len() as u32).filter(|&v| self.is_rim(v)).map(|v| sets.find(v)).collect();
        let place = |v: u32| Vec3::from(self.positions[v as usize]);
        let mut areas: HashMap<u32, f32> = HashMap::new();
        for t in &self.triangles {
            *areas.entry(sets.find(t[0])).or_default() += area(t.map(place));
        }
        let mut gone: BTreeSet<u32> = BTreeSet::new();
        let mut filled: Vec<(Vec3, Vec<u32>)> = Vec::new();
        for around in loops {
            let set = sets.find(around[0]);
            if areas[&set] < MIN_PART_AREA && !at_rim.contains(&set) {
                gone.insert(set);
            } else {
                let middle = around.iter().map(|&v| place(v)).sum::<Vec3>() / around.len() as f32;
                filled.push((middle, around));
            }
        }
        let kept: Vec<bool> =
            self.triangles.iter().map(|t| !gone.contains(&sets.find(t[0]))).collect();
        self.was.resize(kept.len(), None);
        let mut keep = kept.iter();
        self.triangles.retain(|_| *keep.next().expect("one each"));
        let mut keep = kept.iter();
        self.was.retain(|_| *keep.next().expect("one each"));
        for (middle, around) in filled {
            let v = self.positions.len() as u32;
            self.positions.push(middle.to_array());
            for (i, &a) in around.iter().enumerate() {
                self.triangles.push([around[(i + 1) % around.len()], a, v]);
            }
        }
        true
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
