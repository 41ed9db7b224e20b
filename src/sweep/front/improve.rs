//! Better triangles where the mesh has come out of exact cells, at the isovalue of the exchange.
//!
//! # Theory
//!
//! The exact extraction's triangles are small and thin. They are remeshed as the tracked mesh is; what was tracked before
//! does not move. Where that leaves a face turned over, off the isosurface or crossing another, the triangles stay as they
//! came.

use glam::Vec3;

use super::exchange::Exchanged;
use super::part::Part;
use super::region::Grid;
use super::tracked::Tracked;
use super::transport::faults;
use crate::error::Result;
use crate::kernels::Kernels;
use crate::kernels::field::Field;
use crate::mesh::{Face, Mesh, Vertex, intersecting};
use crate::sweep::Parameters;
use crate::sweep::criteria::{Criteria, extend_sizing, sizing};
use crate::sweep::flips::{Flips, flip_edges};
use crate::sweep::refine::{refine, split_long};
use crate::sweep::remesh::SIZING_GOAL;
use crate::sweep::simplify::{Bounds, simplify};

/// Rounds of split, collapse, flip and relaxation.
const ROUNDS: usize = 3;

/// Share of the tolerance within which collapses stay, so that refinement does not undo them.
const COLLAPSE_SHARE: f32 = 0.5;

/// The same is tried so often, each time with fewer vertices that move: around faults twice as far.
const ATTEMPTS: usize = 4;

/// What improvement knows of the sweep.
pub(super) struct Improvement<'a> {
    pub(super) field: &'a Field,
    pub(super) grid: Grid,
    pub(super) parameters: &'a Parameters,
    pub(super) isovalue: f64,
}

impl Improvement<'_> {
    fn criteria(&self) -> Criteria<'_> {
        Criteria::new(self.field, self.isovalue, self.parameters)
    }

    /// The part of the mesh around its new vertices, improved; none if there are no new ones.
    pub(super) fn improved(
        &self,
        whole: &Tracked,
        is_new: &dyn Fn(Vertex) -> bool,
        kernels: &mut dyn Kernels,
    ) -> Result<Option<Exchanged>> {
        let mesh = &whole.mesh;
        let mut is_near = vec![false; mesh.vertex_slots()];
        let is_free_new = |v: &Vertex| !mesh.is_fixed(*v) && is_new(*v);
        let new: Vec<Vertex> = mesh.vertices().filter(is_free_new).collect();
        for &v in &new {
            is_near[v.0 as usize] = true;
            mesh.one_ring(v).for_each(|w| is_near[w.0 as usize] = true);
        }
        let near = |f: &Face| mesh.face_vertices(*f).into_iter().any(|v| is_near[v.0 as usize]);
        let faces: Vec<Face> = mesh.faces().filter(|&f| !mesh.is_cap(f)).filter(near).collect();
        if faces.is_empty() {
            return Ok(None);
        }
        let part = Part::of(whole, &faces);
        let key = |v: u32| part.origin[v as usize].and_then(|o| whole.key(o));
        let made =
            Tracked::of(part.positions.clone(), part.triangles.clone(), key, &mut Vec::new());
        let Ok(fresh) = made else { return Ok(None) };
        let moves = |v: Vertex| {
            let o = part.origin.get(v.0 as usize).copied().flatten();
            o.is_none_or(is_new)
        };
        let mut held: Vec<Vertex> = fresh.mesh.vertices().filter(|&v| !moves(v)).collect();
        let mut made = fresh.clone();
        for attempt in 0..ATTEMPTS {
            self.remesh(&mut made.mesh, &held, kernels)?;
            let bad = self.bad_places(&made);
            if bad.is_empty() || attempt + 1 == ATTEMPTS {
                break;
            }
            log::debug!("{} faults in what is new", bad.len());
            let blocks = bad.into_iter().filter_map(|p| self.block_at(p));
            let around = blocks.flat_map(|b| self.grid.blocks_within(b, 1 << attempt));
            let marked = self.grid.marked(around);
            let is_beside = |v: &Vertex| {
                let block = self.block_at(fresh.mesh.position(*v));
                block.is_some_and(|b| marked[b as usize])
            };
            held.extend(fresh.mesh.vertices().filter(is_beside));
            made = fresh.clone();
        }
        let mut was: Vec<Option<Face>> = part.faces.iter().copied().map(Some).collect();
        was.resize(made.mesh.face_slots(), None);
        let mut origin = part.origin.clone();
        origin.resize(made.mesh.vertex_slots(), None);
        Ok(Some(Exchanged { part, made, origin, was }))
    }

    /// Remeshes what is not held.
    fn remesh(&self, mesh: &mut Mesh, held: &[Vertex], kernels: &mut dyn Kernels) -> Result<()> {
        let held: Vec<Vertex> = held.iter().copied().filter(|&v| !mesh.is_fixed(v)).collect();
        held.iter().for_each(|&v| mesh.set_pinned(v, true));
        let criteria = self.criteria();
        let parameters = self.parameters;
        for _ in 0..ROUNDS {
            let deviations = criteria.deviations(mesh);
            let mut length = sizing(mesh, &criteria, &deviations, SIZING_GOAL * criteria.error);
            split_long(mesh, &criteria, &length, 1.4, &mut Vec::new());
            extend_sizing(mesh, &mut length);
            simplify(mesh, &criteria, &length, Bounds { short: 0.75, share: COLLAPSE_SHARE });
            flip_edges(mesh, &criteria, 3, Flips::ALL);
            let compacted = mesh.compacted_free();
            kernels.load(&compacted.connectivity, &compacted.positions)?;
            let [strength, force] = [parameters.relax_strength, parameters.relax_force];
            kernels.relax(self.isovalue, strength as f32, force as f32, 4)?;
            let positions = kernels.positions()?;
            for (&v, p) in compacted.vertices.iter().zip(positions) {
                if !mesh.is_pinned(v) {
                    mesh.set_position(v, p.into());
                }
            }
        }
        let deviations = criteria.deviations(mesh);
        refine(mesh, &criteria, &deviations, &mut Vec::new());
        flip_edges(mesh, &criteria, 2, Flips::ALL);
        for v in held {
            if mesh.has_vertex(v) {
                mesh.set_pinned(v, false);
            }
        }
        Ok(())
    }

    /// Places of a mesh whose faces are turned over, off, or cross others.
    fn bad_places(&self, tracked: &Tracked) -> Vec<Vec3> {
        let mut places = faults(tracked, &self.criteria(), self.parameters);
        let mesh = &tracked.mesh;
        let faces: Vec<Face> = mesh.faces().filter(|&f| !mesh.is_cap(f)).collect();
        let triangles: Vec<[u32; 3]> =
            faces.iter().map(|&f| mesh.face_vertices(f).map(|v| v.0)).collect();
        let positions: Vec<[f32; 3]> =
            (0..mesh.vertex_slots() as u32).map(|v| mesh.position(Vertex(v)).to_array()).collect();
        let crossing = intersecting(&positions, &triangles);
        let middle = |f: u32| mesh.corners(faces[f as usize]).iter().sum::<Vec3>() / 3.0;
        places.extend(crossing.into_iter().map(middle));
        places
    }

    /// The block around a place of the voxel frame.
    fn block_at(&self, p: Vec3) -> Option<u32> {
        self.grid.block_at(p * self.field.inverse_cell_size())
    }
}
