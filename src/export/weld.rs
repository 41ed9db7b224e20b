//! Preparation of a mesh for formats that identify vertices by their positions: coincident vertices are merged or moved apart.
//!
//! Where the isovalue equals a sample's value, the vertices on all edges of that sample coincide. A reader of an STL file
//! welds equal corners; triangles then lose their area, and edges get four triangles where sheets touch.
//!
//! # Method
//!
//! In this order, on positions as the file will hold them:
//!
//! 1. An edge of zero length is collapsed if the link of the merged vertex stays one cycle (one path at an open border):
//!    exactly then a 2-manifold stays a 2-manifold of the same topology.
//! 2. A component whose vertices all coincide is dropped: it has no surface.
//! 3. Vertices that still coincide (sheets that touch, edges whose collapse would close a handle) are moved apart by units in
//!    the last place, as are those of triangles that have three corners but no area.
//!
//! The twin in the page is `page/weld.js`.
//!
//! # Invariants
//!
//! Vertices have different positions but for [`Welded::n_coincident`], so that welding changes nothing. Vertices and triangles
//! are processed by index: the same mesh gives the same bytes.

use std::collections::HashSet;

use crate::spectrum::Mesh;

/// Largest displacement of a vertex along an axis, units in the last place.
const MAX_DISPLACEMENT: i32 = 3;

/// Largest number of passes over the triangles without area.
const MAX_PASSES: usize = 4;

/// The triangles of a mesh after welding, by their corners.
#[derive(Debug)]
pub(super) struct Welded {
    pub(super) triangles: Vec<[[f32; 3]; 3]>,
    pub(super) n_vertices: usize,
    /// Remaining triangles without area.
    pub(super) n_degenerate: usize,
    /// Remaining vertices with the position of another one.
    pub(super) n_coincident: usize,
}

/// Welds a mesh that is a 2-manifold, with or without a border.
pub(super) fn weld(mesh: &Mesh) -> Welded {
    let mut welder = Welder::new(mesh);
    let mut n_coincident = 0;
    if welder.is_degenerate() {
        welder.collapse_edges();
        welder.drop_points();
        n_coincident = welder.separate_vertices();
        welder.open_triangles();
    }
    let triangles: Vec<_> = welder.triangles().map(|t| welder.corners(t)).collect();
    let n_degenerate = triangles.iter().filter(|corners| has_no_area(**corners)).count();
    Welded { triangles, n_vertices: welder.vertices().count(), n_degenerate, n_coincident }
}

/// A mesh as triangles, and the triangles around each vertex.
struct Welder {
    positions: Vec<[f32; 3]>,
    /// `None` for removed triangles.
    triangles: Vec<Option<[u32; 3]>>,
    around: Vec<Vec<u32>>,
}

impl Welder {
    fn new(mesh: &Mesh) -> Self {
        let mut around = vec![Vec::new(); mesh.positions.len()];
        for (t, triangle) in (0..).zip(&mesh.triangles) {
            triangle.iter().for_each(|&v| around[v as usize].push(t));
        }
        Welder {
            // 0 and -0 are the same position.
            positions: mesh.positions.iter().map(|p| p.map(|x| x + 0.0)).collect(),
            triangles: mesh.triangles.iter().copied().map(Some).collect(),
            around,
        }
    }

    /// The indices of the remaining triangles.
    fn triangles(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.triangles.len()).filter(|&t| self.triangles[t].is_some())
    }

    fn corners(&self, t: usize) -> [[f32; 3]; 3] {
        self.triangles[t].unwrap_or_default().map(|v| self.positions[v as usize])
    }

    /// The vertices that have triangles, by index.
    fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.around.len() as u32).filter(|&v| !self.around[v as usize].is_empty())
    }

    /// Whether vertices coincide or triangles have no area.
    fn is_degenerate(&self) -> bool {
        let mut taken = HashSet::new();
        !self.vertices().all(|v| taken.insert(self.position_bits(v)))
            || self.triangles().any(|t| has_no_area(self.corners(t)))
    }

    fn position_bits(&self, v: u32) -> [u32; 3] {
        self.positions[v as usize].map(f32::to_bits)
    }

    /// Collapses edges of zero length until none can be collapsed.
    fn collapse_edges(&mut self) {
        let is_short = |w: &Self, t: &usize| {
            let [a, b, c] = w.corners(*t);
            a == b || b == c || c == a
        };
        let mut short: Vec<usize> = self.triangles().filter(|t| is_short(self, t)).collect();
        loop {
            let before = short.len();
            for &t in &short {
                self.collapse_one_of(t);
            }
            short.retain(|&t| self.triangles[t].is_some());
            if short.len() == before {
                return;
            }
        }
    }

    /// Collapses the first collapsible edge of zero length of a triangle.
    fn collapse_one_of(&mut self, t: usize) {
        let Some([a, b, c]) = self.triangles[t] else { return };
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if self.position_bits(from) == self.position_bits(to) && self.can_merge(from, to) {
                self.merge(from.max(to), from.min(to));
                return;
            }
        }
    }

    /// The edges opposite `v` of its triangles, in the triangles' direction; without the triangles that also have `except` as a
    /// corner.
    fn link(&self, v: u32, except: Option<u32>) -> impl Iterator<Item = (u32, u32)> + '_ {
        let triangles = self.around[v as usize].iter();
        let corners = triangles.filter_map(|&t| self.triangles[t as usize]);
        let corners = corners.filter(move |c| except.is_none_or(|except| !c.contains(&except)));
        corners.map(move |[a, b, c]| {
            if a == v {
                (b, c)
            } else if b == v {
                (c, a)
            } else {
                (a, b)
            }
        })
    }

    /// Whether the mesh stays a manifold if two adjacent vertices are merged.
    fn can_merge(&self, a: u32, b: u32) -> bool {
        let merged = self.link(a, Some(b)).chain(self.link(b, Some(a))).collect();
        let is_open = [a, b].iter().any(|&v| is_chain(self.link(v, None).collect()) != Some(true));
        match is_chain(merged) {
            Some(closed) => closed != is_open,
            None => false,
        }
    }

    /// Replaces the vertex `removed` by `target`, and removes the triangles that have both.
    fn merge(&mut self, removed: u32, target: u32) {
        for t in std::mem::take(&mut self.around[removed as usize]) {
            let Some(corners) = self.triangles[t as usize] else { continue };
            if corners.contains(&target) {
                self.remove(t);
            } else {
                self.triangles[t as usize] =
                    Some(corners.map(|v| if v == removed { target } else { v }));
                self.around[target as usize].push(t);
            }
        }
    }

    fn remove(&mut self, t: u32) {
        for v in self.triangles[t as usize].take().into_iter().flatten() {
            self.around[v as usize].retain(|&other| other != t);
        }
    }

    /// Drops the components whose vertices all coincide.
    fn drop_points(&mut self) {
        let mut seen = vec![false; self.positions.len()];
        for first in 0..self.positions.len() as u32 {
            if seen[first as usize] || self.around[first as usize].is_empty() {
                continue;
            }
            seen[first as usize] = true;
            let (mut component, mut next) = (vec![first], 0);
            while let Some(&v) = component.get(next) {
                next += 1;
                for (a, b) in self.link(v, None) {
                    for w in [a, b] {
                        if !std::mem::replace(&mut seen[w as usize], true) {
                            component.push(w);
                        }
                    }
                }
            }
            if component.iter().all(|&v| self.position_bits(v) == self.position_bits(first)) {
                for v in component {
                    self.around[v as usize].clone().into_iter().for_each(|t| self.remove(t));
                }
            }
        }
    }

    /// Moves coincident vertices apart; returns the number of those that still coincide.
    fn separate_vertices(&mut self) -> usize {
        let vertices: Vec<u32> = self.vertices().collect();
        let mut taken = HashSet::new();
        let coincident: Vec<u32> =
            vertices.into_iter().filter(|&v| !taken.insert(self.position_bits(v))).collect();
        coincident.into_iter().filter(|&v| !self.displace(v, &mut taken, false)).count()
    }

    /// Gives area to degenerate triangles, by moving the corner between the other two.
    fn open_triangles(&mut self) {
        let mut taken: HashSet<[u32; 3]> = self.vertices().map(|v| self.position_bits(v)).collect();
        for _ in 0..MAX_PASSES {
            let degenerate: Vec<usize> =
                self.triangles().filter(|&t| has_no_area(self.corners(t))).collect();
            if degenerate.is_empty() {
                return;
            }
            for t in degenerate {
                let Some(corners) = self.triangles[t] else { continue };
                if !has_no_area(self.corners(t)) {
                    continue;
                }
                let length = |i: usize| {
                    let [p, q] = [corners[(i + 1) % 3], corners[(i + 2) % 3]].map(|v| {
                        glam::DVec3::from_array(self.positions[v as usize].map(f64::from))
                    });
                    p.distance_squared(q)
                };
                // The corner opposite the longest side first.
                let mut order = [0, 1, 2];
                order.sort_by(|&i, &j| length(j).total_cmp(&length(i)));
                for i in order {
                    if self.displace(corners[i], &mut taken, true) {
                        break;
                    }
                }
            }
        }
    }

    /// Moves a vertex to the nearest free position where each of its triangles has an area, or, if not `strictly`, to any free
    /// position. Returns whether the vertex has moved.
    fn displace(&mut self, v: u32, taken: &mut HashSet<[u32; 3]>, strictly: bool) -> bool {
        let old = self.positions[v as usize];
        let largest = old.iter().fold(f32::MIN_POSITIVE / f32::EPSILON, |m, x| m.max(x.abs()));
        let step = largest * f32::EPSILON;
        let mut free = None;
        for offset in offsets() {
            let new: [f32; 3] = std::array::from_fn(|i| old[i] + step * offset[i] as f32 + 0.0);
            if taken.contains(&new.map(f32::to_bits)) || !new.iter().all(|x| x.is_finite()) {
                continue;
            }
            self.positions[v as usize] = new;
            let around = &self.around[v as usize];
            if !around.iter().any(|&t| has_no_area(self.corners(t as usize))) {
                taken.insert(self.position_bits(v));
                return true;
            }
            free = free.or(Some(new));
        }
        match free.filter(|_| !strictly) {
            Some(new) => {
                self.positions[v as usize] = new;
                taken.insert(self.position_bits(v));
                true
            }
            None => {
                self.positions[v as usize] = old;
                false
            }
        }
    }
}

/// Displacements along x, y, z in units in the last place, the shortest first.
fn offsets() -> impl Iterator<Item = [i32; 3]> {
    (1..=MAX_DISPLACEMENT).flat_map(|shell| {
        let along = move || -shell..=shell;
        along()
            .flat_map(move |x| along().flat_map(move |y| along().map(move |z| [x, y, z])))
            .filter(move |o| o.iter().any(|x| x.abs() == shell))
    })
}

/// `Some(true)` if the arcs are one closed cycle of at least three, `Some(false)` if they are one path.
fn is_chain(mut arcs: Vec<(u32, u32)>) -> Option<bool> {
    arcs.sort_unstable();
    let mut ends: Vec<u32> = arcs.iter().map(|arc| arc.1).collect();
    ends.sort_unstable();
    let is_double =
        arcs.windows(2).any(|w| w[0].0 == w[1].0) || ends.windows(2).any(|w| w[0] == w[1]);
    if arcs.is_empty() || is_double {
        return None;
    }
    let next = |from: u32| arcs.binary_search_by_key(&from, |arc| arc.0).ok().map(|i| arcs[i].1);
    let starts = arcs.iter().map(|arc| arc.0).filter(|from| ends.binary_search(from).is_err());
    let starts: Vec<u32> = starts.collect();
    let first = *starts.first().unwrap_or(&arcs[0].0);
    let (mut at, mut n) = (first, 0);
    while let Some(to) = next(at) {
        (at, n) = (to, n + 1);
        if at == first {
            break;
        }
    }
    match starts.len() {
        0 if n == arcs.len() && n >= 3 => Some(true),
        1 if n == arcs.len() => Some(false),
        _ => None,
    }
}

/// Whether the area of a triangle is zero, computed in 64-bit or in 32-bit floats.
fn has_no_area([a, b, c]: [[f32; 3]; 3]) -> bool {
    let wide = |p: [f32; 3]| glam::DVec3::from_array(p.map(f64::from));
    let narrow = glam::Vec3::from_array;
    (wide(b) - wide(a)).cross(wide(c) - wide(a)) == glam::DVec3::ZERO
        || (narrow(b) - narrow(a)).cross(narrow(c) - narrow(a)) == glam::Vec3::ZERO
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Two joined pyramids over a regular polygon.
    fn bipyramid(n: u32) -> Mesh {
        let corner = |i: u32| {
            let (s, c) = (std::f32::consts::TAU * i as f32 / n as f32).sin_cos();
            [c, s, 0.0]
        };
        let positions: Vec<[f32; 3]> =
            (0..n).map(corner).chain([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]).collect();
        let sides = (0..n).flat_map(|i| {
            let j = (i + 1) % n;
            [[i, j, n], [j, i, n + 1]]
        });
        mesh(positions, sides.collect())
    }

    fn mesh(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Mesh {
        let normals = vec![[0.0; 3]; positions.len()];
        let caps = vec![false; triangles.len()];
        Mesh { positions, normals, triangles, caps }
    }

    /// Welds as a reader does and counts: triangles, edges that do not have exactly one triangle in each direction, triangles
    /// without area.
    fn read(welded: &Welded) -> (usize, usize, usize) {
        let bits = |p: [f32; 3]| p.map(|x| (x + 0.0).to_bits());
        let mut sides: BTreeMap<[[u32; 3]; 2], (i32, i32)> = BTreeMap::new();
        for corners in &welded.triangles {
            let [a, b, c] = corners.map(bits);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let side = sides.entry([p.min(q), p.max(q)]).or_default();
                if p < q { side.0 += 1 } else { side.1 += 1 }
            }
        }
        let bad = sides.values().filter(|&&s| s != (1, 1)).count();
        let degenerate = welded.triangles.iter().filter(|&&t| has_no_area(t)).count();
        (welded.triangles.len(), bad, degenerate)
    }

    #[test]
    fn a_mesh_without_coincident_vertices_is_unchanged() {
        let mesh = bipyramid(6);
        let corners: Vec<_> =
            mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect();
        assert_eq!(weld(&mesh).triangles, corners);
    }

    #[test]
    fn edges_of_zero_length_are_collapsed() {
        let mut mesh = bipyramid(9);
        for v in [1, 2, 3] {
            mesh.positions[v] = mesh.positions[0];
        }
        assert_eq!(read(&weld(&mesh)), (12, 0, 0));
    }

    #[test]
    fn vertices_that_cannot_be_merged_are_moved_apart() {
        // The apexes meet in the middle; no edge joins them.
        let mut mesh = bipyramid(6);
        mesh.positions[6] = [0.0; 3];
        mesh.positions[7] = [-0.0, 0.0, 0.0];
        let welded = weld(&mesh);
        assert_eq!((welded.n_coincident, welded.n_degenerate), (0, 0));
        assert_eq!(read(&welded), (12, 0, 0));
        // A triangle with its corners in a row.
        let mut mesh = bipyramid(4);
        mesh.positions[4] =
            std::array::from_fn(|i| 0.5 * (mesh.positions[0][i] + mesh.positions[1][i]));
        assert_eq!(read(&weld(&mesh)), (8, 0, 0));
        // A tetrahedron has no edge that may collapse.
        let corners = vec![[0.0; 3], [0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        assert_eq!(read(&weld(&self::mesh(corners, faces.clone()))), (4, 0, 0));
        // A component that is one point is dropped.
        assert_eq!(read(&weld(&self::mesh(vec![[5.0; 3]; 4], faces))), (0, 0, 0));
    }

    #[test]
    fn an_open_mesh_keeps_its_border() {
        let mut mesh = bipyramid(8);
        mesh.triangles.retain(|t| t.contains(&8));
        mesh.caps.truncate(8);
        mesh.positions[1] = mesh.positions[0];
        // Seven triangles around the apex, each with one side at the border.
        assert_eq!(read(&weld(&mesh)), (7, 7, 0));
    }

    #[test]
    fn paths_of_arcs_are_distinguished_from_cycles() {
        assert_eq!(is_chain(vec![(1, 2), (3, 1), (2, 3)]), Some(true));
        assert_eq!(is_chain(vec![(2, 3), (1, 2)]), Some(false));
        assert_eq!(is_chain(vec![(1, 2), (2, 1)]), None);
        assert_eq!(is_chain(vec![(1, 2), (3, 4)]), None);
        assert_eq!(is_chain(vec![(1, 2), (2, 3), (3, 1), (4, 5), (5, 6), (6, 4)]), None);
        assert_eq!(is_chain(vec![]), None);
    }
}
