//! Which stretches of which arcs the exact extraction shows.

use crate::sweep::{Piece, Sweep};

/// The intervals of isovalues to show.
pub(super) struct Shown {
    by_arc: Vec<Vec<(f64, f64)>>,
    /// All of them merged, ascending.
    pub(super) merged: Vec<(f64, f64)>,
    /// Per arc: up to where everything is to be shown that its component becomes, if it is to be shown
    /// at its upper end.
    beyond: Vec<f64>,
}

impl Shown {
    pub(super) fn new(sweep: &Sweep, stretches: &[Piece]) -> Self {
        let mut by_arc = vec![Vec::new(); sweep.topology.arcs.len()];
        let mut all: Vec<(f64, f64)> = Vec::new();
        for s in stretches.iter().filter(|s| s.low < s.high) {
            by_arc[s.arc].push((s.low, s.high));
            all.push((s.low, s.high));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut merged: Vec<(f64, f64)> = Vec::new();
        for (low, high) in all {
            match merged.last_mut() {
                Some(last) if low <= last.1 => last.1 = last.1.max(high),
                _ => merged.push((low, high)),
            }
        }
        by_arc.iter_mut().for_each(|s| s.sort_by(|a, b| a.0.total_cmp(&b.0)));
        let beyond = beyond(sweep, &by_arc);
        Shown { by_arc, merged, beyond }
    }

    /// The merged intervals that overlap an interval.
    pub(super) fn overlapping(&self, low: f64, high: f64) -> &[(f64, f64)] {
        let first = self.merged.partition_point(|m| m.1 <= low);
        let last = self.merged.partition_point(|m| m.0 < high);
        &self.merged[first..last.max(first)]
    }
}

/// See [`Shown::beyond`]. Where noise makes a component meet thousands of others, it is followed at
/// once to where a mesh takes over.
fn beyond(sweep: &Sweep, by_arc: &[Vec<(f64, f64)>]) -> Vec<f64> {
    let arcs = &sweep.topology.arcs;
    let mut descending: Vec<usize> = (0..arcs.len()).collect();
    descending.sort_by_key(|&a| std::cmp::Reverse(arcs[a].death_event.map_or(u32::MAX, |e| e)));
    let mut from_event = vec![f64::INFINITY; sweep.topology.events.len()];
    let mut beyond = vec![f64::INFINITY; arcs.len()];
    for a in descending {
        if let Some(death) = arcs[a].death_event {
            beyond[a] = from_event[death as usize];
        }
        if let Some(birth) = arcs[a].birth_event {
            let (low, high) = sweep.shown(&arcs[a]);
            let until = if low >= high {
                beyond[a]
            } else {
                match by_arc[a].first() {
                    Some(first) if first.0 > low => low,
                    Some(first) if first.1 < high => first.1,
                    Some(_) => beyond[a],
                    None => low,
                }
            };
            let from = &mut from_event[birth as usize];
            *from = from.min(until);
        }
    }
    beyond
}

/// Where in an interval the component with a crossing is to be shown.
pub(super) fn shown_intervals(
    sweep: &Sweep,
    shown: &Shown,
    crossing: (u32, u32),
    low: f64,
    high: f64,
) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    for &(a, b) in shown.overlapping(low, high) {
        walk_arcs(sweep, shown, crossing, [low.max(a), high.min(b)], &mut found);
    }
    found
}

/// Follows the component with a crossing through the arcs of an interval and adds where it shows.
fn walk_arcs(
    sweep: &Sweep,
    shown: &Shown,
    crossing: (u32, u32),
    [low, high]: [f64; 2],
    found: &mut Vec<(f64, f64)>,
) {
    let tiny = 1e-10 * (sweep.range.1 - sweep.range.0);
    let mut at = low;
    while at < high {
        let probe = (at + tiny).min(at + 0.5 * (high - at));
        // Between neighbouring numbers it may round to the upper one.
        let probe = if probe < high { probe } else { at };
        let arc = sweep.topology.arc_of(crossing.0, crossing.1, probe);
        let Some(arc) = arc else { break };
        let end = sweep.shown(&sweep.topology.arcs[arc]).1;
        let mut next = if end > at { end } else { probe.max(at.next_up()) };
        for &(a, b) in &shown.by_arc[arc] {
            let b = if b == end { shown.beyond[arc].max(end) } else { b };
            let (a, b) = (a.max(at), b.min(high));
            if a >= b {
                continue;
            }
            next = next.max(b);
            match found.last_mut() {
                Some(last) if last.1 == a => last.1 = b,
                _ => found.push((a, b)),
            }
        }
        let end = next.min(high);
        if end <= at {
            break;
        }
        at = end;
    }
}
