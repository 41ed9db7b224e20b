//! Volumes at the limits of floating point numbers: they are computed, or refused in one line.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::program::{Folder, one_line, path};
use crate::common::spectra::assert_isosurfaces;
use isospectrum::file;
use isospectrum::volume::{ReadOptions, read_volume};

/// Time limit, after which the program counts as hanging; its runs here take seconds.
const TIME_LIMIT: Duration = Duration::from_secs(300);

/// Runs the program and expects it to end with an exit code. Returns the text on stderr.
fn ends(folder: &Folder, arguments: &[&str], code: i32) -> String {
    let printed = folder.path().join("said");
    let stderr = std::fs::File::create(&printed).expect("a file");
    let mut command = Command::new(path());
    command.args(arguments).current_dir(folder.path()).stdout(Stdio::null()).stderr(stderr);
    let mut child = command.spawn().expect("the program runs");
    let begin = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child") {
            break status;
        }
        if begin.elapsed() > TIME_LIMIT {
            child.kill().expect("killed");
            panic!("{arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let printed = std::fs::read_to_string(printed).expect("text");
    let printed: String = printed
        .lines()
        .filter(|line| !line.contains("XDG_RUNTIME_DIR"))
        .map(|line| format!("{line}\n"))
        .collect();
    assert_eq!(status.code(), Some(code), "{arguments:?}: {printed}");
    assert!(!printed.contains("internal"), "{arguments:?}: {printed}");
    printed
}

fn bytes(samples: impl IntoIterator<Item = f64>) -> Vec<u8> {
    samples.into_iter().flat_map(f64::to_le_bytes).collect()
}

const COMPUTE: [&str; 6] = ["compute", "-q", "--backend", "cpu", "-o", "s.isp"];

fn compute<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    [&COMPUTE[..], arguments].concat()
}

#[test]
fn a_range_that_underflows_is_refused_in_one_line() {
    let folder = Folder::new();
    let mut one = [0.0; 8];
    one[7] = 1e-323;
    folder.write("a_2x2x2_float64.raw", &bytes(one));
    folder.write("b_8x8x8_float64.raw", &bytes((0..512).map(|i| f64::from(i * 37 % 101) * 5e-324)));
    for volume in ["a_2x2x2_float64.raw", "b_8x8x8_float64.raw"] {
        let all = [vec!["analyze", volume], compute(&[volume])];
        for arguments in all {
            let line = one_line(&ends(&folder, &arguments, 3));
            assert!(line.contains("1e-290"), "{line}");
        }
    }
}

/// Noise of samples that are all different: an offset plus multiples of a step.
fn offset_noise(offset: f64, step: f64, n: u32) -> Vec<u8> {
    bytes((0..n).map(|i| offset + f64::from(i.wrapping_mul(2_654_435_761) % n) * step))
}

/// Computes a volume with some flags and asserts that its meshes have the topology of the isosurfaces at `isovalues` of its range.
fn assert_computed(
    name: &str,
    samples: &[u8],
    flags: &[&str],
    isovalues: impl FnOnce((f64, f64)) -> Vec<f64>,
) {
    let folder = Folder::new();
    folder.write(name, samples);
    ends(&folder, &compute(&[&[name], flags].concat()), 0);
    let spectrum = file::read(folder.path().join("s.isp")).expect("a spectrum");
    let volume = read_volume(&folder.path().join(name), &ReadOptions::default());
    let volume = volume.expect("a volume");
    let what = format!("{name} {flags:?}");
    assert_isosurfaces(&volume, &spectrum, &isovalues(volume.range()), &what);
}

#[test]
fn ranges_that_are_small_next_to_their_offset_are_computed() {
    // With 10^15 and 1/8, and with whole numbers from 5 * 10^15 on, no number lies between two samples.
    let volumes = [
        ("a_4x4x4_float64.raw", offset_noise(1e15, 0.125, 64)),
        ("b_10x10x10_float64.raw", offset_noise(1e13, 1.0 / 128.0, 1000)),
        ("c_10x10x10_float64.raw", offset_noise(5e15, 1.0, 1000)),
        ("d_6x6x6_float64.raw", offset_noise(1e12, 0.125, 216)),
        ("e_6x6x6_float64.raw", offset_noise(-1e14, 0.125, 216)),
    ];
    for (name, samples) in volumes {
        assert_computed(name, &samples, &[], |(low, high)| {
            let share = |i: u32| (f64::from(i) + 0.37) / 120.0;
            (0..120).map(|i| low + share(i) * (high - low)).collect()
        });
    }
}

#[test]
fn spacings_that_no_mesh_can_hold_are_refused_in_one_line() {
    let folder = Folder::new();
    let samples: Vec<u8> = (0..216u32).map(|i| (i * 37 % 101) as u8).collect();
    folder.write("a_6x6x6_uint8.raw", &samples);
    let header =
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 6 6 6\nencoding: raw\nspacings: 1 1 1e39\n\n";
    folder.write("b.nrrd", &[header.as_bytes(), &samples].concat());
    for (volume, spacing, words) in [
        ("a_6x6x6_uint8.raw", Some("1e-320,1,1e308"), "1e-15 to 1e15"),
        ("b.nrrd", None, "1e-15 to 1e15"),
    ] {
        let mut arguments = compute(&[volume]);
        arguments.extend(spacing.iter().flat_map(|s| ["--spacing", s]));
        let line = one_line(&ends(&folder, &arguments, 3));
        assert!(line.contains(words), "{line}");
    }
    assert!(!folder.names().contains(&"s.isp".to_owned()));
}

#[test]
fn long_cells_are_computed() {
    let folder = Folder::new();
    let samples: Vec<u8> = (0..216u32).map(|i| (i * 37 % 101) as u8).collect();
    folder.write("a_6x6x6_uint8.raw", &samples);
    for spacing in ["1,1,100", "1e-10,1,1"] {
        ends(&folder, &compute(&["a_6x6x6_uint8.raw", "--spacing", spacing]), 0);
    }
}

#[test]
fn max_edge_may_be_below_the_least_target_length() {
    let folder = Folder::new();
    ends(&folder, &compute(&["--phantom", "sphere:8", "--max-edge", "0.34"]), 0);
}

#[test]
fn ranges_within_a_grey_level_are_computed() {
    let noise: Vec<u8> = (0..512u32).map(|i| (i * 37 % 101) as u8).collect();
    let mask: Vec<u8> = (0..512u32).map(|i| u8::from(i * 37 % 101 > 60)).collect();
    for (samples, range, low, high) in [
        (&noise, "50:50.4", 50.0, 50.4),
        (&noise, "50.2:50.20001", 50.2, 50.20001),
        (&mask, "0.4:0.6", 0.4, 0.6),
        (&mask, "40%:60%", 0.4, 0.6),
    ] {
        for flags in [&["--range", range][..], &["--range", range, "--brick", "4"]] {
            assert_computed("a_8x8x8_uint8.raw", samples, flags, |_| {
                [0.0, 0.31, 0.77, 1.0].iter().map(|t| low * (1.0 - t) + high * t).collect()
            });
        }
    }
}

#[test]
fn ranges_of_few_floating_point_numbers_are_computed() {
    let is_high = |i: u32| i * 37 % 101 > 60;
    let mask =
        |low: f64, high: f64, n: u32| bytes((0..n).map(|i| if is_high(i) { high } else { low }));
    let volumes = [
        ("a_9x9x9_float64.raw", mask(0.3, 0.1 + 0.2, 729)),
        ("b_2x2x2_float64.raw", mask(1.0, 1.0f64.next_up(), 8)),
        ("c_2x2x2_float64.raw", mask(1e15, 1e15 + 0.125, 8)),
        ("d_3x4x9_float64.raw", offset_noise(-1e12, 1.0 / 8192.0, 108)),
        ("e_8x3x7_float64.raw", offset_noise(1e15, 0.125, 27).repeat(7)[..8 * 168].to_vec()),
    ];
    for (name, samples) in volumes {
        for flags in [&[][..], &["--error", "0.02"], &["--brick", "4"]] {
            assert_computed(name, &samples, flags, |(low, high)| {
                vec![low, low.next_up(), 0.5 * low + 0.5 * high, high.next_down(), high]
            });
        }
    }
}

#[test]
fn removing_noise_from_samples_a_few_units_in_the_last_place_apart_ends() {
    let folder = Folder::new();
    let near = |i: u32| f64::from_bits(1e15f64.to_bits() + u64::from(i * 37 % 11));
    folder.write("v_4x4x4_float64.raw", &bytes((0..64).map(near)));
    let printed = ends(&folder, &compute(&["v_4x4x4_float64.raw", "--persistence", "5%"]), 3);
    assert!(one_line(&printed).contains("expected a range of at least"), "{printed}");
}
