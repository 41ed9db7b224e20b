//! The seam and the mesh go to the end of a step, and are checked there.

use std::collections::BTreeSet;

use glam::Vec3;

use super::state::{March, State};
use crate::mesh::{Face, HalfEdgeMesh, Vertex, area};
use crate::sweep::calendar::Passage;
use crate::sweep::check::{open_seam, unlike_parts};
use crate::sweep::mend::{Shape, mend};
use crate::sweep::region::{LatticeEdge, Link};
use crate::sweep::remesh::criteria::Criteria;
use crate::sweep::tracked::{Changes, Tracked, place_of, place_on};
use crate::sweep::transport::{LEAST_AREA, MOST_OFF, Moved, Step, distance_by_slope, fault};
use crate::topology::exact::ExactField;

/// By vertex slot, where a vertex that is free is at the end of a step, and its normal there.
struct Ends(Vec<Option<[Vec3; 2]>>);

impl Ends {
    fn of(mesh: &HalfEdgeMesh, moved: &Moved) -> Ends {
        let mut ends = Ends(vec![None; mesh.vertex_slots()]);
        for (v, end, normal) in moved.all() {
            ends.set(v, [end, normal].map(Vec3::from));
        }
        ends
    }

    fn get(&self, v: Vertex) -> Option<Vec3> {
        Some(self.0.get(v.0 as usize)?.as_ref()?[0])
    }

    /// Where a vertex that is free is after a share of the step.
    fn on_the_way(&self, mesh: &HalfEdgeMesh, v: Vertex, share: f32) -> Vec3 {
        let p = mesh.position(v);
        self.get(v).map_or(p, |end| p.lerp(end, share))
    }

    /// Where a vertex is at an isovalue of a step: the seam where the exact extraction has it.
    fn place(
        &self,
        exact: &ExactField,
        tracked: &Tracked,
        v: Vertex,
        (step, c): (Step, f64),
    ) -> Vec3 {
        let share = ((c - step.at) / (step.next - step.at)) as f32;
        let free = || self.on_the_way(&tracked.mesh, v, share);
        tracked.key(v).map_or_else(free, |e| place_on(exact, e, c))
    }

    fn set(&mut self, v: Vertex, end: [Vec3; 2]) {
        let slot = v.0 as usize;
        self.0.resize(self.0.len().max(slot + 1), None);
        self.0[slot] = Some(end);
    }

    fn all(&self) -> impl Iterator<Item = (Vertex, [Vec3; 2])> {
        let slots = (0..).map(Vertex).zip(&self.0);
        slots.filter_map(|(v, end)| Some((v, (*end)?)))
    }
}

impl March<'_, '_> {
    /// Blocks in which the mesh is not watertight with the exact cells, or not like the isosurface.
    fn unlike(&self, State { tracked, region, .. }: &State, isovalue: f64) -> BTreeSet<u32> {
        let open = open_seam(tracked, region, self.exact(), isovalue);
        if !open.is_empty() {
            log::debug!(
                "{isovalue}: open at {} samples: {:?}",
                open.len(),
                open.iter().take(4).map(|&v| self.grid.position(v)).collect::<Vec<_>>()
            );
            return self.blocks_at_samples(open);
        }
        let places = unlike_parts(tracked, region, self.exact(), isovalue);
        if !places.is_empty() {
            log::debug!("{isovalue}: unlike at {} places: {:?}", places.len(), places[0]);
        }
        self.blocks_at_samples(places.into_iter().map(|p| self.sample_at(p)))
    }

    /// Blocks of faces that are far from the isosurface where the seam has gone over a sample: it may be fast.
    fn strained(
        &self,
        State { tracked, region, .. }: &State,
        faces: &BTreeSet<Face>,
        ends: &Ends,
        step: Step,
        isovalue: f64,
    ) -> BTreeSet<u32> {
        let mesh = &tracked.mesh;
        let place = |v: Vertex| ends.place(self.exact(), tracked, v, (step, isovalue));
        let criteria = Criteria::new(self.field(), isovalue, self.parameters());
        let most = MOST_OFF * self.parameters().error as f32;
        let alive = faces.iter().filter(|&&f| mesh.has_face(f) && !mesh.is_cap(f));
        let corners = alive.map(|&f| mesh.face_vertices(f).map(place));
        let off =
            corners.filter(|&t| area(t) >= LEAST_AREA && distance_by_slope(&criteria, t) > most);
        let is_free = |b: &u32| !region.holds(*b);
        off.flat_map(|t| {
            let middle = self.blocks_at(&[t.iter().sum::<Vec3>() / 3.0]);
            if middle.iter().all(is_free) {
                return middle;
            }
            // It reaches into exact cells.
            let corners: BTreeSet<u32> = self.blocks_at(&t).into_iter().filter(is_free).collect();
            if corners.is_empty() { middle } else { corners }
        })
        .collect()
    }

    /// Mends faces that are turned over half-way from samples that the seam has passed to those that it passes next: it runs over
    /// vertices of the mesh where it is oblique to the motion. Adds the faces that this changes. Returns the vertices that are
    /// gone, when, and where they were.
    fn mend_passed(
        &mut self,
        state: &mut State,
        faces: &mut BTreeSet<Face>,
        ends: &Ends,
        step: Step,
        [isovalue, next]: [f64; 2],
    ) -> Vec<(Vertex, f64, Vec3)> {
        let (exact, error) = (self.exact(), self.parameters().error as f32);
        let place = |tracked: &Tracked, v: Vertex, c: f64| ends.place(exact, tracked, v, (step, c));
        let middle = 0.5 * (isovalue + next);
        let places = [middle, step.next].map(|c| move |t: &Tracked, v: Vertex| place(t, v, c));
        let criteria = |c: f64| Criteria::new(self.field(), c, self.parameters());
        let shapes = [
            Shape { criteria: criteria(middle), most: MOST_OFF * error, place: &places[0] },
            Shape {
                criteria: criteria(step.next),
                most: 2.0 * MOST_OFF * error,
                place: &places[1],
            },
        ];
        let State { tracked, region, .. } = state;
        let mesh = &tracked.mesh;
        let alive = faces.iter().copied().filter(|&f| mesh.has_face(f) && !mesh.is_cap(f));
        let is_turned = |f: &Face| {
            let corners = mesh.face_vertices(*f).map(|v| places[0](tracked, v));
            fault(&shapes[0].criteria, corners, f32::INFINITY).is_some()
        };
        let turned: Vec<Face> = alive.filter(is_turned).collect();
        if turned.is_empty() {
            return Vec::new();
        }
        let mended = mend(tracked, region, &shapes, &turned);
        self.record.changed(tracked, mended.faces.iter().copied(), isovalue);
        faces.extend(mended.faces);
        mended.gone.into_iter().map(|v| (v, isovalue, place(tracked, v, isovalue))).collect()
    }

    /// The seam goes over all samples that are passed, and every vertex to where it is at the end of the step; unless blocks are
    /// named, or others are to be, for which the seam is not asked in the end.
    pub(super) fn slide(
        &mut self,
        state: &mut State,
        step: Step,
        passage: Passage,
        moved: &Moved,
        named: BTreeSet<u32>,
        asks: bool,
    ) -> std::result::Result<(), BTreeSet<u32>> {
        let exact = self.exact();
        let before = state.tracked.clone();
        let mark = self.record.mark();
        let mut ends = Ends::of(&before.mesh, moved);
        let mut samples: Vec<u32> = self.calendar.samples(passage).to_vec();
        if step.next < step.at {
            samples.reverse();
        }
        let criteria = Criteria::new(self.field(), step.next, self.parameters());
        let mut strained = named;
        let mut passed_faces: BTreeSet<Face> = BTreeSet::new();
        // Vertices that are gone before the end, when, and where they were.
        let mut left: Vec<(Vertex, f64, Vec3)> = Vec::new();
        let mut last = step.at;
        for sample in samples {
            if !matches!(state.region.link(sample), Link::Cycle(..)) {
                continue;
            }
            let value = exact.sample(sample).clamp(step.at.min(step.next), step.at.max(step.next));
            if value != last {
                left.extend(self.mend_passed(state, &mut passed_faces, &ends, step, [last, value]));
                strained.extend(self.strained(state, &passed_faces, &ends, step, last));
                passed_faces.clear();
                last = value;
            }
            let share = ((value - step.at) / (step.next - step.at)) as f32;
            let at = |mesh: &HalfEdgeMesh, v: Vertex| ends.on_the_way(mesh, v, share);
            let mut changes = Changes::default();
            let place = place_of(exact, sample);
            let passed = state.tracked.pass(&state.region, sample, place, &at, &mut changes);
            if let Err(stuck) = passed {
                state.tracked = before;
                self.record.roll_back(mark);
                strained.extend(self.blocks_at_samples([stuck.0]));
                return Err(strained);
            }
            self.counts.passed += 1;
            passed_faces.extend(&changes.faces);
            self.record.changed(&state.tracked, changes.faces.iter().copied(), value);
            for (v, between) in changes.born {
                let [p, q] =
                    between.map(|v| ends.get(v).unwrap_or_else(|| state.tracked.mesh.position(v)));
                let n = state.tracked.mesh.vertex_normal(v);
                let middle = 0.5 * (p + q);
                let reach = 0.5 * p.distance(q) + 0.1;
                let end =
                    crate::field::project_point(self.field(), middle, n, criteria.isovalue, reach);
                // Its way so far is that of the edge's middle; so that it is there at the sample's value, its place
                // at the start of the step is as if it had always moved evenly.
                let now = state.tracked.mesh.position(v);
                let end = end.unwrap_or(middle);
                if share < 1.0 {
                    state.tracked.mesh.set_position(v, (now - share * end) / (1.0 - share));
                }
                ends.set(v, [end, Vec3::ZERO]);
            }
        }
        left.extend(self.mend_passed(state, &mut passed_faces, &ends, step, [last, step.next]));
        strained.extend(self.strained(state, &passed_faces, &ends, step, last));
        let bad = match asks {
            true if !strained.is_empty() => strained,
            _ => self.unlike(state, step.next),
        };
        if !bad.is_empty() {
            state.tracked = before;
            self.record.roll_back(mark);
            return Err(bad);
        }
        for (v, isovalue, position) in left {
            self.record.knot(v, isovalue, position, Vec3::ZERO);
        }
        let bound: Vec<(Vertex, LatticeEdge)> = state.tracked.bound().collect();
        for (v, e) in bound {
            state.tracked.mesh.set_position(v, place_on(exact, e, step.next));
        }
        for (v, [end, normal]) in ends.all() {
            if state.tracked.mesh.has_vertex(v) && state.tracked.key(v).is_none() {
                state.tracked.mesh.set_position(v, end);
                self.record.knot(v, step.next, end, normal);
            }
        }
        Ok(())
    }
}
