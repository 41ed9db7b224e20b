//! All events and arcs of a volume, by isovalue.

use super::arcs::{Arc, ArcTree, n_arcs_in};
use super::critical::CriticalPoints;
use super::event::{Event, TopologyEvent};
use super::exact::{ExactField, IsovalueKeys, ORDER_BITS};
use super::merge::{Direction, MergeTree, NONE};
use super::net::net_events;
use super::pairs::{ExtremumPair, extremum_pairs};
use crate::error::Result;

/// All events of a volume and the contour tree between them.
#[derive(Clone, Debug)]
pub struct Topology {
    /// Every event, ascending.
    pub events: Vec<TopologyEvent>,
    /// Every arc, by birth, then death.
    pub arcs: Vec<Arc>,
    /// Maps isovalues to keys.
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
        Self::compute_with_progress(field, &|_| {})
    }

    /// As [`Topology::compute`]; `report` receives the fraction that is done.
    ///
    /// # Errors
    ///
    /// As [`Topology::compute`].
    pub fn compute_with_progress(field: &ExactField<'_>, report: &dyn Fn(f64)) -> Result<Self> {
        report(0.0);
        let CriticalPoints { points, falling, rising } = CriticalPoints::find(field)?;
        report(0.5);
        let join = MergeTree::sweep(Direction::Up, &points, falling)?;
        report(0.65);
        let split = MergeTree::sweep(Direction::Down, &points, rising)?;
        report(0.8);
        let outside = field.volume().outside();
        let tree = ArcTree::of(points, &join, &split, outside, field.isovalue_keys())?;
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

    /// Number of events up to an isovalue: `events[..n]` have happened.
    pub fn n_events_until(&self, isovalue: f64) -> usize {
        let key = self.keys.key(isovalue) << ORDER_BITS;
        self.events.partition_point(|e| e.key <= key)
    }

    /// The events of the volume without the ramp, ascending: those of [`Self::events`] that only the
    /// ramp makes are removed, so a plateau has its net effect.
    pub fn net_events(&self) -> Vec<Event> {
        net_events(&self.events, &self.arcs, &self.extremum_pairs())
    }

    /// Number of isosurface components. Below the layer's value and above all samples it is 0.
    pub fn n_components_at(&self, isovalue: f64) -> u32 {
        self.n_components[self.time(isovalue) as usize]
    }

    /// Number of arcs that exist somewhere in a range.
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
    /// numbered as in [`ExactField::vertex`]. `None` if the samples are on other sides.
    ///
    /// The edge, a falling walk from its low end to a minimum and a rising walk from its high end
    /// to a maximum cross the isovalue once. So does the path between these two in the contour tree,
    /// in the arc in question. The path below is in one component of {f <= c}, the path above in
    /// one of {f > c}; the arc leads from the shallowest node of one of them to its parent.
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
    /// {f > c}, minima first, each in the order of their events. The extremum of the last component
    /// has no pair: the layer on one side, on the other the last to vanish (or the first to emerge,
    /// if the layer is high).
    pub fn extremum_pairs(&self) -> Vec<ExtremumPair> {
        extremum_pairs(&self.events, self.layer, [&self.join, &self.split])
    }

    /// Number of nodes not above an isovalue.
    fn time(&self, isovalue: f64) -> u32 {
        let key = self.keys.key(isovalue) << ORDER_BITS;
        self.n_events_until(isovalue) as u32 + u32::from(self.layer_key <= key)
    }
}
