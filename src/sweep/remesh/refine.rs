//! Refinement: red-green quadrisection (thesis section 3.7) and splits of edges that are too long.

use rayon::prelude::*;

use super::criteria::Criteria;
use crate::mesh::{Edge, Face, HalfEdgeMesh, Vertex, area};

/// A face that deviates by more than this is refined; in units of the criteria's tolerance, which is .72 of the requested one. Other
/// edits aim at 1: a face between the two is mostly one whose barycentre passes a kink of the field, and is near again after the
/// next step.
const REFINE_FROM: f32 = 1.3;

/// A face that deviates by more than this many tolerances is quadrisected; one that deviates less
/// is bisected. Deviation falls with the square of the edges: to a quarter, or to about a half.
const QUADRISECT_FROM: f32 = 2.0;

/// Refines the faces that deviate too far and are large enough (thesis section 3.7). `deviations`
/// by face slot. Returns how many faces were marked.
pub(crate) fn refine(mesh: &mut HalfEdgeMesh, criteria: &Criteria, deviations: &[f32]) -> usize {
    let deviation = |f: Face| deviations[f.0 as usize];
    let mut marked: Vec<Face> = mesh
        .par_faces()
        .filter(|&f| {
            let pinned = mesh.face_vertices(f).iter().all(|&v| mesh.is_pinned(v));
            let is_far = deviation(f) > REFINE_FROM * criteria.error;
            !pinned && is_far && area(mesh.corners(f)) > criteria.refine_area
        })
        .collect();
    marked.sort_by(|&a, &b| deviation(b).total_cmp(&deviation(a)).then(a.cmp(&b)));
    let n_far = marked.partition_point(|&f| deviation(f) > QUADRISECT_FROM * criteria.error);
    let near: Vec<(Face, [Vertex; 3])> =
        marked[n_far..].iter().map(|&f| (f, mesh.face_vertices(f))).collect();
    quadrisect(mesh, criteria, &marked[..n_far]);
    for (f, vertices) in near {
        // A face that a neighbour's refinement has changed is left to the next round.
        if mesh.face_vertices(f) == vertices {
            let sides = mesh.face_halfedges(f).map(|h| h.edge());
            let free = sides.iter().filter(|e| !is_fixed(mesh, **e));
            let longest = free.max_by(|a, b| mesh.length(**a).total_cmp(&mesh.length(**b)));
            if let Some(e) = longest {
                split_edge(mesh, criteria, *e);
            }
        }
    }
    marked.len()
}

/// Whether both ends of an edge are fixed, so that it must not be split.
fn is_fixed(mesh: &HalfEdgeMesh, e: Edge) -> bool {
    let h = e.halfedge();
    mesh.is_fixed(mesh.from(h)) && mesh.is_fixed(mesh.to(h))
}

/// Quadrisects the given faces, and bisects or quadrisects their neighbours so that no vertex ends
/// up inside an edge: a face with two or three split edges becomes four, one with one split edge two.
/// Returns the new vertices, which are on the isosurface.
pub(crate) fn quadrisect(
    mesh: &mut HalfEdgeMesh,
    criteria: &Criteria,
    marked: &[Face],
) -> Vec<Vertex> {
    let mut split = vec![false; mesh.edge_slots()];
    let mut stack: Vec<Face> = marked.to_vec();
    while let Some(f) = stack.pop() {
        for h in mesh.face_halfedges(f) {
            let e = h.edge().0 as usize;
            if split[e] || is_fixed(mesh, h.edge()) {
                continue;
            }
            split[e] = true;
            let neighbour = mesh.face(h.twin());
            let n = mesh
                .face_halfedges(neighbour)
                .iter()
                .filter(|s| split[s.edge().0 as usize])
                .count();
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
        sorted
            .binary_search_by_key(&key, |s| s.0)
            .map(|i| sorted[i].1)
            .expect("a side of a split face")
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

/// Splits every edge longer than `long` times the wanted length, longest first. Returns the new vertices.
pub(crate) fn split_long(
    mesh: &mut HalfEdgeMesh,
    criteria: &Criteria,
    length: &[f32],
    long: f32,
) -> Vec<Vertex> {
    let mut edges: Vec<(f32, Edge)> = mesh
        .par_edges()
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
fn split_edge(mesh: &mut HalfEdgeMesh, criteria: &Criteria, e: Edge) -> Vertex {
    let h = e.halfedge();
    let (a, b) = (mesh.from(h), mesh.to(h));
    let along = (mesh.face_normal(mesh.face(h)) + mesh.face_normal(mesh.face(h.twin())))
        .normalize_or_zero();
    let middle = 0.5 * (mesh.position(a) + mesh.position(b));
    let m = mesh.split_edge(e, middle).vertex;
    let p = criteria.edge_point(mesh, a, b, along);
    let before: Vec<_> = mesh.spokes(m).map(|s| mesh.face_normal(mesh.face(s))).collect();
    mesh.set_position(m, p);
    let turned =
        mesh.spokes(m).zip(&before).any(|(s, n)| mesh.face_normal(mesh.face(s)).dot(*n) < 0.5);
    if turned {
        mesh.set_position(m, middle);
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Field;
    use crate::mesh::shapes;
    use crate::sweep::parameters::Parameters;
    use crate::volume::phantom;
    use glam::Vec3;
    use std::sync::Arc;

    /// Samples along an axis of the sphere that the tests refine on, and half its extent in voxels.
    const SIZE: usize = 17;
    const HALF: f32 = 8.0;

    /// A radius, voxels, and its isovalue: the phantom is 1 - |p|, p from -1 to 1.
    const RADIUS: f32 = 5.0;
    const ISOVALUE: f64 = 1.0 - (RADIUS / HALF) as f64;

    /// Above every sample: nothing can be projected, so middles of edges stay where they are.
    const NOWHERE: f64 = 5.0;

    fn field() -> Field {
        Field::new(Arc::new(phantom(&format!("sphere:{SIZE}")).expect("a phantom")))
    }

    /// An octahedron around the middle of the volume, its vertices `RADIUS` away.
    fn octahedron() -> HalfEdgeMesh {
        shapes::octahedron(Vec3::splat(HALF), RADIUS)
    }

    /// Quadrisects and checks the invariants.
    fn quadrisected(mesh: &mut HalfEdgeMesh, isovalue: f64, marked: &[Face]) -> Vec<Vertex> {
        let field = field();
        let criteria = Criteria::new(&field, isovalue, &Parameters::default());
        let n_vertices = mesh.n_vertices();
        let added = quadrisect(mesh, &criteria, marked);
        mesh.check().expect("refinement keeps the invariants");
        assert_eq!(mesh.euler(), 2);
        assert_eq!(mesh.n_vertices(), n_vertices + added.len());
        added
    }

    #[test]
    fn a_marked_face_becomes_four_and_its_neighbours_two() {
        let mut mesh = octahedron();
        let corners = mesh.face_vertices(Face(0));
        let added = quadrisected(&mut mesh, NOWHERE, &[Face(0)]);
        assert_eq!((added.len(), mesh.n_faces()), (3, 8 + 3 + 3));
        let n_new = |f: &Face| mesh.face_vertices(*f).iter().filter(|v| added.contains(v)).count();
        assert_eq!(mesh.faces().filter(|f| n_new(f) == 3).count(), 1, "the one in the middle");
        for corner in corners {
            let at_corner = |f: &Face| n_new(f) == 2 && mesh.face_vertices(*f).contains(&corner);
            assert_eq!(mesh.faces().filter(at_corner).count(), 1, "the one at {corner:?}");
        }
    }

    #[test]
    fn a_face_between_two_marked_ones_becomes_four_as_well() {
        let mut mesh = octahedron();
        // The upper four in a cycle: the other two have two split edges each. Each of the lower four
        // has one.
        let added = quadrisected(&mut mesh, NOWHERE, &[Face(0), Face(2)]);
        assert_eq!((added.len(), mesh.n_faces()), (8, 4 * 4 + 4 * 2));
    }

    #[test]
    fn no_vertex_lies_inside_an_edge() {
        for marked in [&[0][..], &[0, 1], &[0, 6], &[3, 5, 6], &[0, 1, 2, 3, 4, 5, 6, 7]] {
            let mut mesh = octahedron();
            let marked: Vec<Face> = marked.iter().map(|&f| Face(f)).collect();
            let added = quadrisected(&mut mesh, NOWHERE, &marked);
            // The new vertices are middles of edges, exactly: an edge that still spans one would
            // have it at its middle.
            for e in mesh.edges() {
                let h = e.halfedge();
                let middle = 0.5 * (mesh.position(mesh.from(h)) + mesh.position(mesh.to(h)));
                assert!(added.iter().all(|&v| mesh.position(v) != middle), "{e:?} of {marked:?}");
            }
        }
    }

    #[test]
    fn a_face_is_quadrisected_where_it_deviates_much_and_bisected_where_it_deviates_a_little() {
        let field = field();
        let criteria = Criteria::new(&field, NOWHERE, &Parameters::default());
        for (tolerances, n_marked, n_faces) in [(1.2, 0, 8), (1.5, 1, 8 + 2), (2.5, 1, 8 + 3 + 3)] {
            let mut mesh = octahedron();
            let mut deviations = [0.0; 8];
            deviations[3] = tolerances * criteria.error;
            assert_eq!(refine(&mut mesh, &criteria, &deviations), n_marked, "{tolerances}");
            mesh.check().expect("refinement keeps the invariants");
            assert_eq!((mesh.n_faces(), mesh.euler()), (n_faces, 2), "{tolerances}");
        }
    }

    #[test]
    fn new_vertices_are_put_onto_the_isosurface() {
        let field = field();
        let mut mesh = octahedron();
        let all: Vec<Face> = mesh.faces().collect();
        let added = quadrisected(&mut mesh, ISOVALUE, &all);
        assert_eq!((added.len(), mesh.n_faces()), (12, 32));
        let isovalue = field.isovalue(ISOVALUE);
        for v in added {
            // Values are rounded, and positions near 16 voxels by 1e-6 voxel, where the field has a
            // slope of an eighth per voxel.
            let missing = field.value(mesh.position(v)) - isovalue;
            assert!(missing.abs() < 1e-5 * field.range(), "{v:?}: {missing}");
        }
    }

    #[test]
    fn edges_that_are_too_long_are_split_the_longest_first() {
        let field = field();
        let criteria = Criteria::new(&field, ISOVALUE, &Parameters::default());
        let mut mesh = octahedron();
        let edge = RADIUS * std::f32::consts::SQRT_2;
        assert_eq!(split_long(&mut mesh, &criteria, &[edge; 6], 1.01), []);
        let added = split_long(&mut mesh, &criteria, &[0.9 * edge; 6], 1.01);
        mesh.check().expect("splits keep the invariants");
        assert_eq!((added.len(), mesh.n_vertices(), mesh.euler()), (12, 18, 2));
    }
}
