//! Refinement: red-green quadrisection (thesis section 3.7) and splits of edges that are too long.

use super::criteria::Criteria;
use crate::mesh::{Edge, Face, Mesh, Vertex};

/// Quadrisects the given faces, and bisects or quadrisects their neighbours so that no vertex ends
/// up inside an edge: a face with two or three split edges is split in four, with one in two.
/// New vertices are put onto the isosurface. Returns them.
pub(crate) fn quadrisect(mesh: &mut Mesh, criteria: &Criteria, marked: &[Face]) -> Vec<Vertex> {
    let mut split = vec![false; mesh.edge_slots()];
    let mut stack: Vec<Face> = marked.to_vec();
    while let Some(f) = stack.pop() {
        for h in mesh.face_halfedges(f) {
            let e = h.edge().0 as usize;
            if split[e] {
                continue;
            }
            split[e] = true;
            let neighbour = mesh.face(h.twin());
            let n = mesh.face_halfedges(neighbour).iter().filter(|s| split[s.edge().0 as usize]).count();
            if n == 2 {
                stack.push(neighbour);
            }
        }
    }
    let edges: Vec<Edge> = mesh.edges().filter(|e| split[e.0 as usize]).collect();
    let whole: Vec<[Vertex; 3]> = mesh
        .faces()
        .filter(|&f| mesh.face_halfedges(f).iter().all(|h| split[h.edge().0 as usize]))
        .map(|f| mesh.face_vertices(f))
        .collect();
    // Splitting three edges one after the other leaves, inside a face, the edge from the first
    // midpoint to the corner opposite to it; turning that edge gives the quadrisection.
    let mut middle = Vec::with_capacity(edges.len());
    let mut ends = Vec::with_capacity(edges.len());
    for &e in &edges {
        let h = e.halfedge();
        ends.push((mesh.from(h), mesh.to(h)));
        middle.push(split_edge(mesh, criteria, e));
    }
    let find = |a: Vertex, b: Vertex, sorted: &[((Vertex, Vertex), usize)]| {
        let key = (a.min(b), a.max(b));
        sorted.binary_search_by_key(&key, |s| s.0).map(|i| sorted[i].1).expect("a side of a split face")
    };
    let mut sorted: Vec<((Vertex, Vertex), usize)> =
        ends.iter().enumerate().map(|(i, &(a, b))| ((a.min(b), a.max(b)), i)).collect();
    sorted.sort_unstable();
    for [a, b, c] in whole {
        let sides = [(find(a, b, &sorted), c), (find(b, c, &sorted), a), (find(c, a, &sorted), b)];
        let (i, opposite) = *sides.iter().min_by_key(|s| s.0).expect("three sides");
        if let Some(h) = mesh.find_halfedge(middle[i], opposite)
            && mesh.can_flip(h.edge())
        {
            mesh.flip(h.edge());
        }
    }
    middle
}

/// Splits every edge longer than `long` times the wanted length, longest first. Returns the new
/// vertices.
pub(crate) fn split_long(mesh: &mut Mesh, criteria: &Criteria, length: &[f32], long: f32) -> Vec<Vertex> {
    let mut edges: Vec<(f32, Edge)> = mesh
        .edges()
        .filter_map(|e| {
            let h = e.halfedge();
            let wanted = 0.5 * (length[mesh.from(h).0 as usize] + length[mesh.to(h).0 as usize]);
            let l = mesh.length(e);
            let pinned = mesh.is_pinned(mesh.from(h)) && mesh.is_pinned(mesh.to(h));
            (!pinned && l > long * wanted).then_some((l, e))
        })
        .collect();
    edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    edges.into_iter().map(|(_, e)| split_edge(mesh, criteria, e)).collect()
}

/// Splits one edge in its middle and puts the new vertex onto the isosurface, unless a face would
/// turn over there.
fn split_edge(mesh: &mut Mesh, criteria: &Criteria, e: Edge) -> Vertex {
    let h = e.halfedge();
    let (a, b) = (mesh.from(h), mesh.to(h));
    let along = (mesh.face_normal(mesh.face(h)) + mesh.face_normal(mesh.face(h.twin()))).normalize_or_zero();
    let middle = 0.5 * (mesh.position(a) + mesh.position(b));
    let m = mesh.split_edge(e, middle).vertex;
    let p = criteria.edge_point(mesh, a, b, along, mesh.border(m));
    let before: Vec<_> = mesh.spokes(m).map(|s| mesh.face_normal(mesh.face(s))).collect();
    mesh.set_position(m, p);
    let turned = mesh.spokes(m).zip(&before).any(|(s, n)| mesh.face_normal(mesh.face(s)).dot(*n) < 0.5);
    if turned {
        mesh.set_position(m, middle);
    }
    m
}
