//! Puts changed parts back into the mesh.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;

use super::exchanged::Exchanged;
use super::region::LatticeEdge;
use super::tracked::Tracked;
use crate::mesh::{Face, HalfEdgeMesh, Replacement, Vertex};

/// The mesh with the changed parts.
pub(super) struct Joined {
    pub(super) tracked: Tracked,
    /// The removed faces, ascending; caps last.
    pub(super) removed: Vec<Face>,
    /// The new faces, and the removed face that each was, if any.
    pub(super) faces: Vec<(Face, Option<Face>)>,
    /// New and removed vertices.
    pub(super) vertices: Vec<Vertex>,
    /// New vertices, and those of the new faces.
    pub(super) placed: Vec<Vertex>,
}

/// Puts changed parts back into the mesh; no two of them have a face in common.
///
/// # Errors
///
/// A position at which the result would not be a manifold.
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
                        r.vertices.push((place, false));
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
    let new = replaced.vertices.iter().copied();
    let placed = known.iter().map(|k| slot(k.1)).chain(new).collect();
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
    Ok(Joined { tracked, removed: r.removed, faces, vertices, placed })
}

/// Removes the caps of all boundary loops that touch removed faces; returns the other edges of these loops. The removed
/// faces are ascending.
fn open_loops(whole: &Tracked, r: &mut Replacement) -> Vec<(u32, u32)> {
    let mesh: &HalfEdgeMesh = &whole.mesh;
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

/// Closes boundary loops by fans of caps, each around a new hub. The edges are directed as in the mesh's faces.
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
        r.vertices.push((middle, true));
        for (i, &a) in around.iter().enumerate() {
            let b = around[(i + 1) % around.len()];
            r.faces.push(([b, a, hub], true));
        }
    }
    Ok(())
}
