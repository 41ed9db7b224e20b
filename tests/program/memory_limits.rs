//! Limits of memory: of the system (`ulimit -v`) and of `--max-memory`.

use std::process::Command;

use crate::common::program::{Folder, one_line, path, stderr};

/// Runs a command with so many megabytes of address space. Returns its exit code and the text on stderr.
fn limited(folder: &Folder, megabytes: usize, arguments: &[&str]) -> (Option<i32>, String) {
    let script = format!("ulimit -v {}; exec \"$0\" \"$@\"", 1000 * megabytes);
    let output = Command::new("sh")
        .args(["-c", &script])
        .arg(path())
        .args(arguments)
        .current_dir(folder.path())
        .env_remove("RUST_BACKTRACE")
        .output()
        .expect("sh runs");
    (output.status.code(), stderr(&output))
}

/// Most megabytes that the smallest program needs: its own code and data, and the first thread.
const LEAST: usize = 60;

#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_address_space_is_kept_or_ends_in_one_line() {
    let folder = Folder::with_phantom("torus:24");
    let before = folder.names();
    let mut n_refused = 0;
    for megabytes in [LEAST, 80, 100, 130, 160, 200, 250, 300] {
        for (arguments, refused) in [
            (&["compute", "-q", "--phantom", "noise:14", "--backend", "cpu", "-o", "o.isp"][..], 2),
            (&["extract", "s.isp", "-c", "50%", "-o", "o.ply", "-q"], 3),
            (&["html", "s.isp", "-o", "o.html", "-q"], 3),
        ] {
            let (code, printed) = limited(&folder, megabytes, arguments);
            let output = arguments[arguments.iter().position(|&a| a == "-o").expect("one") + 1];
            if code == Some(0) {
                assert_eq!(printed, "", "{arguments:?}");
                std::fs::remove_file(folder.path().join(output)).expect("written");
                continue;
            }
            n_refused += 1;
            assert_eq!(code, Some(refused), "{megabytes} MB, {arguments:?}: {printed}");
            let line = one_line(&printed);
            assert!(line.contains("ulimit -v") && line.contains("memory expected"), "{line}");
            assert_eq!(folder.names(), before);
        }
    }
    assert!(0 < n_refused && n_refused < 24, "{n_refused} of 24");
}

#[cfg(target_os = "linux")]
#[test]
fn no_driver_is_opened_in_little_address_space() {
    let folder = Folder::with_phantom("sphere:12");
    for megabytes in [300, 600, 800] {
        let (code, printed) = limited(&folder, megabytes, &["html", "s.isp", "-o", "o.html"]);
        assert_eq!(code, Some(0), "{megabytes} MB: {printed}");
        let line = printed.lines().find(|line| line.starts_with("no still picture"));
        assert!(line.is_some_and(|line| line.contains("ulimit -v")), "{printed}");
        let render = ["render", "s.isp", "-c", "50%", "-o", "o.png"];
        let (code, printed) = limited(&folder, megabytes, &render);
        assert_eq!(code, Some(1), "{megabytes} MB: {printed}");
        assert!(one_line(&printed).contains("ulimit -v"), "{printed}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_allocation_that_fails_in_spite_of_the_forecast_is_no_crash() {
    let folder = Folder::new();
    // The flag overrides the forecast.
    let compute = ["compute", "-q", "--phantom", "noise:24", "--backend", "cpu", "-o", "o.isp"];
    let (code, printed) =
        limited(&folder, LEAST, &[&compute[..], &["--max-memory", "1TB"]].concat());
    assert_eq!(code, Some(3), "{printed}");
    assert!(printed.starts_with("memory allocation of "), "{printed}");
    assert!(!folder.names().contains(&"o.isp".to_owned()));
}

#[test]
fn phantoms_beyond_a_limit_of_memory_are_computed_in_bricks() {
    let folder = Folder::new();
    let compute = ["compute", "--phantom", "blobs:40", "--backend", "cpu", "-o", "o.isp"];
    let output = folder.run(&[&compute[..], &["--max-memory", "70MB"]].concat());
    let printed = stderr(&output);
    assert!(printed.contains("in 8 bricks of about 16^3"), "{printed}");
}
