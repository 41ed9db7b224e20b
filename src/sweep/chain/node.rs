//! Passing a node of the contour tree: surgery on the meshes that have arrived, or new meshes beyond it.

use glam::Vec3;
use rayon::Scope;

use super::{Arrivals, Chain, lock, outputs};
use crate::error::Result;
use crate::sweep::Counts;
use crate::sweep::graph::Node;
use crate::sweep::idle::{self, Idle};
use crate::sweep::recorder::Direction;
use crate::sweep::surgery::{Front, Operation, operate};
use crate::sweep::toil::Toil;
use crate::sweep::window::{WINDOW_SHARE, window};

impl Chain<'_> {
    /// Passes a node: surgery on the meshes that have arrived, or new meshes for the arcs beyond.
    pub(super) fn pass<'s>(
        &'s self,
        node: usize,
        mut arrivals: Arrivals,
        scope: &Scope<'s>,
    ) -> Result<()> {
        let direction = self.direction_of(node);
        let node = &self.graph.nodes[node];
        let arcs = outputs(node, direction);
        arrivals.sort_by_key(|a| a.0);
        let without: Vec<Idle> =
            arrivals.iter().filter_map(|(_, front)| front.as_ref().err().copied()).collect();
        let idle = idle::joined(without.iter().copied());
        let (from, fronts): (Vec<usize>, Vec<Front>) =
            arrivals.into_iter().filter_map(|(arc, front)| Some((arc, front.ok()?))).unzip();
        let mut counts = Counts::default();
        if fronts.is_empty() {
            return self.start_beyond(arcs, idle, scope);
        }
        let toil = Toil::of_operation(fronts.iter().map(|f| f.toil));
        let all_lost = idle::joined(without.iter().copied().chain([Idle::after(toil)]));
        let leads_nowhere = !arcs.is_empty() && arcs.iter().all(|&a| self.length(a) < self.tiny);
        let unresolved = arcs.iter().any(|&a| self.is_unresolved(a));
        if leads_nowhere || unresolved || fronts.iter().any(|f| f.toil.is_too_much()) {
            self.end_before(node, direction, from, fronts, &mut counts)?;
            lock(&self.counts).add(&counts);
            return self.start_beyond(arcs, all_lost, scope);
        }
        let points: Vec<Vec3> = node
            .events
            .iter()
            .map(|&e| Vec3::from(self.sweep.topology.events[e as usize].position.map(|x| x as f32)))
            .collect();
        let windows =
            arcs.iter().map(|&a| window(self.sweep, node, &self.piece(a), &fronts[0].mesh));
        let window = windows.fold(f64::INFINITY, f64::min);
        let operation = Operation {
            direction,
            event: node.isovalue,
            after: self.after(node, direction, window, arcs),
            points: &points,
            arcs,
            repaired: false,
        };
        let mut kernels = self.sweep.backend.kernels(&self.sweep.field)?;
        match operate(self.sweep, &operation, fronts, kernels.as_mut())? {
            Ok(outcome) => {
                counts.surgeries += 1;
                lock(&self.counts).add(&counts);
                lock(&self.log).append(outcome.log);
                for (arc, front) in outcome.fronts {
                    scope.spawn(move |scope| {
                        self.attempt(|| self.run(arc, direction, front, scope));
                    });
                }
                Ok(())
            }
            Err(failed) => {
                counts.surgeries_failed += 1;
                self.end_before(node, direction, from, failed.fronts, &mut counts)?;
                lock(&self.counts).add(&counts);
                // What a small part has lost says nothing of the rest.
                let is_others = idle.is_over() || failed.are_small && !without.is_empty();
                self.start_beyond(arcs, if is_others { idle } else { all_lost }, scope)
            }
        }
    }

    /// The isovalue of the meshes after a surgery: beyond the event by the window, and where the components of all arcs
    /// beyond it are.
    fn after(&self, node: &Node, direction: Direction, window: f64, arcs: &[usize]) -> f64 {
        let alive = arcs.iter().map(|&a| self.sweep.alive(&self.piece(a)));
        let (low, high) =
            alive.fold((f64::NEG_INFINITY, f64::INFINITY), |(l, h), a| (l.max(a.0), h.min(a.1)));
        let after = node.isovalue + direction.sign() * window;
        // Less than the least window, so that it counts beside batches of some width only.
        let margin = 0.5 * WINDOW_SHARE.0 * (high - low);
        if margin.is_finite() && margin > 0.0 {
            after.max(low + margin).min(high - margin)
        } else {
            after
        }
    }

    /// Tracks meshes up to just before a node that they do not get through, and ends them.
    fn end_before(
        &self,
        node: &Node,
        direction: Direction,
        arcs: Vec<usize>,
        fronts: Vec<Front>,
        counts: &mut Counts,
    ) -> Result<()> {
        for (arc, mut front) in arcs.into_iter().zip(fronts) {
            let last = node.isovalue - direction.sign() * self.margin(&self.piece(arc));
            let arrived = self.track_to(&mut front, arc, direction, [last, 0.0], counts)?;
            self.end(front, arc, direction, arrived);
        }
        Ok(())
    }

    /// Starts arcs in their middle.
    pub(super) fn start_beyond<'s>(
        &'s self,
        arcs: &[usize],
        idle: Idle,
        scope: &Scope<'s>,
    ) -> Result<()> {
        for &arc in arcs {
            let is_over = self.beyond(idle, arc).is_over() && self.length(arc) >= self.tiny;
            if self.is_short(arc) && !is_over {
                self.leave(arc, idle, scope);
            } else {
                let idle = self.beyond(idle, arc);
                self.start_in_middle(arc, idle, scope)?;
            }
        }
        Ok(())
    }
}
