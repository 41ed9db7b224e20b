//! Measures of the isosurfaces over the isovalue, for the plot above the slider.

use serde::Serialize;

use crate::error::Result;
use crate::export::place_in_world;
use crate::spectrum::{EventKind, Measures, Query, Spectrum};
use crate::volume::{Histogram, Statistics, between};

/// The number of isovalues of the curves, evenly spaced.
const N_ISOVALUES: usize = 129;

/// The number of bins of the histogram: one for each value of 8-bit samples.
const N_BINS: usize = 256;

/// The number of samples in each of [`N_BINS`] equal parts of a range of isovalues.
pub(super) fn histogram(samples: &Histogram, range: (f64, f64)) -> Vec<u64> {
    samples.parts(N_BINS, range)
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
    /// The isovalue and the kind ([`code`]) of each event.
    events: Vec<(f64, u8)>,
}

impl Curves {
    /// Measures the isosurfaces of a spectrum.
    pub(super) fn of(spectrum: &Spectrum) -> Result<Curves> {
        let range = spectrum.range();
        let mut curves = Curves {
            components: Vec::new(),
            euler: Vec::new(),
            area: Vec::new(),
            volume: Vec::new(),
            events: spectrum.events().iter().map(|e| (e.isovalue, code(e.kind))).collect(),
        };
        let mut query = Query::new(spectrum);
        for i in 0..N_ISOVALUES {
            let mesh = query.mesh_at(isovalue_at(range, i))?;
            let measures = Measures::of(&place_in_world(mesh, &spectrum.volume().placement));
            curves.components.push(measures.components);
            curves.euler.push(measures.euler);
            curves.area.push(measures.area as f32);
            curves.volume.push(measures.volume as f32);
        }
        Ok(curves)
    }

    /// Isovalues that the page offers if its author names none.
    pub(super) fn suggested(
        &self,
        spectrum: &Spectrum,
        samples: Option<&Statistics>,
    ) -> Vec<(f64, &'static str)> {
        let (low, high) = spectrum.range();
        let at = |i: usize| low + (high - low) * (i as f64 / (N_ISOVALUES - 1) as f64);
        let areas: Vec<(f64, f64)> =
            self.area.iter().enumerate().map(|(i, &area)| (at(i), f64::from(area))).collect();
        spectrum.suggested(&areas, samples)
    }
}

/// Isovalue `i` of [`N_ISOVALUES`], the ends of the range among them.
fn isovalue_at(range: (f64, f64), i: usize) -> f64 {
    between(range, i as f64 / (N_ISOVALUES - 1) as f64)
}

/// The code of a kind of event, an index into `KINDS` of `page/plot.js`.
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
