//! Masks and removal of small components: the remaining surface, the reports, and verification.

use crate::common::program::{Folder, json, stderr};
use isospectrum::export::parse_ply;

const N: usize = 16;

/// The raw file of a function of 16^3 samples.
fn write(folder: &Folder, name: &str, f: impl Fn([f64; 3]) -> f64) {
    let at = |i: usize| [i % N, i / N % N, i / (N * N)].map(|p| p as f64);
    let samples: Vec<u8> = (0..N * N * N).map(|i| f(at(i)).round() as u8).collect();
    folder.write(&format!("{name}_16x16x16_uint8.raw"), &samples);
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|a| (p[a] - q[a]).powi(2)).sum::<f64>().sqrt()
}

const MIDDLE: [f64; 3] = [8.0, 7.0, 8.0];
const RADIUS: f64 = 5.0;

fn is_inside(p: [f64; 3]) -> bool {
    distance(p, MIDDLE) < RADIUS
}

/// A slope, whose isosurfaces are planes, a mask that is a ball, and the spectrum of both.
fn masked() -> Folder {
    let folder = Folder::new();
    write(&folder, "slope", |[x, y, z]| 9.0 * x + 5.0 * y + z);
    write(&folder, "ball", |p| if is_inside(p) { 7.0 } else { 0.0 });
    let printed = folder.run(&[
        "compute",
        "slope_16x16x16_uint8.raw",
        "-o",
        "m.isp",
        "--mask",
        "ball_16x16x16_uint8.raw",
        "--backend",
        "cpu",
    ]);
    assert!(stderr(&printed).contains("11.841 %"), "{}", stderr(&printed));
    folder
}

/// The corners of all triangles of a mesh of the spectrum at 115, which passes the middle of the ball.
fn triangles(folder: &Folder, flags: &[&str]) -> Vec<[[f64; 3]; 3]> {
    folder.run(&[&["extract", "m.isp", "-c", "115", "-o", "m.ply"], flags].concat());
    let mesh = parse_ply(&folder.read("m.ply")).expect("a mesh");
    let corner = |v: u32| mesh.positions[v as usize].map(f64::from);
    mesh.triangles.iter().map(|t| t.map(corner)).collect()
}

/// The number of edges with a triangle on one side only.
fn n_open_sides(triangles: &[[[f64; 3]; 3]]) -> usize {
    let bits = |p: [f64; 3]| p.map(f64::to_bits);
    let sides = |t: &[[f64; 3]; 3]| [0, 1, 2].map(|i| (bits(t[i]), bits(t[(i + 1) % 3])));
    let all: std::collections::BTreeSet<_> = triangles.iter().flat_map(sides).collect();
    all.iter().filter(|(a, b)| !all.contains(&(*b, *a))).count()
}

fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    0.5 * distance(cross, [0.0; 3])
}

/// Maximum distance of a triangle's middle from the place at which the mask was looked up, voxels: lifetimes are cut into pieces
/// of a quarter of a voxel, and the mask is looked up in the middle of each.
const MAX_OFFSET: f64 = 0.125;

/// Maximum relative error of the area, compared with the disc in the ball: a mask ends at voxels and a mesh at triangles of
/// up to a voxel each; half a voxel all around would be 2 * 0.5 / 5.
const MAX_AREA_ERROR: f64 = 0.2;

#[test]
fn a_masked_surface_is_open_at_the_border_of_the_mask() {
    let folder = masked();
    let open = triangles(&folder, &[]);
    for t in &open {
        let middle = [0, 1, 2].map(|a| (t[0][a] + t[1][a] + t[2][a]) / 3.0);
        let near = [-MAX_OFFSET, 0.0, MAX_OFFSET].map(|d| [d, 0.0, 0.0]);
        let turned = |d: [f64; 3]| (0..3).map(move |n| [0, 1, 2].map(|a| d[(a + n) % 3]));
        let mut near = near.into_iter().flat_map(turned);
        let is_near = |d: [f64; 3]| is_inside([0, 1, 2].map(|a| (middle[a] + d[a]).round()));
        assert!(near.any(is_near), "{middle:?}");
        // All on the plane: a wall along the border of the mask would not be.
        let off = (9.0 * middle[0] + 5.0 * middle[1] + middle[2] - 115.0).abs() / 107f64.sqrt();
        assert!(off < 0.3, "{middle:?} is {off} voxels from the plane");
    }
    let found: f64 = open.iter().map(|&t| area(t)).sum();
    let disc = std::f64::consts::PI * RADIUS * RADIUS;
    assert!((found / disc - 1.0).abs() < MAX_AREA_ERROR, "area {found}, of a disc {disc}");
    assert!(n_open_sides(&open) > 0);
    assert_eq!(open.len(), triangles(&folder, &["--open"]).len());
    let closed = triangles(&folder, &["--closed"]);
    assert_eq!(n_open_sides(&closed), 0);
    assert!(closed.len() > open.len());
}

#[test]
fn the_mask_is_stored_shown_by_info_and_applied_by_verify() {
    let folder = masked();
    let output = folder.run(&["info", "m.isp"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("mask ball_16x16x16_uint8.raw"), "{text}");
    std::fs::remove_file(folder.path().join("ball_16x16x16_uint8.raw")).expect("not needed");
    folder.run(&["verify", "m.isp", "slope_16x16x16_uint8.raw", "--n", "12", "--events", "2"]);
    // Percentages refer to the samples inside the mask.
    let facts = json(&folder.run(&["info", "m.isp", "--json"]));
    let samples = &facts["parameters"]["samples"];
    let mean = samples["mean"].as_f64().expect("a mean");
    assert!((mean - (9.0 * 8.0 + 5.0 * 7.0 + 8.0)).abs() < 0.5, "mean {mean}");
}

#[test]
fn analyze_counts_areas_inside_the_mask() {
    let folder = masked();
    let slope = "slope_16x16x16_uint8.raw";
    let range = ["--range", "110:120", "--samples", "3", "--json"];
    let with = ["analyze", slope, "--mask", "ball_16x16x16_uint8.raw"];
    let with = json(&folder.run(&[&with[..], &range].concat()));
    let without = json(&folder.run(&[&["analyze", slope][..], &range].concat()));
    let area = |found: &serde_json::Value| found["curves"][1]["area"].as_f64().expect("an area");
    let disc = std::f64::consts::PI * RADIUS * RADIUS;
    assert!((area(&with) / disc - 1.0).abs() < MAX_AREA_ERROR, "{}", area(&with));
    assert!(area(&without) > 2.0 * disc, "{}", area(&without));
}

#[test]
fn a_mask_that_does_not_fit_is_an_error_of_one_line() {
    let folder = masked();
    let slope = "slope_16x16x16_uint8.raw";
    let compute = |mask: &str, flags: &[&str], code| {
        let arguments = ["compute", slope, "-o", "o.isp", "--backend", "cpu", "--mask", mask];
        folder.fails(&[&arguments[..], flags].concat(), code)
    };
    folder.write("small_2x2x2_uint8.raw", &[0, 1, 2, 3, 4, 5, 6, 7]);
    let printed = compute("small_2x2x2_uint8.raw", &[], 3);
    assert!(printed.contains("2x2x2 samples, expected 16x16x16"), "{printed}");
    let printed = compute("ball_16x16x16_uint8.raw", &["--crop", "0:3,:,:"], 3);
    assert!(printed.contains("inside the mask"), "{printed}");
    compute("none.nrrd", &[], 3);
    let mask = "ball_16x16x16_uint8.raw";
    folder.fails(&["analyze", slope, "--mask", mask, "--plot", mask], 2);
    assert_eq!(folder.read("ball_16x16x16_uint8.raw").len(), N * N * N, "it is an input");
}

#[test]
fn dust_is_removed_reported_and_removed_again_by_verify() {
    let folder = Folder::new();
    let specks = [[2.0, 2.0, 2.0], [13.0, 3.0, 12.0], [12.0, 13.0, 2.0]];
    write(&folder, "dusty", |p| {
        let ball = 180.0 - 20.0 * distance(p, MIDDLE);
        if specks.contains(&p) { 250.0 } else { ball.max(1.0) }
    });
    let dusty = "dusty_16x16x16_uint8.raw";
    let compute = ["compute", dusty, "-o", "d.isp", "--backend", "cpu", "--error", "0.3"];
    let printed = folder.run(&[&compute[..], &["--min-component", "8"]].concat());
    let expected = "removed 3 components and 0 cavities below 8 voxels: changed 3 samples";
    assert!(stderr(&printed).contains(expected), "{}", stderr(&printed));
    let output = folder.run(&["info", "d.isp"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains(expected), "{text}");
    folder.run(&["verify", "d.isp", dusty, "--n", "12", "--events", "2"]);
    let found = json(&folder.run(&["components", "d.isp", "-c", "100", "--json"]));
    assert_eq!(found["components"].as_array().map(Vec::len), Some(1));
    let analysis = json(&folder.run(&["analyze", dusty, "--min-component", "8", "--json"]));
    assert_eq!(analysis["dust"]["parts"], 3);
    folder.run(&[&compute[..], &["--range", "90:110"]].concat());
    let found = json(&folder.run(&["components", "d.isp", "-c", "100", "--json"]));
    assert_eq!(found["components"].as_array().map(Vec::len), Some(4), "with the dust");
}

#[test]
fn a_masked_volume_may_be_computed_in_bricks() {
    let folder = masked();
    let volumes = ["slope_16x16x16_uint8.raw", "--mask", "ball_16x16x16_uint8.raw"];
    let flags = ["--backend", "cpu", "--brick", "8", "-q", "-o", "b.isp"];
    folder.run(&[&["compute"], &volumes[..], &flags].concat());
    folder.run(&["convert", "b.isp", "one.isp"]);
    let sorted = |name: &str, flags: &[&str]| {
        folder.run(&[&["extract", name, "-c", "115", "-o", "b.ply"], flags].concat());
        let mesh = parse_ply(&folder.read("b.ply")).expect("a mesh");
        let corner = |v: u32| mesh.positions[v as usize].map(f64::to_bits);
        let corners = |t: &[u32; 3]| {
            let mut corners = t.map(corner);
            corners.sort_unstable();
            corners
        };
        let mut all: Vec<_> = mesh.triangles.iter().map(corners).collect();
        all.sort_unstable();
        all
    };
    let (open, closed) = (sorted("b.isp", &[]), sorted("b.isp", &["--closed"]));
    assert!(open.len() > 50 && 2 * open.len() < closed.len(), "{} of {}", open.len(), closed.len());
    assert_eq!(sorted("one.isp", &[]), open);
    assert_eq!(sorted("one.isp", &["--closed"]), closed);
    // A few triangles of so small a mesh cross each other: their share needs many isovalues.
    folder.run(&["verify", "b.isp", volumes[0], "--n", "64"]);
}
