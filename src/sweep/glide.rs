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

/// Shares of its way that a vertex glides: the longest by which no face turns over.
const SHARES: [f32; 4] = [1.0, 0.9, 0.6, 0.3];

/// A face with less of its first area is flat: those that end with a vertex are.
const FLAT: f32 = 1e-5;

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

/// Where vertices begin and where they end so that nothing jumps.
#[derive(Default)]
pub(super) struct Glides {
    /// Where each new vertex begins; in the mesh it is elsewhere.
    pub(super) born: BTreeMap<Vertex, Spot>,
    /// Where each vertex that is collapsed ends.
    pub(super) ends: BTreeMap<Vertex, Spot>,
}

/// A place on the surface as it was.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Spot {
    /// Voxel frame.
    pub(super) place: Vec3,
    /// The vertices whose weighted mean it is: it goes with them where their trajectories are changed. Empty
    /// if it is some other place.
    pub(super) of: Vec<(Vertex, f32)>,
}

impl Spot {
    /// The middle between two.
    fn middle(&self, other: &Spot) -> Spot {
        let both = self.of.iter().chain(&other.of);
        let of = both.map(|&(v, weight)| (v, 0.5 * weight)).collect();
        Spot { place: 0.5 * (self.place + other.place), of }
    }
}

/// The glides of some edits. `before` is the mesh before them.
pub(super) fn glides(before: &Compacted, edits: &Edits) -> Glides {
    let mut born: BTreeMap<Vertex, Spot> = BTreeMap::new();
    let old = |v: Vertex| {
        let i = before.vertices.binary_search(&v).ok()?;
        Some(Spot { place: before.positions[i].into(), of: vec![(v, 1.0)] })
    };
    for b in &edits.born {
        let ends = b.between.map(|v| born.get(&v).cloned().or_else(|| old(v)));
        if let [Some(p), Some(q)] = ends {
            born.insert(b.vertex, p.middle(&q));
        }
    }
    let target: BTreeMap<Vertex, Vertex> = edits.collapsed.iter().copied().collect();
    let mut ends: BTreeMap<Vertex, Spot> = BTreeMap::new();
    for &(v, first) in edits.collapsed.iter().filter(|c| old(c.0).is_some()) {
        let mut last = first;
        while let Some(&next) = target.get(&last) {
            last = next;
        }
        if let Some(p) = born.get(&last).cloned().or_else(|| old(last)) {
            ends.insert(v, p);
        }
    }
    without_folds(before, &mut ends);
    Glides { born, ends }
}

/// Shortens the glides by which a face would turn over on the way, or takes them away. `ends` is where vertices of
/// the mesh go, all at once.
fn without_folds(mesh: &Compacted, ends: &mut BTreeMap<Vertex, Spot>) {
    let start = |i: u32| Vec3::from(mesh.positions[i as usize]);
    let target: Vec<Option<Vec3>> =
        mesh.vertices.iter().map(|v| Some(ends.get(v)?.place)).collect();
    let glides = |t: &&[u32; 3]| t.iter().any(|&i| target[i as usize].is_some());
    let faces: Vec<[u32; 3]> = mesh.connectivity.faces.iter().filter(glides).copied().collect();
    let mut shortened = vec![0; target.len()];
    let end = |i: u32, shortened: &[usize]| {
        let share = SHARES.get(shortened[i as usize]);
        target[i as usize].zip(share).map(|(to, &share)| start(i).lerp(to, share))
    };
    loop {
        let way = |i: u32| (start(i), end(i, &shortened).unwrap_or(start(i)));
        let mut turning: Vec<u32> =
            faces.iter().filter(|t| turns_over(t.map(way))).flatten().copied().collect();
        turning.retain(|&i| end(i, &shortened).is_some());
        if turning.is_empty() {
            break;
        }
        turning.sort_unstable();
        turning.dedup();
        turning.iter().for_each(|&i| shortened[i as usize] += 1);
    }
    for (i, v) in (0..).zip(&mesh.vertices).filter(|(i, _)| shortened[*i as usize] > 0) {
        match end(i, &shortened) {
            Some(place) => ends.insert(*v, Spot { place, of: Vec::new() }),
            None => ends.remove(v),
        };
    }
}

/// Whether a face turns over where its corners go straight from one place to another, at once. Its normal is of second
/// degree in the share of the way: so is its component along the normal at first, which must not be negative.
fn turns_over(ways: [(Vec3, Vec3); 3]) -> bool {
    let [(a, _), (b, _), (c, _)] = ways;
    let [da, db, dc] = ways.map(|(from, to)| to - from);
    let at_first = normal([a, b, c]);
    let change = (b - a).cross(dc - da) + (db - da).cross(c - a);
    let scale = at_first.length_squared().max(f32::MIN_POSITIVE);
    // The coefficients of Bernstein's polynomials; the first is 1.
    let middle = 1.0 + 0.5 * change.dot(at_first) / scale;
    let last = normal(ways.map(|w| w.1)).dot(at_first) / scale;
    let last = if last.abs() < FLAT { 0.0 } else { last };
    last < 0.0 || middle < -last.sqrt()
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
        assert_eq!(glides.born[&first].place, 0.5 * (p + q));
        assert_eq!(glides.born[&second].place, 0.75 * p + 0.25 * q);
        let weight = |v: Vertex| -> f32 {
            glides.born[&second].of.iter().filter(|o| o.0 == v).map(|o| o.1).sum()
        };
        assert_eq!((weight(a), weight(b)), (0.75, 0.25));
    }

    #[test]
    fn a_collapsed_vertex_ends_where_the_last_of_its_targets_is() {
        let mesh = octahedron();
        let before = mesh.compacted();
        // The corners of a face: the faces at its edges become flat, none turns over.
        let [v, w, x] = mesh.face_vertices(mesh.faces().next().expect("a face"));
        let edits = Edits { born: Vec::new(), collapsed: vec![(v, w), (w, x)] };
        let ends = glides(&before, &edits).ends;
        let there = Spot { place: mesh.position(x), of: vec![(x, 1.0)] };
        assert_eq!(ends, BTreeMap::from([(v, there.clone()), (w, there)]));
    }

    /// How far along its way a vertex of an octahedron glides that is to go to a multiple of its place, and
    /// from there some way towards a vertex beside it.
    fn share_of_way(multiple: f32, towards: f32) -> f32 {
        let mesh = octahedron();
        let before = mesh.compacted();
        let v = before.vertices[0];
        let from = mesh.position(v);
        let to = (multiple * from).lerp(mesh.position(mesh.to(mesh.outgoing(v))), towards);
        let mut ends = BTreeMap::from([(v, Spot { place: to, of: vec![(v, 1.0)] })]);
        without_folds(&before, &mut ends);
        let end = ends.get(&v);
        let share = end.map_or(0.0, |s| s.place.distance(from) / to.distance(from));
        assert_eq!(end.is_some_and(|s| !s.of.is_empty()), share == 1.0);
        share
    }

    #[test]
    fn glides_that_would_turn_a_face_over_are_shorter() {
        // Beside; through the other side of the octahedron; and through that at once.
        for (multiple, towards, share) in
            [(1.0, 0.5, 1.0), (-1.0, 0.0, 0.6), (-0.55, 0.0, 0.9), (-20.0, 0.0, 0.0)]
        {
            let got = share_of_way(multiple, towards);
            assert!((got - share).abs() < 1e-6, "{got}, expected {share} to {multiple}");
        }
    }

    #[test]
    fn a_face_that_ends_with_a_vertex_does_not_turn_over() {
        let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert!(!turns_over([(a, a), (b, a), (c, c)]));
        // Two corners onto the third: from the front, and past it.
        let d = Vec3::new(0.3, 0.3, 0.0);
        assert!(!turns_over([(a, d), (b, d), (c, c)]));
        assert!(turns_over([(a, 2.0 * Vec3::Y), (b, 2.0 * Vec3::Y), (c, c)]));
    }
}
