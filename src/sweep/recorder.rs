//! Writes down what happens to a tracked mesh: knots, lifetimes, collapses.
//!
//! A patch is tracked from its start isovalue in both directions. The start mesh is shared: a
//! triangle that lives on both sides of the start is one triangle.

use crate::mesh::{Face, Mesh, Vertex};
use crate::spectrum::{Collapse, Knot, Patch, Triangle, normal};

/// Which way the isovalue goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    /// To higher isovalues.
    Up,
    /// To lower isovalues.
    Down,
}

impl Direction {
    /// +1 or -1.
    pub(crate) fn sign(self) -> f64 {
        if self == Direction::Up { 1.0 } else { -1.0 }
    }
}

/// A triangle that is part of the mesh now.
#[derive(Clone, Copy, Debug)]
struct Alive {
    vertices: [u32; 3],
    cap: bool,
    since: f64,
    /// Its index in the start mesh's list, if it has lived since the start.
    start: Option<usize>,
}

/// A triangle with both ends of its lifetime.
#[derive(Clone, Copy, Debug)]
struct Ended {
    vertices: [u32; 3],
    cap: bool,
    low: f64,
    high: f64,
}

/// A knot before its isovalue has a rank: isovalue, position, unit normal.
type Unranked = (f64, [f32; 3], [f32; 3]);

/// Records one patch.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    /// Knots of each trajectory in the order they were recorded.
    trajectories: Vec<Vec<Unranked>>,
    start: Vec<Ended>,
    ended: Vec<Ended>,
    collapses: Vec<(u32, u32, f64, bool)>,
    /// Trajectory of each vertex slot of the mesh being tracked.
    trajectory: Vec<u32>,
    start_trajectory: Vec<u32>,
    alive: Vec<Option<Alive>>,
    start_alive: Vec<Option<Alive>>,
}

impl Recorder {
    /// Begins with the start mesh at its isovalue.
    pub(crate) fn begin(
        mesh: &Mesh,
        normals: &[[f32; 3]],
        vertices: &[Vertex],
        isovalue: f64,
    ) -> Self {
        let mut r =
            Recorder { trajectory: vec![u32::MAX; mesh.vertex_slots()], ..Recorder::default() };
        for (i, &v) in vertices.iter().enumerate() {
            r.trajectory[v.0 as usize] = i as u32;
            r.trajectories.push(vec![(isovalue, mesh.position(v).to_array(), normals[i])]);
        }
        for slot in 0..mesh.face_slots() {
            let f = Face(slot as u32);
            let alive = mesh.has_face(f).then(|| {
                let vertices = r.triangle(mesh, f);
                let start = Some(r.start.len());
                r.start.push(Ended {
                    vertices,
                    cap: mesh.is_cap(f),
                    low: isovalue,
                    high: isovalue,
                });
                Alive { vertices, cap: mesh.is_cap(f), since: isovalue, start }
            });
            r.alive.push(alive);
        }
        r.start_trajectory = r.trajectory.clone();
        r.start_alive = r.alive.clone();
        r
    }

    /// Goes back to the start mesh, to track it the other way.
    pub(crate) fn restart(&mut self) {
        self.trajectory = self.start_trajectory.clone();
        self.alive = self.start_alive.clone();
    }

    fn triangle(&self, mesh: &Mesh, f: Face) -> [u32; 3] {
        mesh.face_vertices(f).map(|v| self.trajectory[v.0 as usize])
    }

    /// Records where the vertices are at an isovalue.
    pub(crate) fn knots(
        &mut self,
        vertices: &[Vertex],
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        isovalue: f64,
    ) {
        for ((v, &p), &n) in vertices.iter().zip(positions).zip(normals) {
            self.trajectories[self.trajectory[v.0 as usize] as usize].push((isovalue, p, n));
        }
    }

    /// Records what edits changed at an isovalue: compares the mesh with the triangles alive.
    ///
    /// `collapsed` are the vertices that ended and those in their place.
    pub(crate) fn edits(
        &mut self,
        mesh: &Mesh,
        collapsed: &[(Vertex, Vertex)],
        isovalue: f64,
        direction: Direction,
    ) {
        for slot in self.trajectory.len()..mesh.vertex_slots() {
            let v = Vertex(slot as u32);
            let live = mesh.has_vertex(v);
            self.trajectory.push(if live { self.trajectories.len() as u32 } else { u32::MAX });
            if live {
                let n = mesh.vertex_normal(v).to_array();
                self.trajectories.push(vec![(isovalue, mesh.position(v).to_array(), n)]);
            }
        }
        for &(from, to) in collapsed {
            let (a, b) = (self.trajectory[from.0 as usize], self.trajectory[to.0 as usize]);
            if a != u32::MAX && b != u32::MAX {
                self.collapses.push((a, b, isovalue, direction == Direction::Up));
            }
        }
        self.alive.resize(mesh.face_slots(), None);
        for slot in 0..mesh.face_slots() {
            let f = Face(slot as u32);
            let now = mesh.has_face(f).then(|| self.triangle(mesh, f));
            if self.alive[slot].map(|a| a.vertices) == now {
                continue;
            }
            if let Some(alive) = self.alive[slot].take() {
                self.end(alive, isovalue);
            }
            self.alive[slot] = now.map(|vertices| Alive {
                vertices,
                cap: mesh.is_cap(f),
                since: isovalue,
                start: None,
            });
        }
    }

    fn end(&mut self, alive: Alive, isovalue: f64) {
        let (low, high) = (alive.since.min(isovalue), alive.since.max(isovalue));
        if let Some(i) = alive.start {
            let s = &mut self.start[i];
            (s.low, s.high) = (s.low.min(low), s.high.max(high));
        } else {
            self.ended.push(Ended { vertices: alive.vertices, cap: alive.cap, low, high });
        }
    }

    /// Ends every triangle alive: tracking in this direction is over.
    pub(crate) fn finish_direction(&mut self, isovalue: f64) {
        for slot in 0..self.alive.len() {
            if let Some(alive) = self.alive[slot].take() {
                self.end(alive, isovalue);
            }
        }
    }

    /// The patch: what was recorded, sorted and without what never shows.
    pub(crate) fn patch(self) -> Patch {
        let mut triangles: Vec<Ended> = self.start;
        triangles.extend(self.ended);
        triangles.retain(|t| t.low < t.high);
        let mut isovalues: Vec<f64> = self.trajectories.iter().flatten().map(|k| k.0).collect();
        isovalues.sort_by(f64::total_cmp);
        isovalues.dedup();
        let rank = |c: f64| isovalues.partition_point(|&x| x < c) as u32;
        let mut used = vec![false; self.trajectories.len()];
        for t in &triangles {
            for v in t.vertices {
                used[v as usize] = true;
            }
        }
        let mut index = vec![u32::MAX; self.trajectories.len()];
        let mut patch = Patch { first_knot: vec![0], ..Patch::default() };
        for (i, mut knots) in self.trajectories.into_iter().enumerate() {
            if !used[i] {
                continue;
            }
            index[i] = patch.first_knot.len() as u32 - 1;
            knots.sort_by(|a, b| a.0.total_cmp(&b.0));
            knots.dedup_by(|a, b| a.0 == b.0);
            patch.knots.extend(knots.into_iter().map(|(c, position, n)| Knot {
                rank: rank(c),
                position,
                normal: normal::encode(n),
            }));
            patch.first_knot.push(patch.knots.len() as u32);
        }
        patch.triangles = triangles
            .iter()
            .map(|t| Triangle {
                vertices: t.vertices.map(|v| index[v as usize]),
                birth: rank(t.low),
                death: rank(t.high),
                cap: t.cap,
            })
            .collect();
        patch.collapses = self
            .collapses
            .iter()
            .filter(|c| used[c.0 as usize] && used[c.1 as usize])
            .map(|&(a, b, c, upward)| Collapse {
                vertex: index[a as usize],
                target: index[b as usize],
                rank: rank(c),
                upward,
            })
            .collect();
        patch.isovalues = isovalues;
        patch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Edge;
    use glam::Vec3;

    fn octahedron() -> Mesh {
        let positions = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let triangles = [
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        let positions = positions.map(|p| p.to_array());
        Mesh::from_triangles(&positions, &[0; 6], &triangles, &[false; 8]).expect("closed")
    }

    /// Records that the mesh, as it is, lies there at an isovalue.
    fn knots(recorder: &mut Recorder, mesh: &Mesh, isovalue: f64) {
        let compacted = mesh.compacted();
        let normals = vec![[0.0, 0.0, 1.0]; compacted.vertices.len()];
        recorder.knots(&compacted.vertices, &compacted.positions, &normals, isovalue);
    }

    fn begun(mesh: &Mesh, isovalue: f64) -> Recorder {
        let vertices: Vec<Vertex> = mesh.vertices().collect();
        let mut recorder =
            Recorder::begin(mesh, &vec![[0.0, 0.0, 1.0]; vertices.len()], &vertices, isovalue);
        recorder.restart();
        recorder
    }

    /// How many triangles live from one isovalue to another.
    fn n_living(patch: &Patch, from: f64, to: f64) -> usize {
        let at = |rank: u32| patch.isovalues[rank as usize];
        patch.triangles.iter().filter(|t| (at(t.birth), at(t.death)) == (from, to)).count()
    }

    fn knot_isovalues(patch: &Patch, v: usize) -> Vec<f64> {
        let knots = patch.first_knot[v] as usize..patch.first_knot[v + 1] as usize;
        patch.knots[knots].iter().map(|k| patch.isovalues[k.rank as usize]).collect()
    }

    #[test]
    fn a_triangle_of_the_start_lives_on_both_sides_of_it() {
        let mesh = octahedron();
        let mut recorder = begun(&mesh, 1.0);
        knots(&mut recorder, &mesh, 3.0);
        recorder.finish_direction(3.0);
        recorder.restart();
        knots(&mut recorder, &mesh, 0.0);
        recorder.finish_direction(0.0);
        let patch = recorder.patch();
        assert_eq!((patch.triangles.len(), n_living(&patch, 0.0, 3.0)), (8, 8));
        for v in 0..6 {
            assert_eq!(knot_isovalues(&patch, v), [0.0, 1.0, 3.0]);
        }
    }

    #[test]
    fn a_flip_ends_two_triangles_and_begins_two() {
        let start = octahedron();
        let mut recorder = begun(&start, 1.0);
        let mut mesh = start.clone();
        knots(&mut recorder, &mesh, 2.0);
        mesh.flip(Edge(0));
        recorder.edits(&mesh, &[], 2.0, Direction::Up);
        knots(&mut recorder, &mesh, 3.0);
        recorder.finish_direction(3.0);
        recorder.restart();
        knots(&mut recorder, &start, 0.0);
        recorder.finish_direction(0.0);
        let patch = recorder.patch();
        assert_eq!(patch.triangles.len(), 10);
        assert_eq!(n_living(&patch, 0.0, 3.0), 6);
        assert_eq!(n_living(&patch, 0.0, 2.0), 2);
        assert_eq!(n_living(&patch, 2.0, 3.0), 2);
    }

    #[test]
    fn a_vertex_between_a_split_and_a_collapse_has_a_trajectory_of_its_own() {
        for (direction, [split, middle, collapse, end]) in
            [(Direction::Up, [2.0, 2.5, 3.0, 4.0]), (Direction::Down, [-2.0, -2.5, -3.0, -4.0])]
        {
            let mut mesh = octahedron();
            let mut recorder = begun(&mesh, 0.0);
            knots(&mut recorder, &mesh, split);
            let added = mesh.split_edge(Edge(0), Vec3::ZERO).vertex;
            recorder.edits(&mesh, &[], split, direction);
            knots(&mut recorder, &mesh, middle);
            recorder.edits(&mesh, &[], middle, direction);
            knots(&mut recorder, &mesh, collapse);
            let spoke = mesh.outgoing(added);
            let target = mesh.to(spoke);
            assert!(mesh.can_collapse(spoke));
            mesh.collapse(spoke);
            recorder.edits(&mesh, &[(added, target)], collapse, direction);
            knots(&mut recorder, &mesh, end);
            recorder.finish_direction(end);
            let patch = recorder.patch();
            let living = |a: f64, b: f64| n_living(&patch, f64::min(a, b), f64::max(a, b));
            // The split cuts two faces in two, the collapse puts the two back together.
            assert_eq!(living(0.0, end), 6, "{direction:?}");
            assert_eq!(living(0.0, split), 2, "{direction:?}");
            assert_eq!(living(split, collapse), 4, "{direction:?}");
            assert_eq!(living(collapse, end), 2, "{direction:?}");
            assert_eq!(patch.triangles.len(), 14, "{direction:?}");
            let mut expected = [split, middle, collapse];
            expected.sort_by(f64::total_cmp);
            assert_eq!(knot_isovalues(&patch, 6), expected);
            let [recorded] = patch.collapses[..] else { panic!("one collapse: {patch:?}") };
            assert_eq!((recorded.vertex, recorded.target), (6, target.0));
            assert_eq!(patch.isovalues[recorded.rank as usize], collapse);
            assert_eq!(recorded.upward, direction == Direction::Up);
        }
    }

    #[test]
    fn what_never_shows_is_left_out() {
        let mut mesh = octahedron();
        let mut recorder = begun(&mesh, 0.0);
        let added = mesh.split_edge(Edge(0), Vec3::ZERO).vertex;
        recorder.edits(&mesh, &[], 0.0, Direction::Up);
        let spoke = mesh.outgoing(added);
        let target = mesh.to(spoke);
        mesh.collapse(spoke);
        recorder.edits(&mesh, &[(added, target)], 0.0, Direction::Up);
        knots(&mut recorder, &mesh, 1.0);
        recorder.finish_direction(1.0);
        let patch = recorder.patch();
        assert_eq!((patch.triangles.len(), n_living(&patch, 0.0, 1.0)), (8, 8));
        assert_eq!((patch.first_knot.len(), patch.collapses.len()), (7, 0));
    }
}
