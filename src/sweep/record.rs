//! Writes down what happens to the tracked mesh: where its vertices are, and when its triangles live.
//!
//! # Invariants
//!
//! 1. A vertex bound to a lattice edge has that edge's trajectory, which is the exact extraction's own: so triangles on
//!    both sides of the seam share it. Every other vertex has a trajectory of its own.
//! 2. A triangle lives as long as its three trajectories stay the same.

use std::collections::HashMap;

use glam::Vec3;

use super::join::Joined;
use super::life::{Life, Track};
use super::tracked::Tracked;
use crate::mesh::{Face, Vertex};

/// A knot, with what thinning needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnKnot {
    pub(super) isovalue: f64,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct Recorder {
    /// Knots by own trajectory, in the order in which they were written.
    pub(super) knots: Vec<Vec<OwnKnot>>,
    pub(super) lives: Vec<Life>,
    /// By vertex slot.
    tracks: Vec<Option<Track>>,
    /// By face slot: the trajectories, and since when.
    alive: Vec<Option<([Track; 3], f64)>>,
}

/// A place in what is written, and what was alive then.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    tracks: Vec<Option<Track>>,
    alive: Vec<Option<([Track; 3], f64)>>,
    n_lives: usize,
    n_knots: usize,
}

impl Recorder {
    /// Where writing is, to go back there.
    pub(super) fn mark(&self) -> Mark {
        Mark {
            tracks: self.tracks.clone(),
            alive: self.alive.clone(),
            n_lives: self.lives.len(),
            n_knots: self.knots.len(),
        }
    }

    /// Forgets what was written since; but for knots of trajectories that were there, which must be none.
    pub(super) fn roll_back(&mut self, mark: Mark) {
        self.lives.truncate(mark.n_lives);
        self.knots.truncate(mark.n_knots);
        (self.tracks, self.alive) = (mark.tracks, mark.alive);
    }

    /// Adds what another recorder has written that was a copy of this one.
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

    /// Whether a vertex's own trajectory begins at an isovalue, where it has only one knot.
    pub(super) fn begins(&self, v: Vertex, isovalue: f64) -> bool {
        match self.tracks.get(v.0 as usize) {
            Some(Some(Track::Own(n))) => {
                matches!(self.knots[*n as usize][..], [k] if k.isovalue == isovalue)
            }
            _ => false,
        }
    }

    /// Writes down that a vertex whose trajectory begins at the present isovalue begins elsewhere.
    pub(super) fn begins_at(&mut self, v: Vertex, position: Vec3, normal: Vec3) {
        if let Some([knot]) = self.own(v).map(|k| &mut k[..]) {
            (knot.position, knot.normal) = (position, normal);
        }
    }

    /// Gives a vertex the trajectory that it should have; a new one begins at the isovalue where the mesh has it.
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

    /// Writes down where a vertex with a trajectory of its own is.
    pub(super) fn knot(&mut self, v: Vertex, isovalue: f64, position: Vec3, normal: Vec3) {
        if let Some(knots) = self.own(v)
            && knots.last().is_none_or(|k| k.isovalue != isovalue)
        {
            knots.push(OwnKnot { isovalue, position, normal });
        }
    }

    /// Writes down that faces have changed at an isovalue; their vertices are traced.
    pub(super) fn changed(
        &mut self,
        tracked: &Tracked,
        faces: impl Iterator<Item = Face>,
        isovalue: f64,
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
                self.end(slot, isovalue);
                self.alive[slot] = now.map(|vertices| (vertices, isovalue));
            }
        }
    }

    /// Writes down that all of the mesh may have changed at an isovalue.
    pub(super) fn changed_all(&mut self, tracked: &Tracked, isovalue: f64) {
        self.forget(tracked);
        self.changed(tracked, (0..tracked.mesh.face_slots() as u32).map(Face), isovalue);
    }

    /// Writes down an exchange at an isovalue.
    pub(super) fn exchanged(&mut self, joined: &Joined, isovalue: f64) {
        let mut before: HashMap<Face, ([Track; 3], f64)> = HashMap::new();
        for f in &joined.removed {
            if let Some(alive) = self.alive.get_mut(f.0 as usize).and_then(Option::take) {
                before.insert(*f, alive);
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
            self.alive[f.0 as usize] = was.and_then(|was| before.remove(&was));
        }
        // In an order that does not depend on the map.
        for f in &joined.removed {
            if let Some(alive) = before.remove(f) {
                self.write(alive, isovalue);
            }
        }
        self.changed(&joined.tracked, joined.faces.iter().map(|f| f.0), isovalue);
    }

    /// Vertex slots that are empty have no trajectory: another vertex may take them.
    fn forget(&mut self, tracked: &Tracked) {
        for (v, track) in self.tracks.iter_mut().enumerate() {
            if v >= tracked.mesh.vertex_slots() || !tracked.mesh.has_vertex(Vertex(v as u32)) {
                *track = None;
            }
        }
    }

    fn end(&mut self, slot: usize, isovalue: f64) {
        if let Some(alive) = self.alive[slot].take() {
            self.write(alive, isovalue);
        }
    }

    fn write(&mut self, (vertices, since): ([Track; 3], f64), isovalue: f64) {
        let (low, high) = (since.min(isovalue), since.max(isovalue));
        if low < high {
            self.lives.push(Life { vertices, low, high, cap: false });
        }
    }

    /// Ends everything: nothing is tracked any more.
    pub(super) fn clear(&mut self, isovalue: f64) {
        self.finish(isovalue);
        self.tracks.clear();
    }

    /// Ends everything: the march is over.
    pub(super) fn finish(&mut self, isovalue: f64) {
        for slot in 0..self.alive.len() {
            self.end(slot, isovalue);
        }
    }
}
