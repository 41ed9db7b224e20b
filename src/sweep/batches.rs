//! Events that cannot be told apart by their isovalue are one batch.
//!
//! The exact topology orders events by a field whose ties are broken by an invisible ramp. Saddles
//! between tied samples then lie a trace beside the samples' value; between two isovalues so close
//! nothing is ever shown, so all of a batch happens at one isovalue.

use crate::topology::Topology;
use crate::topology::critical::Place;

/// Events closer together than this share of the range happen at one isovalue.
const BATCH_SHARE: f64 = 1e-9;

/// The isovalue at which each event is taken to happen, in the order of [`Topology::events`]: that
/// of a sample in its batch if there is one, else the lowest of the batch.
pub(super) fn batched_isovalues(topology: &Topology, range: (f64, f64)) -> Vec<f64> {
    let tolerance = BATCH_SHARE * (range.1 - range.0);
    let mut order: Vec<usize> = (0..topology.events.len()).collect();
    order.sort_by(|&a, &b| topology.events[a].isovalue.total_cmp(&topology.events[b].isovalue));
    let mut batched = vec![0.0; order.len()];
    for batch in order
        .chunk_by(|&a, &b| topology.events[b].isovalue - topology.events[a].isovalue < tolerance)
    {
        let of_sample =
            batch.iter().find(|&&e| matches!(topology.events[e].place, Place::Vertex(_)));
        let isovalue = topology.events[*of_sample.unwrap_or(&batch[0])].isovalue;
        for &e in batch {
            batched[e] = isovalue;
        }
    }
    batched
}
