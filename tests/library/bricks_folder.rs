//! A spectrum as a folder of parts equals the spectrum in one file; a query reads only the parts that it needs.

use std::sync::{Arc, OnceLock};

use crate::common::program::{Folder, json};
use crate::common::random::Random;
use crate::common::spectra::cpu;
use isospectrum::bricks::{BrickLimits, OpenVolume};
use isospectrum::bricks::{
    Parts, Plan, Survey, VolumeSource, compute_parts, merge, merge_to_folder,
};
use isospectrum::file::{FolderQuery, SpectrumFolder, from_bytes, to_bytes};
use isospectrum::spectrum::{Components, Mesh, Query, Spectrum};
use isospectrum::volume::{Preparation, Volume, phantom};
use isospectrum::{Cleaned, Noise, Prepared};
use isospectrum::{Parameters, Silent};

/// A volume's spectrum in one file, and the folder `s.ispt` of its parts.
struct Both {
    folder: Folder,
    file: Arc<Spectrum>,
    split: SpectrumFolder,
}

fn both(volume: Volume, side: usize, range: Option<(f64, f64)>) -> Both {
    let folder = Folder::new();
    let (made, split) = (folder.path().join("parts"), folder.path().join("s.ispt"));
    for path in [&made, &split] {
        std::fs::create_dir(path).expect("a folder");
    }
    let source = VolumeSource::Phantom { name: "-".to_owned(), outside: volume.outside() };
    let prepared = Prepared::of(volume, Preparation::default(), Cleaned::default());
    let survey = Survey::of(prepared);
    let parameters = Parameters::default().with_range(range);
    let plan = Plan::new(source, &survey, Noise::default(), &parameters, side).expect("a plan");
    let parts = Parts::new(&plan, &made);
    let limits = BrickLimits { memory: f64::INFINITY, one_file: true, triangles: None };
    let volume: &OpenVolume = survey.volume();
    compute_parts(&parts, volume, &cpu(), limits, &Silent).expect("parts");
    let merged = merge(&parts, volume, &Silent).expect("parts that fit");
    let file = from_bytes(&to_bytes(&merged).expect("a spectrum")).expect("as it was written");
    merge_to_folder(&parts, volume, &split, None, &Silent).expect("parts that fit");
    let split = SpectrumFolder::open(&split).expect("as it was written");
    Both { folder, file: Arc::new(file), split }
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
fn meshes_of_the_folder_are_those_of_the_file() {
    for (name, side, range) in
        [("noise:11:6", 5, None), ("blobs:15", 5, Some((0.2, 0.6))), ("gyroid:9", 4, None)]
    {
        let Both { file, split, folder: _folder } =
            both(phantom(name).expect("a phantom"), side, range);
        let mut query = Query::new(file.clone());
        let mut of_folder = FolderQuery::new(split.clone()).expect("a folder");
        let all = split.read().expect("all parts");
        assert_eq!(all.events(), file.events(), "{name}");
        assert_eq!(all.parameters(), file.parameters(), "{name}");
        let size = [file.n_vertices(), file.knots().len(), file.triangles().len()];
        assert_eq!(split.index().size, size.map(|n| n as u64), "{name}");
        assert_eq!(
            split.index().parts.iter().map(|p| p.events).sum::<usize>(),
            file.events().len()
        );
        let mut of_all = Query::new(&all);
        let (low, high) = file.range();
        let mut random = Random(3);
        let at = (0..10).map(|_| low + random.unit() * (high - low));
        // At events and both ends, too.
        let events = file.events().iter().step_by(1 + file.events().len() / 6).map(|e| e.isovalue);
        let (mut n, mut most) = (0, 0);
        for c in at.chain(events).chain([low, high]) {
            let expected = query.mesh_at(c).expect("inside");
            let one = split.read_between((c, c)).expect("parts that live");
            let wider = (c, high.min(c + 0.1 * (high - low)));
            let wide = split.read_between(wider).expect("parts that live");
            for mesh in [
                of_folder.mesh_at(c).expect("inside"),
                of_all.mesh_at(c).expect("inside"),
                Query::new(&one).mesh_at(c).expect("inside"),
                Query::new(&wide).mesh_at(c).expect("inside"),
            ] {
                assert_eq!(mesh.positions.len(), expected.positions.len(), "{name} at {c}");
                assert_same(&mesh, &expected, &format!("{name} at {c}"));
            }
            // Parts that do not live there are dropped.
            assert_eq!(one.triangles().len(), expected.triangles.len(), "{name} at {c}");
            n += expected.triangles.len();
            most = most.max(expected.triangles.len());
        }
        assert!(most > 300 && n > 3000, "{name}: {n} triangles");
        assert!(split.read_between((low, high + 1.0)).is_err());
        assert!(of_folder.mesh_at(low - 1.0).is_err());
    }
}

/// Chunks have many triangles, so only a large spectrum has several.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn parts_are_cut_by_isovalue_and_dropped_again() {
        let Both { file, split, folder: _folder } =
            both(phantom("noise:41:6").expect("a phantom"), 20, None);
        let index = split.index();
        let n: usize = index.parts.iter().map(|part| part.chunks.len()).sum();
        assert!(n > 2 * index.parts.len(), "{n} chunks of {} parts", index.parts.len());
        let triangles = file.triangles().len();
        // Triangles that live across a cut are stored in two chunks.
        let stored: u64 =
            index.parts.iter().flat_map(|part| &part.chunks).map(|c| c.triangles).sum();
        assert!(stored as usize > triangles && (stored as f64) < 1.2 * triangles as f64);
        let all = split.read().expect("all chunks");
        assert_eq!(all.triangles().len(), triangles);
        assert_eq!(all.knots().len(), file.knots().len());
        let most = triangles as u64 / 4;
        let mut few = FolderQuery::within(split.clone(), most).expect("a folder");
        let mut many = FolderQuery::new(split.clone()).expect("a folder");
        let mut query = Query::new(file.clone());
        let (low, high) = file.range();
        let mut random = Random(5);
        let (mut dropped, mut before) = (0, 0);
        for i in 0..60 {
            // Small steps and jumps.
            let t = if i % 3 == 0 { random.unit() } else { i as f64 / 60.0 };
            let c = low + t * (high - low);
            let expected = query.mesh_at(c).expect("inside");
            assert_same(&few.mesh_at(c).expect("inside"), &expected, &format!("few at {c}"));
            assert_same(&many.mesh_at(c).expect("inside"), &expected, &format!("many at {c}"));
            let need: u64 = split.chunks_between((c, c)).map(|(_, chunk)| chunk.triangles).sum();
            assert!(few.n_triangles() as u64 <= most.max(need), "{} triangles", few.n_triangles());
            dropped += usize::from(few.n_read() < before);
            before = few.n_read();
        }
        assert!(dropped > 3, "{dropped}");
        assert_eq!(many.n_triangles(), triangles);
        let need: u64 = split.chunks_between((0.5, 0.5)).map(|(_, chunk)| chunk.bytes).sum();
        assert!(2 * need < split.n_bytes(), "{need} of {} bytes", split.n_bytes());
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
    let none = BrickLimits { memory: f64::INFINITY, one_file: true, triangles: None };
    let (printed, n) = refused(BrickLimits { memory: 1e5, ..none });
    assert!(printed.contains("9x9x9") && printed.contains("1 MB"), "{printed}");
    assert_eq!(n, 0);
    let (printed, n) = refused(BrickLimits { memory: 12e6, ..none });
    assert!(printed.contains("12 MB") && printed.contains("-o NAME.ispt"), "{printed}");
    assert!((1..27).contains(&n), "{n} parts");
}

#[test]
fn only_parts_that_live_at_an_isovalue_are_read() {
    let Both { folder, file, split } = both(phantom("blobs:17").expect("a phantom"), 6, None);
    let (low, high) = file.range();
    let c = low + 0.9 * (high - low);
    let needed: Vec<(usize, usize)> =
        split.chunks_between((c, c)).map(|(place, _)| place).collect();
    let mut living: Vec<usize> = needed.iter().map(|place| place.0).collect();
    living.dedup();
    let n = split.index().parts.len();
    assert!(!living.is_empty() && 2 * living.len() < n, "{} of {n}", living.len());
    // Of each of these parts one chunk is needed.
    assert_eq!(needed.len(), living.len());
    let parts = split.index().parts.iter().enumerate();
    let all = parts.flat_map(|(i, part)| (0..part.chunks.len()).map(move |k| (i, k)));
    for (number, chunk) in all.filter(|place| !needed.contains(place)) {
        for kind in ["isp", "seam"] {
            let name = format!("{number:06}-{chunk:03}.{kind}");
            std::fs::remove_file(split.path().join(name)).expect("there");
        }
    }
    let expected = Query::new(file.clone()).mesh_at(c).expect("inside");
    let read = split.read_between((c, c)).expect("no other part is needed");
    assert_same(&read.mesh_at(c).expect("inside"), &expected, "blobs");
    let text = c.to_string();
    folder.run(&["extract", "s.ispt", "-c", &text, "-o", "m.ply"]);
    let components = ["components", "s.ispt", "-c", &text];
    let here = [&components[..], &["--no-lineage"]].concat();
    let report = json(&folder.run(&[&here[..], &["--json"]].concat()));
    let n = Components::of(&expected).list.len();
    assert_eq!(report["n_components"], n);
    let rows = report["components"].as_array().expect("rows");
    assert!(n > 0 && rows.iter().all(|row| row.get("birth").is_none() && row["area"].is_f64()));
    let table = String::from_utf8_lossy(&folder.run(&here).stdout).into_owned();
    assert!(table.contains("Euler  triangles  box\n"), "{table}");
    // Their birth and death need all parts.
    let line = folder.fails(&components, 3);
    assert!(line.contains("s.ispt/") && line.contains(".isp"), "{line}");
    let line = folder.fails(&["extract", "s.ispt", "-c", "50%", "-o", "n.ply"], 3);
    assert!(line.contains("s.ispt/") && line.contains(".isp"), "{line}");
}

/// A plan, its parts, and the file and the folder that the program merges them to. Computed once for all tests.
fn computed() -> Folder {
    static COMPUTED: OnceLock<Folder> = OnceLock::new();
    let computed = COMPUTED.get_or_init(|| {
        let folder = Folder::new();
        folder.run(&["plan", "--phantom", "noise:9:4", "--brick", "4", "-o", "p.json"]);
        folder.run(&["compute", "--backend", "cpu", "-q", "--plan", "p.json"]);
        folder.run(&["merge", "p.json", "-o", "s.isp", "-q"]);
        folder.run(&["merge", "p.json", "-o", "s.ispt", "-q"]);
        folder
    });
    computed.copy()
}

#[test]
fn the_program_takes_a_folder_wherever_it_takes_a_file() {
    let folder = computed();
    let compute = ["compute", "--phantom", "noise:9:4", "--backend", "cpu", "--brick", "4"];
    folder.run(&[&compute[..], &["-q", "-o", "c.ispt"]].concat());
    let info = |name: &str| json(&folder.run(&["info", name, "--json"]));
    let (file, split) = (info("s.isp"), info("s.ispt"));
    for key in ["n_vertices", "n_knots", "n_triangles", "n_events", "events", "parameters"] {
        assert_eq!(file[key], split[key], "{key}");
    }
    assert_eq!(split["n_parts"], 8);
    folder.run(&["verify", "s.ispt", "--phantom", "noise:9:4", "--n", "8"]);
    for name in ["s.isp", "s.ispt", "c.ispt"] {
        let mesh = ["extract", name, "-c", "40%", "-c", "45%", "-o", "m%d.ply", "--json"];
        let found = json(&folder.run(&mesh));
        let expected = json(
            &folder.run(&["extract", "s.isp", "-c", "40%", "-c", "45%", "-o", "e%d.ply", "--json"]),
        );
        for i in 0..2 {
            for key in ["isovalue", "n_vertices", "n_triangles"] {
                assert_eq!(found["meshes"][i][key], expected["meshes"][i][key], "{name}: {key}");
            }
        }
    }
    folder.run(&["html", "s.ispt", "--range", "40%:60%", "-o", "s.html", "-q"]);
    folder.run(&["convert", "s.ispt", "again.isp"]);
    folder.run(&["verify", "again.isp", "--phantom", "noise:9:4", "--n", "4"]);
    // A second file replaces the first.
    folder.run(&["merge", "p.json", "-o", "s.ispt", "-q"]);
    let names = folder.names();
    assert!(!names.iter().any(|name| name.starts_with('.')), "{names:?}");
}

#[test]
fn errors_of_a_damaged_folder_are_one_line() {
    let folder = computed();
    // All chunks are read.
    let extract = ["extract", "s.ispt", "-c", "0%", "-c", "100%", "-o", "m%d.ply"];
    let change = |name: &str, change: &dyn Fn(&mut Vec<u8>)| {
        let path = folder.path().join("s.ispt").join(name);
        let before = std::fs::read(&path).expect("there");
        let mut bytes = before.clone();
        change(&mut bytes);
        std::fs::write(&path, bytes).expect("written");
        let line = folder.fails(&extract, 3);
        std::fs::write(&path, before).expect("written");
        line
    };
    let flip = |bytes: &mut Vec<u8>| {
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
    };
    for name in ["whole.isp", "000003-000.isp", "000003-000.seam"] {
        assert!(change(name, &flip).contains(name));
        let line = change(name, &|bytes| bytes.truncate(bytes.len() / 2));
        assert!(line.contains(name), "{line}");
    }
    let other = folder.read("s.ispt/000002-000.isp");
    let line = change("000003-000.isp", &|bytes| bytes.clone_from(&other));
    assert!(line.contains("chunk 0 of part 3"), "{line}");
    let other = folder.read("s.ispt/000002-000.seam");
    let line = change("000003-000.seam", &|bytes| bytes.clone_from(&other));
    assert!(line.contains("000003"), "{line}");
    let line = change("index.json", &|bytes| *bytes = b"{}".to_vec());
    assert!(line.contains("index.json: "), "{line}");
    std::fs::remove_file(folder.path().join("s.ispt/000003-000.seam")).expect("there");
    assert!(folder.fails(&extract, 3).contains("000003-000.seam"));
    // Entries that the index has lost, and a description of another whole.
    let edited = |edit: &dyn Fn(&mut serde_json::Value)| {
        change("index.json", &|bytes| {
            let mut index = serde_json::from_slice(bytes).expect("JSON");
            edit(&mut index);
            *bytes = serde_json::to_vec(&index).expect("JSON");
        })
    };
    let parts = |index: &mut serde_json::Value| -> Vec<serde_json::Value> {
        index["parts"].as_array().expect("a list").clone()
    };
    for line in [
        edited(&|index| index["parts"] = parts(index)[..7].into()),
        edited(&|index| index["parts"] = parts(index)[1..].into()),
        edited(&|index| index["parts"][3]["chunks"] = serde_json::json!([])),
        edited(&|index| index["size"][2] = 7.into()),
        edited(&|index| index["plan"] = "0123456789abcdef".into()),
        edited(&|index| index["format"] = "another".into()),
    ] {
        assert!(line.contains("s.ispt/index.json: "), "{line}");
    }
    let compute = ["compute", "--phantom", "sphere:9", "--backend", "cpu", "--brick", "4", "-q"];
    folder.run(&[&compute[..], &["-o", "other.ispt"]].concat());
    let other = folder.read("other.ispt/whole.isp");
    let line = change("whole.isp", &|bytes| bytes.clone_from(&other));
    assert!(line.contains("s.ispt/whole.isp: ") && line.contains("index.json"), "{line}");
    std::fs::remove_file(folder.path().join("s.ispt/000002-000.isp")).expect("there");
    assert!(folder.fails(&extract, 3).contains("s.ispt/000002-000.isp: "));
    // An existing folder that is no folder of parts is not replaced.
    std::fs::create_dir(folder.path().join("t.ispt")).expect("made");
    let line = folder.fails(&["merge", "p.json", "-o", "t.ispt"], 3);
    assert!(line.contains("t.ispt: already exists"), "{line}");
}
