//! Where arcs of the contour tree meet, as far as it shows: nodes between shown arcs.
//!
//! Events of one batch that are joined by arcs which never show happen together, so they are one
//! node, at one isovalue, with the arcs that end and the arcs that begin there.

use super::Sweep;
use crate::disjoint_sets::DisjointSets;

/// Some events at one isovalue and the arcs they join.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    /// Where it happens.
    pub(super) isovalue: f64,
    /// The arcs that show just below, ascending.
    pub(super) below: Vec<usize>,
    /// The arcs that show just above, ascending.
    pub(super) above: Vec<usize>,
    /// The events, as indices into the topology's.
    pub(super) events: Vec<u32>,
}

/// The nodes of a sweep, and those at the two ends of every arc.
pub(super) struct Graph {
    pub(super) nodes: Vec<Node>,
    /// Per arc: the node at its lower and at its upper end, where it is inside the range.
    pub(super) ends: Vec<[Option<usize>; 2]>,
}

impl Graph {
    /// The graph of the arcs that show inside the range.
    pub(super) fn new(sweep: &Sweep) -> Graph {
        let arcs = &sweep.topology.arcs;
        let isovalues = &sweep.event_isovalues;
        let mut sets = DisjointSets::new(isovalues.len());
        for arc in arcs {
            if let (Some(birth), Some(death)) = (arc.birth_event, arc.death_event)
                && isovalues[birth as usize] >= isovalues[death as usize]
            {
                sets.join(birth, death);
            }
        }
        let mut node_of = vec![usize::MAX; isovalues.len()];
        let mut nodes: Vec<Node> = Vec::new();
        let mut ends = vec![[None; 2]; arcs.len()];
        for (a, arc) in arcs.iter().enumerate() {
            let (low, high) = sweep.shown(arc);
            if low >= high {
                continue;
            }
            for (side, event) in [arc.birth_event, arc.death_event].into_iter().enumerate() {
                let Some(event) = event else { continue };
                let isovalue = isovalues[event as usize];
                if isovalue <= sweep.range.0 || isovalue >= sweep.range.1 {
                    continue;
                }
                let node = &mut node_of[sets.find(event) as usize];
                if *node == usize::MAX {
                    *node = nodes.len();
                    let (below, above, events) = Default::default();
                    nodes.push(Node { isovalue, below, above, events });
                }
                let n = &mut nodes[*node];
                if side == 0 {
                    n.above.push(a);
                } else {
                    n.below.push(a);
                }
                ends[a][side] = Some(*node);
            }
        }
        for event in 0..isovalues.len() as u32 {
            let node = node_of[sets.find(event) as usize];
            if node != usize::MAX {
                nodes[node].events.push(event);
            }
        }
        Graph { nodes, ends }
    }
}
