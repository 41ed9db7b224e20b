//! Where what a surgery takes away and what it brings in are at the event.
//!
//! A surgery makes its mesh at an isovalue just after the event, where sheets are apart. From there the
//! vertices that came in are moved back towards the event, and those that are taken away are moved forth
//! to it from where the mesh arrived, so that both follow the isosurface and meet at the event. What does
//! not get there, or would fold or pass through something on the way, stays where it will be, or was.

use glam::Vec3;

use super::block::Block;
use super::cut::Moved;
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
    let n_kept = patched.stitched.kept_vertices.len();
    let way = Way {
        from: operation.after,
        to: operation.event,
        short_of: if operation.repaired { 0.0 } else { SHORT_OF },
    };
    let goes = |v: Vertex| v.0 as usize >= n_kept;
    let places = followed(mesh, &way, &held, goes, kernels)?;
    Ok(in_nobodys_way(mesh, block, held, places))
}

/// The positions of all vertices of a mesh that arrives at the event, by slot: those that stay are on their
/// way to where they have `moved` afterwards, the others have gone forth, as far as they can.
pub(super) fn before_event(
    operation: &Operation,
    front: &Front,
    moved: &Moved,
    stays: &[bool],
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<Vec<Vec3>> {
    let mesh = &front.mesh;
    let t = ((operation.event - front.at) / (operation.after - front.at)) as f32;
    let is_kept = kept(mesh, stays);
    let all = 0..mesh.vertex_slots() as u32;
    let held: Vec<Vec3> = all
        .map(|v| {
            let p = mesh.position(Vertex(v));
            if is_kept[v as usize] { p.lerp(moved.positions[v as usize], t) } else { p }
        })
        .collect();
    if operation.repaired {
        return Ok(held);
    }
    let way = Way { from: front.at, to: operation.event, short_of: SHORT_OF };
    let goes = |v: Vertex| !is_kept[v.0 as usize];
    let places = followed(mesh, &way, &held, goes, kernels)?;
    Ok(in_nobodys_way(mesh, block, held, places))
}

/// The vertices, by slot, of faces that stay.
pub(super) fn kept(mesh: &Mesh, stays: &[bool]) -> Vec<bool> {
    let mut kept = vec![false; mesh.vertex_slots()];
    for f in mesh.faces().filter(|f| stays[f.0 as usize]) {
        mesh.face_vertices(f).iter().for_each(|v| kept[v.0 as usize] = true);
    }
    kept
}

/// The places with those put back to where they are `held` that are in the way of others.
fn in_nobodys_way(mesh: &Mesh, block: &Block, held: Vec<Vec3>, mut places: Vec<Vec3>) -> Vec<Vec3> {
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
            return places;
        }
    }
    held
}

/// The way of vertices from one isovalue towards another, short of it by a share.
struct Way {
    from: f64,
    to: f64,
    short_of: f64,
}

/// The positions at the end of a way of those vertices that go it and get there; of the others, where they
/// are `held`.
fn followed(
    mesh: &Mesh,
    way: &Way,
    held: &[Vec3],
    goes: impl Fn(Vertex) -> bool,
    kernels: &mut dyn Kernels,
) -> Result<Vec<Vec3>> {
    let to = way.to + way.short_of * (way.from - way.to);
    let c = mesh.compacted();
    kernels.load(&c.connectivity, &c.positions)?;
    let mut is_lost = vec![false; c.vertices.len()];
    for at in [0.5 * (way.from + to), to] {
        kernels.project(at, MOST_MOTION)?;
        for (lost, status) in is_lost.iter_mut().zip(kernels.status()?) {
            *lost |= status == Status::Failed;
        }
    }
    let mut places = held.to_vec();
    for ((&v, p), lost) in c.vertices.iter().zip(kernels.positions()?).zip(is_lost) {
        let (slot, p) = (v.0 as usize, Vec3::from(p));
        let follows = !lost && p.distance(held[slot]) <= MOST_MOTION;
        if goes(v) && follows && !is_of_cap(mesh, v) {
            places[slot] = p;
        }
    }
    Ok(places)
}

/// The faces that fold between the event and where the mesh is, or pass through others at the event or
/// half-way.
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
