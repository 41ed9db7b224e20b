//! Moves every free vertex to the next isovalue, and collects the places where that fails.

use std::collections::{BTreeSet, HashMap};

use glam::Vec3;
use rayon::prelude::*;

use super::places::Places;
use super::region::{LatticeEdge, Region};
use super::tracked::{Tracked, place_on};
use crate::error::Result;
use crate::extract::extract_cell;
use crate::field::{Field, Status};
use crate::kernels::{Advance, Advanced, Kernels, Relaxation};
use crate::mesh::{Compacted, Face, Vertex, area, intersecting, normal};
use crate::sweep::parameters::Parameters;
use crate::sweep::remesh::criteria::Criteria;
use crate::topology::exact::ExactField;

/// A vertex that moves farther in one step is a failure, voxels.
pub(super) const MAX_MOTION: f32 = 2.5;

/// A vertex farther outside the volume is a failure, voxels.
const MAX_OUTSIDE: f32 = 0.05;

/// A smaller face has no reliable normal and is not checked, square voxels.
pub(super) const MIN_FACE_AREA: f32 = 1e-3;

/// Largest deviation of a face from the isosurface, in tolerances; twice as large at the end of a step, before refinement.
pub(super) const MAX_DEVIATION_FACTOR: f32 = 2.0;

/// The vertices at the end of a step, and the failures.
#[derive(Default)]
pub(super) struct Moved {
    /// The vertices that move and their neighbours, ascending.
    pub(super) vertices: Vec<Vertex>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// Places that could not be tracked, voxel frame.
    pub(super) places: Vec<Vec3>,
    /// Faces that are turned over or cross others.
    pub(super) folded: Vec<Face>,
}

impl Moved {
    pub(super) fn end(&self, v: Vertex) -> Option<[f32; 3]> {
        self.vertices.binary_search(&v).ok().map(|i| self.positions[i])
    }

    /// The vertices, with positions and normals.
    pub(super) fn all(&self) -> impl Iterator<Item = (Vertex, [f32; 3], [f32; 3])> {
        let ends = self.positions.iter().zip(&self.normals);
        self.vertices.iter().zip(ends).map(|(v, (p, n))| (*v, *p, *n))
    }

    /// Adds the vertices of an earlier attempt that were not moved again.
    fn keep(&mut self, before: &Moved, tracked: &Tracked) {
        let mut old = before.all().filter(|v| tracked.mesh.has_vertex(v.0)).peekable();
        let mut all = Vec::with_capacity(before.vertices.len());
        for v in self.all() {
            all.extend(std::iter::from_fn(|| old.next_if(|o| o.0 < v.0)));
            old.next_if(|o| o.0 == v.0);
            all.push(v);
        }
        all.extend(old);
        self.vertices = all.iter().map(|v| v.0).collect();
        self.positions = all.iter().map(|v| v.1).collect();
        self.normals = all.iter().map(|v| v.2).collect();
    }
}

/// A retry of a step after the mesh has changed in some places.
pub(super) struct Retry {
    pub(super) before: Moved,
    /// Vertices that are new or removed since.
    pub(super) fresh: BTreeSet<Vertex>,
    /// By block: whether it or a neighbour has changed.
    pub(super) near: Vec<bool>,
    /// By block: whether it is within two blocks of a change.
    pub(super) wide: Vec<bool>,
}

/// A step from one isovalue to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) at: f64,
    pub(super) next: f64,
}

/// The motion of a mesh in one step.
pub(super) struct Transport<'a> {
    pub(super) tracked: &'a Tracked,
    pub(super) places: &'a Places,
    pub(super) region: &'a Region,
    pub(super) exact: &'a ExactField<'a>,
    pub(super) field: &'a Field,
    pub(super) parameters: &'a Parameters,
    pub(super) step: Step,
    /// `None` if all of the mesh moves.
    pub(super) retry: Option<&'a Retry>,
}

impl Transport<'_> {
    /// Moves free vertices to the next isovalue, relaxes them there, and checks the result.
    pub(super) fn moved(&self, kernels: &mut dyn Kernels) -> Result<Moved> {
        let mesh = &self.tracked.mesh;
        // By vertex slot, whether it was moved before.
        let mut known = vec![false; mesh.vertex_slots()];
        for v in self.retry.iter().flat_map(|a| &a.before.vertices) {
            if let Some(known) = known.get_mut(v.0 as usize) {
                *known = true;
            }
        }
        let moves: Vec<bool> = (0..mesh.vertex_slots() as u32)
            .into_par_iter()
            .map(Vertex)
            .map(|v| {
                let retry = |a: &Retry| {
                    a.near[self.places.block(v) as usize]
                        || !known[v.0 as usize]
                        || a.fresh.contains(&v)
                };
                mesh.has_vertex(v) && !mesh.is_pinned(v) && self.retry.is_none_or(retry)
            })
            .collect();
        let moves = |v: Vertex| moves.get(v.0 as usize).copied().unwrap_or(false);
        let compacted = mesh.compacted_where(moves);
        let mut moved = Moved::default();
        if !compacted.positions.is_empty() {
            self.project_and_relax(kernels, &compacted, &moves, &mut moved)?;
            self.check_faces(&compacted, &mut moved);
            self.check_crossings(&compacted, &mut moved);
            moved.folded.sort_unstable();
            moved.folded.dedup();
        }
        if let Some(retry) = self.retry {
            moved.keep(&retry.before, self.tracked);
        }
        Ok(moved)
    }

    /// The end of a vertex that does not move freely: on its lattice edge if it is bound, else where an earlier attempt moved it.
    fn constrained_end(&self, v: Vertex) -> Option<[f32; 3]> {
        match self.tracked.key(v) {
            Some(e) => Some(place_on(self.exact, e, self.step.next).to_array()),
            None => self.retry.and_then(|a| a.before.end(v)),
        }
    }

    /// Projects and relaxes.
    fn project_and_relax(
        &self,
        kernels: &mut dyn Kernels,
        compacted: &Compacted,
        moves: &dyn Fn(Vertex) -> bool,
        moved: &mut Moved,
    ) -> Result<()> {
        let Step { next, .. } = self.step;
        let before = &compacted.positions;
        kernels.load(&compacted.connectivity, before)?;
        let end = |(&v, &p): (&Vertex, &[f32; 3])| {
            if moves(v) { p } else { self.constrained_end(v).unwrap_or(p) }
        };
        let ends: Vec<[f32; 3]> = compacted.vertices.iter().zip(before).map(end).collect();
        let Advanced { positions, normals, status } = kernels.advance(&Advance {
            isovalues: &[next],
            reach: MAX_MOTION,
            ends: &ends,
            relaxation: Relaxation {
                isovalue: next,
                strength: self.parameters.relax_strength as f32,
                threshold: self.parameters.relax_force as f32,
                max_iterations: self.parameters.relax_iterations,
            },
        })?;
        (moved.positions, moved.normals) = (positions, normals);
        moved.vertices = compacted.vertices.clone();
        let top = self.field.top();
        for i in (0..before.len()).filter(|&i| moves(compacted.vertices[i])) {
            let [p, q] = [before[i], moved.positions[i]].map(Vec3::from);
            let far = p.distance(q) > MAX_MOTION || self.is_outside(q, top);
            if status[i] == Status::Failed || far {
                moved.places.push(p);
            }
        }
        Ok(())
    }

    /// Whether a position at the end of the step is outside the volume: the tracked mesh must not enter the layer around it.
    fn is_outside(&self, p: Vec3, top: Vec3) -> bool {
        let beyond = (-p).max(p - top).max_element();
        if beyond <= 0.0 {
            return false;
        }
        let inside = p.clamp(Vec3::ZERO, top);
        let value = self.field.value(inside) - self.field.isovalue(self.step.next);
        let most = self.parameters.error as f32;
        beyond > MAX_OUTSIDE || value.abs() > most * self.field.inner_slope(inside)
    }

    /// True if none of the face's vertices is removed during the step. Where the seam crosses a sample, faces change before the
    /// end.
    fn stays(&self, f: Face) -> bool {
        let level = self.exact.isovalue_level(self.step.next);
        self.tracked.mesh.face_vertices(f).into_iter().all(|v| {
            self.tracked.key(v).is_none_or(|e| {
                let ends = [e.from, e.from + self.exact.strides()[e.axis as usize]];
                let [a, b] = ends.map(|v| self.exact.level(v) > level);
                a != b
            })
        })
    }

    /// The middle of a face before the step, which is in a tracked cell; after the step it may be in another.
    fn middle(&self, f: Face) -> Vec3 {
        self.tracked.mesh.corners(f).iter().sum::<Vec3>() / 3.0
    }

    /// The middle of a face after the step, unless that is in an exact cell.
    fn end_place(&self, corners: [Vec3; 3]) -> Option<Vec3> {
        let p = corners.iter().sum::<Vec3>() / 3.0;
        let block = self.region.grid.block_at(p * self.field.inverse_cell_size());
        (!self.region.holds(block)).then_some(p)
    }

    /// Collects faces that are turned over or off the isosurface.
    fn check_faces(&self, compacted: &Compacted, moved: &mut Moved) {
        let Step { at, next } = self.step;
        let ends = Criteria::new(self.field, next, self.parameters);
        let midway = Criteria::new(self.field, 0.5 * (at + next), self.parameters);
        // At the end of the step faces are refined, so they may deviate more than half-way.
        let [most, most_midway] = [2.0 * MAX_DEVIATION_FACTOR, MAX_DEVIATION_FACTOR]
            .map(|x| x * self.parameters.error as f32);
        let end = |v: u32| Vec3::from(moved.positions[v as usize]);
        let middle = |v: u32| 0.5 * (end(v) + Vec3::from(compacted.positions[v as usize]));
        let faces = compacted.faces.par_iter().zip(&compacted.connectivity.faces);
        let found: Vec<(Fault, [Vec3; 3], Face)> = faces
            .with_min_len(256)
            .filter_map(|(&slot, t)| {
                let [a, m] = [t.map(end), t.map(middle)];
                if !self.stays(slot) || area(a) < MIN_FACE_AREA {
                    return None;
                }
                let is_off = || is_off(&midway, m, most_midway).then_some(Fault::Off);
                let fault = fault(&ends, a, most).or_else(is_off)?;
                Some((fault, a, slot))
            })
            .collect();
        for (fault, corners, slot) in found {
            if fault == Fault::Turned {
                moved.folded.push(slot);
            }
            moved.places.push(self.middle(slot));
            moved.places.extend(self.end_place(corners));
        }
    }

    /// Collects faces that cross others, or exact triangles at the seam.
    fn check_crossings(&self, compacted: &Compacted, moved: &mut Moved) {
        let mesh = &self.tracked.mesh;
        let mut numbers: HashMap<Vertex, u32> = HashMap::new();
        let mut positions = moved.positions.clone();
        let all = compacted.faces.iter().zip(&compacted.connectivity.faces);
        let (slots, mut faces): (Vec<Face>, Vec<[u32; 3]>) =
            all.filter(|f| self.stays(*f.0)).map(|(f, t)| (*f, *t)).unzip();
        let own = |v: Vertex| compacted.vertices.binary_search(&v).ok().map(|i| i as u32);
        if let Some(retry) = self.retry {
            let is_adjacent =
                |f: &Face| compacted.faces.binary_search(f).is_err() && self.stays(*f);
            let near = self.places.faces_in(self.tracked, &retry.wide);
            for f in near.into_iter().filter(is_adjacent) {
                faces.push(mesh.face_vertices(f).map(|v| {
                    own(v).unwrap_or_else(|| {
                        *numbers.entry(v).or_insert_with(|| {
                            let end = self.constrained_end(v);
                            positions.push(end.unwrap_or(mesh.position(v).to_array()));
                            positions.len() as u32 - 1
                        })
                    })
                }));
            }
        }
        let bound = |e: LatticeEdge| {
            let v = self.tracked.vertex_at(e)?;
            own(v).or_else(|| numbers.get(&v).copied())
        };
        self.add_exact_neighbours(&bound, &mut positions, &mut faces);
        let crossing = intersecting(&positions, &faces);
        for f in crossing.into_iter().map(|f| f as usize).filter(|&f| f < slots.len()) {
            moved.folded.push(slots[f]);
            let corners = faces[f].map(|v| Vec3::from(positions[v as usize]));
            moved.places.push(self.middle(slots[f]));
            moved.places.extend(self.end_place(corners));
        }
    }

    /// Adds the exact triangles in exact cells at the seam, which share the seam's vertices.
    fn add_exact_neighbours(
        &self,
        bound: &dyn Fn(LatticeEdge) -> Option<u32>,
        positions: &mut Vec<[f32; 3]>,
        triangles: &mut Vec<[u32; 3]>,
    ) {
        let (region, exact) = (self.region, self.exact);
        let grid = region.grid;
        let strides = exact.strides();
        let is_near = |b: u32| self.retry.is_none_or(|a| a.wide[b as usize]);
        let blocks = region.blocks().iter().copied().filter(|&b| is_near(b));
        let mut made: HashMap<LatticeEdge, u32> = HashMap::new();
        let is_adjacent = |&cell: &u32| {
            strides.iter().any(|s| !region.is_exact(cell - s) || !region.is_exact(cell + s))
        };
        let cells: Vec<u32> = blocks.flat_map(|b| grid.cells_of(b)).filter(is_adjacent).collect();
        let cells = cells.into_par_iter().with_min_len(64);
        let surfaces = cells.map(|cell| extract_cell(exact, cell, self.step.next));
        for surface in surfaces.collect::<Vec<_>>() {
            let mut numbers = Vec::with_capacity(surface.positions.len());
            for (crossing, &position) in surface.crossings.iter().zip(&surface.positions) {
                let next = positions.len() as u32;
                let number = crossing.map_or(next, |ends| {
                    let e = grid.edge_between(ends);
                    bound(e).unwrap_or_else(|| *made.entry(e).or_insert(next))
                });
                if number == next {
                    positions.push(position);
                }
                numbers.push(number);
            }
            triangles.extend(surface.faces.iter().map(|f| f.map(|v| numbers[v as usize])));
        }
    }
}

/// What is wrong with a face: it is turned over, or off the isosurface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    Turned,
    Off,
}

/// What is wrong with a face, if anything.
pub(super) fn fault(criteria: &Criteria, t: [Vec3; 3], most: f32) -> Option<Fault> {
    let barycentre = t.iter().sum::<Vec3>() / 3.0;
    if area(t) < MIN_FACE_AREA {
        return None;
    }
    let (value, gradient) = criteria.field.value_and_gradient(barycentre);
    if normal(t).dot(gradient) > 0.0 {
        return Some(Fault::Turned);
    }
    let distance = distance(criteria, value, gradient);
    (distance > most && criteria.deviation(t) > most).then_some(Fault::Off)
}

/// Those of some faces that are turned over or deviate by more than `most`.
pub(super) fn faults(
    tracked: &Tracked,
    criteria: &Criteria,
    most: f32,
    faces: Vec<Face>,
) -> Vec<Face> {
    let mesh = &tracked.mesh;
    let fails = |f: &Face| {
        mesh.has_face(*f) && !mesh.is_cap(*f) && fault(criteria, mesh.corners(*f), most).is_some()
    };
    faces.into_par_iter().with_min_len(256).filter(fails).collect()
}

/// Whether a face's barycentre is farther than `most` from the isosurface, both by the field's slope there and along its
/// normal, as the normal of a sliver is arbitrary.
fn is_off(criteria: &Criteria, t: [Vec3; 3], most: f32) -> bool {
    distance_by_slope(criteria, t) > most && criteria.deviation(t) > most
}

/// Distance of a face's barycentre from the isosurface by the field's slope there, voxels.
pub(super) fn distance_by_slope(criteria: &Criteria, t: [Vec3; 3]) -> f32 {
    let (value, gradient) = criteria.field.value_and_gradient(t.iter().sum::<Vec3>() / 3.0);
    distance(criteria, value, gradient)
}

fn distance(criteria: &Criteria, value: f32, gradient: Vec3) -> f32 {
    (value - criteria.isovalue).abs() / gradient.length().max(1e-12)
}

/// The slope that nine of ten positions reach.
pub(super) fn typical_slope(
    field: &Field,
    places: impl IndexedParallelIterator<Item = Vec3>,
) -> Option<f32> {
    let mut slopes: Vec<f32> = places.with_min_len(1024).map(|p| field.inner_slope(p)).collect();
    if slopes.is_empty() {
        return None;
    }
    let i = slopes.len() / 10;
    Some(*slopes.select_nth_unstable_by(i, f32::total_cmp).1)
}
