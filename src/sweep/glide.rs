//! Gliding: edits at a sampling isovalue that the surface does not jump by.
//!
//! A vertex that splits an edge begins in the middle of that edge, on the surface as it was, and moves
//! out onto the isosurface over the first part of the next step. A vertex that is collapsed moves
//! along its edge onto the one in its place over the last part of the step before. A flip has no such
//! way; it is bounded by how far apart the two edges are (`flips`).

use std::collections::BTreeMap;

use glam::Vec3;

use crate::mesh::{Compacted, Edge, Mesh, Vertex, normal};

/// Share of a step over which vertices glide.
pub(super) const GLIDE_SHARE: f64 = 0.25;

/// Shares of a glide at which the faces around are looked at.
const LOOKED_AT: [f32; 3] = [0.3, 0.6, 0.95];

/// A vertex that has split an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Born {
    pub(crate) vertex: Vertex,
    /// The ends of the edge.
    pub(crate) between: [Vertex; 2],
}

/// What edits at one sampling isovalue have done.
#[derive(Default)]
pub(super) struct Edits {
    /// In order.
    pub(super) born: Vec<Born>,
    /// The vertices removed and those in their place, in order.
    pub(super) collapsed: Vec<(Vertex, Vertex)>,
}

/// Where vertices begin and where they end so that nothing jumps, voxel frame.
#[derive(Default)]
pub(super) struct Glides {
    /// Where each new vertex begins; in the mesh it is elsewhere.
    pub(super) born: BTreeMap<Vertex, Vec3>,
    /// Where each vertex that is collapsed ends.
    pub(super) ends: BTreeMap<Vertex, Vec3>,
}

/// The glides of some edits. `before` is the mesh before them.
pub(super) fn glides(before: &Compacted, edits: &Edits) -> Glides {
    let mut born: BTreeMap<Vertex, Vec3> = BTreeMap::new();
    let old =
        |v: Vertex| before.vertices.binary_search(&v).ok().map(|i| Vec3::from(before.positions[i]));
    for b in &edits.born {
        let ends = b.between.map(|v| born.get(&v).copied().or_else(|| old(v)));
        if let [Some(p), Some(q)] = ends {
            born.insert(b.vertex, 0.5 * (p + q));
        }
    }
    let target: BTreeMap<Vertex, Vertex> = edits.collapsed.iter().copied().collect();
    let mut ends: BTreeMap<Vertex, Vec3> = BTreeMap::new();
    for &(v, first) in edits.collapsed.iter().filter(|c| old(c.0).is_some()) {
        let mut last = first;
        while let Some(&next) = target.get(&last) {
            last = next;
        }
        if let Some(p) = born.get(&last).copied().or_else(|| old(last)) {
            ends.insert(v, p);
        }
    }
    without_folds(before, &mut ends);
    Glides { born, ends }
}

/// Takes away the glides by which a face would turn over on the way.
fn without_folds(before: &Compacted, ends: &mut BTreeMap<Vertex, Vec3>) {
    loop {
        let way = |i: u32| {
            let p = Vec3::from(before.positions[i as usize]);
            (p, ends.get(&before.vertices[i as usize]).copied().unwrap_or(p))
        };
        let turns = |t: &&[u32; 3]| {
            let ways = t.map(way);
            if ways.iter().all(|w| w.0 == w.1) {
                return false;
            }
            let at_first = normal(ways.map(|w| w.0));
            let turned = |&s: &f32| normal(ways.map(|w| w.0.lerp(w.1, s))).dot(at_first) <= 0.0;
            LOOKED_AT.iter().any(turned)
        };
        let turning: Vec<Vertex> = before
            .connectivity
            .faces
            .iter()
            .filter(turns)
            .flat_map(|t| t.map(|i| before.vertices[i as usize]))
            .collect();
        let n = ends.len();
        turning.iter().for_each(|v| {
            ends.remove(v);
        });
        if ends.len() == n {
            return;
        }
    }
}

/// Splits an edge in its middle, and writes it down.
pub(crate) fn split_edge_of(
    mesh: &mut Mesh,
    e: Edge,
    middle: Vec3,
    born: &mut Vec<Born>,
) -> Vertex {
    let h = e.halfedge();
    let between = [mesh.from(h), mesh.to(h)];
    let vertex = mesh.split_edge(e, middle).vertex;
    born.push(Born { vertex, between });
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn octahedron() -> Mesh {
        shapes::octahedron(Vec3::ZERO, 1.0)
    }

    #[test]
    fn new_vertices_begin_on_the_edges_that_they_split() {
        let mut mesh = octahedron();
        let before = mesh.compacted();
        let old: Vec<Vec3> = mesh.vertices().map(|v| mesh.position(v)).collect();
        let mut born = Vec::new();
        let first = split_edge_of(&mut mesh, Edge(0), Vec3::splat(7.0), &mut born);
        let [a, b] = born[0].between;
        // A half of an edge that was split in the same edits: a quarter of the edge.
        let half = mesh.find_halfedge(a, first).expect("a half of the edge");
        let second = split_edge_of(&mut mesh, half.edge(), Vec3::splat(8.0), &mut born);
        let glides = glides(&before, &Edits { born, collapsed: Vec::new() });
        let [p, q] = [a, b].map(|v| old[v.0 as usize]);
        assert_eq!(glides.born[&first], 0.5 * (p + q));
        assert_eq!(glides.born[&second], 0.75 * p + 0.25 * q);
    }

    #[test]
    fn a_collapsed_vertex_ends_where_the_last_of_its_targets_is() {
        let mesh = octahedron();
        let before = mesh.compacted();
        let [v, w, x] = [0, 1, 2].map(|i| before.vertices[i]);
        let edits = Edits { born: Vec::new(), collapsed: vec![(v, w), (w, x)] };
        let target: BTreeMap<Vertex, Vec3> = glides(&before, &edits).ends;
        // What does not turn over ends at the last target; nothing ends elsewhere.
        assert!(target.values().all(|&p| p == mesh.position(x)), "{target:?}");
    }

    #[test]
    fn glides_that_would_turn_a_face_over_are_left_out() {
        let mesh = octahedron();
        let before = mesh.compacted();
        let v = before.vertices[0];
        let beside = mesh.to(mesh.outgoing(v));
        let mut fine = BTreeMap::from([(v, mesh.position(v).lerp(mesh.position(beside), 0.5))]);
        without_folds(&before, &mut fine);
        assert_eq!(fine.len(), 1);
        // Through the other side of the octahedron.
        let mut folded = BTreeMap::from([(v, -2.0 * mesh.position(v))]);
        without_folds(&before, &mut folded);
        assert!(folded.is_empty());
    }
}
