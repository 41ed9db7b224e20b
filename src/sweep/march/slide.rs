//! Moves the seam across grid samples to the end of a step, repairs inverted faces, and checks the mesh there.

use std::collections::BTreeSet;

use glam::Vec3;

use super::state::{March, State};
use crate::mesh::{Face, HalfEdgeMesh, Vertex, area};
use crate::sweep::calendar::Passage;
use crate::sweep::cause::Cause;
use crate::sweep::check::{mismatched_parts, open_seam};
use crate::sweep::region::{LatticeEdge, Link};
use crate::sweep::remesh::criteria::Criteria;
use crate::sweep::repair::{Shape, repair};
use crate::sweep::tracked::{Changes, Tracked, place_of, place_on};
use crate::sweep::transport::{
    MAX_DEVIATION_FACTOR, MIN_FACE_AREA, Moved, Step, distance_by_slope, fault,
};
use crate::topology::exact::ExactField;

/// By vertex slot: the position and normal of a free vertex at the end of a step.
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

    /// The position of a free vertex after a share of the step.
    fn on_the_way(&self, mesh: &HalfEdgeMesh, v: Vertex, share: f32) -> Vec3 {
        let p = mesh.position(v);
        self.get(v).map_or(p, |end| p.lerp(end, share))
    }

    /// The position of a vertex at an isovalue of a step; a bound vertex is where the exact extraction has it.
    fn place(&self, exact: &ExactField, tracked: &Tracked, v: Vertex, step: Step, c: f64) -> Vec3 {
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
    /// Blocks in which the mesh is not watertight with the exact cells, or its topology is not that of the isosurface.
    fn topology_mismatches(
        &self,
        State { tracked, region, .. }: &State,
        isovalue: f64,
    ) -> BTreeSet<u32> {
        let open = open_seam(tracked, region, self.exact(), isovalue);
        if !open.is_empty() {
            log::debug!(
                "{isovalue}: open at {} samples: {:?}",
                open.len(),
                open.iter().take(4).map(|&v| self.grid.position(v)).collect::<Vec<_>>()
            );
            return self.blocks_at_samples(open);
        }
        let places = mismatched_parts(tracked, region, self.exact(), isovalue);
        if !places.is_empty() {
            log::debug!("{isovalue}: other topology at {} places: {:?}", places.len(), places[0]);
        }
        self.blocks_at_samples(places.into_iter().map(|p| self.sample_at(p)))
    }

    /// Blocks of faces near crossed samples that are far from the isosurface: the seam may have moved far.
    fn blocks_off_surface(
        &self,
        State { tracked, region, .. }: &State,
        faces: &BTreeSet<Face>,
        ends: &Ends,
        step: Step,
        isovalue: f64,
    ) -> BTreeSet<u32> {
        let mesh = &tracked.mesh;
        let place = |v: Vertex| ends.place(self.exact(), tracked, v, step, isovalue);
        let criteria = Criteria::new(self.field(), isovalue, self.parameters());
        let most = MAX_DEVIATION_FACTOR * self.parameters().error as f32;
        let alive = faces.iter().filter(|&&f| mesh.has_face(f) && !mesh.is_cap(f));
        let corners = alive.map(|&f| mesh.face_vertices(f).map(place));
        let off =
            corners.filter(|&t| area(t) >= MIN_FACE_AREA && distance_by_slope(&criteria, t) > most);
        let is_free = |b: &u32| !region.holds(*b);
        off.flat_map(|t| {
            let middle = self.blocks_at(&[t.iter().sum::<Vec3>() / 3.0]);
            if middle.iter().all(is_free) {
                return middle;
            }
            // The face extends into exact cells.
            let corners: BTreeSet<u32> = self.blocks_at(&t).into_iter().filter(is_free).collect();
            if corners.is_empty() { middle } else { corners }
        })
        .collect()
    }

    /// Repairs faces that are turned over half-way between the value of the samples just crossed and the next one: where the seam
    /// is oblique to the motion, it runs over vertices of the mesh. Adds the changed faces to `faces`. Returns the removed
    /// vertices, each with the isovalue and its last position.
    fn repair_crossed(
        &mut self,
        state: &mut State,
        faces: &mut BTreeSet<Face>,
        ends: &Ends,
        step: Step,
        [isovalue, next]: [f64; 2],
    ) -> Vec<(Vertex, f64, Vec3)> {
        let (exact, error) = (self.exact(), self.parameters().error as f32);
        let place = |tracked: &Tracked, v: Vertex, c: f64| ends.place(exact, tracked, v, step, c);
        let middle = 0.5 * (isovalue + next);
        let places = [middle, step.next].map(|c| move |t: &Tracked, v: Vertex| place(t, v, c));
        let criteria = |c: f64| Criteria::new(self.field(), c, self.parameters());
        let shapes = [
            Shape {
                criteria: criteria(middle),
                max_deviation: MAX_DEVIATION_FACTOR * error,
                place: &places[0],
            },
            Shape {
                criteria: criteria(step.next),
                max_deviation: 2.0 * MAX_DEVIATION_FACTOR * error,
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
        let repaired = repair(tracked, region, &shapes, &turned);
        let changed = repaired.faces.iter().copied();
        self.record.changed(tracked, changed, isovalue, |_| Cause::Repair);
        faces.extend(repaired.faces);
        repaired.gone.into_iter().map(|v| (v, isovalue, place(tracked, v, isovalue))).collect()
    }

    /// Moves the seam across all samples of the passage, and every vertex to the end of the step.
    ///
    /// # Errors
    ///
    /// The blocks that failed; the mesh and the record are as before. `failed` are blocks that have failed before: while
    /// `may_retry`, they and faces off the isosurface are errors, and topology is checked only without them. Later only topology
    /// is checked.
    pub(super) fn slide(
        &mut self,
        state: &mut State,
        step: Step,
        passage: Passage,
        moved: &Moved,
        mut failed: BTreeSet<u32>,
        may_retry: bool,
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
        let mut crossed_faces: BTreeSet<Face> = BTreeSet::new();
        // Vertices removed before the end, each with the isovalue and its last position.
        let mut left: Vec<(Vertex, f64, Vec3)> = Vec::new();
        let mut last = step.at;
        for sample in samples {
            if !matches!(state.region.link(sample), Link::Cycle(..)) {
                continue;
            }
            // Where exact cells change, too.
            let value =
                exact.vertex_value(sample).clamp(step.at.min(step.next), step.at.max(step.next));
            if value != last {
                left.extend(self.repair_crossed(
                    state,
                    &mut crossed_faces,
                    &ends,
                    step,
                    [last, value],
                ));
                failed.extend(self.blocks_off_surface(state, &crossed_faces, &ends, step, last));
                crossed_faces.clear();
                last = value;
            }
            let share = ((value - step.at) / (step.next - step.at)) as f32;
            let at = |mesh: &HalfEdgeMesh, v: Vertex| ends.on_the_way(mesh, v, share);
            let mut changes = Changes::default();
            let place = place_of(exact, sample);
            let passed =
                state.tracked.cross_sample(&state.region, sample, place, &at, &mut changes);
            if let Err(stuck) = passed {
                state.tracked = before;
                self.record.roll_back(mark);
                failed.extend(self.blocks_at_samples([stuck.0]));
                return Err(failed);
            }
            self.counts.passed += 1;
            crossed_faces.extend(&changes.faces);
            let faces = changes.faces.iter().copied();
            self.record.changed(&state.tracked, faces, value, |_| Cause::Seam);
            for (v, between) in changes.born {
                let [p, q] =
                    between.map(|v| ends.get(v).unwrap_or_else(|| state.tracked.mesh.position(v)));
                let n = state.tracked.mesh.vertex_normal(v);
                let middle = 0.5 * (p + q);
                let reach = 0.5 * p.distance(q) + 0.1;
                let end =
                    crate::field::project_point(self.field(), middle, n, criteria.isovalue, reach);
                // `on_the_way` interpolates between the position at the start of the step and the end. The vertex exists only
                // since the sample's value, so its start is extrapolated from its present position.
                let now = state.tracked.mesh.position(v);
                let end = end.unwrap_or(middle);
                if share < 1.0 {
                    state.tracked.mesh.set_position(v, (now - share * end) / (1.0 - share));
                }
                ends.set(v, [end, Vec3::ZERO]);
            }
        }
        left.extend(self.repair_crossed(state, &mut crossed_faces, &ends, step, [last, step.next]));
        failed.extend(self.blocks_off_surface(state, &crossed_faces, &ends, step, last));
        let bad = match may_retry {
            true if !failed.is_empty() => failed,
            _ => self.topology_mismatches(state, step.next),
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
