//! Topological simplification of volumes with known critical points.

use crate::common::program::{Folder, json, stderr};
use isospectrum::spectrum::{EventKind, Metadata};
use isospectrum::unstable::topology::Topology;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::unstable::topology::simplify::{Census, simplified, simplify};
use isospectrum::volume::{Outside, Placement, Samples, Volume, phantom};
use proptest::prelude::*;

fn volume(dims: [usize; 3], samples: Samples) -> Volume {
    Volume::new("v", dims, samples, Placement::default()).expect("a valid volume")
}

fn from_function(n: usize, f: impl Fn([f64; 3]) -> f64) -> Volume {
    let at = |i: usize| f([i % n, i / n % n, i / (n * n)].map(|p| p as f64));
    volume([n; 3], Samples::F64((0..n * n * n).map(at).collect()))
}

/// A bump of a height around a centre, about four samples wide.
fn bump(p: [f64; 3], centre: [f64; 3], height: f64) -> f64 {
    let squared: f64 = (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum();
    height * (-squared / 4.0).exp()
}

/// A slope with two bumps on it, one twenty times as high as the other.
fn two_bumps() -> Volume {
    from_function(24, |p| {
        0.001 * p[0] + bump(p, [6.0, 12.0, 12.0], 1.0) + bump(p, [17.0, 12.0, 12.0], 0.05)
    })
}

fn maxima(volume: &Volume) -> usize {
    let field = ExactField::new(volume).expect("a field");
    let topology = Topology::compute(&field).expect("a topology");
    topology.events.iter().filter(|e| e.kind == EventKind::Vanish).count()
}

fn largest_change(a: &Volume, b: &Volume) -> f64 {
    let n = a.samples().len();
    (0..n).map(|i| (a.samples().get(i) - b.samples().get(i)).abs()).fold(0.0, f64::max)
}

#[test]
fn a_bump_below_the_persistence_is_removed_and_one_far_above_is_kept() {
    let given = two_bumps();
    // The corner at the high end of the slope, and the bumps.
    let before = maxima(&given);
    assert!(before >= 2);
    let (volume, done) = simplify(&given, 0.1).expect("simplifies");
    assert_eq!(maxima(&volume), 1);
    assert_eq!(done.before.maxima, before);
    assert_eq!(done.after.maxima, 1);
    assert_eq!(done.after.maxima_below, 0);
    let high = volume.range().1;
    let lost = given.range().1 - high;
    assert!(lost <= done.largest_change && high > 0.8, "the high bump ends at {high}");
}

#[test]
fn a_bump_of_more_than_twice_the_maximum_change_is_kept() {
    // Stability of persistence: a change of the field by d removes no pair of a persistence above 2 d.
    let given = two_bumps();
    let (volume, done) = simplify(&given, 0.01).expect("simplifies");
    assert!(2.0 * done.largest_change < 0.05, "{done:?}");
    assert!(maxima(&volume) >= 2);
}

#[test]
fn simplification_removes_noise_and_keeps_the_signal() {
    // Noise of up to 2 % on the two bumps, by a generator that every machine repeats.
    let mut state = 7u64;
    let mut noise = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.04 * ((state >> 33) as f64 / (1u64 << 31) as f64 - 0.5)
    };
    let clean = two_bumps();
    let noisy = (0..clean.samples().len()).map(|i| clean.samples().get(i) + noise()).collect();
    let (_, done) = simplify(&volume([24; 3], Samples::F64(noisy)), 0.05).expect("simplifies");
    let (before, after) = (done.before, done.after);
    assert!(20 * after.critical_points < before.critical_points, "{before:?} {after:?}");
    assert!(20 * after.handles < before.handles, "{before:?} {after:?}");
}

#[test]
fn a_field_that_is_all_noise_has_fewer_events_of_every_sort_afterwards() {
    let given = phantom("noise:16:3").expect("a phantom");
    let (low, high) = given.range();
    let (_, done) = simplify(&given, 0.1 * (high - low)).expect("simplifies");
    let (before, after) = (done.before, done.after);
    assert!(after.handles < before.handles && after.minima < before.minima);
    assert!(after.maxima < before.maxima, "{before:?} {after:?}");
}

#[test]
fn samples_of_every_type_become_float64() {
    let ramp = |i: u32| (i * 7 + i * i % 11) % 200;
    let narrow = volume([5, 4, 3], Samples::U8((0..60).map(|i| ramp(i) as u8).collect()));
    let wide = volume([5, 4, 3], Samples::U32((0..60).map(|i| ramp(i) << 20).collect()));
    assert_eq!(simplified(&narrow, 3.0).expect("simplifies").samples().type_name(), "float64");
    assert_eq!(simplified(&wide, 3e6).expect("simplifies").samples().type_name(), "float64");
}

#[test]
fn threads_change_nothing() {
    let given = phantom("noise:16:1").expect("a phantom");
    let with = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
        pool.install(|| simplified(&given, 0.2).expect("simplifies").samples().clone())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn noise_and_plateaus_lose_every_extremum_below_the_persistence() {
    let steps =
        |p: [f64; 3]| ((0.9 * p[0]).sin() * 3.0 + (0.7 * p[1] + 0.4 * p[2]).cos() * 3.0).round();
    for given in [phantom("noise:16:2").expect("a phantom"), from_function(20, steps)] {
        let (low, high) = given.range();
        for share in [0.01, 0.05, 0.3] {
            let (_, done) = simplify(&given, share * (high - low)).expect("simplifies");
            assert_eq!((done.after.minima_below, done.after.maxima_below), (0, 0), "{done:?}");
            assert!(done.before.minima_below + done.before.maxima_below > 0, "{done:?}");
        }
    }
}

#[test]
fn verify_refuses_an_unknown_method_of_simplification() {
    let folder = Folder::new();
    let arguments = ["compute", "--phantom", "noise:8", "--persistence", "10%"];
    folder.run(&[&arguments[..], &["--backend", "cpu", "-o", "s.isp"]].concat());
    let path = folder.path().join("s.isp");
    let file = isospectrum::file::read(&path).expect("a spectrum");
    let mut metadata = serde_json::json!(file.parameters());
    metadata["simplification"]["method"] = 1.into();
    let metadata = Metadata::from_json(&metadata.to_string()).expect("JSON");
    let file = file.changed(|about, _| about.parameters = metadata).expect("valid");
    isospectrum::file::write(&file, &path).expect("written");
    let line = folder.fails(&["verify", "s.isp", "--phantom", "noise:8"], 3);
    assert!(line.contains("noise") && line.contains("method"), "{line}");
}

#[test]
fn a_persistence_of_half_of_the_range_is_refused() {
    let given = two_bumps();
    let (low, high) = given.range();
    for wrong in [0.0, -1.0, f64::NAN, 0.5 * (high - low), 10.0] {
        assert!(simplified(&given, wrong).is_err(), "{wrong}");
    }
}

#[test]
fn a_simplified_spectrum_is_marked_and_verified_against_the_simplified_volume() {
    let folder = Folder::new();
    let arguments = ["--phantom", "noise:8", "--persistence", "10%"];
    let compute = ["compute", "--backend", "cpu", "-o", "s.isp"];
    let output = folder.run(&[&compute[..], &arguments[..]].concat());
    assert!(stderr(&output).contains("persistence"));
    let info = json(&folder.run(&["info", "s.isp", "--json"]));
    let done = &info["parameters"]["simplification"];
    assert!(done["largest_change"].as_f64() > Some(0.0), "{done}");
    assert_eq!(done["after"]["minima_below"], 0, "{done}");
    assert_eq!(done["after"]["maxima_below"], 0, "{done}");
    assert!(
        done["after"]["critical_points"].as_u64() < done["before"]["critical_points"].as_u64(),
        "{done}"
    );

    // 8^3 samples of noise are too coarse for the limits of distance and of jumps; only the topology is checked here.
    let verify = [
        "verify",
        "s.isp",
        "--phantom",
        "noise:8",
        "--max-deviation",
        "4",
        "--max-jump",
        "4",
        "--json",
    ];
    let found = json(&folder.run(&verify));
    assert_eq!(found["totals"]["topology_right"], found["totals"]["isovalues"]);
    // The volume without simplification is a different one.
    folder.run(&["compute", "-q", "--phantom", "noise:8", "--backend", "cpu", "-o", "given.isp"]);
    let given = json(&folder.run(&["info", "given.isp", "--json"]));
    assert_ne!(given["volume"]["range"], info["volume"]["range"]);
}

#[test]
fn a_range_of_the_original_volume_is_clamped_to_that_of_the_simplified_one() {
    let folder = Folder::new();
    let noisy = ["--phantom", "noise:8", "--persistence", "10%"];
    let range = |name: &str| {
        let range = json(&folder.run(&["info", name, "--json"]))["volume"]["range"].clone();
        [0, 1].map(|i| range[i].as_f64().expect("a number"))
    };
    let compute = ["compute", "--backend", "cpu"];
    folder.run(&[&compute[..], &["-o", "all.isp"], &noisy[..]].concat());
    let [least, most] = range("all.isp");
    let middle = 0.5 * (least + most);
    let written = format!("{middle}:{}", most + 0.5);
    for bricks in [&[][..], &["--brick", "4"]] {
        let upper = ["-o", "upper.isp", "--range", &written];
        let output = folder.run(&[&compute[..], &upper, &noisy, bricks].concat());
        assert!(stderr(&output).contains(&format!("so {middle} to {most} is covered")));
        let info = json(&folder.run(&["info", "upper.isp", "--json"]));
        assert_eq!(info["range"], serde_json::json!([middle, most]));
    }
    let beyond = format!("{}:{}", most + 0.1, most + 0.2);
    let beyond = [&compute[..], &["-o", "beyond.isp", "--range", &beyond], &noisy].concat();
    let printed = stderr(&folder.run_for(&beyond, 2));
    assert!(
        printed.contains(&format!("expected one of the volume's {least} to {most}")),
        "{printed}"
    );
}

#[test]
fn analyze_of_the_simplified_volume_it_writes_gives_the_same_events() {
    let folder = Folder::new();
    let raw = "v_8x8x8_float64.raw";
    let analyze = ["analyze", "--json", "--samples", "2"];
    let arguments = ["--phantom", "noise:8", "--persistence", "0.2", "--simplified", raw];
    let first = json(&folder.run(&[&analyze[..], &arguments[..]].concat()));
    let second = json(&folder.run(&[&analyze[..], &[raw]].concat()));
    assert_eq!(first["simplification"]["after"]["critical_points"], second["n_critical_points"]);
    assert_eq!(first["events"], second["events"]);
}

#[test]
fn wrong_persistences_are_errors_of_one_line() {
    let folder = Folder::new();
    for (wrong, message) in
        [("0", "above 0"), ("-5", "above 0"), ("some", "such as 5%"), ("50%", "half")]
    {
        let arguments = ["compute", "--phantom", "noise:8", "-o", "s.isp", "--persistence", wrong];
        let line = folder.fails(&arguments, 2);
        assert!(line.contains(message), "{line}");
    }
    let line = folder.fails(&["analyze", "--phantom", "noise:8", "--simplified", "a.raw"], 2);
    assert!(line.contains("--persistence"), "{line}");
}

/// A small grid of integers with ties or of floating point numbers, with the layer outside on either side.
fn any_volume() -> impl Strategy<Value = Volume> {
    let dims = (2usize..6, 2usize..6, 2usize..6);
    (dims, 0..3u8, any::<bool>(), any::<u64>()).prop_filter_map(
        "all samples equal",
        |((x, y, z), kind, high, seed)| {
            let mut state = seed;
            let mut next = move || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                state >> 40
            };
            let n = x * y * z;
            let samples = match kind {
                0 => Samples::U8((0..n).map(|_| (next() % 9) as u8 * 20).collect()),
                1 => Samples::F32((0..n).map(|_| next() as f32 * 1e-3).collect()),
                _ => Samples::I32((0..n).map(|_| next() as i32 - (1 << 23)).collect()),
            };
            let outside = if high { Outside::High } else { Outside::Low };
            let volume = Volume::new("grid", [x, y, z], samples, Placement::default()).ok()?;
            Some(volume.with_outside(outside))
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_extremum_below_the_persistence_is_left(given in any_volume(), share in 0.001..0.49) {
        let persistence = share * (given.range().1 - given.range().0);
        let (volume, done) = simplify(&given, persistence).expect("simplifies");
        let left = Census::of(&volume, persistence).expect("a census");
        prop_assert_eq!(left, done.after);
        prop_assert_eq!((left.minima_below, left.maxima_below), (0, 0));
        prop_assert_eq!(largest_change(&given, &volume), done.largest_change);
        prop_assert_eq!(volume.outside(), given.outside());
        let again = simplified(&given, persistence).expect("again");
        prop_assert_eq!(again.samples(), volume.samples());
    }
}

mod real_volumes {
    use super::*;
    use crate::common::data;

    mod long {
        use super::*;

        #[test]
        #[ignore = "long, needs $ISOSPECTRUM_DATA: run by scripts/test --long"]
        fn a_scan_keeps_one_of_a_hundred_of_its_critical_points_handles_included() {
            let path = data::file("tooth_103x94x161_uint8.raw");
            let samples = Samples::U8(std::fs::read(path).expect("readable"));
            let given = volume([103, 94, 161], samples);
            // Measured: 820,147 and 4,343; 2.28 P.
            let (_, done) = simplify(&given, 5.1).expect("simplifies");
            assert!(100 * done.after.critical_points < done.before.critical_points, "{done:?}");
            assert!(done.largest_change < 2.5 * done.persistence, "{done:?}");
            assert_eq!((done.after.minima_below, done.after.maxima_below), (0, 0), "{done:?}");
        }
    }
}
