//! Messages: no control characters, no output of other libraries, suggestions for misspelt and swapped arguments, errors
//! before work that cannot fit into memory.

use crate::common::program;
use crate::common::program::{Folder, stderr};
use isospectrum::spectrum::Metadata;

/// Sets the title of a window, clears the screen, and contains a line that imitates a message of the program.
const TRAP: &str = "\u{1b}]0;gone\u{7}\u{1b}[2J\u{9b}2J\nisospectrum: all is well";

/// The first control character of an output, if there is one.
fn control(printed: &[u8]) -> Option<char> {
    String::from_utf8_lossy(printed).chars().find(|&c| c.is_control() && c != '\n')
}

fn check_plain(output: &std::process::Output, n_lines: usize) {
    assert_eq!(control(&output.stdout), None, "{}", String::from_utf8_lossy(&output.stdout));
    assert_eq!(control(&output.stderr), None, "{}", stderr(output));
    assert!(stderr(output).lines().count() <= n_lines, "{}", stderr(output));
    let says_well = |text: &[u8]| {
        String::from_utf8_lossy(text).lines().any(|line| line.starts_with("isospectrum: all is"))
    };
    assert!(!says_well(&output.stdout) && !says_well(&output.stderr));
}

#[test]
fn control_characters_in_names_and_fields_are_escaped() {
    let folder = Folder::with_spectrum();
    let spectrum = folder.read("s.isp");
    // Names of files, in errors and in reports.
    let named = |ending: &str| format!("{TRAP}{ending}");
    folder.write(&named(".isp"), &spectrum);
    folder.write(&named("_2x2x2_uint8.raw"), &[1, 2, 3, 4, 5, 6, 7]);
    let isp = named(".isp");
    for (arguments, code) in [
        (&["info", &named("")][..], 3),
        (&["info", &isp], 0),
        (&["extract", &isp, "-c", "1e9", "-o", "m.ply"], 4),
        (&["extract", &isp, "-c", "50%", "-o", &named(".ply")], 0),
        (&["analyze", &named("_2x2x2_uint8.raw")], 3),
        (&["compute", "--phantom", TRAP, "-o", "t.isp"], 2),
        (&[TRAP], 2),
        (&["info", "--", TRAP], 3),
    ] {
        check_plain(&folder.run_for(arguments, code), 1);
    }
    // Fields of headers.
    let nrrd = |field: &str| {
        format!("NRRD0004\n{field}\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n12345678")
            .into_bytes()
    };
    let escape = "\u{1b}[2J\u{7}";
    for field in
        [format!("type: {escape}"), format!("type: uint8\nspace: {escape}"), format!("{escape}: 1")]
    {
        folder.write("a.nrrd", &nrrd(&field));
        // Some are errors, some are skipped.
        let analyze = std::process::Command::new(program::path())
            .args(["analyze", "a.nrrd", "--samples", "2"])
            .current_dir(folder.path())
            .output();
        check_plain(&analyze.expect("the program runs"), 1);
    }
    folder.write("a.ply", format!("ply\nformat {escape} 1.0\nend_header\n").as_bytes());
    let start = ["--phantom", "sphere:8", "--start", "0.4", "--initial-mesh", "a.ply"];
    let compute = ["compute", "--backend", "cpu", "-o", "t.isp"];
    check_plain(&folder.run_for(&[&compute[..], &start].concat(), 3), 1);
}

#[test]
fn control_characters_in_a_spectrum_are_shown_escaped() {
    let folder = Folder::with_spectrum();
    let path = folder.path().join("s.isp");
    let spectrum = isospectrum::file::read(&path).expect("a spectrum");
    let mut metadata = serde_json::json!(spectrum.parameters());
    metadata["backend"] = TRAP.into();
    metadata["counts"] = serde_json::json!({ TRAP: TRAP });
    let spectrum = spectrum.changed(|about, _| {
        about.volume.name = TRAP.repeat(1000);
        about.volume.sample_type = TRAP.into();
        about.parameters = Metadata::from_json(&metadata.to_string()).expect("JSON");
    });
    let spectrum = spectrum.expect("valid");
    isospectrum::file::write(&spectrum, &path).expect("written");
    let output = folder.run(&["info", "s.isp"]);
    check_plain(&output, 0);
    assert!(output.stdout.len() < 4000, "{} bytes", output.stdout.len());
    let info = folder.run(&["info", "s.isp", "--json"]);
    assert_eq!(control(&info.stdout), None);
    assert_eq!(program::json(&info)["adapter"], TRAP, "JSON has it all, escaped");
}

#[test]
fn a_long_name_is_shortened() {
    let folder = Folder::new();
    let long = "x".repeat(900_000);
    let head = format!("NRRD0004\ntype: {long}\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n");
    folder.write("a.nrrd", head.as_bytes());
    let line = folder.fails(&["analyze", "a.nrrd"], 3);
    assert!(line.starts_with("a.nrrd: ") && line.len() < 2000, "{} bytes", line.len());
    let line = folder.fails(&["analyze", "--phantom", &long[..100_000]], 2);
    assert!(line.len() < 2000, "{} bytes", line.len());
}

#[test]
fn no_library_prints_to_stderr() {
    let folder = Folder::with_spectrum();
    for arguments in [
        &["compute", "--phantom", "sphere:8", "--backend", "gpu", "-o", "t.isp"][..],
        &["render", "s.isp", "-c", "50%", "-o", "a.png", "--size", "8x8"],
        &["html", "s.isp", "-o", "a.html"],
    ] {
        let mut command = std::process::Command::new(program::path());
        command.args(arguments).arg("-q").current_dir(folder.path());
        for unset in ["XDG_RUNTIME_DIR", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            command.env_remove(unset);
        }
        for relative in [false, true] {
            if relative {
                command
                    .env("XDG_RUNTIME_DIR", "no/absolute/path")
                    .env("WAYLAND_DISPLAY", "wayland-0");
            }
            let output = command.output().expect("the program runs");
            assert_eq!(output.status.code(), Some(0), "{arguments:?}");
            assert_eq!(stderr(&output), "", "{arguments:?}");
        }
    }
}

#[test]
fn misspelt_arguments_get_a_suggestion() {
    let folder = Folder::new();
    for (arguments, meant) in [
        (&["rendr", "s.isp"][..], "'render'"),
        (&["compute", "--phantm", "sphere:8"], "'--phantom'"),
        (&["compute", "--phantom", "sphere:8", "--backend", "cpy", "-o", "s.isp"], "'cpu'"),
    ] {
        let line = folder.fails(arguments, 2);
        assert!(line.contains("did you mean") && line.contains(meant), "{line}");
    }
}

#[test]
fn swapped_arguments_are_recognised() {
    let folder = Folder::with_spectrum();
    folder.write("v_2x2x2_uint8.raw", &[1, 2, 3, 4, 5, 6, 7, 8]);
    std::fs::copy(folder.path().join("s.isp"), folder.path().join("odd.name")).expect("copied");
    for (arguments, words) in [
        (&["verify", "v_2x2x2_uint8.raw", "s.isp"][..], &["verify s.isp v_2x2x2_uint8.raw"][..]),
        (&["verify", "s.isp", "s.isp"], &["s.isp: a spectrum", "expected a volume"]),
        (&["extract", "v_2x2x2_uint8.raw", "-c", "1", "-o", "m.ply"], &["a volume", "compute"]),
        (&["info", "v_2x2x2_uint8.raw"], &["a volume", "expected a spectrum"]),
        (&["render", "v_2x2x2_uint8.raw", "-c", "1", "-o", "m.png"], &["a volume", "compute"]),
        (&["html", "v_2x2x2_uint8.raw", "-o", "m.html"], &["a volume", "compute"]),
        (&["compute", "s.isp", "-o", "t.isp"], &["a spectrum", "expected a volume"]),
        (&["compute", "odd.name", "-o", "t.isp"], &["a spectrum", "expected a volume"]),
        (&["analyze", "s.isp"], &["a spectrum", "expected a volume"]),
    ] {
        let line = folder.fails(arguments, 2);
        for word in words {
            assert!(line.contains(word), "expected '{word}' in: {line}");
        }
    }
    // A missing argument is named as well.
    assert!(folder.fails(&["extract", "v_2x2x2_uint8.raw"], 2).contains("--isovalue"));
}

#[cfg(target_os = "linux")]
#[test]
fn too_little_memory_is_an_error_before_the_work() {
    let folder = Folder::new();
    let script =
        "ulimit -v 100000; \"$0\" compute --phantom noise:24 --backend cpu --threads 1 -o s.isp";
    let output = folder.shell(script);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    let line = program::one_line(&text);
    assert!(line.contains("address space") && line.contains("--max-memory"), "{line}");
    assert_eq!(folder.names(), [] as [&str; 0]);
}

#[test]
fn compute_says_which_promise_a_mask_breaks_and_what_helps() {
    let folder = Folder::new();
    // A diagonal thread.
    let is_in_thread = |i: usize| i % 9 < 8 && i == (i % 9) * (1 + 9 + 81);
    let samples: Vec<u8> = (0..9 * 9 * 9).map(|i| u8::from(is_in_thread(i))).collect();
    folder.write("mask_9x9x9_uint8.raw", &samples);
    let compute = ["compute", "mask_9x9x9_uint8.raw", "--backend", "cpu", "-o", "s.isp", "--json"];
    let output = folder.run(&compute);
    let text = stderr(&output);
    let line = text.lines().find(|line| line.contains("does not keep its promises"));
    let line = line.unwrap_or_else(|| panic!("{text}"));
    assert!(line.contains("two values only: --smooth 0.5"), "{line}");
    let report = program::json(&output);
    let [broken, uncertain] = ["broken_promises", "uncertain_promises"]
        .map(|list| report[list].as_array().expect("a list"));
    assert!(!broken.is_empty());
    assert!(uncertain.iter().all(|promise| line.contains(promise.as_str().expect("text"))));
    let verified = folder.run_for(&["verify", "s.isp", "mask_9x9x9_uint8.raw", "-q"], 5);
    let verified = stderr(&verified);
    for promise in broken {
        let promise = promise.as_str().expect("text");
        assert!(verified.contains(promise) && line.contains(promise), "{promise}: {verified}");
    }
}

#[test]
fn html_reports_what_it_packs() {
    let folder = Folder::with_spectrum();
    let text = stderr(&folder.run(&["html", "s.isp", "-o", "a.html"]));
    assert!(text.lines().next().is_some_and(|line| line.starts_with("packing ")), "{text}");
    let text = stderr(&folder.run(&["html", "s.isp", "-o", "b.html", "-c", "100%"]));
    assert!(text.contains("is empty"), "{text}");
}

#[cfg(target_os = "linux")]
#[test]
fn progress_is_shown_on_a_terminal() {
    let folder = Folder::new();
    // `script` gives a terminal.
    let compute =
        format!("{} compute --phantom sphere:16 --backend cpu -o s.isp", program::path().display());
    let output = std::process::Command::new("script")
        .args(["-qec", &compute, "/dev/null"])
        .current_dir(folder.path())
        .output()
        .expect("script runs");
    let seen = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && seen.contains(" % "), "{seen}");
}
