//! Moves the seam across grid samples to the end of a step, repairs inverted faces, and checks the mesh there.

use std::collections::BTreeSet;

use glam::Vec3;

use super::ends::Ends;
use super::state::{March, State};
use crate::field::project_point;
use crate::mesh::{Face, HalfEdgeMesh, Vertex, area};
use crate::sweep::calendar::Passage;
use crate::sweep::cause::Cause;
use crate::sweep::check::{mismatched_parts, open_seam};
use crate::sweep::region::{LatticeEdge, Link};
use crate::sweep::remesh::criteria::Criteria;
use crate::sweep::tracked::{Changes, Stuck, Tracked, place_of, place_on};
use crate::sweep::transport::{
    MAX_DEVIATION_FACTOR, MIN_FACE_AREA, Moved, Step, distance_by_slope, fault,
};

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
        let middle = 0.5 * (isovalue + next);
        let exact = self.exact();
        let place = |tracked: &Tracked, v, c| ends.place(exact, tracked, v, step, c);
        let criteria = Criteria::new(self.field(), middle, self.parameters());
        let State { tracked, .. } = &*state;
        let mesh = &tracked.mesh;
        let alive = faces.iter().copied().filter(|&f| mesh.has_face(f) && !mesh.is_cap(f));
        let is_turned = |f: &Face| {
            let corners = mesh.face_vertices(*f).map(|v| place(tracked, v, middle));
            fault(&criteria, corners, f32::INFINITY).is_some()
        };
        let turned: Vec<Face> = alive.filter(is_turned).collect();
        if turned.is_empty() {
            return Vec::new();
        }
        let repaired = self.repair_in_step(state, &turned, ends, step, [middle, step.next]);
        let State { tracked, .. } = state;
        let changed = repaired.faces.iter().copied();
        self.record.changed(tracked, changed, isovalue, |_| Cause::Repair);
        faces.extend(repaired.faces);
        repaired.gone.into_iter().map(|v| (v, isovalue, place(tracked, v, isovalue))).collect()
    }

    /// Moves the seam across a sample at its value. Adds the changed faces to `faces`, and the ends of new vertices to `ends`.
    fn cross(
        &mut self,
        state: &mut State,
        (sample, value): (u32, f64),
        step: Step,
        ends: &mut Ends,
        faces: &mut BTreeSet<Face>,
    ) -> std::result::Result<(), Stuck> {
        let share = ((value - step.at) / (step.next - step.at)) as f32;
        let at = |mesh: &HalfEdgeMesh, v: Vertex| ends.on_the_way(mesh, v, share);
        let State { tracked, region, .. } = state;
        let mut changes = Changes::default();
        tracked.cross_sample(region, sample, place_of(self.exact(), sample), &at, &mut changes)?;
        self.counts.passed += 1;
        faces.extend(&changes.faces);
        self.record.changed(tracked, changes.faces, value, |_| Cause::Seam);
        for (v, between) in changes.born {
            let [p, q] = between.map(|v| ends.get(v).unwrap_or_else(|| tracked.mesh.position(v)));
            let (middle, reach) = (0.5 * (p + q), 0.5 * p.distance(q) + 0.1);
            let isovalue = self.field().isovalue(step.next);
            let normal = tracked.mesh.vertex_normal(v);
            let end = project_point(self.field(), middle, normal, isovalue, reach);
            let end = end.unwrap_or(middle);
            // `on_the_way` interpolates between the position at the start of the step and the end. The vertex exists only
            // since the sample's value, so its start is extrapolated from its present position.
            if share < 1.0 {
                let now = tracked.mesh.position(v);
                tracked.mesh.set_position(v, (now - share * end) / (1.0 - share));
            }
            ends.set(v, [end, Vec3::ZERO]);
        }
        Ok(())
    }

    /// Moves the seam across all samples of the passage, value by value. Adds the blocks of faces off the isosurface to `failed`. Returns
    /// the vertices removed by repairs, each with the isovalue and its last position.
    fn cross_all(
        &mut self,
        state: &mut State,
        step: Step,
        passage: Passage,
        ends: &mut Ends,
        failed: &mut BTreeSet<u32>,
    ) -> std::result::Result<Vec<(Vertex, f64, Vec3)>, Stuck> {
        let (low, high) = (step.at.min(step.next), step.at.max(step.next));
        // Where exact cells change, too.
        let value = |sample: u32| self.exact().vertex_value(sample).clamp(low, high);
        let on_seam = |s: &u32| matches!(state.region.link(*s), Link::Cycle(..));
        let samples = self.calendar.samples(passage).iter().copied().filter(on_seam);
        let mut samples: Vec<(u32, f64)> = samples.map(|s| (s, value(s))).collect();
        if step.next < step.at {
            samples.reverse();
        }
        let mut left = Vec::new();
        let mut by_value = samples.chunk_by(|a, b| a.1 == b.1).peekable();
        while let Some(of_value) = by_value.next() {
            let mut faces: BTreeSet<Face> = BTreeSet::new();
            for &sample in of_value {
                self.cross(state, sample, step, ends, &mut faces)?;
            }
            let at = of_value[0].1;
            let next = by_value.peek().map_or(step.next, |of_next| of_next[0].1);
            left.extend(self.repair_crossed(state, &mut faces, ends, step, [at, next]));
            failed.extend(self.blocks_off_surface(state, &faces, ends, step, at));
        }
        Ok(left)
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
        let before = state.tracked.clone();
        let mark = self.record.mark();
        let mut ends = Ends::of(&before.mesh, moved);
        let crossed = self.cross_all(state, step, passage, &mut ends, &mut failed);
        if let Err(Stuck(sample)) = crossed {
            failed.extend(self.blocks_at_samples([sample]));
        } else if failed.is_empty() || !may_retry {
            failed = self.topology_mismatches(state, step.next);
        }
        let left = match crossed {
            Ok(left) if failed.is_empty() => left,
            _ => {
                state.tracked = before;
                self.record.roll_back(mark);
                return Err(failed);
            }
        };
        for (v, isovalue, position) in left {
            self.record.knot(v, isovalue, position, Vec3::ZERO);
        }
        let bound: Vec<(Vertex, LatticeEdge)> = state.tracked.bound().collect();
        for (v, e) in bound {
            state.tracked.mesh.set_position(v, place_on(self.exact(), e, step.next));
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
