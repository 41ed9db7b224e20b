//! The topology of a mesh: components, Euler characteristic, and violations of a closed
//! oriented 2-manifold.
//!
//! Computed from the triangle list alone, independently of the half-edge mesh of the sweep.

use serde::Serialize;

use crate::disjoint_sets::DisjointSets;
use crate::grouped::grouped;

/// The topology of a triangle mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct MeshTopology {
    /// Connected components.
    pub components: usize,
    /// Vertices - edges + triangles.
    pub euler: i64,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Edges with more than two triangles, or triangles that use a vertex twice.
    pub nonmanifold_edges: usize,
    /// Edges whose two triangles have opposite orientations.
    pub misoriented_edges: usize,
    /// Vertices whose triangles form more than one fan.
    pub nonmanifold_vertices: usize,
}

impl MeshTopology {
    /// Whether the mesh is an oriented 2-manifold without boundary.
    pub fn is_closed_manifold(&self) -> bool {
        self.boundary_edges == 0
            && self.nonmanifold_edges == 0
            && self.misoriented_edges == 0
            && self.nonmanifold_vertices == 0
    }
}

/// A half-edge at the smaller one of its ends: the larger one, and the corner of its triangle where it starts.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    larger: u32,
    start: u32,
}

impl HalfEdge {
    /// The corners of its triangle at the smaller and at the larger end, and whether it starts at the smaller one.
    fn corners(self, smaller: u32, triangles: &[[u32; 3]]) -> ([u32; 2], bool) {
        let (start, end) =
            (self.start, if self.start % 3 == 2 { self.start - 2 } else { self.start + 1 });
        let is_forward = triangles.as_flattened()[start as usize] == smaller;
        (if is_forward { [start, end] } else { [end, start] }, is_forward)
    }
}

/// The topology of a mesh. Vertices without a triangle do not count.
pub fn mesh_topology(n_vertices: usize, triangles: &[[u32; 3]]) -> MeshTopology {
    let mut result = MeshTopology::default();
    let has_twice = |&&[a, b, c]: &&[u32; 3]| a == b || b == c || c == a;
    result.nonmanifold_edges = triangles.iter().filter(has_twice).count();
    let (starts, mut half_edges) = by_smaller_end(n_vertices, triangles);
    let mut components = DisjointSets::new(n_vertices);
    let mut fans = DisjointSets::new(3 * triangles.len());
    let mut n_edges = 0;
    for (smaller, ends) in starts.windows(2).enumerate() {
        let of_vertex = &mut half_edges[ends[0] as usize..ends[1] as usize];
        of_vertex.sort_unstable();
        let smaller = smaller as u32;
        for edge in of_vertex.chunk_by(|a, b| a.larger == b.larger) {
            n_edges += 1;
            components.join(smaller, edge[0].larger);
            match edge.len() {
                1 => result.boundary_edges += 1,
                2 => {}
                _ => result.nonmanifold_edges += 1,
            }
            for pair in edge.windows(2) {
                let [(a, a_is_forward), (b, b_is_forward)] =
                    [pair[0], pair[1]].map(|half| half.corners(smaller, triangles));
                fans.join(a[0], b[0]);
                fans.join(a[1], b[1]);
                let is_misoriented = edge.len() == 2 && a_is_forward == b_is_forward;
                result.misoriented_edges += usize::from(is_misoriented);
            }
        }
    }
    // By vertex, a fan of its triangles, and whether there is another one.
    let mut fan_of: Vec<Option<u32>> = vec![None; n_vertices];
    let mut has_several = vec![false; n_vertices];
    for (&v, corner) in triangles.as_flattened().iter().zip(0..) {
        let fan = fans.find(corner);
        has_several[v as usize] |= *fan_of[v as usize].get_or_insert(fan) != fan;
    }
    result.nonmanifold_vertices = has_several.iter().filter(|several| **several).count();
    let used = || (0..n_vertices as u32).filter(|&v| fan_of[v as usize].is_some());
    result.components = used().filter(|&v| components.find(v) == v).count();
    result.euler = used().count() as i64 - n_edges + triangles.len() as i64;
    result
}

/// The half-edges of triangles, those with the same smaller end together, and the index of the first one of each vertex.
fn by_smaller_end(n_vertices: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<HalfEdge>) {
    let half_edges = triangles.iter().enumerate().flat_map(|(t, triangle)| {
        (0..3).map(move |k| {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            (from.min(to), HalfEdge { larger: from.max(to), start: (3 * t + k) as u32 })
        })
    });
    grouped(n_vertices, half_edges)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn a_tetrahedron_is_a_sphere() {
        let t = mesh_topology(4, &TETRAHEDRON);
        assert!(t.is_closed_manifold());
        assert_eq!((t.components, t.euler), (1, 2));
    }

    #[test]
    fn vertices_without_triangles_do_not_count() {
        assert_eq!(mesh_topology(9, &TETRAHEDRON), mesh_topology(4, &TETRAHEDRON));
    }

    #[test]
    fn a_missing_triangle_leaves_three_boundary_edges() {
        let t = mesh_topology(4, &TETRAHEDRON[..3]);
        assert_eq!((t.boundary_edges, t.euler), (3, 1));
        assert!(!t.is_closed_manifold());
    }

    #[test]
    fn a_flipped_triangle_has_three_misoriented_edges() {
        let mut triangles = TETRAHEDRON;
        triangles[0].swap(0, 1);
        assert_eq!(mesh_topology(4, &triangles).misoriented_edges, 3);
    }

    #[test]
    fn a_vertex_shared_by_two_tetrahedra_is_nonmanifold() {
        let second = TETRAHEDRON.map(|t| t.map(|v| if v == 0 { 0 } else { v + 3 }));
        let triangles = [TETRAHEDRON, second].concat();
        let t = mesh_topology(7, &triangles);
        assert_eq!((t.nonmanifold_vertices, t.nonmanifold_edges, t.components), (1, 0, 1));
        assert_eq!(t.euler, 3);
    }

    #[test]
    fn an_edge_shared_by_two_tetrahedra_is_nonmanifold() {
        let second = TETRAHEDRON.map(|t| t.map(|v| if v < 2 { v } else { v + 2 }));
        let triangles = [TETRAHEDRON, second].concat();
        assert_eq!(mesh_topology(6, &triangles).nonmanifold_edges, 1);
    }

    #[test]
    fn a_seven_vertex_torus_has_euler_characteristic_zero() {
        // Moebius' torus: triangles (i, i+1, i+3) and (i, i+3, i+2) modulo 7.
        let mut triangles = Vec::new();
        for i in 0..7u32 {
            triangles.push([i, (i + 1) % 7, (i + 3) % 7]);
            triangles.push([i, (i + 3) % 7, (i + 2) % 7]);
        }
        let t = mesh_topology(7, &triangles);
        assert!(t.is_closed_manifold(), "{t:?}");
        assert_eq!((t.components, t.euler), (1, 0));
    }
}
