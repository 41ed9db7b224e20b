//! Volumes of other programs: a spectrum preserves their world frame and records their preparation.

use std::path::Path;

use crate::common::program::{Folder, json};
use isospectrum::export::parse_ply;

/// A folder with a file of `tests/oracle`.
fn folder_with(name: &str) -> Folder {
    let folder = Folder::new();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle").join(name);
    folder.write(name, &std::fs::read(path).expect("checked in"));
    folder
}

#[test]
fn a_sheared_scan_keeps_its_world_through_spectrum_and_mesh() {
    let folder = folder_with("nifti_f8.nii");
    folder.run(&["compute", "nifti_f8.nii", "--backend", "cpu", "-q", "-o", "s.isp"]);
    let info = json(&folder.run(&["info", "s.isp", "--json"]));
    let placement = &info["volume"]["placement"];
    assert_eq!((&placement["unit"], &placement["space"]), (&"mm".into(), &"RAS".into()));
    let table = folder.run(&["info", "s.isp"]).stdout;
    let table = String::from_utf8(table).expect("text");
    assert!(table.contains("mm, RAS, sheared"), "{table}");

    folder.run(&["extract", "s.isp", "-c", "50%", "-o", "m.ply"]);
    let file = folder.read("m.ply");
    let head = String::from_utf8_lossy(&file[..300]).into_owned();
    assert!(head.contains("comment SPACE=RAS\ncomment unit mm\n"), "{head}");
    // Inside the box of the eight corners, enlarged by a tenth of a cell for caps.
    let entries: serde_json::Value =
        serde_json::from_str(include_str!("../oracle/values.json")).expect("JSON");
    let entry = entries.as_array().expect("a list").iter().find(|e| e["file"] == "nifti_f8.nii");
    let corners = entry.expect("there")["corners"].as_array().expect("a list").clone();
    let mesh = parse_ply(&file).expect("valid");
    assert!(mesh.positions.len() > 20);
    for i in 0..3 {
        let of = |corner: &serde_json::Value| corner[i].as_f64().expect("a number");
        let low = corners.iter().map(of).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        let cell = 0.3;
        let is_inside = |p: &[f64; 3]| (low - cell..=high + cell).contains(&p[i]);
        assert!(mesh.positions.iter().all(is_inside), "{low} {high}");
        let reach = mesh.positions.iter().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max);
        assert!(reach > 0.5 * (low + high), "{reach} {low} {high}");
    }
    let verify = ["verify", "s.isp", "nifti_f8.nii", "--n", "6", "--json"];
    let report = json(&folder.run(&verify));
    assert_eq!(report["totals"]["topology_right"], report["totals"]["isovalues"]);
}

#[test]
fn preparation_is_recorded_and_repeated_by_verify() {
    let folder = Folder::new();
    let volume = ["--phantom", "blobs:32"];
    let steps = ["--crop", "2:31,:,1:", "--median", "1", "--smooth", "0.7", "--downsample", "2"];
    let compute = ["compute", "--backend", "cpu", "-q", "-o", "s.isp"];
    folder.run(&[&compute[..], &volume, &steps].concat());
    let info = json(&folder.run(&["info", "s.isp", "--json"]));
    assert_eq!(info["volume"]["dims"], serde_json::json!([14, 16, 15]));
    let done = &info["parameters"]["preparation"];
    assert_eq!(done["crop"], serde_json::json!([[2, 31], [0, 32], [1, 32]]));
    assert_eq!((&done["median"], &done["downsample"]), (&1.into(), &2.into()));
    // The first block averages samples 2 and 3, 0 and 1, 1 and 2.
    let placement = &info["volume"]["placement"];
    assert_eq!(placement["origin"], serde_json::json!([2.5, 0.5, 1.5]));
    assert_eq!(placement["spacing"], serde_json::json!([2.0, 2.0, 2.0]));
    let table = String::from_utf8(folder.run(&["info", "s.isp"]).stdout).expect("text");
    assert!(table.contains("samples 2:31, 0:32, 1:32; median within 1"), "{table}");
    let report =
        json(&folder.run(&[&["verify", "s.isp", "--n", "6", "--json"], &volume[..]].concat()));
    assert_eq!(report["passed"], true, "{report}");
    // Analyze uses the same volume.
    let analysis = json(&folder.run(&[&["analyze", "--json"], &volume[..], &steps].concat()));
    assert_eq!(analysis["dims"], serde_json::json!([14, 16, 15]));
    assert_eq!(analysis["n_events"], info["n_events"]);
}

#[test]
fn options_that_do_not_fit_a_volume_are_errors_of_one_line() {
    let folder = folder_with("vti_raw.vti");
    folder.write("a_2x2x2_uint8.raw", &[1, 2, 3, 4, 5, 6, 7, 8]);
    let file = "vti_raw.vti";
    // VTK marks an active array, which is the default.
    folder.run(&["analyze", file, "--json"]);
    for (arguments, code, part) in [
        (&[file, "--array", "pressure"][..], 3, "density, velocity"),
        (&[file, "--array", "velocity"], 3, "--channel 0 to 2"),
        (&[file, "--array", "velocity", "--channel", "3"], 3, "channel 3"),
        (&[file, "--array", "density", "--frame", "1"], 2, "--frame"),
        (&[file, "--array", "density", "--dims", "2x2x2"], 2, "dimensions"),
        (&["a_2x2x2_uint8.raw", "--crop", "0:3,:,:"], 2, "0:2"),
        (&["a_2x2x2_uint8.raw", "--smooth", "1mm"], 2, "unit"),
        (&["a_2x2x2_uint8.raw", "--downsample", "2"], 2, "at least 2"),
    ] {
        let line = folder.fails(&[&["analyze"], arguments].concat(), code);
        assert!(line.contains(part), "{arguments:?}: {line}");
    }
}
