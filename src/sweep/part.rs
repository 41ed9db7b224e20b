//! A part of the tracked mesh, taken out to be exchanged, and put back.
//!
//! # Theory
//!
//! What an exchange changes lies near the blocks that change, so only the mesh near them is looked at: as a mesh of its own
//! whose boundary is the seam where the part has some of it, and the *rim* where the rest of the mesh goes on. Nothing
//! changes at the rim.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;

use super::exchange::Exchanged;
use super::region::LatticeEdge;
use super::tracked::{Tracked, parted};
use crate::kernels::PINNED;
use crate::mesh::{FIXED, Face, Mesh, Replacement, Vertex};

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Part {
    /// The faces of the whole mesh that it is made of; the part's first face slots, in this order.
    pub(super) faces: Vec<Face>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// By vertex of the part: the vertex of the whole that it is.
    pub(super) origin: Vec<Option<Vertex>>,
    /// By vertex of the part: whether it is on the rim.
    pub(super) is_rim: Vec<bool>,
    /// The edges of the rim, as the part's faces have them, by vertices of the whole.
    pub(super) rim: BTreeSet<(Vertex, Vertex)>,
}

impl Part {
    /// Some faces of a mesh, ascending, caps not among them.
    pub(super) fn of(whole: &Tracked, faces: &[Face]) -> Part {
        let mesh = &whole.mesh;
        let is_part = |f: Face| faces.binary_search(&f).is_ok();
        let mut part = Part { faces: faces.to_vec(), ..Part::default() };
        let mut vertices: Vec<Vertex> =
            part.faces.iter().flat_map(|&f| mesh.face_vertices(f)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |v: Vertex| vertices.binary_search(&v).expect("a vertex of the part") as u32;
        part.is_rim = vec![false; vertices.len()];
        for &f in &part.faces {
            part.triangles.push(mesh.face_vertices(f).map(number));
            for h in mesh.face_halfedges(f) {
                let other = mesh.face(h.twin());
                if !mesh.is_cap(other) && !is_part(other) {
                    let ends = [mesh.from(h), mesh.to(h)];
                    part.rim.insert((ends[0], ends[1]));
                    ends.iter().for_each(|&v| part.is_rim[number(v) as usize] = true);
                }
            }
        }
        part.positions = vertices.iter().map(|&v| mesh.position(v).to_array()).collect();
        part.origin = vertices.into_iter().map(Some).collect();
        for v in parted(&mut part.triangles, part.positions.len()) {
            part.positions.push(part.positions[v as usize]);
            part.origin.push(part.origin[v as usize]);
            part.is_rim.push(part.is_rim[v as usize]);
        }
        part
    }
}

/// A mesh into which a part was put back.
pub(super) struct Joined {
    pub(super) tracked: Tracked,
    /// The faces that have gone.
    pub(super) removed: Vec<Face>,
    /// The faces that have come, and the one of those gone that each was.
    pub(super) faces: Vec<(Face, Option<Face>)>,
    /// The slots of vertices that have come or gone.
    pub(super) vertices: Vec<Vertex>,
}

/// Puts parts back after changes; no two of them have a face in common.
///
/// # Errors
///
/// A place where the result would be no manifold.
pub(super) fn join(whole: &Tracked, exchanged: &[&Exchanged]) -> Result<Joined, Vec3> {
    let mut tracked = whole.clone();
    let first_new = whole.mesh.vertex_slots() as u32;
    let mut r = Replacement { first_new, ..Replacement::default() };
    for e in exchanged {
        r.removed.extend(&e.part.faces);
    }
    r.removed.sort_unstable();
    let mut places: HashMap<u32, Vec3> = HashMap::new();
    let mut edges: Vec<(u32, u32)> = Vec::new();
    let mut from = Vec::new();
    let mut known: Vec<(Vertex, u32, Option<LatticeEdge>, Vec3)> = Vec::new();
    for Exchanged { part, made, origin, was } in exchanged {
        let mut numbers: Vec<Option<u32>> = vec![None; made.mesh.vertex_slots()];
        let mut number = |r: &mut Replacement, v: Vertex| {
            *numbers[v.0 as usize].get_or_insert_with(|| {
                let place = made.mesh.position(v);
                let n = origin.get(v.0 as usize).copied().flatten().map_or_else(
                    || {
                        r.vertices.push((place, 0));
                        first_new + r.vertices.len() as u32 - 1
                    },
                    |o| o.0,
                );
                places.insert(n, place);
                known.push((v, n, made.key(v), place));
                n
            })
        };
        for f in made.mesh.faces().filter(|&f| !made.mesh.is_cap(f)) {
            let t = made.mesh.face_vertices(f).map(|v| number(&mut r, v));
            r.faces.push((t, false));
            from.push(was.get(f.0 as usize).copied().flatten());
            for h in made.mesh.face_halfedges(f).into_iter().filter(|&h| made.is_boundary(h)) {
                let ends = [made.mesh.from(h), made.mesh.to(h)].map(|v| number(&mut r, v));
                if !part.rim.contains(&(Vertex(ends[0]), Vertex(ends[1]))) {
                    edges.push((ends[0], ends[1]));
                }
            }
        }
    }
    edges.extend(open_loops(whole, &mut r));
    add_caps(&mut r, edges, &|v| {
        places.get(&v).copied().unwrap_or_else(|| whole.mesh.position(Vertex(v)))
    })?;
    for e in exchanged {
        let old: Vec<Vertex> = e.part.origin.iter().copied().flatten().collect();
        tracked.unbind_all(&old);
    }
    let replaced = tracked.mesh.replace_faces(&r)?;
    let slot =
        |n: u32| n.checked_sub(first_new).map_or(Vertex(n), |i| replaced.vertices[i as usize]);
    for &(_, n, _, place) in &known {
        tracked.mesh.set_position(slot(n), place);
        tracked.mesh.set_fixed(slot(n), false);
    }
    for (_, n, key, _) in known {
        if let Some(e) = key {
            tracked.bind(slot(n), e);
        }
    }
    let n = from.len();
    let faces = replaced.faces[..n].iter().copied().zip(from).collect();
    let vertices = replaced.gone.into_iter().chain(replaced.vertices).collect();
    Ok(Joined { tracked, removed: r.removed, faces, vertices })
}

/// Takes away the caps of all loops that faces which go have some of; returns the edges of these loops that stay. The
/// faces are ascending.
fn open_loops(whole: &Tracked, r: &mut Replacement) -> Vec<(u32, u32)> {
    let mesh: &Mesh = &whole.mesh;
    let mut hubs: BTreeSet<Vertex> = BTreeSet::new();
    for &f in &r.removed {
        for h in mesh.face_halfedges(f).into_iter().filter(|&h| whole.is_boundary(h)) {
            hubs.insert(mesh.to(mesh.next(h.twin())));
        }
    }
    let n = r.removed.len();
    let mut edges = Vec::new();
    for hub in hubs {
        for spoke in mesh.spokes(hub) {
            r.removed.push(mesh.face(spoke));
            let rim = mesh.next(spoke).twin();
            if r.removed[..n].binary_search(&mesh.face(rim)).is_err() {
                edges.push((mesh.from(rim).0, mesh.to(rim).0));
            }
        }
    }
    edges
}

/// Closes loops by fans of caps, each around a new hub. The edges are as the mesh's faces have them.
fn add_caps(
    r: &mut Replacement,
    edges: Vec<(u32, u32)>,
    place: &dyn Fn(u32) -> Vec3,
) -> Result<(), Vec3> {
    let mut next: BTreeMap<u32, u32> = BTreeMap::new();
    for (a, b) in edges {
        if next.insert(a, b).is_some() {
            return Err(place(a));
        }
    }
    while let Some((first, mut at)) = next.pop_first() {
        let mut around = vec![first];
        while at != first {
            around.push(at);
            at = next.remove(&at).ok_or_else(|| place(at))?;
        }
        let hub = r.first_new + r.vertices.len() as u32;
        let middle = around.iter().map(|&v| place(v)).sum::<Vec3>() / around.len() as f32;
        r.vertices.push((middle, FIXED | PINNED));
        for (i, &a) in around.iter().enumerate() {
            let b = around[(i + 1) % around.len()];
            r.faces.push(([b, a, hub], true));
        }
    }
    Ok(())
}
