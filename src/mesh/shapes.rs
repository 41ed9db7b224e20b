//! Meshes that the tests of several modules begin with.

use std::collections::BTreeMap;

use glam::Vec3;

use super::Mesh;

/// An octahedron, counter-clockwise seen from outside, with its vertices so far from its middle along
/// both ways of each axis.
pub(crate) fn octahedron(middle: Vec3, radius: f32) -> Mesh {
    let positions = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z]
        .map(|p| (middle + radius * p).to_array());
    let triangles =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    Mesh::from_triangles(&positions, &[0; 6], &triangles, &[false; 8]).expect("closed")
}

/// A sphere around the origin: an octahedron whose triangles are quadrisected `levels` times, 8 * 4^levels of them.
pub(crate) fn sphere(radius: f32, levels: u32) -> Mesh {
    let start = octahedron(Vec3::ZERO, 1.0);
    let mut positions: Vec<Vec3> = start.vertices().map(|v| start.position(v)).collect();
    let mut triangles: Vec<[u32; 3]> =
        start.faces().map(|f| start.face_vertices(f).map(|v| v.0)).collect();
    for _ in 0..levels {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let quadrisected = triangles.iter().flat_map(|&[a, b, c]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        triangles = quadrisected.collect();
    }
    let positions: Vec<[f32; 3]> = positions.iter().map(|&p| (radius * p).to_array()).collect();
    let (borders, caps) = (vec![0; positions.len()], vec![false; triangles.len()]);
    Mesh::from_triangles(&positions, &borders, &triangles, &caps).expect("closed")
}
