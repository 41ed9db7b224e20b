//! Which events matter: their persistence.
//!
//! # Theory
//!
//! An event that makes a component or a handle has a partner that ends it: emerge and merge, split and vanish, handle open and handle close (the
//! pairs of persistent homology; Edelsbrunner, Letscher, Zomorodian 2002). Events of components know their persistence
//! ([`Event::persistence`]). That of handles needs more than merge trees, so it is estimated: a handle that opens is paired with the nearest one that
//! closes at a higher isovalue, near in isovalue and place, nearest pairs first. Noise makes such pairs next to each other, so they are
//! found.
//!
//! Pairs are found scale by scale: in buckets of space that double in size, only pairs not farther apart than half of a bucket. Of what is
//! left, a handle that closes is paired with the last one before that has opened and has no partner.

use crate::topology::{Event, EventKind};
use crate::volume::VolumeInfo;

/// The sizes of buckets, voxels: noise makes pairs of neighbouring samples.
const BUCKETS: [f64; 4] = [4.0, 8.0, 16.0, 32.0];

/// An event is compared with at most so many events of a bucket, those that follow it by isovalue, so that the time is proportional to their number.
const MAX_CANDIDATES: usize = 16;

/// The persistence of each event of a volume, in ascending order of isovalues, as a share of the range: that of the event if it is known, for handles an
/// estimate. Without a partner it reaches to the end of the range: the upper end if the event makes something, else the lower end; it is 0 for a handle whose
/// partner is not known.
pub fn event_persistence(
    events: &[Event],
    volume: &VolumeInfo,
    (low, high): (f64, f64),
) -> Vec<f64> {
    let range = high - low;
    let share = |persistence: f64| if range > 0.0 { persistence / range } else { 0.0 };
    let diagonal = volume.dims.map(|n| (n as f64).powi(2)).iter().sum::<f64>().sqrt();
    let distance = |a: &Event, b: &Event| {
        let squares = (0..3).map(|k| (a.position[k] - b.position[k]).powi(2));
        share(b.isovalue - a.isovalue) * diagonal + squares.sum::<f64>().sqrt()
    };
    let mut partners: Vec<Option<usize>> = vec![None; events.len()];
    for bucket in BUCKETS {
        pair_near(events, bucket, &distance, &mut partners);
    }
    pair_last(events, &mut partners);
    let of = |(event, partner): (&Event, &Option<usize>)| {
        let partner = partner.map(|j| (event.isovalue - events[j].isovalue).abs());
        share(event.persistence.or(partner).unwrap_or(match event.kind {
            // Every handle that opens closes: in the volume's range its partner was paired with another one.
            EventKind::HandleOpen if high >= volume.range.1 => 0.0,
            EventKind::HandleClose if low <= volume.range.0 => 0.0,
            EventKind::Emerge | EventKind::HandleOpen | EventKind::Split => high - event.isovalue,
            EventKind::Merge | EventKind::HandleClose | EventKind::Vanish => event.isovalue - low,
        }))
    };
    events.iter().zip(&partners).map(of).collect()
}

/// Pairs handles that open and have no partner with those that close within half of a bucket, the nearest pairs first.
fn pair_near(
    events: &[Event],
    bucket: f64,
    distance: &dyn Fn(&Event, &Event) -> f64,
    partners: &mut [Option<usize>],
) {
    let alone = |kind: EventKind| {
        let is_alone = |&i: &usize| events[i].kind == kind && partners[i].is_none();
        (0..events.len()).filter(is_alone).collect::<Vec<usize>>()
    };
    let mut ends: Vec<(u64, usize)> = alone(EventKind::HandleClose)
        .into_iter()
        .map(|i| (key(events[i].position.map(|x| x / bucket), 0), i))
        .collect();
    ends.sort_unstable();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for i in alone(EventKind::HandleOpen) {
        // Eight buckets contain all that is within half of a bucket.
        let place = events[i].position.map(|x| x / bucket - 0.5);
        for key in (0..8).map(|corner| key(place, corner)) {
            let from = ends.partition_point(|end| *end <= (key, i));
            let inside = ends[from..].iter().take_while(|end| end.0 == key);
            let pairs_of =
                inside.take(MAX_CANDIDATES).map(|&(_, j)| (distance(&events[i], &events[j]), i, j));
            pairs.extend(pairs_of.filter(|pair| pair.0 <= 0.5 * bucket));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    for (_, i, j) in pairs {
        if partners[i].is_none() && partners[j].is_none() {
            (partners[i], partners[j]) = (Some(j), Some(i));
        }
    }
}

/// The bucket of a position in buckets, or one of those after it: along x, y and z if bits 0, 1 and 2 of `corner` are set.
fn key(position: [f64; 3], corner: i64) -> u64 {
    const BITS: u32 = 21;
    let along = |axis: usize| {
        let index = position[axis].floor() as i64 + (corner >> axis & 1) + (1 << (BITS - 1));
        index as u64 & ((1 << BITS) - 1)
    };
    along(0) << (2 * BITS) | along(1) << BITS | along(2)
}

/// Pairs handles that close and have no partner with the last one before that has opened and has none.
fn pair_last(events: &[Event], partners: &mut [Option<usize>]) {
    let mut open: Vec<usize> = Vec::new();
    let n = partners.len();
    for j in (0..n).filter(|&j| partners[j].is_none()).collect::<Vec<usize>>() {
        match events[j].kind {
            EventKind::HandleOpen => open.push(j),
            EventKind::HandleClose => {
                if let Some(i) = open.pop() {
                    (partners[i], partners[j]) = (Some(j), Some(i));
                }
            }
            _ => {}
        }
    }
}

/// The numbers of the `n` events of the largest persistence, ascending.
pub fn most_persistent(persistence: &[f64], n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..persistence.len()).collect();
    order.sort_by(|&i, &j| persistence[j].total_cmp(&persistence[i]).then(i.cmp(&j)));
    order.truncate(n);
    order.sort_unstable();
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::phantom;

    fn handle(isovalue: f64, x: f64, kind: EventKind) -> Event {
        Event { isovalue, position: [x, 0.0, 0.0], kind, persistence: None }
    }

    #[test]
    fn a_short_pair_of_handles_in_one_place_is_found_inside_a_long_one() {
        let mut volume = phantom("blobs:16").expect("a phantom").info();
        let (open, close) = (EventKind::HandleOpen, EventKind::HandleClose);
        let emerges = Event { persistence: Some(35.0), ..handle(5.0, 0.0, EventKind::Emerge) };
        let events = [
            emerges,
            handle(10.0, 2.0, open),
            handle(50.0, 12.0, open),
            handle(51.0, 12.0, close),
            handle(60.0, 5.0, EventKind::Vanish),
            handle(70.0, 3.0, close),
            handle(80.0, 9.0, open),
        ];
        volume.range = (-1.0, 101.0);
        let persistence = event_persistence(&events, &volume, (0.0, 100.0));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        let expected = [0.35, 0.6, 0.01, 0.01, 0.6, 0.6, 0.2];
        assert!(persistence.iter().zip(expected).all(|(&a, b)| close(a, b)), "{persistence:?}");
        assert_eq!(most_persistent(&persistence, 3), [1, 4, 5]);
        assert_eq!(most_persistent(&persistence, 9).len(), 7);
        // The last handle has no partner in all of the volume's range.
        volume.range = (0.0, 100.0);
        assert_eq!(event_persistence(&events, &volume, (0.0, 100.0))[6], 0.0);
    }
}
