//! Suggested isovalues.

use super::data::Spectrum;
use crate::volume::Statistics;

/// Isosurfaces with less than this share of the largest area are not suggested.
const MIN_AREA_SHARE: f64 = 0.1;

/// Least length, as a share of the range, of an interval without events: between the events of noise there is always a
/// longest one.
const MIN_INTERVAL: f64 = 0.02;

impl Spectrum {
    /// Suggested isovalues with their names: those that enclose 1 and 10 per cent of the samples (1 per cent is the rule of
    /// thumb for densities), and the middle of the longest interval without events, in which the topology is unchanged,
    /// among those with a large enough surface. `areas` are (isovalue, area), ascending.
    pub(crate) fn suggested(
        &self,
        areas: &[(f64, f64)],
        samples: Option<&Statistics>,
    ) -> Vec<(f64, &'static str)> {
        let (low, high) = self.range();
        let shares = [(99.0, "top:1%"), (90.0, "top:10%")];
        let of_samples =
            samples.map(|samples| shares.map(|(p, name)| (samples.percentile(p), name)));
        let largest_area = areas.iter().map(|&(_, area)| area).fold(0.0, f64::max);
        let is_large = |isovalue: f64| {
            let nearest = areas.iter().min_by(|a, b| {
                let distance = |at: &(f64, f64)| (at.0 - isovalue).abs();
                distance(a).total_cmp(&distance(b))
            });
            nearest.is_some_and(|&(_, area)| area >= MIN_AREA_SHARE * largest_area)
        };
        let mut ends: Vec<f64> = self.events().iter().map(|e| e.isovalue).collect();
        ends.extend([low, high]);
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let intervals = ends.windows(2).map(|w| (w[1] - w[0], 0.5 * w[0] + 0.5 * w[1]));
        let long = intervals.filter(|(length, _)| *length >= MIN_INTERVAL * (high - low));
        let longest =
            long.filter(|&(_, middle)| is_large(middle)).max_by(|a, b| a.0.total_cmp(&b.0));
        let longest = longest.map(|(_, middle)| (middle, "longest unchanged"));
        let all = of_samples.into_iter().flatten().chain(longest);
        all.filter(|&(c, _)| low < c && c < high).collect()
    }
}
