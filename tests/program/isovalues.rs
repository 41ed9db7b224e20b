//! The notations of isovalues on the command line, compared with the samples that they refer to; several isovalues at once.

use crate::common::program::Folder;
use isospectrum::volume::{Histogram, Samples, phantom};

fn isovalue_of(folder: &Folder, spectrum: &str, written: &str) -> f64 {
    let output = folder.run(&["extract", spectrum, "-c", written, "-o", "m.ply", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    report["isovalue"].as_f64().expect("a number")
}

#[test]
fn isovalues_can_be_relative_to_the_range_and_to_the_samples() {
    let folder = Folder::with_spectrum();
    let volume = phantom("sphere:12").expect("a phantom");
    let Samples::F32(samples) = volume.samples() else { panic!("phantoms are of f32") };
    let n = samples.len() as f64;
    let mean = samples.iter().map(|&x| f64::from(x)).sum::<f64>() / n;
    let variance = samples.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / n;
    let (low, high) = volume.range();
    let length = high - low;
    let of = |written: &str| isovalue_of(&folder, "s.isp", written);
    let histogram = Histogram::of(&volume);
    for (written, expected) in [
        ("25%", low + 0.25 * length),
        ("p90", histogram.percentile(90.0)),
        ("top:10%", histogram.percentile(90.0)),
        ("top:0.1%", histogram.percentile(99.9)),
        ("0.5sigma", mean + 0.5 * variance.sqrt()),
        ("-1sigma", mean - variance.sqrt()),
    ] {
        let found = of(written);
        // Sums in another order.
        assert!(
            (found - expected).abs() <= 1e-9 * length,
            "{written}: {found}, expected {expected}"
        );
    }
    let line = folder.fails(&["extract", "s.isp", "-c", "9sigma", "-o", "m.ply"], 4);
    assert!(line.contains("outside the range"), "{line}");
    for wrong in ["p101", "top:5", "sigma", "level"] {
        let line = folder.fails(&["extract", "s.isp", "-c", wrong, "-o", "m.ply"], 2);
        assert!(line.contains("2.5sigma or top:1%"), "{line}");
    }
    // A format without statistics of the samples.
    folder.run(&["convert", "s.isp", "s.thesis"]);
    let line = folder.fails(&["extract", "s.thesis", "-c", "p90", "-o", "m.ply"], 2);
    assert!(line.contains("p90 needs"), "{line}");
    assert_eq!(isovalue_of(&folder, "s.thesis", "25%"), of("25%"));
}

#[test]
fn ranges_and_sweeps_take_the_same_notation() {
    let folder = Folder::new();
    let arguments = ["compute", "--phantom", "sphere:12", "--backend", "cpu", "-o", "s.isp"];
    folder.run(&[&arguments[..], &["--range", "top:50%:p90"]].concat());
    let output = folder.run(&["info", "s.isp", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let volume = phantom("sphere:12").expect("a phantom");
    let histogram = Histogram::of(&volume);
    let expected = [50.0, 90.0].map(|p| histogram.percentile(p));
    for (found, expected) in report["range"].as_array().expect("two").iter().zip(expected) {
        assert_eq!(found.as_f64(), Some(expected));
    }
    let line = folder.fails(&["render", "s.isp", "--sweep", "top:90%:p60:3", "-o", "%d.png"], 4);
    assert!(line.contains("outside the range"), "{line}");
}

#[test]
fn meshes_of_several_isovalues_are_numbered_files() {
    let folder = Folder::with_spectrum();
    folder.run(&["extract", "s.isp", "-c", "40%", "-c", "60%", "-o", "m-%d.stl"]);
    for (i, written) in ["40%", "60%"].into_iter().enumerate() {
        folder.run(&["extract", "s.isp", "-c", written, "-o", "one.stl"]);
        assert!(folder.read(&format!("m-{i}.stl")) == folder.read("one.stl"), "{written}");
    }
    let line = folder.fails(&["extract", "s.isp", "-c", "40%", "-c", "60%", "-o", "m.stl"], 2);
    assert!(line.contains("for the number"), "{line}");
    // If one isovalue is invalid, nothing is written.
    folder.fails(&["extract", "s.isp", "-c", "40%", "-c", "900%", "-o", "n-%d.stl"], 4);
    assert!(folder.names().iter().all(|name| !name.starts_with("n-")), "{:?}", folder.names());
}
