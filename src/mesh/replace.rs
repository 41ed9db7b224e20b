//! Replaces faces by others with the same boundary.

use glam::Vec3;

use super::half_edge::{Face, HalfEdge, HalfEdgeMesh, NONE, Vertex};

/// Faces to remove, and those to put in their place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Replacement {
    /// The faces to remove.
    pub(crate) removed: Vec<Face>,
    /// New vertices: position (voxel frame), and whether it is fixed.
    pub(crate) vertices: Vec<(Vec3, bool)>,
    /// New faces, and whether they are caps. A vertex below `first_new` is one of the mesh, `first_new + i` is new vertex `i`.
    pub(crate) faces: Vec<([u32; 3], bool)>,
    pub(crate) first_new: u32,
}

/// The result of a replacement.
#[derive(Clone, Debug, Default)]
pub(crate) struct Replaced {
    /// New vertices, in the order of the replacement.
    pub(crate) vertices: Vec<Vertex>,
    /// New faces, in the order of the replacement.
    pub(crate) faces: Vec<Face>,
    /// The removed vertices, except those whose slots new vertices use.
    pub(crate) gone: Vec<Vertex>,
}

/// The half-edges on the boundary of removed faces by their ends, ascending.
type Outer = Vec<((u32, u32), u32)>;

impl HalfEdgeMesh {
    /// Replaces faces, reusing empty slots.
    ///
    /// # Errors
    ///
    /// A position at which the result is not a closed manifold; the mesh is invalid then.
    pub(crate) fn replace_faces(&mut self, replacement: &Replacement) -> Result<Replaced, Vec3> {
        let mut is_removed = vec![false; self.face_slots()];
        replacement.removed.iter().for_each(|f| is_removed[f.0 as usize] = true);
        let old =
            replacement.faces.iter().flat_map(|(t, _)| *t).filter(|&v| v < replacement.first_new);
        let removed = replacement.removed.iter().flat_map(|&f| self.face_vertices(f)).map(|v| v.0);
        // By vertex slot: the number of faces that are not removed, where that is needed.
        let mut valences = vec![NONE; self.vertex_slots()];
        for v in old.chain(removed.clone()) {
            if self.has_vertex(Vertex(v)) && valences[v as usize] == NONE {
                valences[v as usize] = self.valence(Vertex(v)) as u32;
            }
        }
        removed.for_each(|v| valences[v as usize] -= 1);
        let mut outer: Outer = Vec::new();
        let mut touched: Vec<u32> = Vec::with_capacity(3 * replacement.removed.len());
        let mut inner: Vec<u32> = Vec::new();
        for &f in &replacement.removed {
            for h in self.face_halfedges(f) {
                let (from, to) = (self.from(h), self.to(h));
                touched.push(from.0);
                let other = self.face(h.twin());
                if !is_removed[other.0 as usize] {
                    outer.push(((from.0, to.0), h.0));
                } else if h.0 % 2 == 0 {
                    inner.push(h.0);
                }
            }
        }
        outer.sort_unstable();
        touched.sort_unstable();
        touched.dedup();
        for &h in &inner {
            self.to[h as usize] = NONE;
            self.to[h as usize + 1] = NONE;
        }
        for f in &replacement.removed {
            self.face_halfedge[f.0 as usize] = NONE;
        }
        touched.iter().for_each(|&v| self.vertex_halfedge[v as usize] = NONE);
        for &((from, _), h) in &outer {
            // Any of them will do: the walk around a vertex may start anywhere.
            self.vertex_halfedge[from as usize] = h;
        }
        let vertices = self.add_vertices(replacement, &outer);
        let vertex = |v: u32| {
            let new = v.checked_sub(replacement.first_new);
            new.map_or(v, |n| vertices[n as usize].0)
        };
        let triangles: Vec<[u32; 3]> =
            replacement.faces.iter().map(|(t, _)| t.map(vertex)).collect();
        let halfedges = self.pair(&triangles, &outer)?;
        let mut free_faces: Vec<u32> = self.empty_faces(replacement.faces.len());
        let mut faces = Vec::with_capacity(triangles.len());
        for (i, &(_, cap)) in replacement.faces.iter().enumerate() {
            let f = free_faces.pop().unwrap_or_else(|| {
                self.face_halfedge.push(NONE);
                self.caps.push(cap);
                self.caps.len() as u32 - 1
            });
            self.caps[f as usize] = cap;
            let h = [0, 1, 2].map(|k| HalfEdge(halfedges[3 * i + k]));
            self.link_face(Face(f), h);
            for (k, h) in h.into_iter().enumerate() {
                self.vertex_halfedge[triangles[i][k] as usize] = h.0;
            }
            faces.push(Face(f));
        }
        let lives = |v: u32| self.vertex_halfedge[v as usize] != NONE;
        let lost = touched.iter().filter(|v| !lives(**v)).count();
        let is_more = |v: &&Vertex| touched.binary_search(&v.0).is_err() && lives(v.0);
        let came = vertices.iter().filter(is_more).count();
        touched.extend(vertices.iter().map(|v| v.0));
        touched.extend(triangles.iter().flatten());
        touched.sort_unstable();
        touched.dedup();
        self.n_vertices = self.n_vertices - lost + came;
        self.n_faces = self.n_faces - replacement.removed.len() + faces.len();
        self.check_around(&touched, &triangles, &valences)?;
        let gone = touched.into_iter().filter(|&v| self.vertex_halfedge[v as usize] == NONE);
        Ok(Replaced { vertices, faces, gone: gone.map(Vertex).collect() })
    }

    /// New vertices, in empty slots first.
    fn add_vertices(&mut self, replacement: &Replacement, outer: &Outer) -> Vec<Vertex> {
        let mut used = vec![false; self.vertex_slots()];
        for &((from, to), _) in outer {
            used[from as usize] = true;
            used[to as usize] = true;
        }
        for (t, _) in &replacement.faces {
            for &v in t.iter().filter(|&&v| v < replacement.first_new) {
                used[v as usize] = true;
            }
        }
        let is_empty = |v: &u32| self.vertex_halfedge[*v as usize] == NONE && !used[*v as usize];
        let slots = 0..self.vertex_slots() as u32;
        let mut free = lowest_last(slots.filter(is_empty), replacement.vertices.len());
        let add = |&(position, fixed): &(Vec3, bool)| {
            let v = free.pop().unwrap_or_else(|| {
                self.positions.push(position);
                self.fixed.push(fixed);
                self.pinned.push(false);
                self.vertex_halfedge.push(NONE);
                self.positions.len() as u32 - 1
            });
            self.positions[v as usize] = position;
            self.set_fixed(Vertex(v), fixed);
            Vertex(v)
        };
        replacement.vertices.iter().map(add).collect()
    }

    /// The `n` lowest empty face slots, the lowest one last.
    fn empty_faces(&self, n: usize) -> Vec<u32> {
        let slots = 0..self.face_slots() as u32;
        lowest_last(slots.filter(|&f| self.face_halfedge[f as usize] == NONE), n)
    }

    /// The half-edges of new triangles: those of the boundary, and new ones in pairs.
    fn pair(&mut self, triangles: &[[u32; 3]], outer: &Outer) -> Result<Vec<u32>, Vec3> {
        let mut halfedges = vec![NONE; 3 * triangles.len()];
        let mut is_used = vec![false; outer.len()];
        let mut sides: Vec<(u32, u32, bool, u32)> = Vec::with_capacity(halfedges.len());
        for (i, t) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                let corner = (3 * i + k) as u32;
                match outer.binary_search_by_key(&(a, b), |o| o.0) {
                    Ok(place) if !is_used[place] => {
                        is_used[place] = true;
                        halfedges[corner as usize] = outer[place].1;
                    }
                    _ => sides.push((a.min(b), a.max(b), a > b, corner)),
                }
            }
        }
        let position = |mesh: &HalfEdgeMesh, v: u32| mesh.positions[v as usize];
        if let Some(open) = is_used.iter().position(|used| !used) {
            return Err(position(self, outer[open].0.0));
        }
        sides.sort_unstable();
        let slots = (0..self.to.len() as u32).step_by(2);
        let empty = slots.filter(|&h| self.to[h as usize] == NONE);
        let mut free = lowest_last(empty, sides.len() / 2);
        for pair in sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            let &[(a, b, false, up), (_, _, true, down)] = pair else {
                return Err(position(self, pair[0].0));
            };
            let h = match free.pop() {
                Some(h) => h,
                None => {
                    self.next.extend([NONE; 2]);
                    self.face.extend([NONE; 2]);
                    self.to.extend([NONE; 2]);
                    self.to.len() as u32 - 2
                }
            };
            self.to[h as usize] = b;
            self.to[h as usize + 1] = a;
            halfedges[up as usize] = h;
            halfedges[down as usize] = h + 1;
        }
        Ok(halfedges)
    }

    /// Checks that the faces around each of some vertices form one cycle, in which no neighbour is repeated. `valences` are the
    /// numbers of faces that were not removed, by vertex slot.
    fn check_around(
        &self,
        vertices: &[u32],
        triangles: &[[u32; 3]],
        valences: &[u32],
    ) -> Result<(), Vec3> {
        let mut corners: Vec<u32> = triangles.iter().flatten().copied().collect();
        corners.sort_unstable();
        let mut ring: Vec<Vertex> = Vec::new();
        for &v in vertices {
            if self.vertex_halfedge[v as usize] == NONE {
                continue;
            }
            let new = corners.partition_point(|&c| c <= v) - corners.partition_point(|&c| c < v);
            let left = valences.get(v as usize).filter(|n| **n != NONE);
            let all = new + left.map_or(0, |&n| n as usize);
            ring.clear();
            ring.extend(self.one_ring(Vertex(v)));
            let valence = ring.len();
            ring.sort_unstable();
            ring.dedup();
            if ring.len() != all || valence != all || all < 3 {
                return Err(self.positions[v as usize]);
            }
        }
        Ok(())
    }
}

/// The first `n` slots, to be popped from the end: the lowest one last.
fn lowest_last(slots: impl Iterator<Item = u32>, n: usize) -> Vec<u32> {
    let mut first: Vec<u32> = slots.take(n).collect();
    first.reverse();
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn a_fan_is_replaced_by_two_triangles_and_back_in_the_same_slots() {
        let mut mesh = shapes::octahedron(Vec3::ZERO, 1.0);
        let top = Vertex(0);
        let fan: Vec<Face> = mesh.spokes(top).map(|h| mesh.face(h)).collect();
        let ring: Vec<u32> = mesh.spokes(top).map(|h| mesh.to(h).0).collect();
        let first_new = mesh.vertex_slots() as u32;
        let flat = vec![([ring[0], ring[1], ring[2]], false), ([ring[0], ring[2], ring[3]], false)];
        let down = Replacement { removed: fan, faces: flat, first_new, ..Replacement::default() };
        let made = mesh.replace_faces(&down).expect("the same boundary");
        mesh.check().expect("the invariants hold");
        assert_eq!((mesh.n_vertices(), mesh.n_faces(), mesh.euler()), (5, 6, 2));
        assert_eq!(made.gone, [top]);
        let fan = (0..4).map(|i| ([ring[i], ring[(i + 1) % 4], first_new], false)).collect();
        let vertices = vec![(Vec3::Z, false)];
        let up = Replacement { removed: made.faces, vertices, faces: fan, first_new };
        let made = mesh.replace_faces(&up).expect("the same boundary");
        mesh.check().expect("the invariants hold");
        assert_eq!((mesh.n_vertices(), mesh.n_faces(), mesh.euler()), (6, 8, 2));
        assert_eq!(made.vertices, [top], "an empty slot is taken again");
        assert_eq!(mesh.position(top), Vec3::Z);
        assert!(made.faces.iter().all(|&f| !mesh.is_cap(f)));
    }

    #[test]
    fn a_replacement_that_does_not_fit_is_an_error_with_its_position() {
        let mesh = shapes::octahedron(Vec3::ZERO, 1.0);
        let f = mesh.faces().next().expect("a face");
        let first_new = mesh.vertex_slots() as u32;
        let hole = Replacement { removed: vec![f], first_new, ..Replacement::default() };
        let place = mesh.clone().replace_faces(&hole).expect_err("the mesh is open");
        assert!(mesh.corners(f).contains(&place));
        let [a, b, c] = mesh.face_vertices(f).map(|v| v.0);
        let turned = Replacement { faces: vec![([a, c, b], false)], ..hole };
        mesh.clone().replace_faces(&turned).expect_err("the face is turned over");
    }
}
