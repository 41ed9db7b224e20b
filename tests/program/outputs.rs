//! Output files: an output is never an input, links stay links, and a command that is stopped leaves no files.

use std::io::BufRead as _;

use crate::common::program;
use crate::common::program::{Folder, stderr};
use crate::common::random::Random;
use crate::common::synthetic::{Growth, growing_sphere};

/// A volume whose computation takes no time.
fn write_volume(folder: &Folder, name: &str) -> Vec<u8> {
    let samples: Vec<u8> = (0..64).map(|i| if i == 21 { 200 } else { i }).collect();
    folder.write(name, &samples);
    samples
}

#[test]
fn an_output_is_never_an_input() {
    let folder = Folder::with_spectrum();
    let volume = write_volume(&folder, "v_4x4x4_uint8.raw");
    let spectrum = folder.read("s.isp");
    folder.run(&["extract", "s.isp", "-c", "0.4", "-o", "start.ply"]);
    let mesh = folder.read("start.ply");
    std::fs::copy(folder.path().join("s.isp"), folder.path().join("s.png")).expect("copied");
    std::fs::copy(folder.path().join("start.ply"), folder.path().join("start.isp"))
        .expect("copied");
    std::fs::copy(folder.path().join("s.isp"), folder.path().join("f1.png")).expect("copied");
    folder.write("v.isp", &volume);
    folder.write("v.raw", &volume);
    folder.write(
        "d.nhdr",
        b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\ndata file: v.raw\n\n",
    );
    let compute = ["compute", "--backend", "cpu"];
    let raw = "v_4x4x4_uint8.raw";
    let as_raw = ["--dims", "4x4x4", "--type", "uint8"];
    let start = ["--phantom", "sphere:12", "--start", "0.4", "--initial-mesh", "start.isp"];
    let noise = ["--persistence", "1"];
    for arguments in [
        [&compute[..], &[raw, "-o", raw]].concat(),
        [&compute[..], &["v.isp", "-o", "v.isp"], &as_raw].concat(),
        [&compute[..], &["v.isp", "-o", "./v.isp"], &as_raw].concat(),
        [&compute[..], &start, &["-o", "start.isp"]].concat(),
        vec!["extract", "s.isp", "-c", "50%", "-o", "s.isp", "--format", "ply"],
        vec!["extract", "s.png", "-c", "50%", "-o", "s.png", "--format", "ply"],
        vec!["convert", "s.isp", "s.isp"],
        vec!["render", "s.png", "-c", "50%", "-o", "s.png"],
        vec!["render", "f1.png", "--sweep", "10%:90%:3", "-o", "f%d.png"],
        vec!["html", "s.isp", "-o", "s.isp"],
        [&["analyze", raw, "--simplified", raw][..], &noise].concat(),
        [&["analyze", "d.nhdr", "--simplified", "v.raw"][..], &noise].concat(),
        vec!["analyze", raw, "--plot", raw],
        vec!["analyze", "d.nhdr", "--plot", "v.raw"],
    ] {
        folder.fails(&arguments, 2);
    }
    for name in [raw, "v.isp", "v.raw"] {
        assert_eq!(folder.read(name), volume, "{name}");
    }
    for name in ["s.isp", "s.png", "f1.png"] {
        assert_eq!(folder.read(name), spectrum, "{name}");
    }
    assert_eq!(folder.read("start.isp"), mesh);
}

#[cfg(unix)]
#[test]
fn hard_and_symbolic_links_to_an_input_are_recognised() {
    let folder = Folder::new();
    let volume = write_volume(&folder, "v_4x4x4_uint8.raw");
    let at = |name: &str| folder.path().join(name);
    std::os::unix::fs::symlink("v_4x4x4_uint8.raw", at("soft.isp")).expect("a link");
    std::fs::hard_link(at("v_4x4x4_uint8.raw"), at("hard.isp")).expect("a link");
    for output in ["soft.isp", "hard.isp"] {
        let line = folder.fails(&["compute", "v_4x4x4_uint8.raw", "-o", output], 2);
        assert!(line.contains(output) && line.contains("v_4x4x4_uint8.raw"), "{line}");
        assert_eq!(folder.read(output), volume);
    }
}

#[test]
fn the_output_of_compute_must_be_named_isp() {
    let folder = Folder::with_spectrum();
    for output in ["s.raw", "s", "s.ply", "s.thesis"] {
        let compute = ["compute", "--phantom", "sphere:8", "--backend", "cpu", "-o", output];
        let line = folder.fails(&compute, 2);
        assert!(line.contains(".isp"), "{line}");
    }
    for output in ["m.isp", "m.stl"] {
        let extract = ["extract", "s.isp", "-c", "50%", "-o", output, "--format", "ply"];
        assert!(folder.fails(&extract, 2).contains("--format"));
    }
}

#[test]
fn the_name_of_a_simplified_volume_must_match_its_type() {
    let folder = Folder::new();
    write_volume(&folder, "v_4x4x4_uint8.raw");
    let samples: Vec<u8> = (0..64).flat_map(|i| (i as f32).to_le_bytes()).collect();
    folder.write("f_4x4x4_float32.raw", &samples);
    let analyze = |volume: &str, output: &str, code: i32| -> String {
        let arguments = ["analyze", volume, "-q", "--persistence", "1", "--simplified", output];
        match code {
            0 => stderr(&folder.run(&arguments)),
            _ => folder.fails(&arguments, code),
        }
    };
    let float = "f_4x4x4_float32.raw";
    assert!(analyze(float, "n_4x4x4_uint8.raw", 2).contains("out_4x4x4_float64.raw"));
    assert!(analyze(float, "n_2x4x8_float32.raw", 2).contains("4x4x4 float64"));
    assert!(analyze(float, "n.nrrd", 2).contains(".raw"));
    analyze(float, "n_4x4x4_float64.raw", 0);
    analyze(float, "n.raw", 0);
    let both = ["analyze", float, "--persistence", "1", "--simplified", "b.raw", "--plot", "b.raw"];
    assert!(folder.fails(&both, 2).contains("two files"));
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_its_target_is_written() {
    let folder = Folder::with_spectrum();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("far")).expect("a folder");
    folder.write("far/old.ply", b"before");
    for (link, target) in [("old.ply", "far/old.ply"), ("new.ply", "far/new.ply")] {
        std::os::unix::fs::symlink(target, at(link)).expect("a link");
    }
    // A link to a link to a file that is not there yet.
    std::os::unix::fs::symlink("new.ply", at("twice.ply")).expect("a link");
    for (link, target) in [("old.ply", "far/old.ply"), ("twice.ply", "far/new.ply")] {
        folder.run(&["extract", "s.isp", "-c", "50%", "-o", link]);
        assert!(at(link).symlink_metadata().expect("there").is_symlink(), "{link}");
        assert!(folder.read(target).starts_with(b"ply\n"), "{target}");
    }
    std::os::unix::fs::symlink("nowhere/m.ply", at("lost.ply")).expect("a link");
    std::os::unix::fs::symlink("circle.ply", at("circle.ply")).expect("a link");
    for link in ["lost.ply", "circle.ply"] {
        let line = folder.fails(&["extract", "s.isp", "-c", "50%", "-o", link], 3);
        assert!(line.starts_with(link), "{line}");
        assert!(at(link).symlink_metadata().expect("there").is_symlink(), "{link}");
    }
}

/// The arguments that compute a small spectrum in bricks, in a folder next to it.
const PARTS: [&str; 8] =
    ["compute", "--phantom", "noise:9:4", "--backend", "cpu", "--brick", "4", "-q"];

/// A command that computes in bricks.
fn in_bricks(name: &str) -> Vec<&str> {
    [&PARTS[..], &["-o", name]].concat()
}

#[cfg(unix)]
#[test]
fn the_folder_of_a_killed_run_is_removed_by_the_next_one_but_not_that_of_a_living_run() {
    let folder = Folder::new();
    let hidden = || {
        let names = folder.names();
        names.into_iter().filter(|name| name.starts_with('.')).collect::<Vec<_>>()
    };
    let mut child = std::process::Command::new(program::path())
        .args(["compute", "--phantom", "hydrogen:96", "--backend", "cpu", "--brick", "24"])
        .args(["-o", "x.isp", "-v"])
        .current_dir(folder.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    let stderr = child.stderr.take().expect("piped");
    let mut lines = std::io::BufReader::new(stderr).lines();
    assert!(lines.any(|line| line.is_ok_and(|line| line.contains("bricks of about"))));
    let of_child = hidden();
    assert_eq!(of_child.len(), 1, "{of_child:?}");
    folder.run(&in_bricks("x.isp"));
    assert_eq!(hidden(), of_child, "the run is alive");
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert_eq!(hidden(), of_child, "nobody could remove it");
    // Files of others, another output, and what has no lock.
    folder.write(".isospectrum-mine.part", b"mine");
    std::fs::create_dir(folder.path().join(".isospectrum-2.part")).expect("made");
    folder.run(&in_bricks("y.isp"));
    assert!(hidden().contains(&of_child[0]), "another output");
    let foreign = format!("{}/notes.txt", of_child[0]);
    folder.write(&foreign, b"mine");
    folder.run(&in_bricks("x.isp"));
    assert_eq!(folder.read(&foreign), b"mine");
    std::fs::remove_file(folder.path().join(&foreign)).expect("there");
    folder.run(&in_bricks("x.isp"));
    assert_eq!(hidden(), [".isospectrum-2.part", ".isospectrum-mine.part"]);
}

#[cfg(unix)]
#[test]
fn the_file_of_a_killed_run_is_removed_by_the_next_one_but_not_that_of_a_living_run() {
    let folder = Folder::with_spectrum();
    let name = |output: &str, n: usize| {
        format!(".isospectrum-{:08x}-{n}.part", crc32fast::hash(output.as_bytes()))
    };
    let (killed, living, other) = (name("o.ply", 0), name("o.ply", 1), name("p.ply", 0));
    for file in [&killed, &living, &other] {
        folder.write(file, b"half of a mesh");
    }
    let lock = std::fs::File::open(folder.path().join(&living)).expect("readable");
    lock.lock().expect("locked");
    folder.run(&["extract", "s.isp", "-c", "50%", "-o", "o.ply", "-q"]);
    let mut expected = [living, other, "o.ply".to_owned(), "s.isp".to_owned()];
    expected.sort();
    assert_eq!(folder.names(), expected);
}

/// Sends a signal to a command, run with `-v`, once it has printed a text. Returns the exit code and the lines after that.
#[cfg(unix)]
fn stopped(
    folder: &Folder,
    arguments: &[&str],
    printed: &str,
    signal: &str,
) -> (Option<i32>, Vec<String>) {
    let mut child = std::process::Command::new(program::path())
        .args(arguments)
        .arg("-v")
        .current_dir(folder.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut lines = std::io::BufReader::new(child.stderr.take().expect("piped")).lines();
    assert!(lines.any(|line| line.is_ok_and(|line| line.contains(printed))), "{arguments:?}");
    let sent = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    (child.wait().expect("the program ends").code(), rest)
}

#[cfg(unix)]
#[test]
fn a_termination_signal_leaves_no_files() {
    let folder = Folder::new();
    let compute = ["compute", "--phantom", "hydrogen:96", "--backend", "cpu", "-o", "s.isp"];
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        // Once the sweep begins.
        let (found, printed) = stopped(&folder, &compute, "Forecast", signal);
        assert_eq!(found, Some(code), "{signal}");
        assert_eq!(printed.last().map(String::as_str), Some("isospectrum: interrupted"));
        assert_eq!(folder.names(), [] as [&str; 0]);
    }
}

#[cfg(unix)]
#[test]
fn a_signal_stops_work_that_does_not_poll_for_it() {
    let folder = Folder::new();
    let growth = Growth { subdivisions: 8, n_steps: 1, splits: 0, flips: 0, knot_distance: 1 };
    isospectrum::file::write(&growing_sphere(&growth), folder.path().join("large.isp"))
        .expect("written");
    // Noise from sample to sample: a million critical points.
    let mut random = Random(1);
    let noise = (0..96 * 96 * 96).flat_map(|_| (random.unit() as f32).to_le_bytes());
    let volume = "n_96x96x96_float32.raw";
    folder.write(volume, &noise.collect::<Vec<u8>>());
    // `done` would be printed after the work during which the signal is sent.
    for (arguments, begun, done) in [
        (&["compute", volume, "--backend", "cpu", "-o", "s.isp"][..], "96x96x96", "Forecast"),
        (&["analyze", volume, "--samples", "2"], "96x96x96", "critical points"),
        (&["html", "large.isp", "-o", "p.html"], "packing", "packed"),
    ] {
        for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
            let (found, printed) = stopped(&folder, arguments, begun, signal);
            assert_eq!(found, Some(code), "{arguments:?}: {printed:?}");
            assert_eq!(printed.last().map(String::as_str), Some("isospectrum: interrupted"));
            assert!(!printed.iter().any(|line| line.contains(done)), "{arguments:?}: {printed:?}");
            assert_eq!(folder.names(), ["large.isp", volume]);
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn help_to_a_full_device_is_an_error() {
    let folder = Folder::with_spectrum();
    for command in [
        "--help",
        "--version",
        "help",
        "help compute",
        "compute --help",
        "completions bash",
        "info s.isp",
        "info s.isp --json",
        "analyze --phantom sphere:8 --samples 2",
        "verify s.isp --phantom sphere:12 --n 1 --json",
    ] {
        let script = format!("\"$0\" {command} >/dev/full");
        let output = folder.shell(&script);
        let printed = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{command}: {printed}");
        assert!(printed.contains("standard output: No space left"), "{command}: {printed}");
    }
    // The message is lost; the exit code stays.
    let output = folder.shell("\"$0\" info no.isp 2>/dev/full");
    assert_eq!(output.status.code(), Some(3));
}
