//! Temporal coherence: how many triangles survive events, from the spectrum alone.
//!
//! *Just* before and after an event means a millionth of the range to either side, as for jumps:
//! triangles replaced within that count as replaced by the event.

use serde::Serialize;

use crate::spectrum::Spectrum;

/// Distance from an event to "just" before or after it, as a share of the range.
pub(super) const JUST: f64 = 1e-6;

/// Survival of triangles at the events of one isovalue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct EventCoherence {
    /// The isovalue.
    pub isovalue: f64,
    /// The number of events there.
    pub n_events: usize,
    /// Triangles alive just before.
    pub before: u64,
    /// Triangles alive just after.
    pub after: u64,
    /// Triangles alive just before that are also alive just after.
    pub survived: u64,
}

/// Survival of triangles at events, over the whole range.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Coherence {
    /// Of the triangles alive just before an event, summed over the events, the share alive just
    /// after; `None` where there are none.
    pub survived_share: Option<f64>,
    /// Lifetimes that begin or end just at an event, as a share of all that do.
    pub changes_at_events_share: Option<f64>,
    /// Every isovalue with events inside the range, ascending.
    pub events: Vec<EventCoherence>,
}

/// The intervals of ranks just around the events of one isovalue.
#[derive(Clone)]
struct Window {
    isovalue: f64,
    n_events: usize,
    /// The number of ranks before it, and of those before its end.
    from: usize,
    to: usize,
}

/// When triangles are born and die. Lifetimes are added one by one, in any order.
#[derive(Clone)]
pub(super) struct Lifetimes {
    range: (f64, f64),
    /// Isovalues of events, increasing.
    events: Vec<f64>,
    isovalues: Vec<f64>,
    /// Per rank: triangles born at it; triangles that die at it.
    born: Vec<u64>,
    dead: Vec<u64>,
    /// By isovalue.
    windows: Vec<Window>,
    /// Per rank: the windows that begin at or before it; those that end at or before it.
    begun: Vec<u32>,
    ended: Vec<u32>,
    /// By window, triangles alive before it that die in it, minus those of the window before.
    lost: Vec<i64>,
}

impl Lifetimes {
    /// No lifetimes yet, of the spectrum with this range and these events, whose ranks have these isovalues.
    pub(super) fn new(about: &Spectrum, isovalues: Vec<f64>) -> Self {
        let (low, high) = about.range();
        let just = JUST * (high - low);
        let mut events: Vec<f64> = about.events().iter().map(|e| e.isovalue).collect();
        events.sort_by(f64::total_cmp);
        let ranks_until = |isovalue: f64| isovalues.partition_point(|&c| c <= isovalue);
        let is_inside = |c: f64| c - just > low && c + just < high;
        let windows =
            events.chunk_by(|a, b| a == b).filter(|same| is_inside(same[0])).map(|same| {
                let (from, to) = (ranks_until(same[0] - just), ranks_until(same[0] + just));
                Window { isovalue: same[0], n_events: same.len(), from, to }
            });
        let windows: Vec<Window> = windows.collect();
        let n = isovalues.len();
        let at_or_before = |of: fn(&Window) -> usize| {
            let count = |rank: usize| windows.partition_point(|w| of(w) <= rank) as u32;
            (0..n).map(count).collect()
        };
        let (begun, ended) = (at_or_before(|w| w.from), at_or_before(|w| w.to));
        let lost = vec![0; windows.len() + 1];
        let (born, dead) = (vec![0; n], vec![0; n]);
        let range = (low, high);
        Lifetimes { range, events, isovalues, born, dead, windows, begun, ended, lost }
    }

    /// Adds a triangle by the ranks of its birth and its death.
    pub(super) fn add(&mut self, birth: u32, death: u32) {
        let (birth, death) = (birth as usize, death as usize);
        self.born[birth] += 1;
        self.dead[death] += 1;
        // It dies in the windows that have begun and not ended, and is alive before those that begin after its birth.
        let first = self.ended[death].max(self.begun[birth]);
        let end = self.begun[death];
        if first < end {
            self.lost[first as usize] += 1;
            self.lost[end as usize] -= 1;
        }
    }

    /// The coherence of the spectrum at its events.
    pub(super) fn coherence(&self) -> Coherence {
        // Triangles born and dead in the first ranks.
        let summed = |counts: &[u64]| {
            let sums = counts.iter().scan(0, |sum, n| {
                *sum += n;
                Some(*sum)
            });
            std::iter::once(0).chain(sums).collect::<Vec<u64>>()
        };
        let (born, dead) = (summed(&self.born), summed(&self.dead));
        let changes_in = |from: usize, to: usize| born[to] - born[from] + dead[to] - dead[from];
        let mut found = Coherence::default();
        // The windows may overlap; each change counts once.
        let (mut changes, mut counted, mut lost) = (0, 0, 0);
        for (window, more_lost) in self.windows.iter().zip(&self.lost) {
            let &Window { isovalue, n_events, from, to } = window;
            changes += changes_in(from.max(counted).min(to), to);
            counted = to.max(counted);
            lost += more_lost;
            let [before, after] = [from, to].map(|ranks| born[ranks] - dead[ranks]);
            let survived = before - lost as u64;
            found.events.push(EventCoherence { isovalue, n_events, before, after, survived });
        }
        let sum = |of: fn(&EventCoherence) -> u64| found.events.iter().map(of).sum::<u64>();
        let (before, survived) = (sum(|e| e.before), sum(|e| e.survived));
        found.survived_share = (before > 0).then(|| survived as f64 / before as f64);
        let all = changes_in(0, self.isovalues.len());
        found.changes_at_events_share = (all > 0).then(|| changes as f64 / all as f64);
        found
    }

    /// Isovalues just before and just after those at which most triangles are born
    /// or die, away from events; at most `n` pairs, ascending.
    pub(super) fn busiest_elsewhere(&self, n: usize) -> Vec<(f64, f64)> {
        let (low, high) = self.range;
        let just = JUST * (high - low);
        let is_near_event = |c: f64| {
            let next = self.events.partition_point(|&e| e < c - 2.0 * just);
            self.events.get(next).is_some_and(|&e| e <= c + 2.0 * just)
        };
        let changes = |r: usize| self.born[r] + self.dead[r];
        let mut ranks: Vec<usize> = (0..self.isovalues.len())
            .filter(|&r| {
                let c = self.isovalues[r];
                changes(r) > 0 && c - just > low && c + just < high && !is_near_event(c)
            })
            .collect();
        ranks.sort_by_key(|&r| (std::cmp::Reverse(changes(r)), r));
        ranks.truncate(n);
        ranks.sort_unstable();
        ranks.into_iter().map(|r| self.isovalues[r]).map(|c| (c - just, c + just)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::{About, Event, EventKind, Patch, VolumeInfo};
    use crate::volume::{Outside, Placement};

    /// Triangles by birth and death in ranks, one rank for each whole isovalue from 0 to 10.
    fn of(lives: &[(u32, u32)], events: &[f64]) -> Lifetimes {
        let event = |&isovalue: &f64| Event {
            isovalue,
            position: [0.0; 3],
            kind: EventKind::Merge,
            persistence: None,
        };
        let info = VolumeInfo {
            name: "v".into(),
            dims: [2; 3],
            sample_type: "uint8".into(),
            range: (0.0, 10.0),
            placement: Placement::default(),
            outside: Outside::Low,
        };
        let events = events.iter().map(event).collect();
        let about = About { events, ..About::new(info, (0.0, 10.0), 0.1) };
        let about = Spectrum::unchecked(about, Patch::empty());
        let mut lifetimes = Lifetimes::new(&about, (0..=10).map(f64::from).collect());
        lives.iter().for_each(|&(birth, death)| lifetimes.add(birth, death));
        lifetimes
    }

    #[test]
    fn triangles_alive_on_both_sides_of_an_event_survive_it() {
        // At 5: one dies, two live on, one is born; one has died before.
        let found = of(&[(0, 5), (0, 9), (3, 7), (5, 8), (1, 4)], &[5.0, 5.0]).coherence();
        let [at] = found.events[..] else { panic!("{found:?}") };
        assert_eq!((at.n_events, at.before, at.after, at.survived), (2, 3, 3, 2));
        assert_eq!(found.survived_share, Some(2.0 / 3.0));
        // Of the ten ends of lifetimes two lie there.
        assert_eq!(found.changes_at_events_share, Some(0.2));
    }

    #[test]
    fn births_and_deaths_away_from_events_are_elsewhere() {
        let lifetimes = of(&[(0, 5), (2, 9), (2, 5), (3, 5)], &[5.0]);
        let pairs = lifetimes.busiest_elsewhere(1);
        let [(before, after)] = pairs[..] else { panic!("{pairs:?}") };
        assert!(before < 2.0 && 2.0 < after);
        assert_eq!(lifetimes.busiest_elsewhere(10).len(), 3);
    }

    #[test]
    fn without_events_there_is_no_survival() {
        let found = of(&[(0, 9)], &[]).coherence();
        assert_eq!((found.survived_share, found.events.len()), (None, 0));
        assert_eq!(found.changes_at_events_share, Some(0.0));
    }
}
