//! Remeshing of triangles that come from released cells, at the isovalue of the exchange.
//!
//! # Theory
//!
//! The exact extraction's triangles are small and thin. They are remeshed like the tracked mesh; vertices tracked before
//! do not move. Where faces are turned over or off after that, cells become exact in the next step.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::SIZING_GOAL;
use super::criteria::{Criteria, extend_sizing, sizing};
use super::flips::{Flips, flip_edges};
use super::refine::{refine, split_long};
use super::simplify::{Bounds, simplify};
use crate::disjoint_sets::DisjointSets;
use crate::error::Result;
use crate::field::Field;
use crate::kernels::{Advance, Kernels, Relaxation};
use crate::mesh::{Compacted, Connectivity, Face, HalfEdgeMesh, Vertex};
use crate::sweep::exchanged::Exchanged;
use crate::sweep::parameters::Parameters;
use crate::sweep::part::MeshPart;
use crate::sweep::tracked::Tracked;

/// Rounds of split, collapse, flip and relaxation.
const ROUNDS: usize = 3;

/// Largest deviation after a collapse, as a share of the tolerance, so that refinement does not undo it.
const COLLAPSE_SHARE: f32 = 0.5;

/// The parameters of the remeshing.
pub(in crate::sweep) struct Improvement<'a> {
    pub(in crate::sweep) field: &'a Field,
    pub(in crate::sweep) parameters: &'a Parameters,
    pub(in crate::sweep) isovalue: f64,
}

/// A part of the mesh that is new, or next to new faces.
struct Fresh {
    part: MeshPart,
    made: Tracked,
    /// The vertices that do not move.
    pinned: Vec<Vertex>,
}

impl Improvement<'_> {
    /// The parts of the mesh around its new vertices, improved; no two have a vertex in common.
    pub(in crate::sweep) fn improved(
        &self,
        whole: &Tracked,
        new: &BTreeSet<Vertex>,
        kernels: &mut dyn Kernels,
    ) -> Result<Vec<Exchanged>> {
        let is_new = &|v: Vertex| new.contains(&v);
        let parts = parts(whole, new.iter().copied());
        let mut all: Vec<Fresh> =
            parts.par_iter().filter_map(|faces| Fresh::of(whole, faces, is_new)).collect();
        self.remesh(&mut all, kernels)?;
        Ok(all.into_iter().map(Fresh::exchanged).collect())
    }

    /// Remeshes all parts; their pinned vertices do not move.
    fn remesh(&self, all: &mut [Fresh], kernels: &mut dyn Kernels) -> Result<()> {
        let criteria = Criteria::new(self.field, self.isovalue, self.parameters);
        all.iter_mut().for_each(|fresh| fresh.pin(true));
        for _ in 0..ROUNDS {
            all.par_iter_mut().for_each(|fresh| edit(&mut fresh.made.mesh, &criteria));
            self.relax(all, kernels)?;
        }
        all.par_iter_mut().for_each(|fresh| {
            let mesh = &mut fresh.made.mesh;
            let deviations = criteria.deviations(mesh);
            refine(mesh, &criteria, &deviations);
            let edges = mesh.edges().collect();
            flip_edges(mesh, &criteria, edges, 2, Flips::ALL);
            fresh.pin(false);
        });
        Ok(())
    }

    /// Relaxes all parts at once.
    fn relax(&self, all: &mut [Fresh], kernels: &mut dyn Kernels) -> Result<()> {
        let free = |fresh: &Fresh| {
            let mesh = &fresh.made.mesh;
            mesh.compacted_where(|v| !mesh.is_pinned(v))
        };
        let compacted: Vec<Compacted> = all.par_iter().map(free).collect();
        let mut connectivity = Connectivity::default();
        let mut positions = Vec::new();
        for c in &compacted {
            connectivity.append(&c.connectivity);
            positions.extend_from_slice(&c.positions);
        }
        if positions.is_empty() {
            return Ok(());
        }
        kernels.load(&connectivity, &positions)?;
        let advanced = kernels.advance(&Advance {
            isovalues: &[],
            reach: 0.0,
            ends: &[],
            relaxation: Relaxation {
                isovalue: self.isovalue,
                strength: self.parameters.relax_strength as f32,
                threshold: self.parameters.relax_force as f32,
                max_iterations: self.parameters.relax_iterations,
            },
        })?;
        let mut positions = advanced.positions.into_iter();
        for (fresh, c) in all.iter_mut().zip(&compacted) {
            let mesh = &mut fresh.made.mesh;
            for (&v, p) in c.vertices.iter().zip(&mut positions) {
                if !mesh.is_pinned(v) {
                    mesh.set_position(v, p.into());
                }
            }
        }
        Ok(())
    }
}

impl Fresh {
    fn of(
        whole: &Tracked,
        faces: &[Face],
        is_new: &(dyn Fn(Vertex) -> bool + Sync),
    ) -> Option<Fresh> {
        let part = MeshPart::of(whole, faces);
        let origin = |v: u32| part.origin.get(v as usize).copied().flatten();
        let key = |v: u32| origin(v).and_then(|o| whole.key(o));
        let made = Tracked::of(part.positions.clone(), part.triangles.clone(), key);
        let made = made.ok()?;
        let moves = |v: Vertex| origin(v.0).is_none_or(is_new);
        let still = made.mesh.vertices().filter(|&v| !made.mesh.is_fixed(v) && !moves(v));
        let pinned = still.collect();
        Some(Fresh { part, made, pinned })
    }

    fn pin(&mut self, is_pinned: bool) {
        for &v in &self.pinned {
            if self.made.mesh.has_vertex(v) {
                self.made.mesh.set_pinned(v, is_pinned);
            }
        }
    }

    fn exchanged(self) -> Exchanged {
        let Fresh { part, made, .. } = self;
        let mut was: Vec<Option<Face>> = part.faces.iter().copied().map(Some).collect();
        was.resize(made.mesh.face_slots(), None);
        let mut origin = part.origin.clone();
        origin.resize(made.mesh.vertex_slots(), None);
        Exchanged { part, made, origin, was }
    }
}

/// The faces at new vertices and their neighbours, ascending, in sets that have no vertex in common.
fn parts(whole: &Tracked, new: impl Iterator<Item = Vertex>) -> Vec<Vec<Face>> {
    let mesh = &whole.mesh;
    let free = new.filter(|&v| mesh.has_vertex(v) && !mesh.is_fixed(v));
    let mut near: Vec<Vertex> = free.flat_map(|v| mesh.one_ring(v).chain([v])).collect();
    near.sort_unstable();
    near.dedup();
    let around = near.into_iter().flat_map(|v| mesh.spokes(v)).map(|h| mesh.face(h));
    let mut faces: Vec<Face> = around.filter(|&f| !mesh.is_cap(f)).collect();
    faces.sort_unstable();
    faces.dedup();
    let mut sets = DisjointSets::new(mesh.vertex_slots());
    for &f in &faces {
        let [a, b, c] = mesh.face_vertices(f).map(|v| v.0);
        sets.join(a, b);
        sets.join(a, c);
    }
    let mut parts: BTreeMap<u32, Vec<Face>> = BTreeMap::new();
    for &f in &faces {
        parts.entry(sets.find(mesh.face_vertices(f)[0].0)).or_default().push(f);
    }
    parts.into_values().collect()
}

/// One round of splits, collapses and flips of everything that is not pinned.
fn edit(mesh: &mut HalfEdgeMesh, criteria: &Criteria) {
    let deviations = criteria.deviations(mesh);
    let mut length = sizing(mesh, criteria, &deviations, SIZING_GOAL * criteria.error);
    split_long(mesh, criteria, &length, 1.4);
    extend_sizing(mesh, &mut length);
    simplify(mesh, criteria, &length, Bounds { short: 0.75, share: COLLAPSE_SHARE });
    let edges = mesh.edges().collect();
    flip_edges(mesh, criteria, edges, 3, Flips::ALL);
}
