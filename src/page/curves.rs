//! What the isosurfaces measure over the isovalue, for the plot above the slider.

use serde::Serialize;

use crate::error::Result;
use crate::export::place_in_world;
use crate::spectrum::{EventKind, Measures, Query, Spectrum};
use crate::volume::Histogram;

/// Isovalues at which the curves are known.
const N_ISOVALUES: usize = 129;

/// Bins of the histogram; with 256, 8-bit samples have one each.
const N_BINS: usize = 256;

/// Percentiles are known to a tenth of a percent.
const N_PERCENTILES: usize = 1000;

/// What a page tells of the samples of the volume.
#[derive(Serialize)]
pub(super) struct SamplesShown {
    /// How many lie in each of as many equal parts of the range of isovalues.
    histogram: Vec<u64>,
    /// Percentiles from 0 to 100 in even steps.
    percentiles: Vec<f64>,
}

/// What a page that shows a range of isovalues tells of the samples.
pub(super) fn samples(samples: &Histogram, range: (f64, f64)) -> SamplesShown {
    let percent = |i: usize| 100.0 * i as f64 / N_PERCENTILES as f64;
    SamplesShown {
        histogram: samples.parts(N_BINS, range),
        percentiles: (0..=N_PERCENTILES).map(|i| samples.percentile(percent(i))).collect(),
    }
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
    let (low, high) = spectrum.range;
    let mut curves = Curves {
        components: Vec::new(),
        euler: Vec::new(),
        area: Vec::new(),
        volume: Vec::new(),
        events: spectrum.events.iter().map(|e| (e.isovalue, code(e.kind))).collect(),
    };
    let mut query = Query::new(spectrum);
    for i in 0..N_ISOVALUES {
        let t = i as f64 / (N_ISOVALUES - 1) as f64;
        // Weighted, so that both ends are met exactly; between them for any rounding.
        let isovalue = (low * (1.0 - t) + high * t).clamp(low, high);
        let mesh = place_in_world(query.mesh_at(isovalue)?, &spectrum.volume.placement);
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
    fn samples_outside_the_range_are_in_no_bin_but_count_for_percentiles() {
        let values = [0.0, 9.0, 10.0, 10.0, 15.0, 20.0, 21.0];
        let shown = samples(&Histogram::of_values(values.into_iter(), (0.0, 21.0)), (9.99, 20.01));
        let bins = shown.histogram;
        assert_eq!((bins[0], bins[N_BINS / 2], bins[N_BINS - 1]), (2, 1, 1));
        assert_eq!(bins.iter().sum::<u64>(), 4);
        let of = |percent: usize| shown.percentiles[percent * N_PERCENTILES / 100];
        // A bin of the finer histogram is 21 / 65,536 wide.
        assert!((of(0) - 0.0).abs() < 1e-3 && (of(50) - 10.0).abs() < 1e-3);
        assert!((of(100) - 21.0).abs() < 1e-3);
    }
}
