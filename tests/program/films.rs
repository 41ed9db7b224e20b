//! `render --turntable` and films: their pictures, and the files left where ffmpeg fails.
//!
//! A script replaces ffmpeg: the tests check its input and the handling of its output.

use std::os::unix::fs::PermissionsExt as _;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use crate::common::program;
use crate::common::program::{Folder, one_line, stderr};

const SIZE: [&str; 2] = ["--size", "96x64"];

/// Concatenates the pictures to a film and writes its arguments to `said`.
const JOINS: &str = r#"#!/bin/sh
[ "$1" = -version ] && exit 0
for last; do :; done
echo "$@" > "$SAID"
cat [0-9]*.png > "$last"
"#;

/// Fails after some output.
const FAILS: &str = r#"#!/bin/sh
[ "$1" = -version ] && exit 0
for last; do :; done
echo half > "$last"
echo "first line" >&2
echo "Unknown encoder 'libx264'" >&2
exit 1
"#;

/// Creates a file once it runs, and does not end within a test.
const LINGERS: &str = r#"#!/bin/sh
[ "$1" = -version ] && exit 0
for last; do :; done
echo half > "$last"
: > "$SAID"
exec sleep 100
"#;

/// Runs the program where `ffmpeg` is a script, or nothing.
fn run(folder: &Folder, ffmpeg: Option<&str>, arguments: &[&str]) -> Output {
    run_with(folder, ffmpeg, arguments, |_| ())
}

/// As [`run`]; `meanwhile` gets the running program.
fn run_with(
    folder: &Folder,
    ffmpeg: Option<&str>,
    arguments: &[&str],
    meanwhile: impl FnOnce(&Child),
) -> Output {
    let bin = tempfile::tempdir().expect("a folder");
    if let Some(script) = ffmpeg {
        let path = bin.path().join("ffmpeg");
        std::fs::write(&path, script).expect("written");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("set");
    }
    let path = match ffmpeg {
        Some(_) => format!("{}:/usr/bin:/bin", bin.path().display()),
        None => bin.path().display().to_string(),
    };
    let child = Command::new(program::path())
        .args(arguments)
        .current_dir(folder.path())
        .env("PATH", path)
        .env("SAID", folder.path().join("said"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    meanwhile(&child);
    child.wait_with_output().expect("it ends")
}

#[test]
fn a_turntable_goes_around_in_even_steps() {
    let folder = Folder::with_spectrum();
    let around = |name: &str, camera: &str, n: &str| {
        let flags = ["render", "s.isp", "-c", "50%", "--clip", "x:60%", "-o", name];
        folder.run(&[&flags[..], &["--camera", camera, "--turntable", n], &SIZE].concat());
    };
    around("a%d.png", "10,20", "4");
    around("b%02d.png", "100,20", "4");
    assert_eq!(
        folder.names(),
        [
            "a0.png", "a1.png", "a2.png", "a3.png", "b00.png", "b01.png", "b02.png", "b03.png",
            "s.isp"
        ]
    );
    // The other sweep begins a quarter later.
    for (a, b) in [("a1.png", "b00.png"), ("a3.png", "b02.png")] {
        assert!(folder.read(a) == folder.read(b), "{a} is not {b}");
    }
    assert!(folder.read("a0.png") != folder.read("a1.png"));
    for (n, output, message) in [
        ("1", "f%d.png", "turntable"),
        ("4", "f.png", "%04d"),
        ("4", "f%d.jpg", ".webm"),
        ("100001", "f%d.png", "turntable"),
    ] {
        let flags = ["render", "s.isp", "-c", "50%", "--turntable", n, "-o", output];
        let line = folder.fails(&flags, 2);
        assert!(line.contains(message), "{line}");
    }
    folder
        .fails(&["render", "s.isp", "--sweep", "0%:9%:3", "--turntable", "4", "-o", "f%d.png"], 2);
}

#[test]
fn a_film_is_made_of_the_pictures_that_files_would_have() {
    let folder = Folder::with_spectrum();
    let sweep = ["render", "s.isp", "--sweep", "30%:60%:3"];
    folder.run(&[&sweep[..], &SIZE, &["-o", "f%d.png"]].concat());
    for (name, extra, words) in [
        ("film.mp4", &["--fps", "12"][..], ["-framerate 12", "libx264", "format=yuv420p"]),
        ("film.webm", &[], ["-framerate 30", "libvpx-vp9", "format=yuv420p"]),
        ("clear.webm", &["--background", "transparent"], ["30", "vp9", "format=yuva420p"]),
    ] {
        let output = run(&folder, Some(JOINS), &[&sweep[..], &SIZE, &["-o", name], extra].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        if name != "clear.webm" {
            let pictures = ["f0.png", "f1.png", "f2.png"].map(|name| folder.read(name)).concat();
            assert!(folder.read(name) == pictures, "{name} has other pictures");
        }
        let printed = String::from_utf8(folder.read("said")).expect("text");
        assert!(words.iter().all(|word| printed.contains(word)), "{printed}");
        assert!(stderr(&output).contains(&format!("{name}: 3 pictures of 96x64")));
    }
    let names = folder.names();
    assert!(names.iter().all(|name| !name.contains(".part")), "nothing is left over: {names:?}");
}

#[test]
fn without_a_working_ffmpeg_there_is_one_line_and_no_film() {
    let folder = Folder::with_spectrum();
    folder.write("old.mp4", b"as it was");
    let before = folder.names();
    let turntable = ["render", "s.isp", "-c", "50%", "--turntable", "2", "-q"];
    let sized = |name, size, more: &[&'static str]| {
        [&turntable[..], &["-o", name, "--size", size], more].concat()
    };
    for (ffmpeg, arguments, code, message) in [
        (None, sized("old.mp4", "96x64", &[]), 2, "PATH"),
        (Some(FAILS), sized("old.mp4", "96x64", &[]), 3, "Unknown encoder"),
        (Some(FAILS), sized("new.webm", "96x64", &[]), 3, "new.webm: "),
        (Some(JOINS), sized("new.mp4", "95x64", &[]), 2, "even"),
        (Some(JOINS), sized("new.mp4", "96x64", &["--background", "transparent"]), 2, ".webm"),
        (Some(JOINS), sized("none/new.mp4", "96x64", &[]), 3, "none/new.mp4"),
        (Some(JOINS), sized("f%d.png", "96x64", &["--fps", "9"]), 2, "--fps"),
        (Some(JOINS), sized("new.mp4", "96x64", &["--fps", "0"]), 2, "--fps"),
    ] {
        let output = run(&folder, ffmpeg, &arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
        let line = one_line(&stderr(&output));
        assert!(line.contains(message), "{line}");
        assert_eq!(folder.names(), before, "{arguments:?}");
        assert_eq!(folder.read("old.mp4"), b"as it was");
    }
    let one = ["render", "s.isp", "-c", "50%", "-o", "one.mp4"];
    let line = folder.fails(&one, 2);
    assert!(line.contains(".png"), "{line}");
}

#[test]
fn an_interrupted_film_leaves_the_old_file() {
    let folder = Folder::with_spectrum();
    folder.write("old.mp4", b"as it was");
    let flags = ["render", "s.isp", "-c", "50%", "--turntable", "2", "-q", "-o", "old.mp4"];
    let interrupt = |child: &Child| {
        // As long as a loaded machine takes for two pictures, and longer.
        let begun = (0..600).any(|_| {
            std::thread::sleep(Duration::from_millis(100));
            folder.path().join("said").exists()
        });
        assert!(begun, "ffmpeg was not run");
        let id = child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &id]).status().expect("kill runs");
        assert!(sent.success());
    };
    let output = run_with(&folder, Some(LINGERS), &[&flags[..], &SIZE].concat(), interrupt);
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert_eq!(one_line(&stderr(&output)), "interrupted");
    assert_eq!(folder.names(), ["old.mp4", "s.isp", "said"]);
    assert_eq!(folder.read("old.mp4"), b"as it was");
}
