//! Events of the volume without the ramp: those that only the ramp makes are removed.
//!
//! # Theory
//!
//! On a plateau the ramp makes many events at one isovalue that cancel each other. Between them are
//! arcs of the contour tree as short as the ramp. Contract those: every cluster of events becomes
//! one node of the contour tree without the ramp, whose arcs have a length. The arcs determine the
//! net events: with d arcs below and u above, d - 1 merges and u - 1 splits (or an emergence, if
//! d = 0, or a vanishing, if u = 0), and the rest of the change of the Euler characteristic is
//! handles that open or close. A cluster with one arc on either side and no such change is not an
//! event.
//!
//! This is the shortest list of events with this effect: it does not include a handle that opens and
//! closes at one isovalue.
//!
//! Their persistence is that of pairs of an extremum and a saddle in different clusters, of which the persistence is not 0.

use super::arcs::Arc;
use super::event::{Event, EventKind, TopologyEvent};
use super::pairs::ExtremumPair;

/// Events joined by arcs that only the ramp makes.
#[derive(Clone, Default)]
struct EventCluster {
    n_below: u32,
    n_above: u32,
    /// Euler characteristic above minus that below.
    euler_change: i64,
    /// Members, ascending.
    events: Vec<u32>,
    /// The pairs of which one event is here: what happens to their component here, and their persistence; the largest first.
    pairs: Vec<(EventKind, f64)>,
}

/// The events without the ramp, ascending; within a cluster emergences come first, then merges,
/// handles, splits, vanishings. Each has the position of the first event of its kind.
pub(super) fn net_events(
    events: &[TopologyEvent],
    arcs: &[Arc],
    pairs: &[ExtremumPair],
) -> Vec<Event> {
    let mut net: Vec<(usize, Event)> = Vec::new();
    for cluster in clusters(events, arcs, pairs) {
        let Some(&last) = cluster.events.last() else { continue };
        let isovalue = events[last as usize].isovalue;
        for (kind, n) in cluster.changes() {
            let of_kind =
                cluster.events.iter().find(|&&e| events[e as usize].kind == kind).unwrap_or(&last);
            let position = events[*of_kind as usize].position;
            let mut persistence = cluster.persistence(kind);
            net.extend((0..n).map(|_| {
                let persistence = persistence.next();
                (last as usize, Event { isovalue, position, kind, persistence })
            }));
        }
    }
    // Stable: the order within a cluster stays.
    net.sort_by_key(|(last, _)| *last);
    net.into_iter().map(|(_, event)| event).collect()
}

impl EventCluster {
    /// The persistence of its net events of a kind, as far as it is known.
    fn persistence(&self, kind: EventKind) -> impl Iterator<Item = f64> {
        self.pairs.iter().filter(move |pair| pair.0 == kind).map(|pair| pair.1)
    }

    /// The net events: kinds and numbers.
    fn changes(&self) -> [(EventKind, u32); 6] {
        let emerges = u32::from(self.n_below == 0 && self.n_above > 0);
        let vanishes = u32::from(self.n_above == 0 && self.n_below > 0);
        let merges = self.n_below.saturating_sub(1);
        let splits = self.n_above.saturating_sub(1);
        let euler_of_components =
            2 * (emerges as i64 + splits as i64 - merges as i64 - vanishes as i64);
        let handles = (self.euler_change - euler_of_components) / 2;
        [
            (EventKind::Emerge, emerges),
            (EventKind::Merge, merges),
            (EventKind::HandleOpen, (-handles).max(0) as u32),
            (EventKind::HandleClose, handles.max(0) as u32),
            (EventKind::Split, splits),
            (EventKind::Vanish, vanishes),
        ]
    }
}

/// The clusters with the arcs that leave them, and the pairs that do.
fn clusters(events: &[TopologyEvent], arcs: &[Arc], pairs: &[ExtremumPair]) -> Vec<EventCluster> {
    let n_events = events.len();
    let mut parent: Vec<u32> = (0..n_events as u32).collect();
    let find = |parent: &mut Vec<u32>, mut i: u32| {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    };
    for arc in arcs.iter().filter(|a| a.ramp_only) {
        if let (Some(a), Some(b)) = (arc.birth_event, arc.death_event) {
            let (a, b) = (find(&mut parent, a), find(&mut parent, b));
            parent[a as usize] = b;
        }
    }
    let mut clusters = vec![EventCluster::default(); n_events];
    for i in 0..n_events as u32 {
        clusters[find(&mut parent, i) as usize].events.push(i);
    }
    for arc in arcs.iter().filter(|a| !a.ramp_only) {
        if let Some(birth) = arc.birth_event {
            let cluster = &mut clusters[find(&mut parent, birth) as usize];
            cluster.n_above += 1;
            cluster.euler_change += arc.euler;
        }
        if let Some(death) = arc.death_event {
            let cluster = &mut clusters[find(&mut parent, death) as usize];
            cluster.n_below += 1;
            cluster.euler_change -= arc.euler;
        }
    }
    for pair in pairs.iter().filter(|pair| pair.persistence > 0.0) {
        let [extremum, saddle] = [pair.extremum, pair.saddle].map(|e| find(&mut parent, e));
        let (begins, ends) = match events[pair.extremum as usize].index {
            0 => ((extremum, EventKind::Emerge), (saddle, EventKind::Merge)),
            _ => ((saddle, EventKind::Split), (extremum, EventKind::Vanish)),
        };
        for (cluster, kind) in [begins, ends] {
            clusters[cluster as usize].pairs.push((kind, pair.persistence));
        }
    }
    clusters.iter_mut().for_each(|cluster| cluster.pairs.sort_by(|a, b| b.1.total_cmp(&a.1)));
    clusters
}
