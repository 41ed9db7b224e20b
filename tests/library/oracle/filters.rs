//! Regions and filters against SciPy and ITK.

use std::collections::BTreeMap;

use isospectrum::Error;
use isospectrum::spectrum::{About, Metadata, Patch, Spectrum};
use isospectrum::volume::{Placement, Preparation, ReadOptions, Samples, Volume, read_volume};

use crate::oracle::here;

/// Maximum difference of results, for samples between -3 and 12: those of float64 in another order.
const ROUNDING: f64 = 1e-12;

fn volume() -> Volume {
    read_volume(&here().join("nifti_f8.nii"), &ReadOptions::default()).expect("checked in")
}

fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.samples().len()).map(|i| volume.samples().get(i)).collect()
}

fn assert_near(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (i, (a, b)) in found.iter().zip(expected).enumerate() {
        assert!((a - b).abs() <= ROUNDING, "{what}: {a} at {i}, expected {b}");
    }
}

#[test]
fn filters_give_what_scipy_and_itk_give() {
    let text = std::fs::read_to_string(here().join("filters.json")).expect("checked in");
    let expected: BTreeMap<String, Vec<f64>> = serde_json::from_str(&text).expect("JSON");
    let none = Preparation::default();
    for (name, preparation) in [
        ("gaussian", Preparation { smooth: Some([1.5, 0.75, 0.5]), ..none.clone() }),
        ("median", Preparation { median: Some(1), ..none.clone() }),
        ("wide_median", Preparation { median: Some(2), ..none.clone() }),
    ] {
        let filtered = preparation.apply(volume()).expect("a volume");
        assert_near(&values(&filtered), &expected[name], name);
        assert_eq!(filtered.placement(), volume().placement());
    }
    // As `make.py` does: the volume, and above it the same plus 1.
    let mut tall = values(&volume());
    tall.extend(values(&volume()).iter().map(|v| v + 1.0).collect::<Vec<_>>());
    let placement = *volume().placement();
    let tall = Volume::new("tall", [5, 4, 6], Samples::F64(tall), placement).expect("a volume");
    let halved = Preparation { downsample: Some(2), ..none }.apply(tall).expect("a volume");
    assert_eq!(halved.dims(), [2, 2, 3]);
    assert_near(&values(&halved), &expected["halved"], "halved");
    // A block lies in the middle of its samples.
    let (first, next) =
        (halved.placement().world([0.0; 3]), halved.placement().world([0.0, 1.0, 0.0]));
    let wanted = [placement.world([0.5; 3]), placement.world([0.5, 2.5, 0.5])];
    for i in 0..3 {
        assert!((first[i] - wanted[0][i]).abs() < 1e-9 && (next[i] - wanted[1][i]).abs() < 1e-9);
    }
}

#[test]
fn a_region_keeps_its_samples_and_its_place() {
    let whole = volume();
    let region = Preparation { crop: Some([[1, 4], [0, 3], [1, 3]]), ..Preparation::default() };
    let kept = region.apply(volume()).expect("a volume");
    assert_eq!(kept.dims(), [3, 3, 2]);
    for (x, y, z) in [(0, 0, 0), (2, 2, 1), (1, 0, 1)] {
        assert_eq!(kept.sample(x, y, z), whole.sample(x + 1, y, z + 1));
        let (at, before) = ([x, y, z].map(|i| i as f64), [x + 1, y, z + 1].map(|i| i as f64));
        let (a, b) = (kept.placement().world(at), whole.placement().world(before));
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-9), "{a:?} {b:?}");
    }
    for wrong in
        [[[0, 6], [0, 4], [0, 3]], [[3, 4], [0, 4], [0, 3]], [[usize::MAX, 1], [0, 4], [0, 3]]]
    {
        let region = Preparation { crop: Some(wrong), ..Preparation::default() };
        assert!(matches!(region.apply(volume()), Err(Error::Usage(_))), "{wrong:?}");
    }
}

#[test]
fn filters_keep_integers_small_and_do_not_depend_on_threads() {
    let samples: Vec<u8> =
        (0..20 * 17 * 9u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let volume = Volume::new("noise", [20, 17, 9], Samples::U8(samples), Placement::default());
    let volume = volume.expect("a volume");
    let all = Preparation {
        median: Some(1),
        smooth: Some([0.8, 0.8, 0.4]),
        downsample: Some(2),
        ..Preparation::default()
    };
    let median = Preparation { median: Some(1), ..Preparation::default() };
    let median = median.apply(volume.clone()).expect("a volume");
    assert_eq!(median.samples().type_name(), "uint8");
    let once = all.apply(volume.clone()).expect("a volume");
    assert_eq!(once.samples().type_name(), "float32");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let again = pool.install(|| all.apply(volume)).expect("a volume");
    assert_eq!(once.samples(), again.samples());
    // The recorded preparation is repeated.
    let spectrum = |metadata: serde_json::Value| {
        let mut about = About::new(once.info(), once.range(), 0.1);
        about.parameters = Metadata::from_json(&metadata.to_string()).expect("JSON");
        Spectrum::from_patch(about, Patch::default()).expect("a spectrum without triangles")
    };
    let done = spectrum(serde_json::json!({ "preparation": all })).preparation();
    assert_eq!(done.expect("known"), all);
    let unknown = serde_json::json!({ "preparation": { "sharpen": 1 } });
    assert!(matches!(spectrum(unknown).preparation(), Err(Error::Input(_))));
}
