//! The program as its users see it: commands, files, reports, exit codes.

use crate::common::program::{Folder, json, stderr};

#[test]
fn a_spectrum_is_computed_summarised_extracted_and_verified() {
    let folder = Folder::with_spectrum();
    let info = json(&folder.run(&["info", "s.isp", "--json"]));
    assert_eq!(info["volume"]["dims"], serde_json::json!([12, 12, 12]));
    for count in ["n_vertices", "n_triangles", "n_knots", "bytes"] {
        assert!(info[count].as_u64().is_some_and(|n| n > 0), "{count}: {info}");
    }
    assert_eq!(info["bytes"].as_u64(), Some(folder.read("s.isp").len() as u64));
    assert!(info["range"][0].as_f64() < info["range"][1].as_f64());
    assert!(info["events"].as_array().is_some_and(|e| e.iter().all(serde_json::Value::is_number)));
    assert_eq!(info["backend"], "cpu");
    assert!(info["adapter"].is_null() && info["parameters"].is_object());
    assert!(info["tolerance"].as_f64().is_some_and(|h| h > 0.0));

    folder.run(&["extract", "s.isp", "--isovalue", "50%", "-o", "m.ply"]);
    assert!(folder.read("m.ply").starts_with(b"ply\nformat binary_little_endian 1.0\n"));

    let verify = ["verify", "s.isp", "--phantom", "sphere:12", "--n", "8", "--json"];
    let report = json(&folder.run(&verify));
    assert_eq!(report["passed"], true, "{report}");
    assert_eq!(report["totals"]["topology_right"], report["totals"]["isovalues"]);
    assert_eq!(report["totals"]["manifold"], report["totals"]["isovalues"]);
    assert_eq!(report["rows"][0]["expected_components"], 1);
}

#[test]
fn the_same_input_gives_the_same_bytes_with_any_number_of_threads() {
    let folder = Folder::with_spectrum();
    let compute = ["compute", "--phantom", "sphere:12", "--backend", "cpu", "-q"];
    folder.run(&[&compute[..], &["-o", "one.isp", "--threads", "1"]].concat());
    folder.run(&[&compute[..], &["-o", "three.isp", "--threads", "3"]].concat());
    assert_eq!(folder.read("one.isp"), folder.read("three.isp"));
    assert_eq!(folder.read("one.isp"), folder.read("s.isp"));
}

#[test]
fn every_format_is_chosen_by_the_extension_and_stdout_is_data_only() {
    let folder = Folder::with_spectrum();
    for (extension, start) in [("ply", &b"ply\n"[..]), ("glb", b"glTF"), ("obj", b""), ("stl", b"")]
    {
        let name = format!("m.{extension}");
        let output = folder.run(&["extract", "s.isp", "-c", "50%", "-o", &name]);
        assert!(output.stdout.is_empty());
        let bytes = folder.read(&name);
        assert!(bytes.len() > 1000 && bytes.starts_with(start), "{extension}");
        let piped = ["extract", "s.isp", "-c", "50%", "-o", "-", "--format", extension];
        assert_eq!(folder.run(&piped).stdout, bytes, "{extension}");
    }
}

#[test]
fn an_empty_surface_explains_itself() {
    let folder = Folder::with_spectrum();
    let output = folder.run(&["extract", "s.isp", "-c", "100%", "-o", "m.ply"]);
    let printed = stderr(&output);
    assert!(printed.contains("is empty") && printed.contains("the range is"), "{printed}");
    assert!(folder.read("m.ply").starts_with(b"ply\n"));
}

#[test]
fn isovalues_are_printed_with_significant_digits_only() {
    let folder = Folder::with_spectrum();
    // Percentages whose isovalues are not short decimals.
    for percent in ["10%", "33.3%", "70%"] {
        let printed = stderr(&folder.run(&["extract", "s.isp", "-c", percent, "-o", "m.ply"]));
        let (_, isovalue) = printed.split_once("isovalue ").expect("the isovalue is printed");
        let digits =
            isovalue.chars().take_while(|c| c.is_ascii_digit() || ".-".contains(*c)).count();
        assert!((1..=8).contains(&digits), "{printed}");
    }
}

#[test]
fn reports_have_a_name_and_a_version() {
    let folder = Folder::with_spectrum();
    for (report, arguments) in [
        ("info", &["info", "s.isp"][..]),
        ("analyze", &["analyze", "--phantom", "sphere:12", "--samples", "4"]),
        ("verify", &["verify", "s.isp", "--phantom", "sphere:12", "--n", "2"]),
        ("extract", &["extract", "s.isp", "-c", "50%", "-o", "m.stl"]),
        ("compute", &["compute", "--phantom", "sphere:8", "--backend", "cpu", "-o", "t.isp"]),
    ] {
        let value = json(&folder.run(&[arguments, &["--json"]].concat()));
        assert_eq!((&value["report"], &value["version"]), (&report.into(), &2.into()));
    }
}

#[test]
fn compute_prints_the_quality_and_only_with_v_the_counts_of_the_sweep() {
    let folder = Folder::new();
    let compute = ["compute", "--phantom", "sphere:8", "--backend", "cpu", "-o", "s.isp"];
    let printed = stderr(&folder.run(&compute));
    for wanted in
        ["done in", "tracked", "% of the area", "within 0.1 voxel", "radius ratio", "size"]
    {
        assert!(printed.contains(wanted), "no '{wanted}' in: {printed}");
    }
    assert!(!printed.contains("exchanges") && !printed.contains("steps"), "{printed}");
    assert!(stderr(&folder.run(&[&compute[..], &["-v"]].concat())).contains("exchanges"));
    let report = json(&folder.run(&[&compute[..], &["--json"]].concat()));
    assert!(report["counts"]["exchanges_refused"].is_number(), "{report}");
    let share = report["tracked_area_share"].as_f64().expect("a share");
    // A sphere is one mesh that moves, but close to its last isovalues.
    assert!((0.5..=1.0).contains(&share), "{share}");
    let within = report["measured"]["within_tolerance_share"].as_f64().expect("a share");
    assert!((0.5..=1.0).contains(&within), "{within}");
    assert!(report["measured"]["radius_ratio"].as_f64().is_some_and(|r| (0.5..1.0).contains(&r)));
}

#[test]
fn analyze_suggests_the_isovalue_that_separates_most_components() {
    let folder = Folder::new();
    let mut samples = [0u8; 9 * 5 * 5];
    // Three peaks on a plane; the others branch off from the component of the highest.
    for (x, height) in [(2, 100), (4, 200), (6, 60)] {
        samples[x + 9 * (2 + 5 * 2)] = height;
    }
    folder.write("peaks_9x5x5_uint8.raw", &samples);
    let analyze = ["analyze", "peaks_9x5x5_uint8.raw", "--samples", "2", "--json"];
    let candidates = json(&folder.run(&analyze))["candidates"].clone();
    let found = candidates.as_array().and_then(|c| c.iter().find(|c| c["by"] == "persistence"));
    let found = found.expect("a candidate");
    assert_eq!(found["n_branches"], 2);
    assert_eq!(found["isovalue"].as_f64(), Some(30.0), "{found}");
}

#[test]
fn analyze_and_info_count_the_same_events() {
    let folder = Folder::new();
    // A plateau in few grey levels: the exact topology has more critical points than the volume has events.
    let samples: Vec<u8> = (0..7 * 7 * 7u32).map(|i| (i * i % 11 / 4) as u8).collect();
    folder.write("v_7x7x7_uint8.raw", &samples);
    folder.run(&["compute", "-q", "v_7x7x7_uint8.raw", "--backend", "cpu", "-o", "v.isp"]);
    let info = json(&folder.run(&["info", "v.isp", "--json"]));
    let analysis = json(&folder.run(&["analyze", "v_7x7x7_uint8.raw", "--samples", "2", "--json"]));
    for count in ["n_events", "n_event_isovalues"] {
        assert!(info[count].as_u64().is_some_and(|n| n > 0), "{info}");
        assert_eq!(info[count], analysis[count], "{count}");
    }
    assert_eq!(
        analysis["events"].as_array().map(Vec::len),
        info["events"].as_array().map(Vec::len)
    );
    assert!(analysis["n_critical_points"].as_u64() > analysis["n_events"].as_u64());
    // The tables show the same numbers.
    let events = format!("{} at {} isovalues", info["n_events"], info["n_event_isovalues"]);
    for arguments in [&["info", "v.isp"][..], &["analyze", "v_7x7x7_uint8.raw", "--samples", "2"]] {
        let output = folder.run(arguments);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(text.contains(&events), "no '{events}' in: {text}");
        let is_analysis = arguments[0] == "analyze";
        assert_eq!(text.contains("caps"), is_analysis, "{text}");
    }
}

#[test]
fn quiet_prints_nothing() {
    let folder = Folder::with_spectrum();
    let output = folder.run(&["extract", "s.isp", "-c", "50%", "-o", "m.ply", "-q"]);
    assert!(output.stdout.is_empty());
    assert_eq!(stderr(&output), "");
}

#[test]
fn without_a_terminal_there_are_no_colours_and_no_progress_bar() {
    let folder = Folder::new();
    let compute = ["compute", "--phantom", "sphere:8", "--backend", "cpu", "-o", "s.isp", "-v"];
    let printed = stderr(&folder.run(&compute));
    assert!(!printed.contains('\u{1b}') && !printed.contains('\r'), "{printed}");
}

#[test]
fn the_topology_of_a_sphere_is_one_component_and_its_curves_are_drawn() {
    let folder = Folder::new();
    let analyze = ["analyze", "--phantom", "sphere:24", "--samples", "8", "--range", "60%:95%"];
    let report = json(&folder.run(&[&analyze[..], &["--json", "--plot", "c.svg"]].concat()));
    assert!(folder.read("c.svg").starts_with(b"<svg"));
    // The isosurface c of the phantom is the sphere of radius r = 1 - c in units of half the
    // volume's 23 cells, all inside the volume over this range. Flat triangles with edges of a voxel
    // lose about 1 / (8 r^2) of its area, and the trilinear interpolation of the distance about as
    // much: 1.6 % at 4 voxels; twice that is allowed.
    const SHARE: f64 = 0.032;
    let curves = report["curves"].as_array().expect("curves");
    assert_eq!(curves.len(), 8);
    for curve in curves {
        assert_eq!((&curve["components"], &curve["handles"]), (&1.into(), &0.into()));
        let radius = (1.0 - curve["isovalue"].as_f64().expect("a number")) * 11.5;
        let area = curve["area"].as_f64().expect("a number");
        let expected = 4.0 * std::f64::consts::PI * radius * radius;
        if radius > 4.0 {
            assert!((area / expected - 1.0).abs() < SHARE, "{area}, expected {expected}");
        }
    }
}

#[test]
fn a_spectrum_goes_to_the_layout_of_the_thesis_and_back() {
    let folder = Folder::with_spectrum();
    folder.run(&["convert", "s.isp", "s.thesis"]);
    folder.run(&["convert", "s.thesis", "back.isp"]);
    let count = |name: &str| json(&folder.run(&["info", name, "--json"]))["n_triangles"].clone();
    assert_eq!(count("back.isp"), count("s.isp"));
    let output = folder.run_for(&["convert", "s.isp", "s.txt"], 2);
    assert!(stderr(&output).contains(".isp or .thesis"));
}

#[test]
fn a_spectrum_of_another_volume_does_not_pass() {
    let folder = Folder::with_spectrum();
    let output = folder.run_for(&["verify", "s.isp", "--phantom", "sphere:13"], 3);
    assert!(stderr(&output).contains("expected 12x12x12"), "{}", stderr(&output));
}

#[test]
fn an_exceeded_limit_is_exit_code_5_with_the_reason() {
    let folder = Folder::with_spectrum();
    let verify = ["verify", "s.isp", "--phantom", "sphere:12", "--n", "8", "--max-deviation", "0"];
    let output = folder.run_for(&verify, 5);
    let printed = stderr(&output);
    let reason =
        "isospectrum: s.isp: verification failed: barycentres from isosurface, 99 % within: 0.";
    assert!(printed.starts_with(reason), "{printed}");
    let report = String::from_utf8_lossy(&output.stdout);
    // The report is printed nevertheless, with passed and failed limits.
    assert!(report.contains("promised 0 voxel: NOT KEPT") && report.contains(": kept"), "{report}");
    assert!(!report.contains("refused."), "counts of the sweep are for -v: {report}");
}

#[test]
fn completions_are_printed_for_every_shell() {
    let folder = Folder::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let output = folder.run(&["completions", shell]);
        assert!(String::from_utf8_lossy(&output.stdout).contains("isospectrum"), "{shell}");
    }
}

#[test]
fn help_and_version_are_printed_on_stdout() {
    let folder = Folder::new();
    let help = folder.run(&["--help"]);
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    for command in [
        "compute",
        "extract",
        "info",
        "analyze",
        "verify",
        "render",
        "convert",
        "demo",
        "completions",
    ] {
        assert!(text.contains(command), "{command}");
        assert!(!folder.run(&[command, "--help"]).stdout.is_empty());
    }
    assert!(text.contains("Exit codes"));
    assert!(folder.run(&["--version"]).stdout.starts_with(b"isospectrum "));
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_error() {
    let folder = Folder::with_spectrum();
    let script = "{ \"$0\" extract s.isp -c 50% -o -; echo code $? >&2; } | head -c 4 >/dev/null";
    let printed = stderr(&folder.shell(script));
    assert!(printed.contains("code 0") && !printed.contains("isospectrum:"), "{printed}");
}

#[test]
fn the_demo_writes_a_spectrum_and_a_mesh_and_names_them() {
    let folder = Folder::new();
    let demo = ["demo", "--phantom", "sphere:12", "--backend", "cpu", "-o", "out", "--json"];
    let output = folder.run(&demo);
    let summary = json(&output);
    let files = summary["files"].as_array().expect("files");
    assert!(files.len() >= 2, "{summary}");
    for file in files {
        let file = file.as_str().expect("a name");
        assert!(!folder.read(file).is_empty(), "{file}");
    }
    // Either the pictures exist, or a message gives the reason.
    assert!(files.len() == 5 || stderr(&output).contains("no pictures: "), "{summary}");
}
