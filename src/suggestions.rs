//! Isovalues of interest, with the reason.
//!
//! # Theory
//!
//! Otsu (1979) separates the samples into two classes by their histogram. The contour tree adds topology: each of its
//! branches is a component between an extremum and the saddle at which it meets an older one. A long branch is an object, a
//! short one noise (Carr, Snoeyink, van de Panne, "Simplifying flexible isosurfaces using local geometric measures", 2004).
//! At the isovalue with the most long branches, the most objects are separate.

use serde::Serialize;

use crate::error::Result;
use crate::topology::exact::ExactField;
use crate::topology::{Event, Topology};
use crate::volume::{Histogram, Volume};

/// Length of a branch, as a fraction of the range, below which it counts as noise.
const MIN_BRANCH_LENGTH: f64 = 0.05;

/// The events of a volume, and isovalues of interest.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Suggestions {
    /// All changes of topology, for ascending isovalues.
    pub events: Vec<Event>,
    /// Isovalues of interest.
    pub suggested: Vec<Candidate>,
}

/// An isovalue of interest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Candidate {
    /// The isovalue.
    pub isovalue: f64,
    /// `otsu`: separates the samples into two classes with the largest variance between them. `persistence`: the middle of
    /// the interval with the most branches of the contour tree that are at least 5 % of the range long.
    pub by: &'static str,
    /// Number of such branches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_branches: Option<usize>,
}

/// The events of a volume, and isovalues of interest.
///
/// ```
/// use isospectrum::{suggestions, volume::phantom};
///
/// let found = suggestions(&phantom("blobs:16")?)?;
/// assert_eq!(found.suggested[0].by, "otsu");
/// assert!(!found.events.is_empty());
/// # Ok::<(), isospectrum::Error>(())
/// ```
///
/// # Errors
///
/// Those of computing its topology: [`Error::Input`](crate::Error::Input), [`Error::Internal`](crate::Error::Internal).
pub fn suggestions(volume: &Volume) -> Result<Suggestions> {
    let topology = Topology::compute(&ExactField::new(volume)?)?;
    Ok(Suggestions { events: topology.net_events(), suggested: candidates(volume, &topology) })
}

/// The isovalues of interest of a volume whose topology is known.
pub fn candidates(volume: &Volume, topology: &Topology) -> Vec<Candidate> {
    let otsu = Candidate { isovalue: Histogram::of(volume).otsu(), by: "otsu", n_branches: None };
    let (low, high) = volume.range();
    let min_length = MIN_BRANCH_LENGTH * (high - low);
    let pairs = topology.extremum_pairs();
    let long = pairs.iter().filter(|pair| pair.persistence >= min_length).map(|pair| {
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

/// Returns the middle of the longest stretch that the largest number of intervals cover, and this number; of equally long
/// stretches the lowest.
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
