//! Isovalues that may be of interest, and why.
//!
//! # Theory
//!
//! Otsu (1979) parts the samples. The contour tree knows nothing of how many samples there are: each branch of it is a part
//! that lives between an extremum and the saddle at which it meets an older part, and a long branch is a thing, a short
//! one noise (Carr, Snoeyink, van de Panne, "Simplifying flexible isosurfaces using local geometric measures", 2004).
//! Where most long branches are alive at once, most things are seen apart from each other.

use isospectrum::unstable::topology::Topology;
use isospectrum::volume::{Histogram, Volume};
use serde::Serialize;

/// Branches shorter than this share of the range are noise.
const LEAST_SHARE: f64 = 0.05;

/// An isovalue that may be of interest.
#[derive(Serialize)]
pub(super) struct Candidate {
    pub(super) isovalue: f64,
    /// `otsu`: parts the samples into two groups with the largest variance between them. `persistence`: the middle of
    /// the isovalues at which most branches of the contour tree are alive that are at least 5 % of the range long.
    pub(super) by: &'static str,
    /// How many such branches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) n_branches: Option<usize>,
}

/// The candidates of a volume.
pub(super) fn of(volume: &Volume, topology: &Topology) -> Vec<Candidate> {
    let otsu = Candidate { isovalue: Histogram::of(volume).otsu(), by: "otsu", n_branches: None };
    let (low, high) = volume.range();
    let least = LEAST_SHARE * (high - low);
    let pairs = topology.extremum_pairs();
    let long = pairs.iter().filter(|pair| pair.persistence >= least).map(|pair| {
        let ends = [pair.extremum, pair.saddle].map(|e| topology.events[e as usize].isovalue);
        (ends[0].min(ends[1]), ends[0].max(ends[1]))
    });
    let by_persistence = most_covered(&long.collect::<Vec<_>>()).map(|(isovalue, n)| Candidate {
        isovalue,
        by: "persistence",
        n_branches: Some(n),
    });
    std::iter::once(otsu).chain(by_persistence).collect()
}

/// The middle of the longest stretch that most intervals cover, and how many do; the lowest of equally long ones.
fn most_covered(intervals: &[(f64, f64)]) -> Option<(f64, usize)> {
    let mut ends: Vec<(f64, bool)> =
        intervals.iter().flat_map(|&(from, to)| [(from, true), (to, false)]).collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut n = 0;
    let mut best: Option<(usize, f64, f64)> = None;
    for pair in ends.windows(2) {
        if pair[0].1 {
            n += 1;
        } else {
            n -= 1;
        }
        let (from, length) = (pair[0].0, pair[1].0 - pair[0].0);
        let is_better = |(most, _, longest)| n > most || (n == most && length > longest);
        if length > 0.0 && n > 0 && best.is_none_or(is_better) {
            best = Some((n, from, length));
        }
    }
    best.map(|(n, from, length)| (from + 0.5 * length, n))
}
