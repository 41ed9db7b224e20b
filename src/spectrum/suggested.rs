//! Isovalues that may be worth a look, where nobody tells which are.

use super::Spectrum;
use crate::volume::Statistics;

/// An isosurface with less than this share of the largest area is a trace.
const AREA_SHARE: f64 = 0.1;

/// A stretch without events that is shorter than this share of the range says nothing: among the events of noise there is always a
/// longest one.
const LEAST_STRETCH: f64 = 0.02;

impl Spectrum {
    /// What shows 1 and 10 per cent of the samples (1 per cent is the rule of thumb for densities), and the middle of the longest
    /// stretch without an event, where the surface keeps its shape longest, of those where there is more than a trace of it; each with
    /// what it is. `areas` are areas of isosurfaces by rising isovalue.
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
        let is_seen = |isovalue: f64| {
            let nearest = areas.iter().min_by(|a, b| {
                let away = |at: &(f64, f64)| (at.0 - isovalue).abs();
                away(a).total_cmp(&away(b))
            });
            nearest.is_some_and(|&(_, area)| area >= AREA_SHARE * largest_area)
        };
        let mut ends: Vec<f64> = self.events().iter().map(|e| e.isovalue).collect();
        ends.extend([low, high]);
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let stretches = ends.windows(2).map(|w| (w[1] - w[0], 0.5 * w[0] + 0.5 * w[1]));
        let long = stretches.filter(|(length, _)| *length >= LEAST_STRETCH * (high - low));
        let calm = long.filter(|&(_, middle)| is_seen(middle)).max_by(|a, b| a.0.total_cmp(&b.0));
        let calm = calm.map(|(_, middle)| (middle, "longest unchanged"));
        let all = of_samples.into_iter().flatten().chain(calm);
        all.filter(|&(c, _)| low < c && c < high).collect()
    }
}
