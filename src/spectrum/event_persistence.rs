//! Which events matter: their persistence, estimated.
//!
//! # Theory
//!
//! An event that makes a component or a handle has a partner that ends it: emerge and merge, handle open and handle close, split and
//! vanish (the pairs of persistent homology; Edelsbrunner, Letscher, Zomorodian 2002). A spectrum does not store the pairs, which need
//! the samples. Here an event is paired with the nearest one of the other kind at a higher isovalue, near in isovalue and place,
//! nearest pairs first. Noise makes such pairs next to each other, so they are found; for pairs far apart the persistence is an estimate.
//!
//! Pairs are found scale by scale: in buckets of space that double in size, only pairs not farther apart than half of a bucket. Of what is
//! left, an event is paired with the last one of its kind before it that has no partner, as in merge trees.

use crate::topology::{Event, EventKind};
use crate::volume::VolumeInfo;

/// The sizes of buckets, voxels: noise makes pairs of neighbouring samples.
const BUCKETS: [f64; 4] = [4.0, 8.0, 16.0, 32.0];

/// An event is compared with at most so many events of a bucket, those that follow it by isovalue, so that the time is proportional to their number.
const MAX_CANDIDATES: usize = 16;

/// The kinds of events that make something.
const MAKERS: [EventKind; 3] = [EventKind::Emerge, EventKind::HandleOpen, EventKind::Split];

/// The persistence of each event of a volume, in ascending order of isovalues: the isovalues between it and its partner, as a share of the range. Without a
/// partner they reach to the end of the range: the upper end if the event makes something, else the lower end.
pub fn event_persistence(
    events: &[Event],
    volume: &VolumeInfo,
    (low, high): (f64, f64),
) -> Vec<f64> {
    let range = high - low;
    let share = |from: f64, to: f64| if range > 0.0 { (to - from) / range } else { 0.0 };
    let diagonal = volume.dims.map(|n| (n as f64).powi(2)).iter().sum::<f64>().sqrt();
    let distance = |a: &Event, b: &Event| {
        let squares = (0..3).map(|k| (a.position[k] - b.position[k]).powi(2));
        share(a.isovalue, b.isovalue) * diagonal + squares.sum::<f64>().sqrt()
    };
    let mut partners: Vec<Option<usize>> = vec![None; events.len()];
    for maker in MAKERS {
        for bucket in BUCKETS {
            pair_near(events, maker, bucket, &distance, &mut partners);
        }
        pair_last(events, maker, &mut partners);
    }
    let of = |(event, partner): (&Event, &Option<usize>)| match partner {
        Some(j) => share(event.isovalue, events[*j].isovalue).abs(),
        None if MAKERS.contains(&event.kind) => share(event.isovalue, high),
        None => share(low, event.isovalue),
    };
    events.iter().zip(&partners).map(of).collect()
}

/// Pairs events of a kind that have no partner with those that end them within half of a bucket, the nearest pairs first.
fn pair_near(
    events: &[Event],
    maker: EventKind,
    bucket: f64,
    distance: &dyn Fn(&Event, &Event) -> f64,
    partners: &mut [Option<usize>],
) {
    let alone = |kind: EventKind| {
        let is_alone = |&i: &usize| events[i].kind == kind && partners[i].is_none();
        (0..events.len()).filter(is_alone).collect::<Vec<usize>>()
    };
    let Some(end) = partner(maker) else { return };
    let mut ends: Vec<(u64, usize)> = alone(end)
        .into_iter()
        .map(|i| (key(events[i].position.map(|x| x / bucket), 0), i))
        .collect();
    ends.sort_unstable();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for i in alone(maker) {
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

/// Pairs events that end something and have no partner with the last event before that makes it and has none.
fn pair_last(events: &[Event], maker: EventKind, partners: &mut [Option<usize>]) {
    let mut open: Vec<usize> = Vec::new();
    for (j, event) in events.iter().enumerate() {
        if partners[j].is_some() {
            continue;
        }
        if event.kind == maker {
            open.push(j);
        } else if partner(maker) == Some(event.kind)
            && let Some(i) = open.pop()
        {
            (partners[i], partners[j]) = (Some(j), Some(i));
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
