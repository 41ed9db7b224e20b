//! Where what a surgery takes away and what it brings in are at the event.
//!
//! A surgery makes its mesh at an isovalue just after the event, where sheets are apart. From there the
//! vertices that came in are moved back towards the event, and those that are taken away are moved forth
//! to it from where the mesh arrived, so that both follow the isosurface and meet at the event. What does
//! not get there, or would fold or pass through something on the way, stays where it will be, or was. The
//! vertices that stay follow the isosurface to the event, too, or else go straight past it.

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

/// The stops at which faces must not pass through each other.
const LOOKED_AT: [usize; 4] = [2, 4, 6, 8];

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

/// The vertices of a mesh after the surgery: those that stayed are at the event where `before` has them, those
/// that came in have gone back, as far as they can.
pub(super) fn at_event(
    sweep: &Sweep,
    operation: &Operation,
    before: &[Passage],
    patched: &Patched,
    block: &Block,
    kernels: &mut dyn Kernels,
) -> Result<Passage> {
    sweep.cancelled()?;
    let mesh = &patched.mesh;
    let all = 0..mesh.vertex_slots() as u32;
    let mut held: Vec<Vec3> = all.map(|v| mesh.position(Vertex(v))).collect();
    for (slot, &(r, v)) in patched.stitched.kept_vertices.iter().enumerate() {
        held[slot] = before[r].at_event[v.0 as usize];
    }
    let n_kept = patched.stitched.kept_vertices.len();
    let way = Way {
        from: operation.after,
        to: operation.event,
        short_of: if operation.repaired { 0.0 } else { SHORT_OF },
    };
    let goes = |v: Vertex| v.0 as usize >= n_kept;
    let (stops, _) = followed(mesh, &way, held, goes, kernels)?;
    Ok(in_nobodys_way(mesh, block, &way, stops, &vec![false; mesh.vertex_slots()]))
}

/// The vertices of a mesh that arrives at the event: those that stay have followed all of the way, or are on a
/// straight one to where they have `moved` afterwards; the others have gone forth, as far as they can.
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
    let (mut stops, is_lost) = followed(mesh, &way, held, |_| true, kernels)?;
    let (straight, rest) = stops.split_first_mut().expect("a first stop");
    for v in (0..is_kept.len()).filter(|&v| is_kept[v] && is_lost[v]) {
        rest.iter_mut().for_each(|stop| stop[v] = straight[v]);
    }
    Ok(in_nobodys_way(mesh, block, &way, stops, &is_kept))
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
/// earlier one, or to the first at once for those that `go_straight` else.
fn in_nobodys_way(
    mesh: &Mesh,
    block: &Block,
    way: &Way,
    stops: Vec<Vec<Vec3>>,
    go_straight: &[bool],
) -> Passage {
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
        let at_stop = |k: usize, v: Vertex| {
            let slot = v.0 as usize;
            if places[slot] == stops[0][slot] {
                mesh.position(v).lerp(places[slot], way.share(k))
            } else {
                stops[k.min(stop_of[slot])][slot]
            }
        };
        let mut in_the_way: Vec<usize> = bad(mesh, &faces, at_stop)
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
            stop_of[v] = if go_straight[v] { 0 } else { stop_of[v] - 1 };
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

    /// The share of the way to its end at a stop; all of it at the last.
    fn share(&self, stop: usize) -> f32 {
        if stop == STOPS {
            return 1.0;
        }
        ((self.isovalue(stop) - self.from) / (self.to - self.from)) as f32
    }
}

/// The positions at the stops of a way, the first of them where the vertices are `held`, and which vertices
/// get lost on it. Those that do not go, or get no farther, stay.
fn followed(
    mesh: &Mesh,
    way: &Way,
    held: Vec<Vec3>,
    goes: impl Fn(Vertex) -> bool,
    kernels: &mut dyn Kernels,
) -> Result<(Vec<Vec<Vec3>>, Vec<bool>)> {
    let c = mesh.compacted();
    kernels.load(&c.connectivity, &c.positions)?;
    let mut is_lost = vec![false; mesh.vertex_slots()];
    let mut stops = vec![held];
    for stop in 1..=STOPS {
        kernels.project(way.isovalue(stop), MOST_MOTION)?;
        let (status, positions) = (kernels.status()?, kernels.positions()?);
        let mut places = stops[stop - 1].clone();
        for (i, &v) in c.vertices.iter().enumerate() {
            let (slot, p) = (v.0 as usize, Vec3::from(positions[i]));
            is_lost[slot] |= status[i] == Status::Failed
                || p.distance(stops[0][slot]) > MOST_MOTION
                || is_of_cap(mesh, v);
            if goes(v) && !is_lost[slot] {
                places[slot] = p;
            }
        }
        stops.push(places);
    }
    Ok((stops, is_lost))
}

/// The faces that fold between the event and where the mesh is, or pass through others at some of the stops,
/// with the places of vertices at a stop.
fn bad(mesh: &Mesh, faces: &[Face], at_stop: impl Fn(usize, Vertex) -> Vec3) -> Vec<Face> {
    let corners = |f: Face| mesh.face_vertices(f).map(|v| at_stop(STOPS, v));
    let mut bad: Vec<Face> = faces
        .iter()
        .copied()
        .filter(|&f| normal(corners(f)).dot(normal(mesh.corners(f))) <= 0.0)
        .collect();
    let (vertices, triangles) = renumbered(mesh, faces);
    for k in LOOKED_AT {
        let positions: Vec<[f32; 3]> = vertices.iter().map(|&v| at_stop(k, v).to_array()).collect();
        bad.extend(intersecting(&positions, &triangles).iter().map(|&f| faces[f as usize]));
    }
    bad
}
