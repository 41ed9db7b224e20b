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

/// In so many stops a way is gone, and so many times what is in the way of others is put back by one.
const STOPS: usize = 8;
const ROUNDS: usize = 24;

/// Faces are looked at within this distance from the block, voxels.
const NEAR_BLOCK: f32 = 1.0;

/// Where the vertices of a mesh are at the event, and on their way there.
pub(super) struct Passage {
    /// By slot, voxel frame.
    pub(super) at_event: Vec<Vec3>,
    /// The isovalues of stops on the way, and by slot where the vertices are that have got so far.
    pub(super) between: Vec<(f64, Vec<Option<Vec3>>)>,
}

impl Passage {
    /// Of vertices that go straight.
    fn straight(at_event: Vec<Vec3>) -> Passage {
        Passage { at_event, between: Vec::new() }
    }

    /// The stops of a vertex on its way.
    pub(super) fn stops_of(&self, v: Vertex) -> impl Iterator<Item = (f64, Vec3)> + '_ {
        self.between.iter().filter_map(move |(c, places)| Some((*c, places[v.0 as usize]?)))
    }
}

/// The vertices of a mesh after the surgery: those that stayed are on their way from before to after, those
/// that came in have gone back, as far as they can.
pub(super) fn at_event(
    sweep: &Sweep,
    operation: &Operation,
    fronts: &[Front],
    patched: &Patched,
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<Passage> {
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
    let stops = followed(mesh, &way, held, goes, kernels)?;
    Ok(in_nobodys_way(mesh, block, &way, stops))
}

/// The vertices of a mesh that arrives at the event: those that stay are on their way to where they have
/// `moved` afterwards, the others have gone forth, as far as they can.
pub(super) fn before_event(
    operation: &Operation,
    front: &Front,
    moved: &Moved,
    stays: &[bool],
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<Passage> {
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
        return Ok(Passage::straight(held));
    }
    let way = Way { from: front.at, to: operation.event, short_of: SHORT_OF };
    let goes = |v: Vertex| !is_kept[v.0 as usize];
    let stops = followed(mesh, &way, held, goes, kernels)?;
    Ok(in_nobodys_way(mesh, block, &way, stops))
}

/// The vertices, by slot, of faces that stay.
pub(super) fn kept(mesh: &Mesh, stays: &[bool]) -> Vec<bool> {
    let mut kept = vec![false; mesh.vertex_slots()];
    for f in mesh.faces().filter(|f| stays[f.0 as usize]) {
        mesh.face_vertices(f).iter().for_each(|v| kept[v.0 as usize] = true);
    }
    kept
}

/// The way to the last stop of every vertex, but for those that are in the way of others there: to an
/// earlier one.
fn in_nobodys_way(mesh: &Mesh, block: &Block, way: &Way, stops: Vec<Vec<Vec3>>) -> Passage {
    let mut places = stops[STOPS].clone();
    let mut stop_of = vec![STOPS; places.len()];
    let faces: Vec<Face> = mesh
        .faces()
        .filter(|&f| {
            mesh.face_vertices(f).iter().any(|v| places[v.0 as usize] != stops[0][v.0 as usize])
                || block.touches_triangle(mesh.corners(f), NEAR_BLOCK)
        })
        .collect();
    for _ in 0..ROUNDS {
        let mut in_the_way: Vec<usize> = bad(mesh, &faces, &places)
            .into_iter()
            .flat_map(|f| mesh.face_vertices(f))
            .map(|v| v.0 as usize)
            .filter(|&v| places[v] != stops[0][v])
            .collect();
        in_the_way.sort_unstable();
        in_the_way.dedup();
        if in_the_way.is_empty() {
            let between = (1..STOPS).map(|k| {
                let is_there = |v: usize| stop_of[v] >= k && places[v] != stops[0][v];
                let at = |v: usize| is_there(v).then(|| stops[k][v]);
                (way.isovalue(k), (0..places.len()).map(at).collect())
            });
            return Passage { between: between.collect(), at_event: places };
        }
        for v in in_the_way {
            stop_of[v] -= 1;
            places[v] = stops[stop_of[v]][v];
        }
    }
    Passage::straight(stops.into_iter().next().unwrap_or_default())
}

/// The way of vertices from one isovalue towards another, short of it by a share.
struct Way {
    from: f64,
    to: f64,
    short_of: f64,
}

impl Way {
    /// The isovalue of a stop. Beside a saddle the isosurface moves like the square root of the isovalue: the
    /// last stops are close together.
    fn isovalue(&self, stop: usize) -> f64 {
        let to = self.to + self.short_of * (self.from - self.to);
        let left = 1.0 - stop as f64 / STOPS as f64;
        to + left * left * (self.from - to)
    }
}

/// The positions at the stops of a way, the first of them where the vertices are `held`. Those that do not
/// go, or get no farther, stay.
fn followed(
    mesh: &Mesh,
    way: &Way,
    held: Vec<Vec3>,
    goes: impl Fn(Vertex) -> bool,
    kernels: &mut dyn Kernels,
) -> Result<Vec<Vec<Vec3>>> {
    let c = mesh.compacted();
    kernels.load(&c.connectivity, &c.positions)?;
    let mut is_lost = vec![false; c.vertices.len()];
    let mut stops = vec![held];
    for stop in 1..=STOPS {
        kernels.project(way.isovalue(stop), MOST_MOTION)?;
        let (status, positions) = (kernels.status()?, kernels.positions()?);
        let mut places = stops[stop - 1].clone();
        for (i, &v) in c.vertices.iter().enumerate() {
            let (slot, p) = (v.0 as usize, Vec3::from(positions[i]));
            is_lost[i] |= status[i] == Status::Failed || p.distance(stops[0][slot]) > MOST_MOTION;
            if goes(v) && !is_lost[i] && !is_of_cap(mesh, v) {
                places[slot] = p;
            }
        }
        stops.push(places);
    }
    Ok(stops)
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
