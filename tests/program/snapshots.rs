//! The wording of help, reports and messages: one file per command in `snapshots/`.
//!
//! A line that starts with `$ ` is a command line, which runs in a folder with the spectrum `s.isp`. The lines up to the
//! next one are what it prints on stderr, then on stdout, then `? CODE` if the exit code is not 0. `[..]` stands for any text
//! within a line. To accept new wording: `SNAPSHOTS=overwrite cargo test --test program snapshots`, then read `git diff`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::common::program::{Folder, path};

fn snapshot_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/snapshots").join(name)
}

/// Runs a command line of a snapshot. Returns what it prints.
fn printed(folder: &Folder, line: &str) -> String {
    let arguments: Vec<&str> = line.split_whitespace().skip(1).collect();
    let output = std::process::Command::new(path())
        .args(&arguments)
        .current_dir(folder.path())
        // The width to which help is wrapped.
        .env("COLUMNS", "80")
        .output()
        .expect("the program runs");
    let [err, out] =
        [output.stderr, output.stdout].map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
    // Times differ from run to run.
    let without_time = |line: &str| match line.split_once("done in ") {
        Some((head, _)) => format!("{head}done in [..] s\n"),
        None => format!("{line}\n"),
    };
    let mut text: String = (err + &out).lines().map(without_time).collect();
    if !output.status.success() {
        let _ = writeln!(text, "? {}", output.status.code().expect("an exit code"));
    }
    text
}

/// True if a line is as expected, where `[..]` matches any text.
fn matches(expected: &str, line: &str) -> bool {
    let mut parts = expected.split("[..]");
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = line.strip_prefix(first) else { return false };
    let mut is_exact = true;
    for part in parts {
        is_exact = part.is_empty();
        match rest.rfind(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.is_empty() || is_exact && expected.ends_with("[..]")
}

/// Compares a snapshot with what the program prints, or rewrites it.
fn check(name: &str) {
    let file = snapshot_file(name);
    let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let folder = Folder::with_spectrum();
    let mut found = String::new();
    for block in format!("\n{text}").split("\n$ ").skip(1) {
        let (command, expected) = block.split_once('\n').unwrap_or((block, ""));
        let printed = printed(&folder, command);
        let _ = writeln!(found, "$ {command}");
        // A line that matches keeps its placeholders.
        let mut expected = expected.lines();
        for line in printed.lines() {
            let line = line.trim_end();
            let known = expected.clone().position(|expected| matches(expected, line));
            let line = known.and_then(|n| expected.nth(n)).unwrap_or(line);
            let _ = writeln!(found, "{line}");
        }
        found.push('\n');
    }
    if std::env::var_os("SNAPSHOTS").is_some_and(|wish| wish == "overwrite") {
        std::fs::write(&file, &found).expect("written");
        return;
    }
    let (mut expected, mut found) = (text.lines(), found.lines());
    for number in 1.. {
        match (expected.next(), found.next()) {
            (None, None) => break,
            (expected, found) => assert_eq!(found, expected, "{}:{number}", file.display()),
        }
    }
}

macro_rules! snapshots {
    ($($name:ident)*) => {
        $(#[test] fn $name() { check(concat!(stringify!($name), ".txt")); })*

        #[test]
        fn every_snapshot_is_checked() {
            let names = [$(stringify!($name)),*];
            for entry in std::fs::read_dir(snapshot_file("")).expect("readable") {
                let path = entry.expect("readable").path();
                let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
                assert!(names.contains(&&*name), "{name}");
            }
        }
    };
}

snapshots! {
    isospectrum compute plan merge extract components info analyze verify render html convert demo completions usage
}

#[test]
fn placeholders_match_any_text_of_a_line() {
    assert!(matches("done in [..] s", "done in 0.1 s") && matches("[..]", "") && matches("a", "a"));
    assert!(matches("size [..]", "size 12 kB") && matches("a [..] b [..] c", "a 1 b 2 c"));
    assert!(!matches("done in [..] s", "done in 0.1 min") && !matches("a", "ab"));
}
