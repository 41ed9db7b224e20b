//! The file of a spectrum in bricks, which has a tree of chunks for each, equals the spectrum that is merged in memory.

use std::sync::{Arc, OnceLock};

use crate::common::program::{Folder, json};
use crate::common::random::Random;
use crate::common::spectra::cpu;
use isospectrum::bricks::{BrickLimits, OpenVolume};
use isospectrum::bricks::{Parts, Plan, Survey, VolumeSource, compute_parts, merge, merge_to_path};
use isospectrum::file::{FileQuery, SpectrumFile, from_bytes, to_bytes};
use isospectrum::spectrum::{Components, Mesh, Query, Size, Spectrum};
use isospectrum::verify::{Limits, Sampling, verify, verify_file};
use isospectrum::volume::{Preparation, Volume, phantom};
use isospectrum::{Cleaned, Noise, Prepared};
use isospectrum::{Parameters, Silent};

/// A volume's spectrum merged in memory, and the file `s.isp` of its parts.
struct Both {
    folder: Folder,
    merged: Arc<Spectrum>,
    file: Arc<SpectrumFile>,
}

fn both(volume: Volume, side: usize, range: Option<(f64, f64)>) -> Both {
    let folder = Folder::new();
    let (made, path) = (folder.path().join("parts"), folder.path().join("s.isp"));
    std::fs::create_dir(&made).expect("a folder");
    let source = VolumeSource::Phantom { name: "-".to_owned(), outside: volume.outside() };
    let prepared = Prepared::of(volume, Preparation::default(), Cleaned::default());
    let survey = Survey::of(prepared);
    let parameters = Parameters::default().with_range(range);
    let plan = Plan::new(source, &survey, Noise::default(), &parameters, side).expect("a plan");
    let parts = Parts::new(&plan, &made);
    let limits = BrickLimits { memory: f64::INFINITY, in_memory: true, triangles: None };
    let volume: &OpenVolume = survey.volume();
    compute_parts(&parts, volume, &cpu(), limits, &Silent).expect("parts");
    let merged = merge(&parts, volume, &Silent).expect("parts that fit");
    let merged = from_bytes(&to_bytes(&merged).expect("a spectrum")).expect("as it was written");
    merge_to_path(&parts, volume, &path, None, &Silent).expect("parts that fit");
    let file = Arc::new(SpectrumFile::open(&path).expect("as it was written"));
    Both { folder, merged: Arc::new(merged), file }
}

/// The triangles of a mesh as the bits of their corners, each rotated to start at its lowest corner, sorted.
fn triangles(mesh: &Mesh) -> Vec<([[u32; 3]; 3], bool)> {
    let one = |(corners, &cap): (&[u32; 3], &bool)| {
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize].map(f32::to_bits));
        // At the value of a sample corners may coincide: then the lowest corner alone is ambiguous.
        let rotations = [[a, b, c], [b, c, a], [c, a, b]];
        (rotations.into_iter().min().unwrap_or([a, b, c]), cap)
    };
    let mut all: Vec<_> = mesh.triangles.iter().zip(&mesh.caps).map(one).collect();
    all.sort_unstable();
    all
}

/// Checks that two meshes have the same triangles; the message names at most one difference.
fn assert_same(mesh: &Mesh, expected: &Mesh, what: &str) {
    let (mesh, expected) = (triangles(mesh), triangles(expected));
    assert_eq!(mesh.len(), expected.len(), "{what}");
    let differs = mesh.iter().zip(&expected).find(|(a, b)| a != b);
    assert_eq!(differs.map(|d| d.0), differs.map(|d| d.1), "{what}");
}

#[test]
fn the_report_of_a_file_of_bricks_is_that_of_the_spectrum_in_memory() {
    for (name, side, range) in [("noise:9:6", 4, None), ("blobs:15", 5, Some((0.2, 0.6)))] {
        let volume = phantom(name).expect("a phantom");
        let Both { file, folder: _folder, .. } = both(volume.clone(), side, range);
        assert!(file.n_trees() > 1, "{name}: {} trees", file.n_trees());
        let whole = file.read().expect("all chunks");
        let sampling = Sampling { n_random: 12, n_events: 6, ..Sampling::default() };
        let found = verify_file(&file, &volume, sampling, Limits::default(), &Silent);
        let expected = verify(&whole, &volume, sampling, Limits::default(), &Silent);
        assert_eq!(found.expect("the volume"), expected.expect("the volume"), "{name}");
    }
}

#[test]
fn meshes_of_the_file_are_those_of_the_merged_spectrum() {
    for (name, side, range) in
        [("noise:11:6", 5, None), ("blobs:15", 5, Some((0.2, 0.6))), ("gyroid:9", 4, None)]
    {
        let Both { merged, file, folder: _folder } =
            both(phantom(name).expect("a phantom"), side, range);
        assert!(file.n_trees() > 1, "{name}: {} trees", file.n_trees());
        let all = file.read().expect("all chunks");
        assert_eq!(all.events(), merged.events(), "{name}");
        assert_eq!(all.parameters(), merged.parameters(), "{name}");
        assert_eq!(all.isovalues(), merged.isovalues(), "{name}");
        assert_eq!(file.size(), Size::of(&merged), "{name}");
        let (mut query, mut of_all) = (Query::new(merged.clone()), Query::new(&all));
        let mut of_file = FileQuery::new(file.clone());
        let (low, high) = merged.range();
        let mut random = Random(3);
        let at = (0..10).map(|_| low + random.unit() * (high - low));
        // At events and both ends, too.
        let events = merged.events();
        let events = events.iter().step_by(1 + events.len() / 6).map(|e| e.isovalue);
        let (mut n, mut most) = (0, 0);
        for c in at.chain(events).chain([low, high]) {
            let expected = query.mesh_at(c).expect("inside");
            let one = file.read_around(&[c]).expect("chunks");
            let wider = [c, high.min(c + 0.1 * (high - low))];
            let wide = file.read_around(&wider).expect("chunks");
            for mesh in [
                of_file.mesh_at(c).expect("inside"),
                of_all.mesh_at(c).expect("inside"),
                Query::new(&one).mesh_at(c).expect("inside"),
                Query::new(&wide).mesh_at(c).expect("inside"),
            ] {
                assert_eq!(mesh.positions.len(), expected.positions.len(), "{name} at {c}");
                assert_same(&mesh, &expected, &format!("{name} at {c}"));
            }
            n += expected.triangles.len();
            most = most.max(expected.triangles.len());
        }
        assert!(most > 300 && n > 3000, "{name}: {n} triangles");
        assert!(of_file.mesh_at(low - 1.0).is_err());
    }
}

/// Chunks have many triangles, so only a large spectrum has several for each brick.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn a_mesh_needs_some_of_the_chunks_of_each_brick() {
        let Both { merged, file, folder: _folder } =
            both(phantom("noise:41:6").expect("a phantom"), 20, None);
        let triangles = merged.triangles().len();
        assert!(triangles > 8 * 25_000, "{triangles} triangles");
        let all = file.read().expect("all chunks");
        assert_eq!(all.triangles().len(), triangles);
        assert_eq!(all.knots().len(), merged.knots().len());
        let most = triangles as u64 / 4;
        let mut few = FileQuery::within(file.clone(), most);
        let mut many = FileQuery::new(file.clone());
        let mut query = Query::new(merged.clone());
        let (low, high) = merged.range();
        let mut random = Random(5);
        let mut n_bytes = 0;
        for i in 0..60 {
            // Small steps and jumps.
            let t = if i % 3 == 0 { random.unit() } else { i as f64 / 60.0 };
            let c = low + t * (high - low);
            let expected = query.mesh_at(c).expect("inside");
            assert_same(&few.mesh_at(c).expect("inside"), &expected, &format!("few at {c}"));
            assert_same(&many.mesh_at(c).expect("inside"), &expected, &format!("many at {c}"));
            n_bytes += file.needed_around(&[c]).1;
        }
        let mean = n_bytes / 60;
        assert!(10 * mean < 9 * file.n_bytes(), "{mean} of {} bytes", file.n_bytes());
    }
}

#[test]
fn exceeding_a_limit_is_an_error_as_soon_as_it_is_known() {
    let prepared = Prepared::of(
        phantom("noise:25:6").expect("a phantom"),
        Preparation::default(),
        Cleaned::default(),
    );
    let survey = Survey::of(prepared);
    let source = VolumeSource::Phantom { name: "-".to_owned(), outside: Default::default() };
    let parameters = Parameters::default();
    let plan = Plan::new(source, &survey, Noise::default(), &parameters, 8).expect("a plan");
    let refused = |limits: BrickLimits| {
        let folder = Folder::new();
        let parts = Parts::new(&plan, folder.path());
        let refused = compute_parts(&parts, survey.volume(), &cpu(), limits, &Silent);
        (refused.expect_err("beyond a limit").to_string(), folder.names().len())
    };
    let none = BrickLimits { memory: f64::INFINITY, in_memory: true, triangles: None };
    let (printed, n) = refused(BrickLimits { memory: 1e5, ..none });
    assert!(printed.contains("9x9x9") && printed.contains("1 MB"), "{printed}");
    assert_eq!(n, 0);
    let (printed, n) = refused(BrickLimits { memory: 12e6, ..none });
    assert!(printed.contains("12 MB") && printed.contains("a file to write to"), "{printed}");
    assert!((1..27).contains(&n), "{n} parts");
}

#[test]
fn only_trees_with_triangles_at_an_isovalue_are_read() {
    let Both { folder, merged, file } = both(phantom("blobs:17").expect("a phantom"), 6, None);
    let (low, high) = merged.range();
    let c = low + 0.9 * (high - low);
    let (n, n_bytes) = file.needed_around(&[c]);
    assert!(2 * n < file.size().triangles && 2 * n_bytes < file.n_bytes(), "{n}, {n_bytes}");
    // All chunks are damaged that are not needed there.
    let mut bytes = folder.read("s.isp");
    let mut n_damaged = 0;
    let mut at = 16;
    while &bytes[at..at + 4] == b"VERT" {
        let start = at;
        for _ in 0..4 {
            let n = u64::from_le_bytes(bytes[at + 8..at + 16].try_into().expect("eight bytes"));
            at += 28 + n as usize;
        }
        bytes[start + 40] ^= 4;
        folder.write("d.isp", &bytes);
        let damaged = SpectrumFile::open(folder.path().join("d.isp")).expect("undamaged tables");
        if damaged.read_around(&[c]).is_err() {
            bytes[start + 40] ^= 4;
        } else {
            n_damaged += 1;
        }
    }
    assert!(2 * n_damaged > file.n_trees(), "{n_damaged} of {}", file.n_trees());
    folder.write("d.isp", &bytes);
    let expected = Query::new(merged.clone()).mesh_at(c).expect("inside");
    let text = c.to_string();
    folder.run(&["extract", "d.isp", "-c", &text, "-o", "m.ply"]);
    let components = ["components", "d.isp", "-c", &text];
    let here = [&components[..], &["--no-lineage"]].concat();
    let report = json(&folder.run(&[&here[..], &["--json"]].concat()));
    let n = Components::of(&expected).list.len();
    assert_eq!(report["n_components"], n);
    let rows = report["components"].as_array().expect("rows");
    assert!(n > 0 && rows.iter().all(|row| row.get("birth").is_none() && row["area"].is_f64()));
    let table = String::from_utf8_lossy(&folder.run(&here).stdout).into_owned();
    assert!(table.contains("Euler  triangles  box\n"), "{table}");
    // Their birth and death need all chunks.
    for arguments in [&components[..], &["extract", "d.isp", "-c", "50%", "-o", "n.ply"]] {
        let line = folder.fails(arguments, 3);
        assert!(line.starts_with("d.isp: chunk ") && line.contains("damaged"), "{line}");
    }
}

/// A plan, its parts, and the file that the program merges them to. Computed once for all tests.
fn computed() -> Folder {
    static COMPUTED: OnceLock<Folder> = OnceLock::new();
    let computed = COMPUTED.get_or_init(|| {
        let folder = Folder::new();
        folder.run(&["plan", "--phantom", "noise:9:4", "--brick", "4", "-o", "p.json"]);
        folder.run(&["compute", "--backend", "cpu", "-q", "--plan", "p.json"]);
        folder.run(&["merge", "p.json", "-o", "s.isp", "-q"]);
        folder
    });
    computed.copy()
}

#[test]
fn all_commands_take_a_file_of_bricks() {
    let folder = computed();
    let compute = ["compute", "--phantom", "noise:9:4", "--backend", "cpu", "--brick", "4"];
    folder.run(&[&compute[..], &["-q", "-o", "c.isp"]].concat());
    assert!(folder.read("c.isp") == folder.read("s.isp"), "the same bytes in one run");
    let to_stdout = folder.run(&["merge", "p.json", "-o", "-", "-q"]);
    assert!(to_stdout.stdout == folder.read("s.isp"), "the same bytes on stdout");
    folder.run(&["convert", "s.isp", "one.isp"]);
    let info = |name: &str| json(&folder.run(&["info", name, "--json"]));
    let (bricks, one) = (info("s.isp"), info("one.isp"));
    for key in [
        "n_vertices",
        "n_knots",
        "n_triangles",
        "n_isovalues",
        "gpu_memory",
        "events",
        "parameters",
    ] {
        assert_eq!(bricks[key], one[key], "{key}");
    }
    assert_eq!((&bricks["n_parts"], &one["n_parts"]), (&8.into(), &1.into()));
    for name in ["s.isp", "one.isp"] {
        folder.run(&["verify", name, "--phantom", "noise:9:4", "--n", "8"]);
        let mesh = ["extract", name, "-c", "40%", "-c", "45%", "-o", "m%d.ply", "--json"];
        let found = json(&folder.run(&mesh));
        let expected = ["extract", "s.isp", "-c", "40%", "-c", "45%", "-o", "e%d.ply", "--json"];
        let expected = json(&folder.run(&expected));
        for i in 0..2 {
            for key in ["isovalue", "n_vertices", "n_triangles"] {
                assert_eq!(found["meshes"][i][key], expected["meshes"][i][key], "{name}: {key}");
            }
        }
    }
    folder.run(&["html", "s.isp", "--range", "40%:60%", "-o", "s.html", "-q"]);
    for name in ["s.isp", "one.isp"] {
        folder.run(&["html", name, "--link", name, "-o", "l.html", "-q"]);
    }
}

#[test]
fn every_damaged_byte_of_a_file_of_bricks_is_one_line() {
    let folder = computed();
    let bytes = folder.read("s.isp");
    let mut random = Random(4);
    for _ in 0..300 {
        let mut damaged = bytes.clone();
        let at = random.below(bytes.len() as u64) as usize;
        damaged[at] ^= 1 << random.below(8);
        let error = from_bytes(&damaged).expect_err("damaged").to_string();
        assert!(!error.contains('\n'), "byte {at}: {error}");
        assert!(from_bytes(&bytes[..at]).is_err(), "up to byte {at}");
    }
    // Two files of the same volume: chunks of one in the other.
    let line = {
        let other = ["compute", "--phantom", "noise:9:3", "--backend", "cpu", "--brick", "4", "-q"];
        folder.run(&[&other[..], &["-o", "o.isp"]].concat());
        let mut mixed = bytes.clone();
        let other = folder.read("o.isp");
        mixed[16..2000].copy_from_slice(&other[16..2000]);
        folder.write("mixed.isp", &mixed);
        folder.fails(&["verify", "mixed.isp", "--phantom", "noise:9:4"], 3)
    };
    assert!(line.starts_with("mixed.isp: chunk 0 "), "{line}");
}
