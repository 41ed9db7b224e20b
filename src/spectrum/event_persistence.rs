//! Which events matter: their persistence, estimated.
//!
//! # Theory
//!
//! An event that makes a component or a handle has a partner that ends it: emerge and merge, handle open and handle close, split and
//! vanish (the pairs of persistent homology; Edelsbrunner, Letscher, Zomorodian 2002). A spectrum does not store the pairs, which need
//! the samples. Here an event is paired with the nearest one of the other kind at a higher isovalue, near in isovalue and place,
//! nearest pairs first. Noise makes such pairs next to each other, so they are found; for pairs far apart the persistence is an estimate.

use crate::topology::{Event, EventKind};
use crate::volume::VolumeInfo;

/// An event is compared with at most so many events at higher isovalues, so that the time is proportional to their number.
const MAX_CANDIDATES: usize = 64;

/// The persistence of each event of a volume, in ascending order of isovalues: the isovalues between it and its partner, as a share of the range. Without a
/// partner they reach to the end of the range: the upper end if the event makes something, else the lower end.
pub fn event_persistence(
    events: &[Event],
    volume: &VolumeInfo,
    (low, high): (f64, f64),
) -> Vec<f64> {
    let range = high - low;
    let diagonal = volume.dims.map(|n| (n as f64).powi(2)).iter().sum::<f64>().sqrt();
    let share = |from: f64, to: f64| if range > 0.0 { (to - from) / range } else { 0.0 };
    let mut pairs = Vec::new();
    for (i, event) in events.iter().enumerate() {
        let Some(partner) = partner(event.kind) else { continue };
        let later = (i + 1..events.len()).filter(|&j| events[j].kind == partner);
        for j in later.take(MAX_CANDIDATES) {
            let other = &events[j];
            let squares = (0..3).map(|a| (event.position[a] - other.position[a]).powi(2));
            let distance = squares.sum::<f64>().sqrt() / diagonal;
            pairs.push((share(event.isovalue, other.isovalue) + distance, i, j));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut persistence: Vec<Option<f64>> = vec![None; events.len()];
    for (_, i, j) in pairs {
        if persistence[i].is_none() && persistence[j].is_none() {
            let of_both = share(events[i].isovalue, events[j].isovalue);
            (persistence[i], persistence[j]) = (Some(of_both), Some(of_both));
        }
    }
    let alone = |event: &Event| match partner(event.kind) {
        Some(_) => share(event.isovalue, high),
        None => share(low, event.isovalue),
    };
    persistence
        .iter()
        .zip(events)
        .map(|(pair, event)| pair.unwrap_or_else(|| alone(event)))
        .collect()
}

/// The numbers of the `n` events of the largest persistence, ascending.
pub fn most_persistent(persistence: &[f64], n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..persistence.len()).collect();
    order.sort_by(|&i, &j| persistence[j].total_cmp(&persistence[i]).then(i.cmp(&j)));
    order.truncate(n);
    order.sort_unstable();
    order
}

/// The kind of event that ends what an event makes; none for those that end something.
fn partner(kind: EventKind) -> Option<EventKind> {
    match kind {
        EventKind::Emerge => Some(EventKind::Merge),
        EventKind::HandleOpen => Some(EventKind::HandleClose),
        EventKind::Split => Some(EventKind::Vanish),
        EventKind::Merge | EventKind::HandleClose | EventKind::Vanish => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::phantom;

    fn event(isovalue: f64, x: f64, kind: EventKind) -> Event {
        Event { isovalue, position: [x, 0.0, 0.0], kind }
    }

    #[test]
    fn a_short_pair_in_one_place_is_found_inside_a_long_one() {
        let volume = phantom("blobs:16").expect("a phantom").info();
        let events = [
            event(10.0, 2.0, EventKind::Emerge),
            event(50.0, 12.0, EventKind::Emerge),
            event(51.0, 12.0, EventKind::Merge),
            event(60.0, 5.0, EventKind::Vanish),
            event(70.0, 3.0, EventKind::Merge),
            event(80.0, 9.0, EventKind::HandleOpen),
        ];
        let persistence = event_persistence(&events, &volume, (0.0, 100.0));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        let expected = [0.6, 0.01, 0.01, 0.6, 0.6, 0.2];
        assert!(persistence.iter().zip(expected).all(|(&a, b)| close(a, b)), "{persistence:?}");
        assert_eq!(most_persistent(&persistence, 3), [0, 3, 4]);
        assert_eq!(most_persistent(&persistence, 9).len(), 6);
    }
}
