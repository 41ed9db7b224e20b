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

/// Lifetimes by rank.
struct Lifetimes<'a> {
    spectrum: &'a Spectrum,
    /// Per rank: triangles born at it, or before; triangles dead at it, or before.
    born: Vec<u64>,
    dead: Vec<u64>,
    /// Births of the triangles, sorted by the rank of their death.
    births: Vec<u32>,
}

impl<'a> Lifetimes<'a> {
    fn of(spectrum: &'a Spectrum) -> Self {
        let n = spectrum.isovalues().len();
        let (mut born, mut dead) = (vec![0u64; n], vec![0u64; n]);
        for triangle in spectrum.triangles() {
            born[triangle.birth as usize] += 1;
            dead[triangle.death as usize] += 1;
        }
        for r in 1..n {
            born[r] += born[r - 1];
            dead[r] += dead[r - 1];
        }
        let mut by_death: Vec<(u32, u32)> =
            spectrum.triangles().iter().map(|t| (t.death, t.birth)).collect();
        by_death.sort_unstable();
        Lifetimes { spectrum, born, dead, births: by_death.into_iter().map(|t| t.1).collect() }
    }

    /// The number of ranks at or below an isovalue.
    fn ranks_until(&self, isovalue: f64) -> usize {
        self.spectrum.isovalues().partition_point(|&c| c <= isovalue)
    }

    /// Alive, born so far and dead so far after the first `ranks` ranks.
    fn after(&self, ranks: usize) -> (u64, u64, u64) {
        let last = ranks.checked_sub(1);
        let (born, dead) = last.map_or((0, 0), |r| (self.born[r], self.dead[r]));
        (born - dead, born, dead)
    }

    /// Of the triangles alive after `from` ranks, those alive after `to` ranks.
    fn survived(&self, from: usize, to: usize) -> u64 {
        let ((alive, _, dead_before), (_, _, dead_after)) = (self.after(from), self.after(to));
        let died = &self.births[dead_before as usize..dead_after as usize];
        alive - died.iter().filter(|&&birth| (birth as usize) < from).count() as u64
    }
}

/// The coherence of a spectrum at its events.
pub(super) fn coherence(spectrum: &Spectrum) -> Coherence {
    let (low, high) = spectrum.range();
    let just = JUST * (high - low);
    let lifetimes = Lifetimes::of(spectrum);
    let mut isovalues: Vec<f64> = spectrum.events().iter().map(|e| e.isovalue).collect();
    isovalues.retain(|c| c - just > low && c + just < high);
    isovalues.sort_by(f64::total_cmp);
    let mut found = Coherence::default();
    // The intervals around events may overlap; each change counts once.
    let (mut changes, mut counted) = (0, 0);
    for same in isovalues.chunk_by(|a, b| a == b) {
        let isovalue = same[0];
        let from = lifetimes.ranks_until(isovalue - just);
        let to = lifetimes.ranks_until(isovalue + just);
        let (before, after) = (lifetimes.after(from), lifetimes.after(to));
        let start = lifetimes.after(from.max(counted).min(to));
        changes += after.1 - start.1 + after.2 - start.2;
        counted = to.max(counted);
        found.events.push(EventCoherence {
            isovalue,
            n_events: same.len(),
            before: before.0,
            after: after.0,
            survived: lifetimes.survived(from, to),
        });
    }
    let sum = |of: fn(&EventCoherence) -> u64| found.events.iter().map(of).sum::<u64>();
    let (before, survived) = (sum(|e| e.before), sum(|e| e.survived));
    found.survived_share = (before > 0).then(|| survived as f64 / before as f64);
    let all = 2 * spectrum.triangles().len();
    found.changes_at_events_share = (all > 0).then(|| changes as f64 / all as f64);
    found
}

/// Isovalues just before and just after those at which most triangles are born
/// or die, away from events; at most `n` pairs, ascending.
pub(super) fn busiest_elsewhere(spectrum: &Spectrum, n: usize) -> Vec<(f64, f64)> {
    let (low, high) = spectrum.range();
    let just = JUST * (high - low);
    let mut events: Vec<f64> = spectrum.events().iter().map(|e| e.isovalue).collect();
    events.sort_by(f64::total_cmp);
    let is_near_event = |c: f64| {
        let next = events.partition_point(|&e| e < c - 2.0 * just);
        events.get(next).is_some_and(|&e| e <= c + 2.0 * just)
    };
    let mut changes = vec![0u64; spectrum.isovalues().len()];
    for triangle in spectrum.triangles() {
        changes[triangle.birth as usize] += 1;
        changes[triangle.death as usize] += 1;
    }
    let mut ranks: Vec<usize> = (0..changes.len())
        .filter(|&r| {
            let c = spectrum.isovalues()[r];
            changes[r] > 0 && c - just > low && c + just < high && !is_near_event(c)
        })
        .collect();
    ranks.sort_by_key(|&r| (std::cmp::Reverse(changes[r]), r));
    ranks.truncate(n);
    ranks.sort_unstable();
    ranks.into_iter().map(|r| spectrum.isovalues()[r]).map(|c| (c - just, c + just)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::{About, Event, EventKind, Patch, Triangle, VolumeInfo};
    use crate::volume::{Outside, Placement};

    /// Triangles by birth and death in ranks, one rank for each whole isovalue from 0 to 10.
    fn spectrum(lifetimes: &[(u32, u32)], events: &[f64]) -> Spectrum {
        let triangle = |&(birth, death): &(u32, u32)| Triangle {
            vertices: [0, 1, 2],
            birth,
            death,
            cap: false,
        };
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
        let patch = Patch {
            isovalues: (0..=10).map(f64::from).collect(),
            first_knot: vec![0; 4],
            triangles: lifetimes.iter().map(triangle).collect(),
            ..Patch::default()
        };
        // Positions do not matter here, so there are none.
        Spectrum::unchecked(about, patch)
    }

    #[test]
    fn triangles_alive_on_both_sides_of_an_event_survive_it() {
        // At 5: one dies, two live on, one is born; one has died before.
        let s = spectrum(&[(0, 5), (0, 9), (3, 7), (5, 8), (1, 4)], &[5.0, 5.0]);
        let found = coherence(&s);
        let [at] = found.events[..] else { panic!("{found:?}") };
        assert_eq!((at.n_events, at.before, at.after, at.survived), (2, 3, 3, 2));
        assert_eq!(found.survived_share, Some(2.0 / 3.0));
        // Of the ten ends of lifetimes two lie there.
        assert_eq!(found.changes_at_events_share, Some(0.2));
    }

    #[test]
    fn births_and_deaths_away_from_events_are_elsewhere() {
        let s = spectrum(&[(0, 5), (2, 9), (2, 5), (3, 5)], &[5.0]);
        let pairs = busiest_elsewhere(&s, 1);
        let [(before, after)] = pairs[..] else { panic!("{pairs:?}") };
        assert!(before < 2.0 && 2.0 < after);
        assert_eq!(busiest_elsewhere(&s, 10).len(), 3);
    }

    #[test]
    fn without_events_there_is_no_survival() {
        let found = coherence(&spectrum(&[(0, 9)], &[]));
        assert_eq!((found.survived_share, found.events.len()), (None, 0));
        assert_eq!(found.changes_at_events_share, Some(0.0));
    }
}
