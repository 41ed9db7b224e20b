//! Records the tracked mesh: knots of its vertices and lifetimes of its triangles.
//!
//! # Invariants
//!
//! 1. A vertex bound to a lattice edge has that edge's trajectory, which exact triangles use too: triangles on
//!    both sides of the seam share it. Every other vertex has its own trajectory.
//! 2. A triangle lives as long as its three trajectories stay the same.

use glam::Vec3;

use super::cause::{Cause, Ended};
use super::join::Joined;
use super::life::Life;
use super::track::Track;
use super::tracked::Tracked;
use crate::mesh::{Face, Vertex};

/// A knot, with the normal that thinning needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnKnot {
    pub(super) isovalue: f64,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
}

/// The trajectories of a face, and the isovalue since which they are those.
type Alive = ([Track; 3], f64);

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct Recorder {
    /// Knots by own trajectory, in the order in which they were recorded.
    pub(super) knots: Vec<Vec<OwnKnot>>,
    pub(super) lives: Vec<Life>,
    /// Lifetimes that ended before the end of the march, by cause.
    pub(super) ended: Ended,
    /// By vertex slot.
    tracks: Vec<Option<Track>>,
    /// By face slot.
    alive: Vec<Option<Alive>>,
}

/// A state of the recorder to roll back to.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    tracks: Vec<Option<Track>>,
    alive: Vec<Option<Alive>>,
    n_lives: usize,
    n_knots: usize,
    ended: Ended,
}

impl Recorder {
    /// The present state, to roll back to.
    pub(super) fn mark(&self) -> Mark {
        Mark {
            tracks: self.tracks.clone(),
            alive: self.alive.clone(),
            n_lives: self.lives.len(),
            n_knots: self.knots.len(),
            ended: self.ended,
        }
    }

    /// Discards everything recorded since. Trajectories that existed then must not have new knots.
    pub(super) fn roll_back(&mut self, mark: Mark) {
        self.lives.truncate(mark.n_lives);
        self.knots.truncate(mark.n_knots);
        (self.tracks, self.alive, self.ended) = (mark.tracks, mark.alive, mark.ended);
    }

    /// Appends the records of another recorder that was a copy of this one; `n_common` trajectories are common to both.
    pub(super) fn join(&mut self, mut other: Recorder, n_common: usize) {
        let n = self.knots.len() - n_common;
        let mut knots = std::mem::take(&mut other.knots).into_iter();
        for (own, others) in self.knots.iter_mut().zip(knots.by_ref().take(n_common)) {
            own.extend(others);
        }
        self.knots.extend(knots);
        let number = |t: Track| match t {
            Track::Own(i) if i as usize >= n_common => Track::Own(i + n as u32),
            t => t,
        };
        let others = other.lives.into_iter();
        self.lives.extend(others.map(|l| Life { vertices: l.vertices.map(number), ..l }));
    }

    /// The knots of a vertex's own trajectory.
    fn own(&mut self, v: Vertex) -> Option<&mut Vec<OwnKnot>> {
        match self.tracks.get(v.0 as usize) {
            Some(Some(Track::Own(n))) => Some(&mut self.knots[*n as usize]),
            _ => None,
        }
    }

    /// Whether a vertex's own trajectory has only one knot, at an isovalue.
    pub(super) fn begins(&self, v: Vertex, isovalue: f64) -> bool {
        match self.tracks.get(v.0 as usize) {
            Some(Some(Track::Own(n))) => {
                matches!(self.knots[*n as usize][..], [k] if k.isovalue == isovalue)
            }
            _ => false,
        }
    }

    /// Replaces the only knot of a trajectory that begins at the present isovalue.
    pub(super) fn begins_at(&mut self, v: Vertex, position: Vec3, normal: Vec3) {
        if let Some([knot]) = self.own(v).map(|k| &mut k[..]) {
            (knot.position, knot.normal) = (position, normal);
        }
    }

    /// Assigns a vertex its trajectory; a new one begins at the isovalue, at the vertex's position.
    pub(super) fn trace(&mut self, tracked: &Tracked, v: Vertex, isovalue: f64) {
        let slot = v.0 as usize;
        if self.tracks.len() <= slot {
            self.tracks.resize(slot + 1, None);
        }
        match (tracked.key(v), self.tracks[slot]) {
            (Some(e), _) => self.tracks[slot] = Some(Track::Edge(e)),
            (None, Some(Track::Own(_))) => {}
            (None, _) => {
                self.tracks[slot] = Some(Track::Own(self.knots.len() as u32));
                let (position, normal) = (tracked.mesh.position(v), tracked.mesh.vertex_normal(v));
                self.knots.push(vec![OwnKnot { isovalue, position, normal }]);
            }
        }
    }

    /// Records a knot of a vertex with its own trajectory.
    pub(super) fn knot(&mut self, v: Vertex, isovalue: f64, position: Vec3, normal: Vec3) {
        if let Some(knots) = self.own(v)
            && knots.last().is_none_or(|k| k.isovalue != isovalue)
        {
            knots.push(OwnKnot { isovalue, position, normal });
        }
    }

    /// Records that faces have changed at an isovalue, and assigns trajectories to their vertices.
    pub(super) fn changed(
        &mut self,
        tracked: &Tracked,
        faces: impl IntoIterator<Item = Face>,
        isovalue: f64,
        cause: impl Fn(usize) -> Cause,
    ) {
        for f in faces {
            let slot = f.0 as usize;
            if self.alive.len() <= slot {
                self.alive.resize(slot + 1, None);
            }
            let lives = tracked.mesh.has_face(f) && !tracked.mesh.is_cap(f);
            let now = lives.then(|| {
                tracked.mesh.face_vertices(f).map(|v| {
                    self.trace(tracked, v, isovalue);
                    self.tracks[v.0 as usize].expect("traced")
                })
            });
            if self.alive[slot].map(|a| a.0) != now {
                self.end(slot, isovalue, Some(cause(slot)));
                self.alive[slot] = now.map(|vertices| (vertices, isovalue));
            }
        }
    }

    /// Records an exchange at an isovalue.
    pub(super) fn exchanged(&mut self, joined: &Joined, isovalue: f64) {
        let mut before: Vec<(Face, Option<Alive>)> = Vec::with_capacity(joined.removed.len());
        for &f in &joined.removed {
            if let Some(alive) = self.alive.get_mut(f.0 as usize).and_then(Option::take) {
                before.push((f, Some(alive)));
            }
        }
        for v in &joined.vertices {
            if let Some(track) = self.tracks.get_mut(v.0 as usize) {
                *track = None;
            }
        }
        let slots = joined.tracked.mesh.face_slots();
        self.alive.resize(slots.max(self.alive.len()), None);
        for (f, was) in &joined.faces {
            let place = was.and_then(|was| before.binary_search_by_key(&was, |b| b.0).ok());
            self.alive[f.0 as usize] = place.and_then(|i| before[i].1.take());
        }
        for alive in before.into_iter().filter_map(|b| b.1) {
            self.write(alive, isovalue, Some(Cause::Exchange));
        }
        let faces = joined.faces.iter().map(|f| f.0);
        self.changed(&joined.tracked, faces, isovalue, |_| Cause::Exchange);
    }

    /// Removes the trajectories of empty vertex slots, as other vertices may reuse them.
    pub(super) fn forget(&mut self, tracked: &Tracked) {
        for (v, track) in self.tracks.iter_mut().enumerate() {
            if v >= tracked.mesh.vertex_slots() || !tracked.mesh.has_vertex(Vertex(v as u32)) {
                *track = None;
            }
        }
    }

    fn end(&mut self, slot: usize, isovalue: f64, cause: Option<Cause>) {
        if let Some(alive) = self.alive[slot].take() {
            self.write(alive, isovalue, cause);
        }
    }

    /// Writes a lifetime that ends at an isovalue; at the end of the march without a cause.
    fn write(&mut self, (vertices, since): Alive, isovalue: f64, cause: Option<Cause>) {
        let (low, high) = (since.min(isovalue), since.max(isovalue));
        if low < high {
            cause.into_iter().for_each(|cause| self.ended.add(cause));
            self.lives.push(Life { vertices, low, high, cap: false });
        }
    }

    /// Ends all lifetimes and trajectories: nothing is tracked any more.
    pub(super) fn clear(&mut self, isovalue: f64) {
        self.end_all(isovalue, Some(Cause::Exchange));
        self.tracks.clear();
    }

    /// Ends all lifetimes at the end of the march.
    pub(super) fn finish(&mut self, isovalue: f64) {
        self.end_all(isovalue, None);
    }

    fn end_all(&mut self, isovalue: f64, cause: Option<Cause>) {
        for slot in 0..self.alive.len() {
            self.end(slot, isovalue, cause);
        }
    }
}
