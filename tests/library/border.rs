//! Surfaces at the border of the volume: where the isovalue passes samples of the border, dents open in the
//! caps, and the mesh must follow them.

use std::sync::Arc;

use crate::common::spectra::swept_with;
use isospectrum::verify::{Limits, Report, Sampling, verify};
use isospectrum::volume::{Outside, Placement, Samples, Volume, phantom};
use isospectrum::{Parameters, Silent};

/// Where the dents open: on a face of the volume, on an edge, in a corner, and between two samples.
const DENTS: [[f64; 3]; 4] =
    [[9.0, 7.0, 0.0], [0.0, 9.0, 17.0], [17.0, 17.0, 17.0], [11.5, 0.0, 10.5]];

const N: usize = 18;

/// A field that rises from the border inwards, most slowly at the dents.
fn dented(outside: Outside) -> Arc<Volume> {
    let sample = |i: usize| {
        let p = [i % N, i / N % N, i / N / N].map(|x| x as f64);
        let depth = |d: &[f64; 3], strength: f64| {
            let r2 = (0..3).map(|a| (p[a] - d[a]).powi(2)).sum::<f64>();
            strength * (-r2 / 20.0).exp()
        };
        let dents: f64 = DENTS.iter().zip([1.0, 0.9, 0.8, 0.7]).map(|(d, s)| depth(d, s)).sum();
        match outside {
            Outside::Low => (1.0 - dents) as f32,
            Outside::High => dents as f32,
        }
    };
    let samples = (0..N * N * N).map(sample).collect();
    let volume = Volume::new("dents", [N; 3], Samples::F32(samples), Placement::default());
    Arc::new(volume.expect("a valid volume").with_outside(outside))
}

/// The spectrum of a volume over a range from a start isovalue before any dent opens, verified.
fn verified(volume: &Arc<Volume>, range: (f64, f64), start: f64) -> (Report, f64) {
    let (start, range) = (Some(start), Some(range));
    let parameters = Parameters::default().with_start(start).with_range(range);
    let spectrum = swept_with(volume, &parameters);
    let sampling = Sampling { n_random: 16, n_events: 2, seed: 3, ..Sampling::default() };
    let report = verify(&spectrum, volume, sampling, Limits::default(), &Silent);
    let share = spectrum.parameters().number("/tracked_area_share").expect("in the metadata");
    (report.expect("verifiable"), share)
}

/// Maximum distance of the isosurface from the mesh, voxels.
const MAX_DISTANCE: f64 = 0.5;

#[test]
fn the_mesh_follows_dents_that_open_in_caps() {
    let low = (Outside::Low, (0.0, 0.4), 0.02);
    let high = (Outside::High, (0.6, 1.0), 0.98);
    for (outside, range, start) in [low, high] {
        let (report, share) = verified(&dented(outside), range, start);
        assert_eq!(report.totals.topology_right, report.totals.isovalues);
        let missing = report.totals.surface_deviation.max.expect("an isosurface");
        assert!(missing < MAX_DISTANCE, "{missing} voxels from the mesh");
        // The dents are tracked, not extracted.
        assert!(share > 0.5, "{share} of the area is tracked");
    }
}

#[test]
fn every_vertex_is_in_the_box_of_the_volume() {
    let mut noise = phantom("noise:7:2").expect("a phantom");
    for (spacing, outside) in [([1.0; 3], Outside::Low), ([1.3, 1.0, 2.17], Outside::High)] {
        let placement = Placement { spacing, ..Placement::default() };
        let samples = noise.samples().clone();
        noise = Volume::new("noise", noise.dims(), samples, placement).expect("a valid volume");
        let volume = Arc::new(noise.clone().with_outside(outside));
        let spectrum = swept_with(&volume, &Parameters::default()).quantised();
        let highest: [f64; 3] = [0, 1, 2].map(|a| 6.0 * volume.voxel_size()[a]);
        // Rounding of 32-bit positions.
        let is_inside =
            |p: [f32; 3]| (0..3).all(|a| (0.0..=highest[a] + 1e-6).contains(&p[a].into()));
        let outside: Vec<_> =
            spectrum.knots().iter().filter(|knot| !is_inside(knot.position)).collect();
        assert!(outside.is_empty(), "{} outside {highest:?}: {:?}", outside.len(), outside[0]);
    }
}
