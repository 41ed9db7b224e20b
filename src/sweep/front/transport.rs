//! Every free vertex to the next isovalue, and what of that cannot be: places, never a verdict on the mesh.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use super::region::{LatticeEdge, Region};
use super::tracked::{Tracked, place_on};
use crate::error::Result;
use crate::extract::extract_cell;
use crate::kernels::field::Field;
use crate::kernels::{Kernels, Status};
use crate::mesh::{Face, Vertex, area, intersecting, normal};
use crate::sweep::Parameters;
use crate::sweep::criteria::Criteria;
use crate::topology::exact::ExactField;

/// How far most vertices move in one projection, voxels.
const SUB_STEP_LENGTH: f32 = 0.4;

/// How far one projection may move a vertex, voxels.
const REACH: f32 = 3.0;

/// A vertex that moves farther in one step, in voxels, is no longer followed.
const MOST_MOTION: f32 = 2.5;

/// How far a vertex may be outside the volume, voxels.
const OUTSIDE: f32 = 0.05;

/// A face of a smaller area, in square voxels, has no direction.
const LEAST_AREA: f32 = 1e-3;

/// So many tolerances a face may be off half-way and at the end of a step.
const MOST_OFF: f32 = 2.0;

/// Where the vertices are after a step.
pub(super) struct Moved {
    /// The vertices that move, ascending, and those beside them.
    pub(super) vertices: Vec<Vertex>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// Places that could not be tracked, voxel frame.
    pub(super) places: Vec<Vec3>,
    /// Faces that are turned over or cross others.
    pub(super) folded: Vec<Face>,
    /// How often each check named one.
    pub(super) named: [usize; 5],
}

/// A step from one isovalue to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) at: f64,
    pub(super) next: f64,
}

/// Moves all free vertices to the next isovalue, relaxes them there, and looks where that went wrong.
pub(super) fn transport(
    tracked: &Tracked,
    region: &Region,
    exact: &ExactField,
    field: &Field,
    kernels: &mut dyn Kernels,
    parameters: &Parameters,
    Step { at, next }: Step,
) -> Result<Moved> {
    let mesh = &tracked.mesh;
    let compacted = mesh.compacted_free();
    let before = &compacted.positions;
    if before.is_empty() {
        return Ok(Moved {
            vertices: Vec::new(),
            positions: Vec::new(),
            normals: Vec::new(),
            places: Vec::new(),
            folded: Vec::new(),
            named: [0; 5],
        });
    }
    kernels.load(&compacted.connectivity, before)?;
    let n = (expected_motion(field, before, at, next) / SUB_STEP_LENGTH).ceil().clamp(1.0, 8.0);
    for i in 1..=n as usize {
        kernels.project(at + (next - at) * i as f64 / f64::from(n), REACH)?;
    }
    let status = kernels.status()?;
    let mut positions = kernels.positions()?;
    for (&v, p) in compacted.vertices.iter().zip(&mut positions) {
        if let Some(e) = tracked.key(v) {
            *p = place_on(exact, e, next).to_array();
        }
    }
    kernels.load(&compacted.connectivity, &positions)?;
    kernels.relax(
        next,
        parameters.relax_strength as f32,
        parameters.relax_force as f32,
        parameters.relax_iterations,
    )?;
    let positions = kernels.positions()?;
    let normals = kernels.normals()?;
    let is_free = |i: usize| !mesh.is_fixed(compacted.vertices[i]);
    let top = crate::sweep::caps::top(field);
    let mut named = [0; 5];
    let mut places: Vec<Vec3> = Vec::new();
    for i in (0..positions.len()).filter(|&i| is_free(i)) {
        let [p, q] = [before[i], positions[i]].map(Vec3::from);
        let outside = (-q).max(q - top).max_element() > OUTSIDE;
        if status[i] == Status::Failed || outside || p.distance(q) > MOST_MOTION {
            named[0] += 1;
            places.push(p);
        }
    }
    // Where the seam goes over a sample on the way, faces change before they are at the end.
    let key = exact.isovalue_key(next);
    let stays: Vec<bool> = compacted
        .vertices
        .iter()
        .map(|&v| {
            tracked.key(v).is_none_or(|e| {
                let ends = [e.from, e.from + exact.strides()[e.axis as usize]];
                let [a, b] = ends.map(|v| exact.key(v) > key);
                a != b
            })
        })
        .collect();
    let stays = |t: &&[u32; 3]| t.iter().all(|&v| stays[v as usize]);
    let all = compacted.faces.iter().zip(&compacted.connectivity.faces);
    let (slots, faces): (Vec<Face>, Vec<[u32; 3]>) = all.filter(|f| stays(&f.1)).unzip();
    let mut folded = Vec::new();
    let end = |v: u32| Vec3::from(positions[v as usize]);
    let middle = |v: u32| 0.5 * (end(v) + Vec3::from(before[v as usize]));
    let ends = Criteria::new(field, next, parameters);
    let midway = Criteria::new(field, 0.5 * (at + next), parameters);
    let most = MOST_OFF * parameters.error as f32;
    let found: Vec<(usize, Vec3, Face)> = faces
        .par_iter()
        .zip(&slots)
        .with_min_len(256)
        .filter_map(|(t, &slot)| {
            let [a, m] = [t.map(end), t.map(middle)];
            let barycentre = a.iter().sum::<Vec3>() / 3.0;
            if let Some(check) = fault(&ends, a, most) {
                return Some((check, barycentre, slot));
            }
            if area(a) < LEAST_AREA {
                return None;
            }
            (off(&midway, m) > most).then_some((3, barycentre, slot))
        })
        .collect();
    for (check, place, slot) in found {
        if check == 1 {
            folded.push(slot);
        }
        named[check] += 1;
        places.push(place);
    }
    let (mut all_positions, mut all) = (positions.clone(), faces.clone());
    let number = |v: Vertex| compacted.vertices.binary_search(&v).ok().map(|i| i as u32);
    let bound = |e: LatticeEdge| tracked.vertex_at(e).and_then(number);
    add_exact_beside(region, exact, next, &bound, &mut all_positions, &mut all);
    let crossing = intersecting(&all_positions, &all);
    for f in crossing.into_iter().filter(|&f| (f as usize) < faces.len()) {
        named[4] += 1;
        folded.push(slots[f as usize]);
        places.push(faces[f as usize].map(end).iter().sum::<Vec3>() / 3.0);
    }
    folded.sort_unstable();
    folded.dedup();
    Ok(Moved { vertices: compacted.vertices, positions, normals, places, folded, named })
}

/// Adds the exact extraction's triangles in the exact cells beside the seam, which share the seam's vertices.
fn add_exact_beside(
    region: &Region,
    exact: &ExactField,
    isovalue: f64,
    bound: &dyn Fn(LatticeEdge) -> Option<u32>,
    positions: &mut Vec<[f32; 3]>,
    triangles: &mut Vec<[u32; 3]>,
) {
    let grid = region.grid;
    let strides = exact.strides();
    let mut made: HashMap<LatticeEdge, u32> = HashMap::new();
    for cell in region.blocks().iter().flat_map(|&b| grid.cells_of(b)) {
        let is_beside =
            strides.iter().any(|s| !region.is_exact(cell - s) || !region.is_exact(cell + s));
        if !is_beside {
            continue;
        }
        let surface = extract_cell(exact, cell, isovalue);
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

/// Which check a face fails, if it does: 1 if it is turned over, 2 if it is off.
fn fault(criteria: &Criteria, t: [Vec3; 3], most: f32) -> Option<usize> {
    let barycentre = t.iter().sum::<Vec3>() / 3.0;
    if area(t) < LEAST_AREA {
        return None;
    }
    if normal(t).dot(criteria.field.gradient(barycentre)) > 0.0 {
        return Some(1);
    }
    (off(criteria, t) > most).then_some(2)
}

/// The places of a mesh where it cannot stay as it is.
pub(super) fn faults(tracked: &Tracked, criteria: &Criteria, parameters: &Parameters) -> Vec<Vec3> {
    let mesh = &tracked.mesh;
    let most = MOST_OFF * parameters.error as f32;
    let faces: Vec<Face> = mesh.faces().filter(|&f| !mesh.is_cap(f)).collect();
    faces
        .par_iter()
        .with_min_len(256)
        .filter_map(|&f| {
            let t = mesh.corners(f);
            fault(criteria, t, most).map(|_| t.iter().sum::<Vec3>() / 3.0)
        })
        .collect()
}

/// How far a face's barycentre is from the isosurface, along its normal or by the field's slope there: the normal of a
/// sliver may lead anywhere.
fn off(criteria: &Criteria, t: [Vec3; 3]) -> f32 {
    let barycentre = t.iter().sum::<Vec3>() / 3.0;
    let field = criteria.field;
    let slope = field.gradient(barycentre).length();
    let by_slope = (field.value(barycentre) - criteria.isovalue).abs() / slope.max(1e-12);
    by_slope.min(criteria.deviation(t))
}

/// How far most vertices will move, from the field's gradient, voxels.
pub(super) fn expected_motion(field: &Field, positions: &[[f32; 3]], at: f64, next: f64) -> f32 {
    let change = (field.isovalue(next) - field.isovalue(at)).abs();
    let slope = typical_slope(field, positions.iter().map(|&p| p.into()));
    slope.map_or(0.0, |s| change / s.max(1e-12))
}

/// The slope that nine of ten places reach.
pub(super) fn typical_slope(field: &Field, places: impl Iterator<Item = Vec3>) -> Option<f32> {
    let mut slopes: Vec<f32> = places.map(|p| crate::sweep::caps::inner_slope(field, p)).collect();
    if slopes.is_empty() {
        return None;
    }
    let i = slopes.len() / 10;
    Some(*slopes.select_nth_unstable_by(i, f32::total_cmp).1)
}
