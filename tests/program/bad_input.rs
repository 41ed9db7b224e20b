//! Bad input: an error of one line, the right exit code, nothing written, no panic.

use crate::common::program;
use crate::common::program::{Folder, one_line, stderr};
use isospectrum::file;

const COMPUTE: [&str; 5] = ["compute", "--backend", "cpu", "-o", "s.isp"];

/// Computes from a volume that should be refused.
fn refused(folder: &Folder, arguments: &[&str], code: i32) -> String {
    folder.fails(&[&COMPUTE[..], arguments].concat(), code)
}

fn contains(line: &str, words: &[&str]) {
    for word in words {
        assert!(line.contains(word), "expected '{word}' in: {line}");
    }
}

#[test]
fn a_missing_file_is_named() {
    let folder = Folder::new();
    contains(
        &refused(&folder, &["no_2x2x2_uint8.raw"], 3),
        &["no_2x2x2_uint8.raw", "No such file"],
    );
    contains(&folder.fails(&["info", "no.isp"], 3), &["no.isp"]);
    contains(&folder.fails(&["extract", "no.isp", "-c", "1", "-o", "m.ply"], 3), &["no.isp"]);
}

#[test]
fn the_error_of_a_truncated_raw_names_both_lengths() {
    let folder = Folder::new();
    folder.write("a_4x4x4_uint8.raw", &[7; 63]);
    contains(&refused(&folder, &["a_4x4x4_uint8.raw"], 3), &["63 bytes", "expected 64"]);
}

#[test]
fn wrong_dimensions_are_refused_however_large() {
    let folder = Folder::new();
    folder.write("a.raw", &[7; 64]);
    for dims in ["4x4x5", "3x3x3", "1000000x1000000x1000000"] {
        let line = refused(&folder, &["a.raw", "--dims", dims, "--type", "uint8"], 3);
        contains(&line, &["64 bytes", "expected"]);
    }
    contains(&refused(&folder, &["a.raw"], 3), &["dimensions"]);
    contains(&refused(&folder, &["a.raw", "--dims", "4x4"], 2), &["--dims"]);
    let unknown = ["a.raw", "--dims", "4x4x4", "--type", "uint7"];
    contains(&refused(&folder, &unknown, 2), &["uint7"]);
}

#[test]
fn a_constant_volume_is_refused() {
    let folder = Folder::new();
    folder.write("a_4x4x4_uint8.raw", &[7; 64]);
    let words = ["every sample is 7", "two different values"];
    contains(&refused(&folder, &["a_4x4x4_uint8.raw"], 3), &words);
}

#[test]
fn nan_is_named_with_its_position_and_can_be_replaced() {
    let folder = Folder::new();
    let mut samples: Vec<f32> = (0..64).map(|i| i as f32).collect();
    samples[1 + 4 * (2 + 4 * 3)] = f32::NAN;
    let bytes: Vec<u8> = samples.iter().flat_map(|s| s.to_le_bytes()).collect();
    folder.write("a_4x4x4_float32.raw", &bytes);
    contains(&refused(&folder, &["a_4x4x4_float32.raw"], 3), &["(1, 2, 3)", "NaN", "--nan-as"]);
    let analyze = ["analyze", "a_4x4x4_float32.raw", "--samples", "2"];
    folder.fails(&analyze, 3);
    folder.run(&[&analyze[..], &["--nan-as", "-1"]].concat());
}

#[test]
fn fewer_than_two_samples_along_an_axis_are_refused() {
    let folder = Folder::new();
    folder.write("a_4x4x1_uint8.raw", &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
    contains(&refused(&folder, &["a_4x4x1_uint8.raw"], 3), &["4x4x1", "at least 2"]);
    folder.write("b_0x4x4_uint8.raw", &[]);
    contains(&refused(&folder, &["b_0x4x4_uint8.raw"], 3), &["0x4x4"]);
}

#[test]
fn a_file_that_is_not_a_volume_is_refused() {
    let folder = Folder::new();
    folder.write("a.txt", b"no volume");
    contains(&refused(&folder, &["a.txt"], 3), &["a.txt"]);
    folder.write("a.nrrd", b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4\n\n");
    contains(&refused(&folder, &["a.nrrd"], 3), &["a.nrrd"]);
    folder.write("a.npy", b"\x93NUMPY\x01\x00");
    contains(&refused(&folder, &["a.npy"], 3), &["a.npy"]);
}

#[test]
fn invalid_flags_are_usage_errors() {
    let folder = Folder::new();
    let sphere = ["--phantom", "sphere:8"];
    for (wrong, word) in [
        (&["--error", "0"][..], "--error"),
        (&["--error", "nan"], "--error"),
        (&["--step", "-1"], "a number above 0"),
        (&["--smooth", "-1"], "a number of at least 0"),
        (&["--median", "-1"], "-1 is not in 1..=64"),
        (&["--step", "1", "--samples", "5"], "--samples"),
        (&["--samples", "1"], "--samples"),
        (&["--min-quality", "1.5"], "--min-quality"),
        (&["--range", "5"], "--range"),
        (&["--range", "0.5:0.1"], "range 0.5:0.1"),
        (&["--threads", "0"], "--threads"),
        (&["--initial-mesh", "m.ply"], "--start"),
        (&["--nonsense"], "--nonsense"),
        (&["--dims", "4x4x4"], "--dims"),
    ] {
        contains(&refused(&folder, &[&sphere, wrong].concat(), 2), &[word]);
    }
    contains(&refused(&folder, &["--phantom", "dragon"], 2), &["dragon", "sphere"]);
    contains(&refused(&folder, &["--phantom", "sphere:100000000"], 2), &["sphere:100000000"]);
    contains(&folder.fails(&["compute", "-o", "s.isp"], 2), &["VOLUME"]);
    contains(&folder.fails(&["frobnicate"], 2), &["frobnicate"]);
}

#[test]
fn an_isovalue_outside_the_range_is_exit_code_4_with_the_range() {
    let folder = Folder::with_spectrum();
    for isovalue in ["1e9", "-1e9", "101%", "-1%"] {
        let line = folder.fails(&["extract", "s.isp", "-c", isovalue, "-o", "m.ply"], 4);
        contains(&line, &["outside the range", "to"]);
    }
    for isovalue in ["", "half", "nan", "inf"] {
        folder.fails(&["extract", "s.isp", "-c", isovalue, "-o", "m.ply"], 2);
    }
    contains(&folder.fails(&["extract", "s.isp", "-c", "1", "-o", "m.xyz"], 2), &[".ply"]);
}

#[test]
fn a_damaged_spectrum_is_exit_code_3_wherever_it_is_damaged() {
    let folder = Folder::with_spectrum();
    let bytes = folder.read("s.isp");
    folder.write("empty.isp", b"");
    folder.write("text.isp", b"this is not a spectrum, not even nearly one");
    folder.write("short.isp", &bytes[..bytes.len() - 1]);
    folder.write("long.isp", &[&bytes[..], b"x"].concat());
    for name in ["empty.isp", "text.isp", "short.isp", "long.isp"] {
        contains(&folder.fails(&["info", name], 3), &[name]);
    }
    for place in (0..bytes.len()).step_by(bytes.len() / 16) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 0x40;
        folder.write("damaged.isp", &damaged);
        let extract = ["extract", "damaged.isp", "-c", "50%", "-o", "m.ply"];
        contains(&folder.fails(&extract, 3), &["damaged.isp"]);
    }
}

#[test]
fn an_adapter_that_is_not_there_is_an_error_of_one_line() {
    let folder = Folder::new();
    let gpu = ["--phantom", "sphere:8", "--backend", "gpu", "--adapter", "nonexistent"];
    let line = folder.fails(&[&["compute", "-o", "s.isp"][..], &gpu].concat(), 1);
    contains(&line, &["nonexistent"]);
    let both = ["--phantom", "sphere:8", "--adapter", "some"];
    contains(&refused(&folder, &both, 2), &["--adapter"]);
}

#[test]
fn a_missing_folder_is_an_error_before_the_work() {
    let folder = Folder::with_spectrum();
    let large = ["compute", "--phantom", "hydrogen:256", "-o", "no/s.isp"];
    contains(&folder.fails(&large, 3), &["no/s.isp", "the folder no does not exist"]);
    let extract = ["extract", "s.isp", "-c", "50%", "-o", "no/m.ply"];
    contains(&folder.fails(&extract, 3), &["no/m.ply", "the folder no does not exist"]);
    let here = ["extract", "s.isp", "-c", "50%", "-o", ".", "--format", "ply"];
    contains(&folder.fails(&here, 3), &["."]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_and_leaves_nothing() {
    let folder = Folder::with_spectrum();
    let shell = |script: &str| {
        let output = folder.shell(script);
        (output.status.code(), one_line(&stderr(&output)))
    };
    for command in ["extract s.isp -c 50% -q -o - >/dev/full", "info s.isp >/dev/full"] {
        let (code, line) = shell(&format!("\"$0\" {command}"));
        assert_eq!(code, Some(3), "{line}");
        contains(&line, &["standard output", "No space left"]);
    }
    // A file may grow to one block of 512 bytes only; the signal that would end the program is
    // ignored, so that writing fails as on a full disk.
    let extract = "trap '' XFSZ; ulimit -f 1; \"$0\" extract s.isp -c 50% -q -o m.ply";
    let (code, line) = shell(extract);
    assert_eq!(code, Some(3), "{line}");
    contains(&line, &["m.ply"]);
    assert_eq!(folder.names(), ["s.isp"]);
}

#[test]
fn an_existing_output_survives_an_error() {
    let folder = Folder::with_spectrum();
    folder.write("m.ply", b"precious");
    folder.fails(&["extract", "s.isp", "-c", "1e9", "-o", "m.ply"], 4);
    assert_eq!(folder.read("m.ply"), b"precious");
}

/// A PLY file in text.
fn ply(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    );
    for [x, y, z] in positions {
        text += &format!("{x} {y} {z}\n");
    }
    for [a, b, c] in triangles {
        text += &format!("3 {a} {b} {c}\n");
    }
    text.into_bytes()
}

#[test]
fn an_initial_mesh_that_does_not_fit_the_volume_is_refused() {
    let folder = Folder::with_spectrum();
    folder.run(&["extract", "s.isp", "-c", "0.4", "-o", "good.ply"]);
    let good = isospectrum::export::read_ply(folder.path().join("good.ply")).expect("a mesh");
    let (positions, triangles) = (&good.positions[..], &good.triangles[..]);
    let doubled: Vec<[f64; 3]> = [positions, positions].concat();
    let n = positions.len() as u32;
    let twice =
        [triangles, &triangles.iter().map(|t| t.map(|v| v + n)).collect::<Vec<_>>()].concat();
    let moved = |p: [f64; 3]| -> Vec<[f64; 3]> { [&[p], &positions[1..]].concat() };
    for (bytes, words) in [
        (b"no mesh".to_vec(), &["no PLY file"][..]),
        (ply(positions, &[]), &["no triangles"]),
        (ply(positions, &triangles[1..]), &["is open", "two triangles of opposite direction"]),
        (ply(positions, &[triangles, &triangles[..1]].concat()), &["non-manifold"]),
        (ply(&moved([5.5; 3]), triangles), &["vertex 0", "from the isosurface", "at most 0.5"]),
        (ply(&moved([5.5, 5.5, 0.0]), triangles), &["vertex 0", "must be extracted"]),
        (ply(&doubled, &twice), &["vertices 0 and", "same component"]),
    ] {
        folder.write("bad.ply", &bytes);
        let start = ["--phantom", "sphere:12", "--start", "0.4", "--initial-mesh", "bad.ply"];
        let line = refused(&folder, &start, 3);
        contains(&line, &[&["bad.ply: "], words].concat());
    }
    let missing = ["--phantom", "sphere:12", "--start", "0.4", "--initial-mesh", "no.ply"];
    contains(&refused(&folder, &missing, 3), &["no.ply", "No such file"]);
    let good = ["--phantom", "sphere:12", "--start", "0.4", "--initial-mesh", "good.ply"];
    folder.run(&[&COMPUTE[..], &good].concat());
}

/// Runs the program with a time limit of two minutes, after which it counts as hanging.
#[cfg(target_os = "linux")]
fn ended(folder: &Folder, arguments: &[&str]) -> (Option<i32>, String) {
    let output = std::process::Command::new("timeout")
        .arg("120")
        .arg(program::path())
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .expect("timeout runs");
    (output.status.code(), stderr(&output))
}

#[cfg(target_os = "linux")]
#[test]
fn special_files_are_refused_without_waiting() {
    let folder = Folder::with_spectrum();
    let mkfifo = std::process::Command::new("mkfifo")
        .args(["p.isp", "p.nrrd", "p_2x2x2_uint8.raw", "p.ply"])
        .current_dir(folder.path())
        .status();
    assert!(mkfifo.expect("mkfifo runs").success());
    folder.write(
        "a.nhdr",
        b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: p.nrrd\n\n",
    );
    let start = ["--phantom", "sphere:12", "--start", "0.4", "--initial-mesh", "p.ply"];
    for (arguments, name) in [
        (&["info", "p.isp"][..], "p.isp"),
        (&["extract", "p.isp", "-c", "1", "-o", "m.ply"], "p.isp"),
        (&["convert", "p.isp", "q.isp"], "p.isp"),
        (&["verify", "s.isp", "p_2x2x2_uint8.raw"], "p_2x2x2_uint8.raw"),
        (&["analyze", "p.nrrd"], "p.nrrd"),
        (&["analyze", "a.nhdr"], "p.nrrd"),
        (&[&COMPUTE[..], &start].concat(), "p.ply"),
        (&["info", "/dev/zero"], "/dev/zero"),
        (&["info", "."], "."),
    ] {
        let (code, printed) = ended(&folder, arguments);
        assert_eq!(code, Some(3), "{arguments:?}: {printed}");
        contains(&one_line(&printed), &[name, "not a regular file"]);
    }
}

#[test]
fn no_infinity_reaches_a_file() {
    let folder = Folder::new();
    let mut samples = [0f64; 27];
    samples[13] = 1e300;
    let bytes: Vec<u8> = samples.iter().flat_map(|s| s.to_le_bytes()).collect();
    folder.write("h_3x3x3_float64.raw", &bytes);
    folder.run(&["compute", "h_3x3x3_float64.raw", "--backend", "cpu", "-o", "h.isp"]);
    let line = folder.fails(&["convert", "h.isp", "h.thesis"], 3);
    contains(&line, &["h.isp: isovalue", "layout of the thesis"]);
    // An origin beyond 32-bit floats, which meshes use: volumes are refused there, but a spectrum file can contain it.
    folder.write("a_3x3x3_float64.raw", &samples.map(|s| s / 1e300).map(f64::to_le_bytes).concat());
    let far = ["a_3x3x3_float64.raw", "--origin", "1e300,0,0"];
    contains(&refused(&folder, &far, 3), &["origin", "1e15"]);
    folder.run(&["compute", "--backend", "cpu", "a_3x3x3_float64.raw", "-o", "near.isp"]);
    let spectrum = file::from_bytes(&folder.read("near.isp")).expect("just written");
    let far = spectrum.changed(|about, _| about.volume.placement.origin = [1e300, 0.0, 0.0]);
    let spectrum = far.expect("valid");
    folder.write("far.isp", &file::to_bytes(&spectrum).expect("a valid spectrum"));
    for name in ["m.ply", "m.stl", "m.obj", "m.glb"] {
        let line = folder.fails(&["extract", "far.isp", "-c", "50%", "-o", name], 3);
        contains(&line, &["far.isp: vertex 0", "inf", "32-bit floats"]);
    }
}

#[test]
fn a_spectrum_beyond_the_budget_that_was_set_is_refused() {
    let folder = Folder::new();
    let compute = ["compute", "--phantom", "noise:8", "--backend", "cpu", "-o", "s.isp"];
    for (flag, value) in [("--max-triangles", "10"), ("--max-memory", "1kB")] {
        let line = folder.fails(&[&compute[..], &[flag, value]].concat(), 2);
        let what = if flag == "--max-triangles" { "triangles (more" } else { "memory (more" };
        // Only the exceeded limit is named.
        assert!(line.contains(what) && line.contains("--range"), "{line}");
        assert_eq!(line.matches("more than").count(), 1, "{line}");
    }
    for (flag, value) in [("--max-triangles", "0"), ("--max-memory", "much")] {
        folder.fails(&[&compute[..], &[flag, value]].concat(), 2);
    }
    let budget = ["--max-triangles", "1e9", "--max-memory", "1TB"];
    folder.run(&[&compute[..], &budget[..]].concat());
    assert_eq!(folder.names(), ["s.isp"]);
}

#[test]
fn numbers_beyond_reach_are_refused() {
    let folder = Folder::with_spectrum();
    for (flag, code, word) in [
        ("--start=-1e9", 4, "-1000000000"),
        ("--start=1e9", 4, "1000000000"),
        ("--starts=0", 2, "expected 1 to 256"),
        ("--starts=1000", 2, "expected 1 to 256"),
        ("--step=1e-9", 2, "at most 1000000"),
        ("--samples=4294967295", 2, "at most 1000000"),
        ("--relax-iterations=4294967295", 2, "at most 10000"),
    ] {
        let compute = ["compute", "--phantom", "sphere:8", "--backend", "cpu", "-o", "t.isp", flag];
        contains(&folder.fails(&compute, code), &[word]);
    }
    let verify = ["verify", "s.isp", "--phantom", "sphere:12", "--n", "18446744073709551615"];
    contains(&folder.fails(&verify, 2), &["at most 1000000"]);
    let center = ["render", "s.isp", "-c", "50%", "-o", "s.png", "--color-center", "nan"];
    contains(&folder.fails(&center, 2), &["--color-center", "expected a number"]);
    let outside = ["analyze", "--phantom", "sphere:12", "--range", "1e8:1e9"];
    contains(&folder.fails(&outside, 2), &["range 100000000 to 1000000000"]);
}
