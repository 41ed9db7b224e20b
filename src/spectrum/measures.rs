//! Measures of a closed mesh: components, Euler characteristic, area, enclosed volume.

use glam::DVec3;

use super::mesh::Mesh;
use crate::disjoint_sets::DisjointSets;

/// The measures of the mesh at one isovalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measures {
    /// The number of connected components, caps included.
    pub(crate) components: u32,
    /// Euler characteristic, caps included.
    pub(crate) euler: i64,
    /// Area without caps, in squares of the unit of the positions.
    pub(crate) area: f64,
    /// Volume inside, caps included, in cubes of it.
    pub(crate) volume: f64,
}

impl Measures {
    /// Measures a closed mesh in which every vertex belongs to a triangle.
    pub(crate) fn of(mesh: &Mesh) -> Measures {
        let corner = |v: u32| DVec3::from(mesh.positions[v as usize].map(f64::from));
        // The volume is a sum of tetrahedra. Their apex is a vertex of the mesh, because the origin may be far away, which costs precision.
        let apex = if mesh.positions.is_empty() { DVec3::ZERO } else { corner(0) };
        let (mut area, mut volume) = (0.0, 0.0);
        let mut parts = DisjointSets::new(mesh.positions.len());
        let mut components = mesh.positions.len() as u32;
        for (&[a, b, c], &cap) in mesh.triangles.iter().zip(&mesh.caps) {
            let [p, q, r] = [a, b, c].map(|v| corner(v) - apex);
            if !cap {
                area += 0.5 * (q - p).cross(r - p).length();
            }
            volume += p.dot(q.cross(r)) / 6.0;
            for other in [b, c] {
                components -= u32::from(parts.join(a, other));
            }
        }
        // A closed mesh has three edges for two triangles.
        let euler = mesh.positions.len() as i64 - mesh.triangles.len() as i64 / 2;
        Measures { components, euler, area, volume: volume.abs() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_tetrahedra_are_two_components_with_the_volume_of_both() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let far = corners.map(|c: [f32; 3]| c.map(|x| 2.0 * x + 10.0));
        let mut mesh = Mesh {
            positions: corners.into_iter().chain(far).collect(),
            normals: vec![[0.0, 0.0, 1.0]; 8],
            triangles: faces.into_iter().chain(faces.map(|f: [u32; 3]| f.map(|v| v + 4))).collect(),
            caps: vec![false; 8],
        };
        let found = Measures::of(&mesh);
        assert_eq!((found.components, found.euler), (2, 4));
        // Coordinates are integers: only the sums of a few products are rounded.
        assert!((found.volume - (1.0 + 8.0) / 6.0).abs() < 1e-12, "{}", found.volume);
        let area = (1.5 + 0.75f64.sqrt()) * (1.0 + 4.0);
        assert!((found.area - area).abs() < 1e-12, "{} {area}", found.area);
        mesh.caps[0] = true;
        assert!((Measures::of(&mesh).area - area + 0.5).abs() < 1e-12, "caps have no area");
        assert_eq!(Measures::of(&Mesh::default()).components, 0);
    }
}
