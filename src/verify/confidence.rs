//! Whether a promise that holds at the isovalues of one verification may not hold at those of another.
//!
//! # Theory
//!
//! A promise of geometry bounds a share: of all values at all isovalues, at most a share q is beyond a limit. If b of n values are beyond it at an
//! isovalue, call b - q n its *excess*. The promise holds if the sum of the excesses is at most 0. The isovalues of a verification are
//! random, so this sum is nearly normally distributed, with mean and variance in proportion to the number of isovalues: the linearised ratio estimator of cluster
//! sampling (W. Cochran, Sampling Techniques, 3rd edition, sections 2.11 and 9.3). From the excesses at m isovalues, the mean of n others has
//! the standard error s (1/n + 1/m)^(1/2), where s is their standard deviation.

use super::distribution::Distribution;
use super::isovalues::Sampling;
use super::measure::Geometry;
use super::promise::{Bounds, N_SHARES, sentence};
use super::report::Report;

/// A promise is uncertain if its mean excess is nearer to 0 than this number of standard errors: one verification in 700 breaks it.
const MIN_STANDARD_ERRORS: f64 = 3.0;

/// As [`MIN_STANDARD_ERRORS`], for which more isovalues are measured.
const MIN_STANDARD_ERRORS_OF_FIRST: f64 = 4.0;

/// A promise is not uncertain if less than this part of the share that it allows is beyond its limit. Of 145 random volumes, all promises that
/// other isovalues broke had more than 0.8.
const MIN_PART: f64 = 0.6;

/// As [`MIN_PART`], for fewer isovalues than a verification has: a few give any figure a large standard error.
const MIN_PART_OF_FEW: f64 = 0.8;

/// The values at one isovalue, or at a pair around an event.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tally {
    n: u64,
    beyond: u64,
}

/// How many values are beyond the limits of the promises of geometry, at each isovalue.
#[derive(Clone, Debug)]
pub(super) struct Tallies {
    bounds: Bounds,
    /// In the order of the promises.
    all: [Vec<Tally>; N_SHARES],
}

impl Tallies {
    pub(super) fn new(bounds: Bounds) -> Self {
        Tallies { bounds, all: Default::default() }
    }

    /// Adds the crossing triangles at an isovalue.
    pub(super) fn add_crossing(&mut self, crossing: usize, n_triangles: usize) {
        self.all[0].push(Tally { n: n_triangles as u64, beyond: crossing as u64 });
    }

    /// Adds the distances at an isovalue, and the triangles that face the wrong side.
    pub(super) fn add(&mut self, geometry: &Geometry) {
        let bounds = self.bounds;
        let n_triangles = geometry.radius_ratio.n();
        self.all[1].push(Tally { n: n_triangles, beyond: geometry.inverted });
        let distances = [
            (&geometry.vertex_deviation, bounds.vertex),
            (&geometry.barycentre_deviation, bounds.typical),
            (&geometry.barycentre_deviation, bounds.barycentre),
            (&geometry.surface_deviation, bounds.typical),
            (&geometry.surface_deviation, bounds.surface),
        ];
        for (tallies, (distances, limit)) in self.all[2..].iter_mut().zip(distances) {
            tallies.push(Tally::of(distances, limit));
        }
    }

    /// Adds the jumps beyond those of the isosurface, away from events: one tally for each pair of isovalues.
    pub(super) fn add_jumps(&mut self, jumps: Vec<Tally>) {
        self.all[N_SHARES - 1].extend(jumps);
    }

    /// Adds those of another choice of isovalues.
    pub(super) fn append(&mut self, other: Tallies) {
        for (mine, theirs) in self.all.iter_mut().zip(other.all) {
            mine.extend(theirs);
        }
    }

    /// Whether more isovalues would show if a promise, of those that hold by a report, may not hold at others.
    pub(super) fn are_doubtful(&self, report: &Report) -> bool {
        let shares = report.promises.iter().skip(report.promises.len() - N_SHARES);
        shares
            .enumerate()
            .any(|(i, p)| p.kept == Some(true) && self.is_near(i, MIN_STANDARD_ERRORS_OF_FIRST))
    }

    fn is_near(&self, promise: usize, min_errors: f64) -> bool {
        is_near(&self.all[promise], self.bounds.shares[promise], min_errors)
    }
}

impl Tally {
    pub(super) fn of(distances: &Distribution, limit: f64) -> Self {
        Tally { n: distances.n(), beyond: distances.n_beyond(limit) }
    }
}

/// Whether the mean excess is positive, or nearer to 0 than `min_errors` standard errors and with enough of the share.
fn is_near(tallies: &[Tally], share: f64, min_errors: f64) -> bool {
    if tallies.is_empty() {
        return false;
    }
    let m = tallies.len() as f64;
    let mean = |of: &dyn Fn(&Tally) -> f64| tallies.iter().map(of).sum::<f64>() / m;
    let excess = |t: &Tally| t.beyond as f64 - share * t.n as f64;
    let (beyond, n) = (mean(&|t| t.beyond as f64), mean(&|t| t.n as f64));
    let n_others = Sampling::default().n_random as f64;
    let min_part = if m < n_others { MIN_PART_OF_FEW } else { MIN_PART };
    if beyond < min_part * share * n {
        return false;
    }
    let found = mean(&excess);
    let variance = m / (m - 1.0).max(1.0) * mean(&|t| (excess(t) - found).powi(2));
    // The variance is estimated, too: the quantile of Student's distribution, to first order.
    let factor = min_errors * (1.0 + (1.0 + min_errors.powi(2)) / (4.0 * m));
    found + factor * (variance * (1.0 / n_others + 1.0 / m)).sqrt() > 0.0
}

/// The promises that do not hold by the first report, or must hold at every isovalue and do not by any, and those that may not hold at other isovalues.
pub(super) fn judge(reports: &[Report], tallies: &Tallies) -> (Vec<String>, Vec<String>) {
    let (mut broken, mut uncertain) = (Vec::new(), Vec::new());
    let Some(first) = reports.first() else { return (broken, uncertain) };
    for (i, promise) in first.promises.iter().enumerate() {
        let found = reports.iter().map(|report| &report.promises[i]);
        let worst = found.reduce(|a, b| if b.found > a.found { b } else { a }).unwrap_or(promise);
        let share = i.checked_sub(first.promises.len() - N_SHARES);
        match share {
            _ if promise.kept == Some(false) => broken.push(sentence(promise)),
            None if worst.kept == Some(false) => broken.push(sentence(worst)),
            Some(share)
                if worst.kept == Some(false) || tallies.is_near(share, MIN_STANDARD_ERRORS) =>
            {
                uncertain.push(sentence(worst));
            }
            _ => {}
        }
    }
    (broken, uncertain)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// A share as the typical distances have.
    const SHARE: f64 = 0.5;

    /// The values at an isovalue of which a quarter of the range has `high`, the others `low` percent beyond the limit.
    fn tally(random: &mut Random, (low, high): (u64, u64)) -> Tally {
        let beyond = if random.unit() < 0.25 { high } else { low };
        Tally { n: 100, beyond: (beyond + random.below(21) as u64).saturating_sub(10) }
    }

    fn draw(random: &mut Random, shares: (u64, u64)) -> Vec<Tally> {
        (0..Sampling::default().n_random).map(|_| tally(random, shares)).collect()
    }

    fn is_uncertain(tallies: &[Tally], share: f64) -> bool {
        is_near(tallies, share, MIN_STANDARD_ERRORS)
    }

    fn holds(tallies: &[Tally]) -> bool {
        tallies.iter().map(|t| t.beyond as f64 - SHARE * t.n as f64).sum::<f64>() <= 0.0
    }

    #[test]
    fn a_promise_that_is_not_uncertain_holds_at_other_isovalues() {
        let mut random = Random::new(3);
        let (mut n_certain, mut n_broken) = ([0, 0], [0, 0]);
        // From far below the limit to above it.
        for low in 0..48 {
            for _ in 0..200 {
                let first = draw(&mut random, (low, 70));
                let others = draw(&mut random, (low, 70));
                if !holds(&first) {
                    continue;
                }
                let is_certain = usize::from(!is_uncertain(&first, SHARE));
                n_certain[is_certain] += 1;
                n_broken[is_certain] += usize::from(!holds(&others));
            }
        }
        // One in 700 at the least distance, and fewer beyond it.
        assert!(n_broken[1] * 700 <= n_certain[1], "{n_broken:?} of {n_certain:?}");
        assert!(n_certain[1] > 1000, "{n_certain:?}");
        // The test can see it: others break indeed.
        assert!(n_broken[0] * 20 > n_certain[0], "{n_broken:?} of {n_certain:?}");
    }

    #[test]
    fn equal_isovalues_leave_no_doubt() {
        let same = |beyond| vec![Tally { n: 100, beyond }; 8];
        assert!(!is_uncertain(&same(49), SHARE));
        assert!(!is_uncertain(&same(50), SHARE));
        assert!(is_uncertain(&same(51), SHARE));
        assert!(!is_uncertain(&[], SHARE));
    }

    #[test]
    fn one_bad_isovalue_of_many_is_a_doubt_if_it_counts() {
        let mut tallies = vec![Tally { n: 100, beyond: 0 }; 64];
        assert!(!is_uncertain(&tallies, 0.01));
        // A quarter of what is allowed on average, and five eighths of it.
        tallies[7].beyond = 16;
        assert!(!is_uncertain(&tallies, 0.01));
        tallies[7].beyond = 40;
        assert!(is_uncertain(&tallies, 0.01));
    }
}
