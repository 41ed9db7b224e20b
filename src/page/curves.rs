//! What the isosurfaces measure over the isovalue, for the plot above the slider.

use serde::Serialize;

use crate::error::Result;
use crate::export::place_in_world;
use crate::spectrum::{EventKind, Measures, Query, Spectrum};
use crate::volume::{Histogram, Statistics};

/// Isovalues at which the curves are known.
const N_ISOVALUES: usize = 129;

/// An isosurface with less than this share of the largest area is a trace.
const AREA_SHARE: f32 = 0.1;

/// Bins of the histogram; with 256, 8-bit samples have one each.
const N_BINS: usize = 256;

/// How many samples lie in each of as many equal parts of a range of isovalues.
pub(super) fn histogram(samples: &Histogram, range: (f64, f64)) -> Vec<u64> {
    samples.parts(N_BINS, range)
}

/// Isovalues that are offered where the author names none: what shows 1 and 10 per cent of the samples (1 per cent is
/// the rule of thumb for densities), and the middle of the longest stretch without an event, where the surface keeps
/// its shape longest, of those where there is more than a trace of it.
pub(super) fn suggested(
    spectrum: &Spectrum,
    curves: &Curves,
    samples: Option<&Statistics>,
) -> Vec<(f64, &'static str)> {
    let (low, high) = spectrum.range();
    let shares = [(99.0, "top:1%"), (90.0, "top:10%")];
    let of_samples = samples.map(|samples| shares.map(|(p, name)| (samples.percentile(p), name)));
    let mut ends: Vec<f64> = spectrum.events().iter().map(|e| e.isovalue).collect();
    ends.extend([low, high]);
    ends.sort_by(f64::total_cmp);
    let largest_area = curves.area.iter().copied().fold(0.0, f32::max);
    let is_seen = |isovalue: f64| {
        let share = (isovalue - low) / (high - low);
        let at = (share * (N_ISOVALUES - 1) as f64).round() as usize;
        curves.area.get(at).is_some_and(|&area| area >= AREA_SHARE * largest_area)
    };
    let stretches = ends.windows(2).map(|w| (w[1] - w[0], 0.5 * w[0] + 0.5 * w[1]));
    let longest = stretches.filter(|&(_, middle)| is_seen(middle));
    let calm = longest.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, c)| (c, "longest unchanged"));
    let all = of_samples.into_iter().flatten().chain(calm);
    all.filter(|&(c, _)| low < c && c < high).collect()
}

/// Curves over evenly spaced isovalues from one end of the range to the other.
#[derive(Serialize)]
pub(super) struct Curves {
    /// Connected components of the mesh, caps included.
    components: Vec<u32>,
    /// Euler characteristic of the mesh, caps included.
    euler: Vec<i64>,
    /// Area without caps, world units squared.
    area: Vec<f32>,
    /// Volume inside the mesh, caps included, world units cubed.
    volume: Vec<f32>,
    /// Isovalue and kind (0 emerge, 1 merge, 2 handle-open, 3 split, 4 handle-close, 5 vanish) of
    /// each event.
    events: Vec<(f64, u8)>,
}

/// The curves of a spectrum.
pub(super) fn curves(spectrum: &Spectrum) -> Result<Curves> {
    let (low, high) = spectrum.range();
    let mut curves = Curves {
        components: Vec::new(),
        euler: Vec::new(),
        area: Vec::new(),
        volume: Vec::new(),
        events: spectrum.events().iter().map(|e| (e.isovalue, code(e.kind))).collect(),
    };
    let mut query = Query::new(spectrum);
    for i in 0..N_ISOVALUES {
        let t = i as f64 / (N_ISOVALUES - 1) as f64;
        // Weighted, so that both ends are met exactly; between them for any rounding.
        let isovalue = (low * (1.0 - t) + high * t).clamp(low, high);
        let mesh = place_in_world(query.mesh_at(isovalue)?, &spectrum.volume().placement);
        let measures = Measures::of(&mesh);
        curves.components.push(measures.components);
        curves.euler.push(measures.euler);
        curves.area.push(measures.area as f32);
        curves.volume.push(measures.volume as f32);
    }
    Ok(curves)
}

fn code(kind: EventKind) -> u8 {
    match kind {
        EventKind::Emerge => 0,
        EventKind::Merge => 1,
        EventKind::HandleOpen => 2,
        EventKind::Split => 3,
        EventKind::HandleClose => 4,
        EventKind::Vanish => 5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_outside_the_range_are_in_no_bin() {
        let values = [0.0, 9.0, 10.0, 10.0, 15.0, 20.0, 21.0];
        let samples = Histogram::of_values(values.into_iter(), (0.0, 21.0));
        let bins = histogram(&samples, (9.99, 20.01));
        assert_eq!((bins[0], bins[N_BINS / 2], bins[N_BINS - 1]), (2, 1, 1));
        assert_eq!(bins.iter().sum::<u64>(), 4);
    }
}
