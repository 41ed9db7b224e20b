//! The arcs of the contour tree: isosurface components between two events.

use super::contour_tree::ContourTree;
use super::critical::{CriticalPoint, GridElement};
use super::event::{EventKind, TopologyEvent};
use super::exact::{IsovalueKeys, ORDER_BITS};
use super::merge::{MergeTree, NONE};
use crate::error::{Error, Result};
use crate::volume::Outside;

/// One isosurface component over the isovalues between two events that touch it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// The event at which it starts; none for the surface that starts at the layer.
    pub birth_event: Option<u32>,
    /// The event at which it ends; none for the surface that ends at the layer.
    pub death_event: Option<u32>,
    /// Isovalue of the birth, units of the volume.
    pub birth: f64,
    /// Isovalue of the death, units of the volume.
    pub death: f64,
    /// Order key of the birth.
    pub birth_key: i128,
    /// Order key of the death.
    pub death_key: i128,
    /// Euler characteristic of the component, even and at most 2; its genus is `1 - euler / 2`.
    pub euler: i64,
    /// Whether only the ramp separates birth and death: without the ramp the component does not
    /// exist at any isovalue.
    pub ramp_only: bool,
}

/// Events and arcs from join and split tree.
pub(super) struct ArcTree {
    pub(super) contour: ContourTree,
    pub(super) events: Vec<TopologyEvent>,
    pub(super) arcs: Vec<Arc>,
    pub(super) arc_of_node: Vec<u32>,
    pub(super) n_components: Vec<u32>,
    pub(super) euler: Vec<i64>,
    /// The node of the layer, and its key.
    pub(super) layer: u32,
    pub(super) layer_key: i128,
}

impl ArcTree {
    pub(super) fn of(
        points: Vec<CriticalPoint>,
        join: &MergeTree,
        split: &MergeTree,
        outside: Outside,
        keys: IsovalueKeys,
    ) -> Result<ArcTree> {
        let contour = ContourTree::combine(&points, join, split)?;
        let kinds: Vec<EventKind> = (0..points.len())
            .map(|i| match (points[i].index, join.n_children[i], split.n_children[i]) {
                (0, ..) => EventKind::Emerge,
                (1, 2, _) => EventKind::Merge,
                (1, ..) => EventKind::HandleOpen,
                (2, _, 2) => EventKind::Split,
                (2, ..) => EventKind::HandleClose,
                _ => EventKind::Vanish,
            })
            .collect();
        let (n_components, euler) = running_counts(&points, &kinds)?;
        let layer = match outside {
            Outside::Low => 0,
            Outside::High => points.len() as u32 - 1,
        };
        if points[layer as usize].element != GridElement::Layer {
            return Err(Error::internal("a critical point is beyond the layer"));
        }
        let layer_key = points[layer as usize].key;
        let (arcs, arc_of_node) = arcs(&points, &contour, layer, keys);
        let events = events(points, &kinds);
        Ok(ArcTree { contour, events, arcs, arc_of_node, n_components, euler, layer, layer_key })
    }
}

/// Number of arcs that exist somewhere in a range.
pub(super) fn n_arcs_in(arcs: &[Arc], (low, high): (f64, f64)) -> usize {
    arcs.iter().filter(|arc| arc.birth.max(low) < arc.death.min(high)).count()
}

/// Components and Euler characteristic of the isosurface after 0, 1, ... nodes.
fn running_counts(points: &[CriticalPoint], kinds: &[EventKind]) -> Result<(Vec<u32>, Vec<i64>)> {
    let (mut components, mut euler) = (0u32, 0i64);
    let mut n_components = vec![0];
    let mut eulers = vec![0];
    for (point, kind) in points.iter().zip(kinds) {
        euler += if point.index % 2 == 0 { 2 } else { -2 };
        let next = match kind {
            EventKind::Emerge | EventKind::Split => components.checked_add(1),
            EventKind::Merge | EventKind::Vanish => components.checked_sub(1),
            EventKind::HandleOpen | EventKind::HandleClose => Some(components),
        };
        components = next.ok_or_else(|| {
            Error::internal(format!("{kind:?} at {:?} without a component", point.position))
        })?;
        n_components.push(components);
        eulers.push(euler);
    }
    if components != 0 || euler != 0 {
        return Err(Error::internal(format!(
            "{components} components with Euler characteristic {euler} are left after the last event"
        )));
    }
    Ok((n_components, eulers))
}

/// The arcs of a contour tree in order, and the arc from each node to its parent.
fn arcs(
    points: &[CriticalPoint],
    tree: &ContourTree,
    layer: u32,
    keys: IsovalueKeys,
) -> (Vec<Arc>, Vec<u32>) {
    let mut ends: Vec<(u32, u32, u32)> = (0..points.len() as u32)
        .filter(|&i| tree.parent[i as usize] != NONE)
        .map(|i| {
            let p = tree.parent[i as usize];
            (i.min(p), i.max(p), i)
        })
        .collect();
    // Two nodes have at most one arc in common, so the order is total.
    ends.sort_unstable();
    let event_of = |node: u32| (node != layer).then(|| node - u32::from(layer == 0));
    let mut arc_of_node = vec![NONE; points.len()];
    let arcs = ends
        .iter()
        .enumerate()
        .map(|(arc, &(birth, death, child))| {
            arc_of_node[child as usize] = arc as u32;
            let (from, to) = (&points[birth as usize], &points[death as usize]);
            Arc {
                birth_event: event_of(birth),
                death_event: event_of(death),
                birth: from.isovalue,
                death: to.isovalue,
                birth_key: from.key,
                death_key: to.key,
                euler: tree.euler[child as usize],
                ramp_only: to.key - from.key <= keys.ramp_range() << ORDER_BITS,
            }
        })
        .collect();
    (arcs, arc_of_node)
}

/// The critical points without the layer, as events of their kinds.
fn events(points: Vec<CriticalPoint>, kinds: &[EventKind]) -> Vec<TopologyEvent> {
    points
        .into_iter()
        .zip(kinds)
        .filter(|(p, _)| p.element != GridElement::Layer)
        .map(|(p, &kind)| TopologyEvent {
            key: p.key,
            isovalue: p.isovalue,
            position: p.position,
            index: p.index,
            kind,
            element: p.element,
            low: p.low,
            high: p.high,
        })
        .collect()
}
