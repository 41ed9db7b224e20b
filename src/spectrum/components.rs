//! The connected components of a mesh, each with its measures, and which of them are kept.
//!
//! # Theory
//!
//! The volume of a component is the sum of the tetrahedra that its triangles make with one point (the divergence
//! theorem); triangles are counter-clockwise seen from the side of the layer around the volume, so it is positive where the
//! component encloses the other side, a *body*, and negative where it is around a hollow in a body, a *cavity*.
//!
//! # Invariants
//!
//! Components are numbered from 0 by decreasing absolute volume; of equal ones the one with the first triangle comes first.
//! Tables, colours, files and pages all use these numbers.

use glam::DVec3;
use serde::Serialize;

use super::mesh::Mesh;
use super::picked::Picked;
use crate::disjoint_sets::DisjointSets;
use crate::mesh::nearest_on_triangle;
use crate::volume::Placement;

/// One component of a closed mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Component {
    /// How many triangles it has, caps included.
    pub n_triangles: usize,
    /// Euler characteristic, caps included.
    pub euler: i64,
    /// Area without caps, in squares of the unit of the positions.
    pub area: f64,
    /// Volume inside, caps included, in cubes of that unit; negative for a cavity.
    pub volume: f64,
    /// Least and largest corner of the box around it, caps included.
    pub bounds: [[f64; 3]; 2],
}

/// The components of a closed mesh.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Components {
    /// The component of each triangle of the mesh.
    pub of_triangle: Vec<u32>,
    /// The components, the largest first.
    pub list: Vec<Component>,
}

impl Components {
    /// The components of a closed mesh in which every vertex belongs to a triangle.
    pub fn of(mesh: &Mesh) -> Components {
        let mut sets = DisjointSets::new(mesh.positions.len());
        for &[a, b, c] in &mesh.triangles {
            sets.join(a, b);
            sets.join(a, c);
        }
        // First numbered by their first triangles.
        let mut number = vec![u32::MAX; mesh.positions.len()];
        let mut n = 0;
        let of_triangle: Vec<u32> = (mesh.triangles.iter())
            .map(|&[a, _, _]| {
                let number = &mut number[sets.find(a) as usize];
                if *number == u32::MAX {
                    *number = n;
                    n += 1;
                }
                *number
            })
            .collect();
        let list = measured(mesh, &of_triangle, n as usize);
        Components { of_triangle, list }.by_size()
    }

    /// The same components, measured on the mesh after a transformation, such as to the world. Their order does not change.
    pub fn moved(&self, mesh: &Mesh) -> Components {
        let list = measured(mesh, &self.of_triangle, self.list.len());
        Components { of_triangle: self.of_triangle.clone(), list }
    }

    fn by_size(mut self) -> Components {
        let mut order: Vec<u32> = (0..self.list.len() as u32).collect();
        let size = |&i: &u32| self.list[i as usize].volume.abs();
        order.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.cmp(b)));
        let mut rank = vec![0; order.len()];
        (0..).zip(&order).for_each(|(new, &old)| rank[old as usize] = new);
        self.of_triangle.iter_mut().for_each(|number| *number = rank[*number as usize]);
        self.list = order.iter().map(|&old| self.list[old as usize]).collect();
        self
    }

    /// By component, whether it is kept. `mesh` is the one of [`Components::of`]; points and sizes are in its frame.
    pub fn kept(&self, mesh: &Mesh, keep: &Keep) -> Vec<bool> {
        self.shown(mesh, keep, &Picked::default())
    }

    /// By component, whether it is kept and selected. Points of `picked` select among all components; the largest are counted among the
    /// remaining ones.
    fn shown(&self, mesh: &Mesh, keep: &Keep, picked: &Picked) -> Vec<bool> {
        let is_large = |c: &Component| c.volume.abs() >= keep.min_volume && c.area >= keep.min_area;
        let mut kept: Vec<bool> = self.list.iter().map(is_large).collect();
        if let Some(point) = keep.at {
            let nearest = self.nearest(mesh, &kept, point);
            (0..).zip(&mut kept).for_each(|(i, kept)| *kept &= nearest == Some(i));
        }
        let (Picked::Only(points) | Picked::Without(points)) = picked;
        let all = vec![true; self.list.len()];
        let mut is_picked = vec![false; self.list.len()];
        for component in points.iter().filter_map(|&point| self.nearest(mesh, &all, point)) {
            is_picked[component as usize] = true;
        }
        let is_wanted = matches!(picked, Picked::Only(_));
        kept.iter_mut().zip(is_picked).for_each(|(kept, is)| *kept &= is == is_wanted);
        let mut n_left = keep.largest.unwrap_or(usize::MAX);
        for kept in &mut kept {
            *kept &= n_left > 0;
            n_left -= usize::from(*kept);
        }
        kept
    }

    /// The component nearest to a point; none of an empty mesh.
    #[cfg(feature = "viewer")]
    pub(crate) fn nearest_to(&self, mesh: &Mesh, point: [f64; 3]) -> Option<u32> {
        self.nearest(mesh, &vec![true; self.list.len()], point)
    }

    /// The component nearest to a point, of those with `among` true.
    fn nearest(&self, mesh: &Mesh, among: &[bool], point: [f64; 3]) -> Option<u32> {
        let point = DVec3::from_array(point);
        let corners = |triangle: &[u32; 3]| {
            triangle.map(|v| DVec3::from(mesh.positions[v as usize].map(f64::from)))
        };
        (mesh.triangles.iter().zip(&self.of_triangle))
            .filter(|(_, component)| among[**component as usize])
            .map(|(t, &component)| {
                (nearest_on_triangle(point, corners(t)).distance_squared(point), component)
            })
            // A triangle without area has no nearest point; its neighbours have the same corners.
            .filter(|(distance, _)| !distance.is_nan())
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, component)| component)
    }
}

/// The measures of `n` components, given the component of each triangle.
fn measured(mesh: &Mesh, of_triangle: &[u32], n: usize) -> Vec<Component> {
    let corner = |v: u32| DVec3::from(mesh.positions[v as usize].map(f64::from));
    let nothing = Component {
        n_triangles: 0,
        euler: 0,
        area: 0.0,
        volume: 0.0,
        bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
    };
    let mut list = vec![nothing; n];
    // Volumes are sums of tetrahedra. Their apex is a vertex of the component, because the origin may be far away, which costs precision.
    let mut apexes: Vec<Option<DVec3>> = vec![None; n];
    let mut is_counted = vec![false; mesh.positions.len()];
    for ((triangle, &cap), &number) in mesh.triangles.iter().zip(&mesh.caps).zip(of_triangle) {
        let component = &mut list[number as usize];
        let apex = *apexes[number as usize].get_or_insert_with(|| corner(triangle[0]));
        let [p, q, r] = triangle.map(|v| corner(v) - apex);
        component.n_triangles += 1;
        if !cap {
            component.area += 0.5 * (q - p).cross(r - p).length();
        }
        component.volume += p.dot(q.cross(r)) / 6.0;
        for &v in triangle {
            if !std::mem::replace(&mut is_counted[v as usize], true) {
                component.euler += 1;
                let [low, high] = &mut component.bounds;
                for (axis, x) in corner(v).to_array().into_iter().enumerate() {
                    low[axis] = low[axis].min(x);
                    high[axis] = high[axis].max(x);
                }
            }
        }
    }
    // A closed mesh has three edges for two triangles.
    list.iter_mut().for_each(|c| c.euler -= c.n_triangles as i64 / 2);
    list
}

/// Limits for the components of an isosurface that are kept; by default all are. In the frame and the unit of the mesh's positions.
///
/// ```
/// use isospectrum::{Keep, Mesh, Placement};
///
/// // The largest one of those that enclose a millilitre, of a volume in millimetres.
/// let keep = Keep { largest: Some(1), min_volume: 1000.0, ..Keep::default() };
/// let keep = keep.in_voxels(&Placement { spacing: [0.5; 3], ..Placement::default() });
/// assert_eq!(keep.min_volume, 8000.0);
/// assert!(Mesh::default().with_components(&keep).triangles.is_empty());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Keep {
    /// Keep this many, the largest by volume, of those within the other limits.
    pub largest: Option<usize>,
    /// Least absolute enclosed volume, of bodies and cavities.
    pub min_volume: f64,
    /// Least area, without caps.
    pub min_area: f64,
    /// Keep the component nearest to this point, of those that are large enough.
    pub at: Option<[f64; 3]>,
}

impl Keep {
    /// Converts from the frame and the unit of the world to the voxel frame of a volume. If that is stretched in the world
    /// ([`Placement::stretch`]) the ratio of two areas depends on their orientation, and the area is converted by the mean.
    pub fn in_voxels(self, placement: &Placement) -> Keep {
        let voxel = placement.voxel();
        let stretch = (placement.voxel_volume() / (voxel.powi(3) * placement.span().abs())).cbrt();
        Keep {
            largest: self.largest,
            min_volume: self.min_volume / placement.voxel_volume(),
            min_area: self.min_area / (voxel * stretch).powi(2),
            at: self.at.map(|point| placement.voxel_of_world(point)),
        }
    }

    /// Whether all components are kept.
    pub fn is_all(&self) -> bool {
        *self == Keep::default()
    }

    /// Checks that all numbers are finite.
    pub(crate) fn check(&self) -> crate::Result<()> {
        let numbers =
            [self.min_volume, self.min_area].into_iter().chain(self.at.into_iter().flatten());
        match numbers.into_iter().find(|x| !x.is_finite()) {
            Some(wrong) => Err(crate::Error::Usage(format!(
                "components kept by {wrong}, expected finite numbers"
            ))),
            None => Ok(()),
        }
    }
}

impl Mesh {
    /// The mesh of the kept components, in the same order.
    pub fn with_components(&self, keep: &Keep) -> Mesh {
        self.with_shown(keep, &Picked::default())
    }

    /// The mesh of the components that are kept and selected, in the same order.
    pub fn with_shown(&self, keep: &Keep, picked: &Picked) -> Mesh {
        match self.shown_triangles(keep, picked) {
            None => self.clone(),
            Some(shown) => self.with_triangles(|t| shown[t]),
        }
    }

    /// The mesh of the kept components, without caps if `open`, and the indices of its vertices and triangles in the original
    /// mesh.
    pub fn kept(&self, keep: &Keep, open: bool) -> (Mesh, [Vec<u32>; 2]) {
        let is_kept = self.kept_triangles(keep);
        if is_kept.is_none() && !open {
            let all = |n: usize| (0..n as u32).collect();
            return (self.clone(), [all(self.positions.len()), all(self.triangles.len())]);
        }
        let is_kept = |t: usize| is_kept.as_ref().is_none_or(|kept| kept[t]);
        self.part(|t| is_kept(t) && !(open && self.caps[t]))
    }

    /// By triangle, whether its component is kept; `None` if all are.
    pub(crate) fn kept_triangles(&self, keep: &Keep) -> Option<Vec<bool>> {
        self.shown_triangles(keep, &Picked::default())
    }

    /// By triangle, whether its component is kept and selected; `None` if all are.
    pub(crate) fn shown_triangles(&self, keep: &Keep, picked: &Picked) -> Option<Vec<bool>> {
        if keep.is_all() && picked.is_all() {
            return None;
        }
        let components = Components::of(self);
        let shown = components.shown(self, keep, picked);
        Some(components.of_triangle.iter().map(|&c| shown[c as usize]).collect())
    }

    /// The mesh of the triangles with `is_kept` true. Its vertices are in the order of their first use.
    pub(crate) fn with_triangles(&self, is_kept: impl Fn(usize) -> bool) -> Mesh {
        self.part(is_kept).0
    }

    /// As `with_triangles`, with the indices of its vertices and triangles in the original mesh.
    pub(crate) fn part(&self, is_kept: impl Fn(usize) -> bool) -> (Mesh, [Vec<u32>; 2]) {
        let mut part = Mesh::default();
        let [mut vertices, mut triangles] = [Vec::new(), Vec::new()];
        let mut index = vec![u32::MAX; self.positions.len()];
        for t in (0..self.triangles.len()).filter(|&t| is_kept(t)) {
            part.triangles.push(self.triangles[t].map(|v| {
                let v = v as usize;
                if index[v] == u32::MAX {
                    index[v] = part.positions.len() as u32;
                    part.positions.push(self.positions[v]);
                    part.normals.push(self.normals[v]);
                    vertices.push(v as u32);
                }
                index[v]
            }));
            part.caps.push(self.caps[t]);
            triangles.push(t as u32);
        }
        (part, [vertices, triangles])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tetrahedra by size and x; a negative size is a cavity.
    fn tetrahedra(sizes: &[(f32, f32)]) -> Mesh {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mut mesh = Mesh::default();
        for &(size, x) in sizes {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(
                corners.map(|[a, b, c]| [size.abs() * a + x, size.abs() * b, size.abs() * c]),
            );
            mesh.triangles.extend(faces.map(|[a, b, c]| {
                let [a, b, c] = [a, b, c].map(|v: u32| v + first);
                if size < 0.0 { [a, c, b] } else { [a, b, c] }
            }));
        }
        mesh.normals = vec![[0.0, 0.0, 1.0]; mesh.positions.len()];
        mesh.caps = vec![false; mesh.triangles.len()];
        mesh
    }

    #[test]
    fn a_triangle_without_area_is_not_nearest() {
        let mut mesh = tetrahedra(&[(3.0, 0.0), (1.0, 10.0)]);
        // Of the larger one; two of its corners are in one place.
        mesh.positions.push(mesh.positions[0]);
        mesh.normals.push(mesh.normals[0]);
        mesh.triangles.push([0, 8, 1]);
        mesh.caps.push(false);
        let kept = mesh.with_components(&Keep { at: Some([10.2, 0.2, 0.2]), ..Keep::default() });
        assert_eq!(kept.triangles.len(), 4);
        assert!(kept.positions.iter().all(|p| p[0] >= 10.0));
    }

    #[test]
    fn components_are_numbered_by_the_size_of_their_volume_and_measured() {
        let mesh = tetrahedra(&[(1.0, 0.0), (3.0, 10.0), (-2.0, 20.0), (1.0, 30.0)]);
        let found = Components::of(&mesh);
        let expected: Vec<u32> = [2, 0, 1, 3].into_iter().flat_map(|c| [c; 4]).collect();
        assert_eq!(found.of_triangle, expected);
        let volumes: Vec<f64> = found.list.iter().map(|c| 6.0 * c.volume).collect();
        // Products of integers, divided once.
        for (found, expected) in volumes.iter().zip([27.0, -8.0, 1.0, 1.0]) {
            assert!((found - expected).abs() < 1e-12, "{volumes:?}");
        }
        assert!(found.list.iter().all(|c| (c.euler, c.n_triangles) == (2, 4)));
        assert_eq!(found.list[1].bounds, [[20.0, 0.0, 0.0], [22.0, 2.0, 2.0]]);
        let area = 4.0 * (1.5 + 0.75f64.sqrt());
        assert!((found.list[1].area - area).abs() < 1e-12);
        assert_eq!(Components::of(&Mesh::default()), Components::default());
    }

    #[test]
    fn components_are_kept_by_size_number_and_place() {
        let mesh = tetrahedra(&[(1.0, 0.0), (3.0, 10.0), (-2.0, 20.0), (0.5, 30.0)]);
        let n_kept = |keep: Keep| mesh.with_components(&keep).triangles.len() / 4;
        let all = Keep::default();
        assert!(all.is_all() && n_kept(all) == 4);
        assert_eq!(n_kept(Keep { largest: Some(3), ..all }), 3);
        assert_eq!(n_kept(Keep { min_volume: 0.9 / 6.0, ..all }), 3);
        assert_eq!(n_kept(Keep { min_area: 3.0, ..all }), 2);
        let at = |x| Keep { at: Some([x, 0.1, 0.1]), ..all };
        let left = |keep: Keep| mesh.with_components(&keep).positions[0][0];
        assert_eq!([0.2, 21.0, 40.0].map(|x| left(at(x))), [0.0, 20.0, 30.0]);
        // Of those that are large enough.
        assert_eq!(left(Keep { min_area: 3.0, ..at(40.0) }), 20.0);
        assert_eq!(n_kept(Keep { largest: Some(0), ..all }), 0);
    }

    #[test]
    fn components_are_picked_one_by_one() {
        let mesh = tetrahedra(&[(1.0, 0.0), (3.0, 10.0), (-2.0, 20.0), (0.5, 30.0)]);
        let left = |keep: Keep, picked: &Picked| -> Vec<f32> {
            let mesh = mesh.with_shown(&keep, picked);
            mesh.positions.iter().step_by(4).map(|p| p[0]).collect()
        };
        let all = Keep::default();
        let [first, third] = [[0.1, 0.1, 0.0], [20.5, 0.0, 0.3]];
        assert!(Picked::default().is_all() && !Picked::Only(vec![]).is_all());
        assert_eq!(left(all, &Picked::default()), [0.0, 10.0, 20.0, 30.0]);
        assert_eq!(left(all, &Picked::Only(vec![first])), [0.0]);
        assert_eq!(left(all, &Picked::Only(vec![])), [0.0; 0]);
        assert_eq!(left(all, &Picked::Without(vec![third, first])), [10.0, 30.0]);
        // `largest` counts the remaining ones; components that are too small can be picked.
        assert_eq!(
            left(Keep { largest: Some(2), ..all }, &Picked::Without(vec![third])),
            [0.0, 10.0]
        );
        assert_eq!(left(Keep { min_area: 3.0, ..all }, &Picked::Only(vec![first, third])), [20.0]);
    }

    #[test]
    fn the_nearest_component_is_that_of_the_nearest_triangle_not_vertex() {
        // The point is 0.1 from the middle of a large triangle, far from its vertices.
        let mesh = tetrahedra(&[(30.0, 0.0), (0.2, -1.0)]);
        let kept = mesh.with_components(&Keep { at: Some([-0.1, 7.0, 7.0]), ..Keep::default() });
        assert_eq!(kept.bounds().expect("one")[1], [30.0; 3]);
    }
}
