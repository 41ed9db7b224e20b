//! The front: see `docs/decisions/0001-front.md`.

use std::sync::Arc;

use isospectrum::inside::sweep::{TRACKED_AREA_SHARE, TRACKED_AREA_SHARES};
use isospectrum::spectrum::Spectrum;
use isospectrum::verify::mesh_topology;
use isospectrum::verify::{Limits, Sampling, verify};
use isospectrum::volume::{Volume, phantom, read_volume};
use isospectrum::{Backend, Choice};
use isospectrum::{Parameters, Silent, compute};

fn spectrum(volume: &Arc<Volume>) -> Spectrum {
    let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
    let parameters = Parameters::default();
    compute(volume, &parameters, &backend, &Silent).expect("a spectrum")
}

#[test]
fn the_topology_is_exact_at_random_isovalues() {
    // The seam of the last three was open before it was looked at in full.
    let names =
        ["sphere:24", "blobs:24", "noise:9:101", "noise:9:111", "noise:9:115", "noise:16:116"];
    for (n, name) in names.into_iter().enumerate() {
        let volume = Arc::new(phantom(name).expect("a phantom"));
        let spectrum = spectrum(&volume);
        let sampling = Sampling { n_random: 24, n_events: 4, seed: 500 + n as u64 };
        let report =
            verify(&spectrum, &volume, sampling, Limits::default(), &Silent).expect("verifiable");
        let totals = &report.totals;
        assert!(totals.isovalues >= 24, "{name}: {}", totals.isovalues);
        assert_eq!(totals.topology_right, totals.isovalues, "{name}");
        assert_eq!(totals.manifold, totals.isovalues, "{name}");
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let volume = Arc::new(phantom("blobs:20").expect("a phantom"));
    let [one, three] = [1, 3].map(|n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads");
        pool.install(|| spectrum(&volume))
    });
    assert!(one.triangles().len() > 1000);
    assert_eq!(one, three);
}

#[test]
fn how_much_is_tracked_is_told_by_isovalue() {
    let share = |name: &str| {
        let volume = Arc::new(phantom(name).expect("a phantom"));
        let spectrum = spectrum(&volume);
        let told = serde_json::json!(spectrum.parameters());
        let shares: Vec<[f64; 2]> = serde_json::from_value(told[TRACKED_AREA_SHARES].clone())
            .expect("isovalues and shares");
        assert!(shares.len() > 50 && shares.is_sorted_by(|a, b| a[0] < b[0]));
        let mean = shares.iter().map(|s| s[1]).sum::<f64>() / shares.len() as f64;
        let told = told[TRACKED_AREA_SHARE].as_f64().expect("a number");
        assert!((told - mean).abs() < 2e-4, "{name}: {told}, mean {mean}");
        told
    };
    let (blobs, noise) = (share("blobs:24"), share("noise:9:101"));
    // 0.94 and 0.65 when this was written.
    assert!(
        blobs > 0.85 && 0.3 < noise && noise < 0.8,
        "tracked: {blobs} of blobs, {noise} of noise"
    );
}

mod real_volumes {
    use super::*;

    #[test]
    #[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
    fn both_cells_of_a_face_change_at_its_saddle_at_once() {
        // By its own arithmetic, a cell changed some numbers before the isovalue of the event of another: between the two
        // nucleon was open.
        let path = data::file("nucleon_41x41x41_uint8.raw");
        let volume = Arc::new(read_volume(&path, &Default::default()).expect("nucleon"));
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let parameters = Parameters { range: Some((189.0, 190.0)), ..Parameters::default() };
        let spectrum = compute(&volume, &parameters, &backend, &Silent).expect("a spectrum");
        let close = |c: &f64| (189.4..189.6).contains(c);
        let near: Vec<f64> = spectrum.isovalues().iter().copied().filter(close).collect();
        assert!(near.len() > 10, "{near:?}");
        for pair in near.windows(2) {
            let isovalue = 0.5 * (pair[0] + pair[1]);
            let mesh = spectrum.mesh_at(isovalue).expect("inside the range");
            let found = mesh_topology(mesh.positions.len(), &mesh.triangles);
            assert!(found.is_closed_manifold(), "{isovalue}: {found:?}");
        }
    }
}
