//! Writes down what happens to a tracked mesh: knots, lifetimes, collapses.
//!
//! A mesh is tracked from its start isovalue in both directions. The start is shared: a triangle
//! that lives on both sides of it is one triangle. Through surgery, the mesh after it goes on with
//! the trajectories and triangles that stay. Trajectories are numbered by the run that began them, so
//! the patch does not depend on which run was done first.

mod joints;
mod patch;
#[cfg(test)]
mod tests;

use glam::Vec3;

use super::glide::{GLIDE_SHARE, Glides};
use crate::mesh::{Face, Mesh, Vertex};
use crate::spectrum::normal;

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

/// A trajectory: the run that began it and its number within the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Trajectory {
    /// The run: see [`Run`].
    pub(crate) run: u32,
    number: u32,
}

/// No trajectory: the vertex slot is empty.
const NONE: Trajectory = Trajectory { run: u32::MAX, number: u32::MAX };

/// Who begins trajectories: numbers them apart, whatever the order in which runs are done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Run {
    /// The mesh that an arc starts from.
    Start,
    /// Tracking an arc's mesh upwards from its start.
    Up,
    /// Tracking it downwards.
    Down,
    /// Surgery on the way into an arc, and tracking from there on.
    Surgery,
}

impl Run {
    /// The run's number.
    pub(crate) fn of_arc(self, arc: usize) -> u32 {
        4 * arc as u32 + self as u32
    }
}

/// A triangle that is part of the mesh now.
#[derive(Clone, Copy, Debug)]
struct Alive {
    vertices: [Trajectory; 3],
    cap: bool,
    since: f64,
    /// Whether it has lived since the mesh that its arc started from: then it may live on the other
    /// side as well.
    start: bool,
}

/// A triangle with both ends of its lifetime.
#[derive(Clone, Copy, Debug)]
struct Ended {
    vertices: [Trajectory; 3],
    cap: bool,
    low: f64,
    high: f64,
    start: bool,
}

/// A knot before its isovalue has a rank.
#[derive(Clone, Copy, Debug)]
struct Unranked {
    trajectory: Trajectory,
    isovalue: f64,
    position: [f32; 3],
    normal: [i16; 2],
    /// Whether it stays though interpolation does not need it: a mesh starts there.
    stays: bool,
}

impl Unranked {
    /// The knot a share of the way to another.
    fn towards(&self, other: &Unranked, share: f64) -> Unranked {
        let [p, q] = [self, other].map(|k| Vec3::from(k.position));
        let [m, n] = [self, other].map(|k| Vec3::from(normal::decode(k.normal)));
        Unranked {
            isovalue: self.isovalue + share * (other.isovalue - self.isovalue),
            position: p.lerp(q, share as f32).to_array(),
            normal: normal::encode(m.lerp(n, share as f32).normalize_or(m).to_array()),
            ..*self
        }
    }
}

/// Where a trajectory begins or ends on the way of others.
#[derive(Clone, Debug, PartialEq)]
struct Joint {
    trajectory: Trajectory,
    isovalue: f64,
    /// The others, and their weights in the mean that it lies in.
    of: Vec<(Trajectory, f32)>,
}

/// What recorders have written down.
#[derive(Debug, Default)]
pub(crate) struct Log {
    knots: Vec<Unranked>,
    joints: Vec<Joint>,
    ended: Vec<Ended>,
    collapses: Vec<(Trajectory, Trajectory, f64, bool)>,
}

/// Records what happens to one mesh.
#[derive(Debug, Default)]
pub(crate) struct Recorder {
    log: Log,
    run: u32,
    n_begun: u32,
    /// Trajectory of each vertex slot of the mesh.
    trajectory: Vec<Trajectory>,
    alive: Vec<Option<Alive>>,
    /// Per vertex slot: its last knot and the one before, as places in the log.
    latest: Vec<[usize; 2]>,
    /// New vertices that begin elsewhere than where the mesh has them, and where it has them.
    rising: Vec<(Vertex, Vec3)>,
}

impl Recorder {
    /// Begins with a start mesh at its isovalue.
    pub(crate) fn begin(
        mesh: &Mesh,
        normals: &[[f32; 3]],
        vertices: &[Vertex],
        isovalue: f64,
        arc: usize,
    ) -> Self {
        let run = Run::Start.of_arc(arc);
        let mut r =
            Recorder { run, trajectory: vec![NONE; mesh.vertex_slots()], ..Recorder::default() };
        for &v in vertices {
            r.trajectory[v.0 as usize] = r.new_trajectory();
        }
        let positions: Vec<[f32; 3]> =
            vertices.iter().map(|&v| mesh.position(v).to_array()).collect();
        r.knots(vertices, &positions, normals, isovalue);
        r.log.knots.iter_mut().for_each(|k| k.stays = true);
        r.edits(mesh, &[], isovalue, Direction::Up);
        r.alive.iter_mut().flatten().for_each(|a| a.start = true);
        r
    }

    /// A recorder that goes on from the same mesh with trajectories of another run.
    pub(crate) fn branch(&self, run: u32) -> Self {
        Recorder {
            log: Log::default(),
            run,
            n_begun: 0,
            trajectory: self.trajectory.clone(),
            alive: self.alive.clone(),
            ..Recorder::default()
        }
    }

    /// A recorder for a mesh put together from `kept` vertices and faces of others, which come
    /// first in it: each given as the recorder's number in `others` and the slot there. New
    /// trajectories belong to the run of one of the others, if it is named, else to `run`.
    pub(crate) fn resume(
        others: &[Recorder],
        kept_vertices: &[(usize, Vertex)],
        kept_faces: &[(usize, Face)],
        continued: Option<usize>,
        run: u32,
    ) -> Self {
        let (run, n_begun) = continued.map_or((run, 0), |r| (others[r].run, others[r].n_begun));
        Recorder {
            log: Log::default(),
            run,
            n_begun,
            trajectory: kept_vertices
                .iter()
                .map(|&(r, v)| others[r].trajectory[v.0 as usize])
                .collect(),
            alive: kept_faces.iter().map(|&(r, f)| others[r].alive[f.0 as usize]).collect(),
            ..Recorder::default()
        }
    }

    /// A recorder for a mesh that has nothing in common with the one before it, of the same run.
    pub(crate) fn begin_again(&self) -> Self {
        Recorder { run: self.run, n_begun: self.n_begun, ..Recorder::default() }
    }

    fn new_trajectory(&mut self) -> Trajectory {
        self.n_begun += 1;
        Trajectory { run: self.run, number: self.n_begun - 1 }
    }

    fn triangle(&self, mesh: &Mesh, f: Face) -> [Trajectory; 3] {
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
        for ((v, &position), &n) in vertices.iter().zip(positions).zip(normals) {
            let trajectory = self.trajectory[v.0 as usize];
            let normal = normal::encode(n);
            let slot = v.0 as usize;
            if self.latest.len() <= slot {
                self.latest.resize(slot + 1, [usize::MAX; 2]);
            }
            self.latest[slot] = [self.log.knots.len(), self.latest[slot][0]];
            self.log.knots.push(Unranked { trajectory, isovalue, position, normal, stays: false });
        }
        self.rise(isovalue);
    }

    /// The last knot of a vertex and the one before, if both are of its trajectory and this log.
    fn last_two(&self, v: Vertex) -> Option<[usize; 2]> {
        let trajectory = self.trajectory[v.0 as usize];
        let two = *self.latest.get(v.0 as usize)?;
        let is_own = |&k: &usize| self.log.knots.get(k).is_some_and(|k| k.trajectory == trajectory);
        two.iter().all(is_own).then_some(two)
    }

    /// Lets vertices glide that edits at an isovalue have made or removed: those removed end where
    /// others are, those made begin on the surface as it was.
    pub(crate) fn glide(&mut self, mesh: &Mesh, glides: &Glides, isovalue: f64) {
        for (&v, end) in &glides.ends {
            let Some([last, before]) = self.last_two(v) else { continue };
            let (from, to) = (self.log.knots[before], self.log.knots[last]);
            if to.isovalue == isovalue && from.isovalue != isovalue {
                self.log.knots.push(from.towards(&to, 1.0 - GLIDE_SHARE));
                self.log.knots[last].position = end.place.to_array();
                self.join(v, &end.of, isovalue);
            }
        }
        let begins = |v| glides.born.get(&v).map_or(mesh.position(v), |b| b.place);
        self.begin_at(mesh, begins, isovalue);
        let living = |v: &Vertex| mesh.has_vertex(*v);
        let born = glides.born.keys().copied().filter(living);
        self.rising = born.map(|v| (v, mesh.position(v))).collect();
        glides
            .born
            .iter()
            .filter(|b| living(b.0))
            .for_each(|(&v, b)| self.join(v, &b.of, isovalue));
    }

    /// Records that a vertex begins or ends where the mean of others is.
    fn join(&mut self, v: Vertex, of: &[(Vertex, f32)], isovalue: f64) {
        if !of.is_empty() {
            let of = of.iter().map(|&(v, w)| (self.trajectory[v.0 as usize], w)).collect();
            let trajectory = self.trajectory[v.0 as usize];
            self.log.joints.push(Joint { trajectory, isovalue, of });
        }
    }

    /// Brings new vertices onto the isosurface over the first part of the way to an isovalue; those that
    /// have no knot there yet stay to be brought.
    fn rise(&mut self, isovalue: f64) {
        for (v, position) in std::mem::take(&mut self.rising) {
            let Some([last, first]) = self.last_two(v) else {
                self.rising.push((v, position));
                continue;
            };
            let (from, to) = (self.log.knots[first], self.log.knots[last]);
            if to.isovalue == isovalue && from.isovalue != isovalue {
                let from = Unranked { position: position.to_array(), ..from };
                self.latest[v.0 as usize][1] = self.log.knots.len();
                self.log.knots.push(from.towards(&to, GLIDE_SHARE));
            }
        }
    }

    /// Records that vertices are, at an isovalue, where the mesh has them.
    pub(crate) fn knots_of(&mut self, mesh: &Mesh, vertices: &[Vertex], isovalue: f64) {
        let at = |f: fn(&Mesh, Vertex) -> Vec3| -> Vec<[f32; 3]> {
            vertices.iter().map(|&v| f(mesh, v).to_array()).collect()
        };
        self.knots(vertices, &at(Mesh::position), &at(Mesh::vertex_normal), isovalue);
    }

    /// Records where a vertex is at an isovalue, if not where the mesh has it.
    pub(crate) fn knot_at(&mut self, mesh: &Mesh, v: Vertex, place: Vec3, isovalue: f64) {
        let normal = mesh.vertex_normal(v).to_array();
        self.knots(&[v], &[place.to_array()], &[normal], isovalue);
    }

    /// Ends the trajectories of vertices that jump: others begin in their place.
    pub(crate) fn renew(&mut self, vertices: &[Vertex]) {
        for v in vertices {
            self.trajectory[v.0 as usize] = NONE;
        }
    }

    /// Begins the trajectories of new vertices, each at its `place`, which may be another than the mesh
    /// has.
    pub(crate) fn begin_at(&mut self, mesh: &Mesh, place: impl Fn(Vertex) -> Vec3, isovalue: f64) {
        self.trajectory.resize(mesh.vertex_slots(), NONE);
        for v in mesh.vertices() {
            let slot = v.0 as usize;
            if self.trajectory[slot] == NONE {
                self.trajectory[slot] = self.new_trajectory();
                self.knot_at(mesh, v, place(v), isovalue);
            }
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
        self.begin_at(mesh, |v| mesh.position(v), isovalue);
        for &(from, to) in collapsed {
            let (a, b) = (self.trajectory[from.0 as usize], self.trajectory[to.0 as usize]);
            if a != NONE && b != NONE {
                self.log.collapses.push((a, b, isovalue, direction == Direction::Up));
            }
        }
        self.alive.resize(mesh.face_slots(), None);
        for slot in 0..mesh.face_slots() {
            let f = Face(slot as u32);
            let now = mesh.has_face(f).then(|| self.triangle(mesh, f));
            let was = self.alive[slot];
            if was.map(|a| a.vertices) == now && was.is_none_or(|a| a.cap == mesh.is_cap(f)) {
                continue;
            }
            self.end_face(f, isovalue);
            self.alive[slot] = now.map(|vertices| Alive {
                vertices,
                cap: mesh.is_cap(f),
                since: isovalue,
                start: false,
            });
        }
    }

    /// Ends a triangle, if it is alive.
    pub(crate) fn end_face(&mut self, f: Face, isovalue: f64) {
        if let Some(alive) = self.alive[f.0 as usize].take() {
            let (low, high) = (alive.since.min(isovalue), alive.since.max(isovalue));
            let Alive { vertices, cap, start, .. } = alive;
            self.log.ended.push(Ended { vertices, cap, low, high, start });
        }
    }

    /// Ends every triangle alive: tracking in this direction is over.
    pub(crate) fn finish(mut self, isovalue: f64) -> Log {
        for slot in 0..self.alive.len() {
            self.end_face(Face(slot as u32), isovalue);
        }
        self.log
    }

    /// Adds what was written down before.
    pub(crate) fn prepend(&mut self, before: Log) {
        self.log.append(before);
    }

    /// What was written down, without ending anything: others go on with the triangles alive.
    pub(crate) fn into_log(self) -> Log {
        self.log
    }
}

impl Log {
    /// Appends what another recorder has written down.
    pub(crate) fn append(&mut self, mut other: Log) {
        self.knots.append(&mut other.knots);
        self.joints.append(&mut other.joints);
        self.ended.append(&mut other.ended);
        self.collapses.append(&mut other.collapses);
    }
}
