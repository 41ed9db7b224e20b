//! Where the vertices of the mesh are during a step, and repairs that look at all of it.

use glam::Vec3;

use super::state::{March, State};
use crate::mesh::{Face, HalfEdgeMesh, Vertex};
use crate::sweep::remesh::criteria::Criteria;
use crate::sweep::repair::{Repaired, Shape, repair};
use crate::sweep::tracked::{Tracked, place_on};
use crate::sweep::transport::{MAX_DEVIATION_FACTOR, Moved, Step};
use crate::topology::exact::ExactField;

/// By vertex slot: the position and normal of a free vertex at the end of a step.
pub(super) struct Ends(Vec<Option<[Vec3; 2]>>);

impl Ends {
    pub(super) fn of(mesh: &HalfEdgeMesh, moved: &Moved) -> Ends {
        let mut ends = Ends(vec![None; mesh.vertex_slots()]);
        for (v, end, normal) in moved.all() {
            ends.set(v, [end, normal].map(Vec3::from));
        }
        ends
    }

    pub(super) fn get(&self, v: Vertex) -> Option<Vec3> {
        Some(self.0.get(v.0 as usize)?.as_ref()?[0])
    }

    /// The position of a free vertex after a share of the step.
    pub(super) fn on_the_way(&self, mesh: &HalfEdgeMesh, v: Vertex, share: f32) -> Vec3 {
        let p = mesh.position(v);
        self.get(v).map_or(p, |end| p.lerp(end, share))
    }

    /// The position of a vertex at an isovalue of a step; a bound vertex is where the exact extraction has it.
    pub(super) fn place(
        &self,
        exact: &ExactField,
        tracked: &Tracked,
        v: Vertex,
        step: Step,
        c: f64,
    ) -> Vec3 {
        let share = ((c - step.at) / (step.next - step.at)) as f32;
        let free = || self.on_the_way(&tracked.mesh, v, share);
        tracked.key(v).map_or_else(free, |e| place_on(exact, e, c))
    }

    pub(super) fn set(&mut self, v: Vertex, end: [Vec3; 2]) {
        let slot = v.0 as usize;
        self.0.resize(self.0.len().max(slot + 1), None);
        self.0[slot] = Some(end);
    }

    pub(super) fn all(&self) -> impl Iterator<Item = (Vertex, [Vec3; 2])> {
        let slots = (0..).map(Vertex).zip(&self.0);
        slots.filter_map(|(v, end)| Some((v, (*end)?)))
    }
}

impl March<'_, '_> {
    /// Repairs faces by edits after which fewer triangles fail at two isovalues of a step. At the second one, the end, twice the
    /// deviation is allowed, as faces are refined there.
    pub(super) fn repair_in_step(
        &self,
        State { tracked, region, .. }: &mut State,
        faces: &[Face],
        ends: &Ends,
        step: Step,
        isovalues: [f64; 2],
    ) -> Repaired {
        let exact = self.exact();
        let places =
            isovalues.map(|c| move |t: &Tracked, v: Vertex| ends.place(exact, t, v, step, c));
        let most = MAX_DEVIATION_FACTOR * self.parameters().error as f32;
        let shape = |i: usize, max_deviation: f32| Shape {
            criteria: Criteria::new(self.field(), isovalues[i], self.parameters()),
            max_deviation,
            place: &places[i],
        };
        repair(tracked, region, &[shape(0, most), shape(1, 2.0 * most)], faces)
    }
}
