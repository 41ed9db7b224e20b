//! Pairs of an extremum and a saddle, by the merge trees.

use super::event::TopologyEvent;
use super::merge::MergeTree;

/// An extremum and the saddle at which its component merges with an older one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtremumPair {
    /// The event of the extremum.
    pub extremum: u32,
    /// The event of the saddle.
    pub saddle: u32,
    /// The difference of their isovalues, units of the volume.
    pub persistence: f64,
}

/// Every minimum and every maximum with the saddle that ends its component of {f <= c} or of {f > c}, by the trees of minima and maxima.
/// Nodes are the events and the layer, which is the first or the last.
pub(super) fn extremum_pairs(
    events: &[TopologyEvent],
    layer: u32,
    [join, split]: [&MergeTree; 2],
) -> Vec<ExtremumPair> {
    let event_of = |node: u32| (node != layer).then(|| node as usize - usize::from(layer == 0));
    let pair = |tree: &MergeTree, node: u32| {
        let saddle = event_of(tree.absorbed_at(node)?)?;
        let extremum = event_of(node)?;
        let persistence = (events[saddle].isovalue - events[extremum].isovalue).abs();
        Some(ExtremumPair { extremum: extremum as u32, saddle: saddle as u32, persistence })
    };
    let nodes = 0..events.len() as u32 + 1;
    let minima = nodes.clone().filter_map(|node| pair(join, node));
    minima.chain(nodes.filter_map(|node| pair(split, node))).collect()
}
