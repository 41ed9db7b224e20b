//! Meshes in other programs: the validator of glTF and the importer of three.js, run by `tests/page/readers.mjs`. Files for VTK,
//! trimesh and USD are tested with the Python package (`python/tests/test_readers.py`).
//!
//! It needs node and the packages of `tests/page`. Without them it fails and names what to install.

use std::path::Path;
use std::process::Command;

use crate::common::program;
use crate::common::program::Folder;
use isospectrum::file;
use isospectrum::spectrum::Spectrum;

/// Two triangles' worth of rounding: 32-bit floats of a few tens.
const ROUNDING: f64 = 1e-5;

fn folder_with_spectrum() -> (Folder, Spectrum) {
    let folder = Folder::with_phantom("torus:24");
    let spectrum = file::from_bytes(&folder.read("s.isp")).expect("just written");
    (folder, spectrum)
}

/// The reports of the validator and the importer about GLB files.
fn inspect(folder: &Folder, names: &[&str]) -> Vec<serde_json::Value> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page");
    for package in ["gltf-validator", "three"] {
        assert!(
            tests.join("node_modules").join(package).is_dir(),
            "GLB is checked with {package}: npm ci --prefix tests/page (scripts/setup does it)"
        );
    }
    let output = Command::new("node")
        .arg("readers.mjs")
        .args(names.iter().map(|name| folder.path().join(name)))
        .current_dir(&tests)
        .output()
        .unwrap_or_else(|error| panic!("node: {error}; apt-get install nodejs npm"));
    let complained = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complained}");
    let lines = String::from_utf8(output.stdout).expect("text");
    lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

/// The box of a mesh as the program has it, low and high corner.
fn bounds(spectrum: &Spectrum, isovalue: f64) -> [[f64; 3]; 2] {
    spectrum.mesh_at(isovalue).expect("inside").bounds().expect("a surface")
}

fn corner(frame: &serde_json::Value, name: &str) -> [f64; 3] {
    std::array::from_fn(|i| frame[name][i].as_f64().expect("a number"))
}

#[test]
fn gltf_validator_and_three_js_accept_every_kind_of_glb() {
    let (folder, spectrum) = folder_with_spectrum();
    let base = ["extract", "s.isp", "-o"];
    folder.run(&[&base[..], &["one.glb", "-c", "50%"]].concat());
    folder.run(&[&base[..], &["colored.glb", "-c", "50%", "--color", "quality"]].concat());
    folder.run(&[&base[..], &["several.glb", "-c", "40%=bone", "-c", "70%=skin@0.3"]].concat());
    folder.run(&[&base[..], &["sweep.glb", "--sweep", "20%:80%:5"]].concat());
    let names = ["one.glb", "colored.glb", "several.glb", "sweep.glb"];
    let reports = inspect(&folder, &names);
    assert_eq!(reports.len(), names.len());
    for file in &reports {
        assert_eq!(file["messages"], serde_json::json!([]), "{file}");
    }
    let (low, high) = spectrum.range();
    let at = |share: f64| low * (1.0 - share) + high * share;
    let n_triangles = |share: f64| spectrum.mesh_at(at(share)).expect("inside").triangles.len();
    assert_eq!(reports[0]["frames"][0]["nTriangles"], n_triangles(0.5));
    assert_eq!(reports[1]["frames"][0]["nTriangles"], n_triangles(0.5));
    assert_eq!(reports[2]["frames"][0]["nTriangles"], n_triangles(0.4) + n_triangles(0.7));
    // A flip-book shows one mesh at each time; 0, 0.26, 0.5 and 0.999 of its five pages.
    for (frame, share) in [(0, 0.2), (1, 0.35), (2, 0.5), (3, 0.8)] {
        assert_eq!(reports[3]["frames"][frame]["nTriangles"], n_triangles(share), "{share}");
    }
    let found = &reports[0]["frames"][0];
    for (name, wanted) in ["low", "high"].iter().zip(bounds(&spectrum, at(0.5))) {
        let corner = corner(found, name);
        assert!((0..3).all(|i| (corner[i] - wanted[i]).abs() < ROUNDING), "{corner:?}");
    }
}

/// The widest range without events, a little inside of its ends.
fn quiet_range(spectrum: &Spectrum) -> (f64, f64) {
    let (low, high) = spectrum.range();
    let mut ends: Vec<f64> = spectrum.events().iter().map(|event| event.isovalue).collect();
    ends.extend([low, high]);
    ends.sort_by(f64::total_cmp);
    let widest = ends.windows(2).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
    let [from, to] = widest.map(|pair| [pair[0], pair[1]]).expect("two ends");
    let inside = 0.1 * (to - from);
    (from + inside, to - inside)
}

#[test]
fn a_morphing_mesh_is_the_isosurface_at_each_of_its_isovalues() {
    // Chords of a mesh of half a voxel's triangles over a ring of a few voxels.
    const MAX_DISTANCE: f64 = 0.3;
    let (folder, spectrum) = folder_with_spectrum();
    let (low, high) = quiet_range(&spectrum);
    let sweep = format!("{low}:{high}:5");
    let output = folder.run(&["extract", "s.isp", "--sweep", &sweep, "--morph", "-o", "m.glb"]);
    let printed = program::stderr(&output);
    assert!(printed.contains("4 morph targets"), "{printed}");
    let reports = inspect(&folder, &["m.glb"]);
    assert_eq!(reports[0]["messages"], serde_json::json!([]));
    // Linear between isovalues: a quarter and a half of the time are at isovalues, the end nearly at the last one.
    let frames = reports[0]["frames"].as_array().expect("frames");
    assert!(frames.iter().all(|frame| frame["nTriangles"] == frames[0]["nTriangles"]));
    for (frame, share) in [(0, 0.0), (2, 0.5), (3, 1.0)] {
        let wanted = bounds(&spectrum, low * (1.0 - share) + high * share);
        for (name, wanted) in ["low", "high"].iter().zip(wanted) {
            let corner = corner(&frames[frame], name);
            let apart = (0..3).map(|i| (corner[i] - wanted[i]).abs()).fold(0.0, f64::max);
            assert!(apart < MAX_DISTANCE, "{share} {name}: {corner:?}, expected {wanted:?}");
        }
    }
    // The ring gets thinner.
    let thickness = |i: usize| corner(&frames[i], "high")[2] - corner(&frames[i], "low")[2];
    assert!(thickness(0) - thickness(3) > 1.0, "it moves");
}

#[test]
fn a_refused_morph_names_a_range_that_works() {
    let (folder, spectrum) = folder_with_spectrum();
    let (_, high) = quiet_range(&spectrum);
    for (flags, message) in [
        (&["--sweep", "10%:90%:5", "-o", "m.glb"][..], "to morph over"),
        (&["--sweep", "10%:90%:40", "-o", "m.glb"], "2 to 33"),
        (&["--sweep", "10%:90%:5", "-o", "m.usda"], ".glb"),
        (&["-c", "50%", "-o", "m.glb"], "--sweep"),
    ] {
        let line = folder.fails(&[&["extract", "s.isp", "--morph", "-q"][..], flags].concat(), 2);
        assert!(line.contains(message), "{line}");
    }
    assert!(!folder.path().join("m.glb").exists());
    // The range in the error works.
    let line = folder
        .fails(&["extract", "s.isp", "--morph", "-q", "--sweep", "10%:90%:5", "-o", "m.glb"], 2);
    let (_, range) = line.trim().rsplit_once("from ").expect("a range");
    let ends: Vec<f64> = range.split(" to below ").map(|end| end.parse().expect("one")).collect();
    assert!(ends[0] < high && high < ends[1], "{ends:?}, expected to reach beyond {high}");
    let sweep = format!("{}:{}:3", ends[0], ends[1] - 1e-6);
    folder.run(&["extract", "s.isp", "--sweep", &sweep, "--morph", "-o", "m.glb"]);
}
