//! Where what comes in is at the event: the way back from just after it.
//!
//! A surgery makes its mesh at an isovalue just after the event, where sheets are apart. From there the
//! vertices that came in are moved back towards the event, so that the mesh follows the isosurface
//! over that stretch too. What does not get there, or would fold or pass through something on the way, stays
//! where it will be.

use glam::Vec3;

use super::block::Block;
use super::patch::renumbered;
use super::{Front, Operation, Patched, Sweep};
use crate::error::Result;
use crate::kernels::{Kernels, Status};
use crate::mesh::{Face, Mesh, Vertex, intersecting, normal};
use crate::sweep::caps::is_of_cap;

/// Not all of the way back to an event: there sheets touch. As a share of the way.
const SHORT_OF: f64 = 0.02;

/// A vertex does not go back farther than this, voxels.
const MOST_MOTION: f32 = 1.0;

/// So many times what is in the way of others is put back.
const ROUNDS: usize = 3;

/// Faces are looked at within this distance from the block, voxels.
const NEAR_BLOCK: f32 = 1.0;

/// The positions of all vertices at the event, by slot: those that stayed are on their way from before to
/// after, those that came in have gone back, as far as they can.
pub(super) fn at_event(
    sweep: &Sweep,
    operation: &Operation,
    fronts: &[Front],
    patched: &Patched,
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<Vec<Vec3>> {
    sweep.cancelled()?;
    let mesh = &patched.mesh;
    let all = 0..mesh.vertex_slots() as u32;
    let mut held: Vec<Vec3> = all.map(|v| mesh.position(Vertex(v))).collect();
    for (slot, &(r, v)) in patched.stitched.kept_vertices.iter().enumerate() {
        let t = (operation.event - fronts[r].at) / (operation.after - fronts[r].at);
        held[slot] = fronts[r].mesh.position(v).lerp(held[slot], t as f32);
    }
    let mut places = gone_back(operation, patched, &held, kernels)?;
    let faces: Vec<Face> = mesh
        .faces()
        .filter(|&f| {
            mesh.face_vertices(f).iter().any(|v| places[v.0 as usize] != held[v.0 as usize])
                || block.touches_triangle(mesh.corners(f), NEAR_BLOCK)
        })
        .collect();
    for _ in 0..ROUNDS {
        let mut is_in_the_way = false;
        for f in bad(mesh, &faces, &places) {
            for v in mesh.face_vertices(f).map(|v| v.0 as usize) {
                is_in_the_way |= places[v] != held[v];
                places[v] = held[v];
            }
        }
        if !is_in_the_way {
            return Ok(places);
        }
    }
    Ok(held)
}

/// The positions after the way back, without a look at what is in the way.
fn gone_back(
    operation: &Operation,
    patched: &Patched,
    held: &[Vec3],
    kernels: &mut dyn Kernels,
) -> Result<Vec<Vec3>> {
    let mesh = &patched.mesh;
    let n_kept = patched.stitched.kept_vertices.len();
    let short_of = if operation.repaired { 0.0 } else { SHORT_OF };
    let to = operation.event + short_of * (operation.after - operation.event);
    let c = mesh.compacted();
    kernels.load(&c.connectivity, &c.positions)?;
    let mut is_lost = vec![false; c.vertices.len()];
    for at in [0.5 * (operation.after + to), to] {
        kernels.project(at, MOST_MOTION)?;
        for (lost, status) in is_lost.iter_mut().zip(kernels.status()?) {
            *lost |= status == Status::Failed;
        }
    }
    let mut places = held.to_vec();
    for ((&v, p), lost) in c.vertices.iter().zip(kernels.positions()?).zip(is_lost) {
        let (slot, p) = (v.0 as usize, Vec3::from(p));
        let follows = !lost && p.distance(held[slot]) <= MOST_MOTION;
        if slot >= n_kept && follows && !is_of_cap(mesh, v) {
            places[slot] = p;
        }
    }
    Ok(places)
}

/// The faces that fold between the event and after it, or pass through others at the event or half-way.
fn bad(mesh: &Mesh, faces: &[Face], places: &[Vec3]) -> Vec<Face> {
    let corners = |f: Face| mesh.face_vertices(f).map(|v| places[v.0 as usize]);
    let mut bad: Vec<Face> = faces
        .iter()
        .copied()
        .filter(|&f| normal(corners(f)).dot(normal(mesh.corners(f))) <= 0.0)
        .collect();
    let (vertices, triangles) = renumbered(mesh, faces);
    let place = |v: Vertex| places[v.0 as usize];
    let at_event: Vec<[f32; 3]> = vertices.iter().map(|&v| place(v).to_array()).collect();
    let half_way = |&v: &Vertex| (0.5 * (place(v) + mesh.position(v))).to_array();
    let half_way: Vec<[f32; 3]> = vertices.iter().map(half_way).collect();
    for positions in [at_event, half_way] {
        bad.extend(intersecting(&positions, &triangles).iter().map(|&f| faces[f as usize]));
    }
    bad
}
