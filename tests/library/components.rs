//! The components of an isosurface, the isovalues where they begin and end, and how the program lists and selects them.
//!
//! The ends of components are compared with the contour tree of the volume, which is computed without a mesh.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::common::program;
use crate::common::program::Folder;
use crate::common::random::Random;
use crate::common::spectra::{phantom_volume, swept};
use glam::DVec3;
use isospectrum::export::read_ply;
use isospectrum::spectrum::{Components, End, Keep, Mesh, lineages};
use isospectrum::unstable::mesh::nearest_on_triangle;
use isospectrum::unstable::topology::Topology;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::volume::{Placement, Samples, Volume};

/// Samples without structure, of so many values; many of them are equal where there are few.
fn noise(seed: u64, n_values: u64) -> Arc<Volume> {
    let mut random = Random(seed);
    let samples = (0..9 * 9 * 9).map(|_| random.below(n_values) as f32).collect();
    let volume = Volume::new("noise", [9; 3], Samples::F32(samples), Placement::default());
    Arc::new(volume.expect("a volume"))
}

/// For each component of a mesh its arc of the contour tree: the arc of the crossed lattice edge nearest to its triangles.
fn arcs_of(
    volume: &Volume,
    topology: &Topology,
    isovalue: f64,
    mesh: &Mesh,
    components: &Components,
) -> Vec<usize> {
    let field = ExactField::new(volume).expect("a field");
    let [nx, ny, nz] = volume.dims().map(|d| d as i64);
    let mut crossings: Vec<([f64; 3], usize)> = Vec::new();
    let value = |p: [i64; 3]| {
        let inside = (0..3).all(|a| (0..volume.dims()[a] as i64).contains(&p[a]));
        let at = (p[0] + nx * (p[1] + ny * p[2])) as usize;
        if inside { volume.samples().get(at) } else { f64::NEG_INFINITY }
    };
    for z in -1..nz {
        for y in -1..ny {
            for x in -1..nx {
                for axis in 0..3 {
                    let p = [x, y, z];
                    let mut q = p;
                    q[axis] += 1;
                    let (a, b) = (value(p), value(q));
                    if (a > isovalue) == (b > isovalue) {
                        continue;
                    }
                    let (low, high) = if a > isovalue { (q, p) } else { (p, q) };
                    let arc = topology.arc_of(field.vertex(low), field.vertex(high), isovalue);
                    let t = if a.is_finite() && b.is_finite() {
                        (isovalue - a) / (b - a)
                    } else if a > isovalue {
                        0.05
                    } else {
                        0.95
                    };
                    let place = std::array::from_fn(|i| p[i] as f64 + t * (q[i] - p[i]) as f64);
                    crossings.push((place, arc.expect("crossed")));
                }
            }
        }
    }
    let corners = |t: &[u32; 3]| t.map(|v| DVec3::from(mesh.positions[v as usize].map(f64::from)));
    let mut nearest = vec![(f64::INFINITY, usize::MAX); components.list.len()];
    for (place, arc) in crossings {
        let place = DVec3::from_array(place);
        for (t, &component) in mesh.triangles.iter().zip(&components.of_triangle) {
            let distance = nearest_on_triangle(place, corners(t)).distance(place);
            let nearest = &mut nearest[component as usize];
            if distance < nearest.0 {
                *nearest = (distance, arc);
            }
        }
    }
    nearest.into_iter().map(|n| n.1).collect()
}

/// The ends of components on arcs, up or down the contour tree: the rule of [`lineages`] on arcs.
fn ends_in_the_tree(
    topology: &Topology,
    isovalue: f64,
    arcs: &[usize],
    upward: bool,
) -> Vec<Option<End>> {
    let n = topology.arcs.len();
    let mut set: Vec<usize> = (0..n).collect();
    let mut label = vec![usize::MAX; n];
    for (component, &arc) in arcs.iter().enumerate() {
        label[arc] = component;
    }
    let mut ends = vec![None; arcs.len()];
    let mut alive = vec![0; n];
    topology.arcs_at(isovalue).iter().for_each(|&arc| alive[arc] = 1);
    let mut events: Vec<usize> = (0..topology.events.len()).collect();
    events.retain(|&e| (topology.events[e].isovalue > isovalue) == upward);
    if !upward {
        events.reverse();
    }
    for e in events {
        let at = topology.events[e].isovalue;
        let touches = |event: Option<u32>| event == Some(e as u32);
        let (mut coming, mut going) = (Vec::new(), Vec::new());
        for (i, arc) in topology.arcs.iter().enumerate() {
            if touches(arc.birth_event) {
                if upward { coming.push(i) } else { going.push(i) }
            }
            if touches(arc.death_event) {
                if upward { going.push(i) } else { coming.push(i) }
            }
        }
        let all: Vec<usize> = coming.iter().chain(&going).copied().collect();
        let first = set[all[0]];
        for &arc in &all[1..] {
            let other = set[arc];
            if other == set[first] {
                continue;
            }
            let root = set[first];
            let (a, b) = (label[root], label[other]);
            if a != usize::MAX && b != usize::MAX {
                ends[a.max(b)] = Some(End { isovalue: at, joins: Some(a.min(b) as u32) });
            }
            label[root] = a.min(b);
            alive[root] += alive[other];
            set.iter_mut().filter(|s| **s == other).for_each(|s| *s = root);
        }
        let root = set[first];
        alive[root] += coming.len();
        alive[root] -= going.len();
        if alive[root] == 0 && label[root] != usize::MAX {
            ends[label[root]] = Some(End { isovalue: at, joins: None });
            label[root] = usize::MAX;
        }
    }
    ends
}

/// Compares the ends of components with the contour tree. Returns the number of ends compared.
fn compare(volume: &Arc<Volume>, is_generic: bool, shares: &[f64]) -> usize {
    let spectrum = swept(volume);
    let field = ExactField::new(volume).expect("a field");
    let topology = Topology::compute(&field).expect("its topology");
    let (low, high) = spectrum.range();
    let mut n_compared = 0;
    for share in shares {
        let isovalue = low + share * (high - low);
        let mesh = spectrum.mesh_at(isovalue).expect("inside");
        let components = Components::of(&mesh);
        assert_eq!(components.list.len() as u32, topology.n_components_at(isovalue));
        let arcs = arcs_of(volume, &topology, isovalue, &mesh, &components);
        assert_eq!(
            BTreeSet::from_iter(&arcs).len(),
            arcs.len(),
            "each component has an arc of its own"
        );
        let found = lineages(&spectrum, isovalue, &components).expect("inside");
        for upward in [false, true] {
            let expected = ends_in_the_tree(&topology, isovalue, &arcs, upward);
            for (i, (lineage, expected)) in found.iter().zip(expected).enumerate() {
                let found = if upward { lineage.death } else { lineage.birth };
                // Ends at the ends of the range need not be found.
                let is_inside = |end: &End| low < end.isovalue && end.isovalue < high;
                let expected = expected.filter(is_inside);
                // An end just inside the range may be found at the end of the range.
                let found = found.filter(|end| expected.is_some() || is_inside(end));
                let message = format!(
                    "{} {i} at {isovalue}: {found:?}, expected {expected:?}",
                    volume.name()
                );
                assert_eq!(found.is_some(), expected.is_some(), "{message}");
                if let (Some(found), Some(expected)) = (found, expected) {
                    // Isovalues of saddles are rounded once on each side.
                    assert!(
                        (found.isovalue - expected.isovalue).abs() <= 1e-9 * (high - low),
                        "{message}"
                    );
                    // The order of events that share an isovalue is not defined.
                    assert!(!is_generic || found.joins == expected.joins, "{message}");
                    n_compared += 1;
                }
            }
        }
    }
    n_compared
}

#[test]
fn components_end_where_their_branch_of_the_contour_tree_does() {
    let smooth = phantom_volume("noise:12:3");
    assert!(compare(&smooth, true, &[0.3, 0.5, 0.7]) > 10);
}

#[test]
fn components_of_noise_end_where_their_branch_of_the_contour_tree_does() {
    assert!(compare(&noise(1, 1 << 20), true, &[0.4, 0.6, 0.8]) > 50);
    assert!(compare(&noise(2, 24), false, &[0.42, 0.61, 0.8]) > 50);
}

#[test]
fn components_are_measured_and_selected_in_world_units() {
    let folder = Folder::new();
    // Two balls of 5 and 3 samples, spacing 0.5, 1, 1: the unit of the voxel frame is half of one.
    let sample = |i: usize| {
        let at = [i % 40, i / 40 % 12, i / 480].map(|x| x as f64);
        let reach = |middle: [f64; 3], radius: f64| {
            let squares = [0, 1, 2].map(|a| ((at[a] - middle[a]) * [0.5, 1.0, 1.0][a]).powi(2));
            radius - squares.iter().sum::<f64>().sqrt()
        };
        reach([12.0, 5.5, 5.5], 4.0).max(reach([32.0, 5.5, 5.5], 2.0)) as f32
    };
    let bytes: Vec<u8> = (0..40 * 12 * 12).flat_map(|i| sample(i).to_le_bytes()).collect();
    folder.write("balls_40x12x12_float32.raw", &bytes);
    let spacing = ["--spacing", "0.5,1,1", "--origin", "100,0,0", "--backend", "cpu"];
    folder.run(
        &[&["compute", "-q", "balls_40x12x12_float32.raw", "-o", "s.isp"][..], &spacing].concat(),
    );
    let report_with = |flags: &[&str]| -> serde_json::Value {
        let output = folder.run(&[&["components", "s.isp", "-c", "0", "--json"], flags].concat());
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let report = report_with(&[]);
    assert_eq!(report["n_components"], 2);
    for (i, (radius, x)) in [(4.0f64, 106.0), (2.0, 116.0)].into_iter().enumerate() {
        let row = &report["components"][i];
        let number = |name: &str| row[name].as_f64().expect("a number");
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        // Trilinear interpolation between samples at distance 1 makes the ball's radius smaller by up to 1 / (8 r) for each of
        // three axes, and its volume by 3/8 of its area over its radius.
        let lack = 3.0 / 8.0 * 4.0 * std::f64::consts::PI * radius;
        assert!(
            number("volume") > volume - lack && number("volume") < volume + 0.1 * lack,
            "{row}"
        );
        assert_eq!((row["euler"].as_i64(), row["is_cavity"].as_bool()), (Some(2), Some(false)));
        let ends = [0, 1].map(|end| row["bounds"][end][0].as_f64().expect("a number"));
        assert!((0.5 * (ends[0] + ends[1]) - x).abs() < 0.1, "{row}");
        // The centre of a ball is within half the diagonal of a cell of a sample: 0.75, of (0.25, 0.5, 0.5).
        let death = number("death");
        assert!(death > radius - 0.75 && death < radius, "{row}");
    }
    let (large, small) = (&report["components"][0], &report["components"][1]);
    // They merge half-way between them, before the border of the volume cuts them.
    assert_eq!(small["splits_from"], 1, "{small}");
    assert!((small["birth"].as_f64().expect("a number") + 2.0).abs() < 0.3, "{small}");
    assert!(large["splits_from"].is_null() && large["merges_into"].is_null());

    let numbers = |flags: &[&str]| -> Vec<u64> {
        let report = report_with(flags);
        let rows = report["components"].as_array().expect("rows").iter();
        rows.map(|row| row["number"].as_u64().expect("a number")).collect()
    };
    assert_eq!(numbers(&["--keep", "largest"]), [1]);
    assert_eq!(numbers(&["--min-volume", "100"]), [1]);
    assert_eq!(numbers(&["--min-area", "300"]), [0u64; 0]);
    assert_eq!(numbers(&["--at", "115,5.5,5.5"]), [2]);

    let csv = folder.run(&["components", "s.isp", "-c", "0", "--csv"]);
    let csv = String::from_utf8(csv.stdout).expect("text");
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), 3);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{csv}");
    assert_eq!(lines[2][2].parse::<f64>().ok(), small["volume"].as_f64());

    // The mesh that `extract` writes is that component.
    folder.run(&["extract", "s.isp", "-c", "0", "--at", "115,5.5,5.5", "-o", "small.ply"]);
    let mesh = read_ply(folder.path().join("small.ply")).expect("a mesh");
    assert_eq!(Some(mesh.triangles.len() as u64), small["n_triangles"].as_u64());
    let least = mesh.positions.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
    let low = small["bounds"][0][0].as_f64().expect("a number");
    // The mesh is written with 32-bit floats, whose steps are 7.6e-6 there.
    assert!((least - low).abs() < 7.7e-6, "{least} and {low}");
    let printed =
        folder.run(&["extract", "s.isp", "-c", "0", "--min-volume", "1e9", "-o", "none.ply"]);
    assert!(program::stderr(&printed).contains("no component is kept"));
    for wrong in [["--keep", "0"], ["--at", "1,2"], ["--min-volume", "-1"]] {
        folder.fails(&[&["components", "s.isp", "-c", "0"][..], &wrong].concat(), 2);
    }
}

#[test]
fn the_table_shows_the_unit_if_the_volume_has_one() {
    let folder = Folder::new();
    let head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 6 6 6\nspace dimension: 3\n\
                space directions: (2,0,0) (0,2,0) (0,0,2)\nspace units: \"mm\" \"mm\" \"mm\"\nencoding: raw\n\n";
    let mut bytes = head.as_bytes().to_vec();
    bytes.extend((0..216).map(|i| if i == 86 { 200 } else { 10 }));
    folder.write("v.nrrd", &bytes);
    folder.write("v_6x6x6_uint8.raw", &bytes[head.len()..]);
    for (volume, unit) in [("v.nrrd", Some("mm")), ("v_6x6x6_uint8.raw", None)] {
        folder.run(&["compute", "-q", volume, "-o", "s.isp", "--backend", "cpu"]);
        let output = folder.run(&["components", "s.isp", "-c", "100"]).stdout;
        let table = String::from_utf8(output).expect("text");
        let head = table.lines().nth(1).expect("a head");
        let has = ["volume, mm^3", "area, mm^2", "box, mm"].map(|name| head.contains(name));
        assert_eq!(has, [unit.is_some(); 3], "{table}");
        let output = folder.run(&["components", "s.isp", "-c", "100", "--json"]).stdout;
        let report: serde_json::Value = serde_json::from_slice(&output).expect("JSON");
        assert_eq!(report["unit"].as_str(), unit);
    }
}

#[test]
fn selecting_components_does_not_change_them() {
    let spectrum = swept(&noise(3, 1 << 20));
    let isovalue = 0.6 * f64::from(1u32 << 20);
    let mesh = spectrum.mesh_at(isovalue).expect("inside");
    let all = Components::of(&mesh);
    let kept = mesh.with_components(&Keep { largest: Some(3), ..Keep::default() });
    let some = Components::of(&kept);
    assert_eq!(some.list, all.list[..3]);
    assert!(all.list.len() > 10);
}
