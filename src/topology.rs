//! Topology of the isosurface at every isovalue, exactly: events, arcs, components, Euler
//! characteristic.
//!
//! # Theory
//!
//! The field is made generic by a ramp far too small to see ([`exact`]); then the trilinear field
//! has simple critical points only, found by local analysis ([`critical`]). Two union-find sweeps
//! give the components of {f <= c} and of {f > c} (`merge`), both together the contour tree
//! (`contour_tree`), whose arcs are the isosurface components: each separates the volume, with one
//! component of {f <= c} on one side and one of {f > c} on the other.
//!
//! The layer around the volume counts as one point: the padded volume with its border collapsed is
//! a 3-sphere, the layer is its lowest minimum ([`Outside::Low`]) or highest maximum
//! ([`Outside::High`]). The alternating sum of all critical points of a 3-sphere is 0; it is checked
//! on every run, also in release builds, as are the properties listed in `contour_tree`.
//!
//! # Invariants
//!
//! Events are ascending in the generic field. An event at exactly the isovalue c has happened at c:
//! everything here is continuous from the right.
//!
//! [`Outside::Low`]: crate::volume::Outside::Low
//! [`Outside::High`]: crate::volume::Outside::High

pub mod blocks;
mod contour_tree;
pub mod critical;
pub mod curves;
pub mod dust;
mod event;
pub mod exact;
mod merge;
mod net;
pub mod plot;
pub mod regions;
pub mod simplify;

pub use event::{Event, EventKind};

use crate::error::{Error, Result};
use crate::topology::contour_tree::ContourTree;
use crate::topology::critical::{CriticalPoint, CriticalPoints, Place};
use crate::topology::exact::{ExactField, IsovalueKeys, ORDER_BITS};
use crate::topology::merge::{Direction, MergeTree, NONE};
use crate::volume::Outside;

/// An isovalue at which the topology changes, with its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopologyEvent {
    /// Place in the order of the generic field; comparable with [`ExactField::isovalue_key`].
    pub key: i128,
    /// The isovalue in units of the volume, without the ramp.
    pub isovalue: f64,
    /// The critical point, voxel frame.
    pub position: [f64; 3],
    /// Number of falling directions: 0 minimum, 1 and 2 saddles, 3 maximum.
    pub index: u8,
    /// What changes.
    pub kind: EventKind,
    /// Which sample, lattice face or cell holds the critical point.
    pub place: Place,
    /// Samples below it, one in each of the regions that meet there (equal where there is one).
    pub low: [u32; 2],
    /// Samples above it, likewise.
    pub high: [u32; 2],
}

/// One isosurface component over the isovalues between two events that touch it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// The event that it starts at; none for the surface that starts at the layer.
    pub birth_event: Option<u32>,
    /// The event that it ends at; none for the surface that ends at the layer.
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
    /// Whether only the ramp separates birth and death: in the volume as it is, the component does
    /// not live for any isovalue.
    pub ramp_only: bool,
}

/// An extremum and the saddle at which its component meets an older one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtremumPair {
    /// The event of the extremum.
    pub extremum: u32,
    /// The event of the saddle.
    pub saddle: u32,
    /// The difference of their isovalues, units of the volume.
    pub persistence: f64,
}

/// All events of a volume and the contour tree between them.
#[derive(Clone, Debug)]
pub struct Topology {
    /// Every event, ascending.
    pub events: Vec<TopologyEvent>,
    /// Every arc, by birth, then death.
    pub arcs: Vec<Arc>,
    /// From isovalues to keys.
    keys: IsovalueKeys,
    /// Nodes of the contour tree are the events and the layer, which is the first or the last.
    layer: u32,
    layer_key: i128,
    join: MergeTree,
    split: MergeTree,
    depth: Vec<u32>,
    /// Per node: the shallowest node of its component of {f <= c} just above it.
    shallowest_below: Vec<u32>,
    /// Per node: the shallowest node of its component of {f > c} just below it.
    shallowest_above: Vec<u32>,
    /// Per node: the arc to its parent, or [`NONE`].
    arc_of_node: Vec<u32>,
    /// By the number of nodes below the isovalue: isosurface components, Euler characteristic.
    n_components: Vec<u32>,
    euler: Vec<i64>,
}

impl Topology {
    /// Finds every event and every arc of a volume.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the volume is too large for the node numbers (2^31 samples);
    /// [`Error::Internal`] if the events contradict each other.
    pub fn compute(field: &ExactField<'_>) -> Result<Self> {
        let CriticalPoints { points, falling, rising } = CriticalPoints::find(field)?;
        let join = MergeTree::sweep(Direction::Up, &points, falling)?;
        let split = MergeTree::sweep(Direction::Down, &points, rising)?;
        let outside = field.volume().outside();
        let tree = Tree::of(points, &join, &split, outside, field.isovalue_keys())?;
        Ok(Topology {
            keys: field.isovalue_keys(),
            layer: tree.layer,
            layer_key: tree.layer_key,
            shallowest_below: tree.contour.shallowest(&join, Direction::Up),
            shallowest_above: tree.contour.shallowest(&split, Direction::Down),
            depth: tree.contour.depth,
            arcs: tree.arcs,
            arc_of_node: tree.arc_of_node,
            n_components: tree.n_components,
            euler: tree.euler,
            events: tree.events,
            join,
            split,
        })
    }

    /// How many events have happened at an isovalue: `events[..n]` have.
    pub fn n_events_until(&self, isovalue: f64) -> usize {
        let key = self.keys.key(isovalue) << ORDER_BITS;
        self.events.partition_point(|e| e.key <= key)
    }

    /// The events of the volume as it is, ascending: [`Self::events`] without those that only the
    /// ramp makes, so that a plateau counts as what it does as a whole.
    pub fn net_events(&self) -> Vec<Event> {
        net::net_events(&self.events, &self.arcs)
    }

    /// Number of isosurface components. Below the layer's value and above all samples it is 0.
    pub fn n_components_at(&self, isovalue: f64) -> u32 {
        self.n_components[self.time(isovalue) as usize]
    }

    /// How many arcs show somewhere in a range.
    pub fn n_arcs_in(&self, range: (f64, f64)) -> usize {
        n_arcs_in(&self.arcs, range)
    }

    /// Euler characteristic of the isosurface, caps included; the total genus is
    /// `n_components_at - euler_at / 2`.
    pub fn euler_at(&self, isovalue: f64) -> i64 {
        self.euler[self.time(isovalue) as usize]
    }

    /// The arcs of all isosurface components at an isovalue, ascending.
    pub fn arcs_at(&self, isovalue: f64) -> Vec<usize> {
        let key = self.keys.key(isovalue) << ORDER_BITS;
        // Arcs are sorted by birth.
        let n_born = self.arcs.partition_point(|a| a.birth_key <= key);
        (0..n_born).filter(|&a| self.arcs[a].death_key > key).collect()
    }

    /// The arc, at an isovalue, of the isosurface component that crosses the lattice edge from
    /// `low_vertex` (its sample not above the isovalue) to `high_vertex` (above). Samples are
    /// numbered as in [`ExactField::vertex`]. `None` if they are not so.
    ///
    /// The edge, a falling walk from its low end to a minimum and a rising walk from its high end
    /// to a maximum cross the isovalue once, so the path between these two in the contour tree
    /// does too, in the arc looked for. The path below lies in one component of {f <= c}, the path
    /// above in one of {f > c}; the arc leads from the shallowest node of one to its parent.
    pub fn arc_of(&self, low_vertex: u32, high_vertex: u32, isovalue: f64) -> Option<usize> {
        let t = self.time(isovalue);
        let below = self.join.latest_node(self.join.representative_at(low_vertex, t), t)?;
        let above = self.split.latest_node(self.split.representative_at(high_vertex, t), t)?;
        let below = self.shallowest_below[below as usize];
        let above = self.shallowest_above[above as usize];
        let deeper =
            if self.depth[below as usize] > self.depth[above as usize] { below } else { above };
        let arc = self.arc_of_node[deeper as usize];
        (arc != NONE).then_some(arc as usize)
    }

    /// Every minimum and every maximum with the saddle that ends its component of {f <= c} or of
    /// {f > c}, minima first, each in the order of their events. The extremum whose component is
    /// left over at the end is in no pair: the layer on one side, on the other the last to vanish
    /// (or the first to emerge, where the layer is high).
    pub fn extremum_pairs(&self) -> Vec<ExtremumPair> {
        let of = |tree: &MergeTree, node: u32| {
            let saddle = self.event_of(tree.absorbed_at(node)?)?;
            let extremum = self.event_of(node)?;
            let persistence = self.events[saddle].isovalue - self.events[extremum].isovalue;
            Some(ExtremumPair {
                extremum: extremum as u32,
                saddle: saddle as u32,
                persistence: persistence.abs(),
            })
        };
        let nodes = 0..self.depth.len() as u32;
        let minima = nodes.clone().filter_map(|node| of(&self.join, node));
        minima.chain(nodes.filter_map(|node| of(&self.split, node))).collect()
    }

    /// How many components of {f <= c} and of {f > c} there are, the one with the layer included.
    pub fn n_sides_at(&self, isovalue: f64) -> (u32, u32) {
        let t = self.time(isovalue);
        (self.join.n_components_at(t), self.split.n_components_at(t))
    }

    /// The number of nodes not above an isovalue.
    fn time(&self, isovalue: f64) -> u32 {
        let key = self.keys.key(isovalue) << ORDER_BITS;
        self.n_events_until(isovalue) as u32 + u32::from(self.layer_key <= key)
    }

    /// The event of a node; `None` for the layer.
    fn event_of(&self, node: u32) -> Option<usize> {
        (node != self.layer).then(|| node as usize - usize::from(self.layer == 0))
    }
}

/// What both sweeps together tell.
struct Tree {
    contour: ContourTree,
    events: Vec<TopologyEvent>,
    arcs: Vec<Arc>,
    arc_of_node: Vec<u32>,
    n_components: Vec<u32>,
    euler: Vec<i64>,
    /// The node of the layer, and its key.
    layer: u32,
    layer_key: i128,
}

impl Tree {
    fn of(
        points: Vec<CriticalPoint>,
        join: &MergeTree,
        split: &MergeTree,
        outside: Outside,
        keys: IsovalueKeys,
    ) -> Result<Tree> {
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
        if points[layer as usize].place != Place::Layer {
            return Err(Error::internal("a critical point lies beyond the layer"));
        }
        let layer_key = points[layer as usize].key;
        let (arcs, arc_of_node) = arcs(&points, &contour, layer, keys);
        let events = events(points, &kinds);
        Ok(Tree { contour, events, arcs, arc_of_node, n_components, euler, layer, layer_key })
    }
}

/// How many arcs show somewhere in a range.
fn n_arcs_in(arcs: &[Arc], (low, high): (f64, f64)) -> usize {
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
            "{components} components with Euler characteristic {euler} are left behind the last event"
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

/// The critical points but the layer, with what changes in each.
fn events(points: Vec<CriticalPoint>, kinds: &[EventKind]) -> Vec<TopologyEvent> {
    points
        .into_iter()
        .zip(kinds)
        .filter(|(p, _)| p.place != Place::Layer)
        .map(|(p, &kind)| TopologyEvent {
            key: p.key,
            isovalue: p.isovalue,
            position: p.position,
            index: p.index,
            kind,
            place: p.place,
            low: p.low,
            high: p.high,
        })
        .collect()
}
