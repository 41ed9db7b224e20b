//! Queries on spectra against direct evaluation of the definition.

use std::collections::BTreeSet;

use crate::common::any_spectrum::any_spectrum;
use crate::common::synthetic::{Growth, growing_sphere, isovalue, small, volume_info};
use isospectrum::Error;
use isospectrum::spectrum::{About, Knot, Mesh, Normals, Patch, Query, Spectrum, Triangle, normal};
use isospectrum::unstable::spectrum::interval_tree::IntervalTree;
use proptest::prelude::*;

/// Two ways to interpolate in f64 and round to f32 differ by one rounding: 2^-23 of coordinates
/// below 256.
const ROUNDING: f32 = 256.0 / (1 << 23) as f32;

/// Corner positions and caps of the mesh at an isovalue, straight from the definition.
fn naive(spectrum: &Spectrum, isovalue: f64) -> Vec<([[f32; 3]; 3], bool)> {
    let c = |rank: u32| spectrum.isovalues()[rank as usize];
    let position = |v: u32| {
        let trajectory = spectrum.trajectory(v);
        let pair = trajectory.windows(2).find(|pair| isovalue <= c(pair[1].rank)).expect("covered");
        let t = (isovalue - c(pair[0].rank)) / (c(pair[1].rank) - c(pair[0].rank));
        let (p, q) = (pair[0].position, pair[1].position);
        std::array::from_fn(|i| (f64::from(p[i]) + t * f64::from(q[i] - p[i])) as f32)
    };
    let alive = |t: &&Triangle| c(t.birth) <= isovalue && isovalue < c(t.death);
    let active = spectrum.triangles().iter().filter(alive);
    active.map(|t| (t.vertices.map(position), t.cap)).collect()
}

fn corners(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect()
}

fn assert_equal_up_to_rounding(mesh: &Mesh, expected: &[([[f32; 3]; 3], bool)]) {
    let caps: Vec<bool> = expected.iter().map(|e| e.1).collect();
    assert_eq!(mesh.caps, caps);
    for (found, (expected, _)) in corners(mesh).iter().zip(expected) {
        for (p, q) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((p - q).abs() <= ROUNDING, "{p} instead of {q}");
        }
    }
}

/// The vertices are those of the living triangles by number, each once, and normals have length one.
fn assert_compact(mesh: &Mesh, spectrum: &Spectrum, isovalue: f64) {
    let rank = spectrum.rank_at(isovalue).expect("inside the table");
    let alive = spectrum.triangles().iter().filter(|t| t.birth <= rank && rank < t.death);
    let used: BTreeSet<u32> = alive.clone().flat_map(|t| t.vertices).collect();
    let used: Vec<u32> = used.into_iter().collect();
    assert_eq!(mesh.positions.len(), used.len());
    let named = mesh.triangles.iter().map(|t| t.map(|v| used[v as usize]));
    assert!(named.eq(alive.map(|t| t.vertices)));
    assert_eq!(mesh.normals.len(), mesh.positions.len());
    for n in &mesh.normals {
        let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!((length - 1.0).abs() < 1e-5, "{n:?}");
    }
}

/// Isovalues of the table, their neighbours as floating point numbers, and isovalues between them.
fn probes(spectrum: &Spectrum) -> Vec<f64> {
    let (low, high) = spectrum.range();
    let near = spectrum.isovalues().iter().flat_map(|c| [c.next_down(), *c, c.next_up()]);
    let between = spectrum.isovalues().windows(2).map(|pair| 0.3 * pair[0] + 0.7 * pair[1]);
    near.chain(between).filter(|c| (low..=high).contains(c)).collect()
}

proptest! {
    #[test]
    fn a_query_agrees_with_the_definition(spectrum in any_spectrum(), order in any::<u64>()) {
        spectrum.check().expect("the generator keeps the invariants");
        let mut query = Query::new(&spectrum);
        let mut mesh = Mesh::default();
        let mut probes = probes(&spectrum);
        // Upwards is the incremental way; a rotation adds a jump.
        let n = probes.len();
        probes.rotate_left((order % n as u64) as usize);
        if order % 3 == 0 {
            probes.reverse();
        }
        for c in probes {
            query.mesh_at_into(c, &mut mesh).expect("inside the range");
            assert_equal_up_to_rounding(&mesh, &naive(&spectrum, c));
            assert_compact(&mesh, &spectrum, c);
            prop_assert_eq!(&mesh, &spectrum.mesh_at(c).expect("inside the range"));
        }
    }

    #[test]
    fn the_interval_tree_agrees_with_a_linear_search(
        intervals in prop::collection::vec((0u32..60, 1u32..60), 0..80),
        far in any::<bool>(),
    ) {
        // Far apart, the tree is as deep as ranks are wide.
        let scale = if far { 30_000_000 } else { 1 };
        let intervals: Vec<(u32, u32)> =
            intervals.into_iter().map(|(birth, n)| (birth * scale, (birth + n) * scale)).collect();
        let tree = IntervalTree::new(&intervals);
        for rank in (0..122).map(|i| i * scale).chain([1, u32::MAX]) {
            let mut found = Vec::new();
            tree.stab(rank, |i| found.push(i));
            found.sort_unstable();
            let holds = |(i, &(birth, death)): (usize, &(u32, u32))| {
                (birth <= rank && rank < death).then_some(i as u32)
            };
            let expected: Vec<u32> = intervals.iter().enumerate().filter_map(holds).collect();
            prop_assert_eq!(found, expected);
        }
    }
}

#[test]
fn the_mesh_is_continuous_from_the_right_and_changes_at_births_and_deaths_only() {
    let spectrum = small();
    let mut query = Query::new(&spectrum);
    for pair in spectrum.isovalues().windows(2) {
        let at = query.mesh_at(pair[0]).expect("inside the range");
        let after = query.mesh_at(pair[0].next_up()).expect("inside the range");
        let before_next = query.mesh_at(pair[1].next_down()).expect("inside the range");
        assert_eq!(at.triangles, after.triangles);
        assert_eq!(at.triangles, before_next.triangles);
        for (p, q) in at.positions.as_flattened().iter().zip(after.positions.as_flattened()) {
            assert!((p - q).abs() <= ROUNDING);
        }
    }
}

#[test]
fn every_isovalue_of_a_growing_sphere_gives_a_sphere() {
    let spectrum = small();
    let mut query = Query::new(&spectrum);
    let (low, high) = spectrum.range();
    for i in 0..400 {
        let c = low + (high - low) * f64::from(i) / 400.0;
        let mesh = query.mesh_at(c).expect("inside the range");
        let edges: BTreeSet<(u32, u32)> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        assert_eq!(edges.len(), 3 * mesh.triangles.len(), "a directed edge occurs twice at {c}");
        assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))), "not closed at {c}");
        let euler =
            mesh.positions.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64;
        assert_eq!(euler, 2, "at {c}");
    }
    assert_eq!(query.mesh_at(high).expect("the range is closed"), Mesh::default());
}

#[test]
fn vertices_are_at_their_knots_exactly() {
    let spectrum = small();
    for v in 0..spectrum.n_vertices() as u32 {
        for knot in spectrum.trajectory(v) {
            let position = spectrum.vertex_at(v, knot.rank, isovalue(knot.rank));
            assert_eq!(position, knot.position);
        }
    }
}

#[test]
fn a_small_move_costs_only_its_changes_and_agrees_with_a_jump() {
    let growth = Growth { subdivisions: 3, n_steps: 60, splits: 2, flips: 5, knot_distance: 9 };
    let spectrum = growing_sphere(&growth);
    let mut near = Query::new(&spectrum);
    for rank in (0..60).chain((0..60).rev()) {
        let c = isovalue(rank) + 0.01;
        let fresh = spectrum.mesh_at(c).expect("inside the range");
        assert_eq!(near.mesh_at(c).expect("inside the range"), fresh, "at {c}");
    }
}

#[test]
fn an_isovalue_outside_the_range_is_an_error_and_the_mesh_is_unchanged() {
    let spectrum = small();
    let (low, high) = spectrum.range();
    let mut query = Query::new(&spectrum);
    let mut mesh = query.mesh_at(low).expect("the range is closed");
    let before = mesh.clone();
    for c in [low.next_down(), high.next_up(), f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let result = query.mesh_at_into(c, &mut mesh);
        assert!(matches!(result, Err(Error::Range { .. })), "{c}: {result:?}");
        assert_eq!(mesh, before);
    }
}

#[test]
fn a_mesh_without_area_still_has_unit_normals() {
    let spectrum = small().changed(|_, patch| {
        patch.knots.iter_mut().for_each(|knot| knot.position = [1.0, 2.0, 3.0]);
    });
    let spectrum = spectrum.expect("valid");
    for c in probes(&spectrum) {
        assert_compact(&spectrum.mesh_at(c).expect("inside the range"), &spectrum, c);
    }
}

/// The middle of the sphere.
const MIDDLE: f32 = 64.0;

/// A sphere that only grows.
fn plain() -> Spectrum {
    let growth = Growth { subdivisions: 3, n_steps: 12, splits: 0, flips: 0, knot_distance: 1 };
    growing_sphere(&growth)
}

/// A sphere whose lower half is a cap.
fn capped() -> Spectrum {
    let spectrum = plain();
    let middle = |spectrum: &Spectrum, t: &Triangle| -> f32 {
        t.vertices.iter().map(|&v| spectrum.trajectory(v)[0].position[2] - MIDDLE).sum()
    };
    let caps: Vec<bool> = spectrum.triangles().iter().map(|t| middle(&spectrum, t) < 0.0).collect();
    let capped = spectrum.changed(|_, patch| {
        patch.triangles.iter_mut().zip(caps).for_each(|(triangle, cap)| triangle.cap = cap);
    });
    capped.expect("valid")
}

#[test]
fn normals_are_those_of_the_mesh_and_caps_count_only_where_there_is_nothing_else() {
    for spectrum in [plain(), capped()] {
        let has_caps = spectrum.triangles().iter().any(|t| t.cap);
        let normals = Normals::of(&spectrum);
        assert_eq!(normals.codes().len(), spectrum.knots().len());
        for c in probes(&spectrum) {
            let mesh = spectrum.mesh_at(c).expect("inside the range");
            let rank = spectrum.rank_at(c).expect("in the table");
            let used: BTreeSet<u32> = (spectrum.triangles().iter())
                .filter(|t| t.birth <= rank && rank < t.death)
                .flat_map(|t| t.vertices)
                .collect();
            for ((&v, n), p) in used.iter().zip(&mesh.normals).zip(&mesh.positions) {
                let p = &p.map(|x| x - MIDDLE);
                let cosine = |a: &[f32; 3], b: &[f32; 3]| -> f32 {
                    let size = |x: &[f32; 3]| x.iter().map(|x| x * x).sum::<f32>().sqrt();
                    a.iter().zip(b).map(|(x, y)| x * y).sum::<f32>() / (size(a) * size(b))
                };
                // The sphere has ripples; along the seam its normals are those of one side.
                let least = if has_caps { 0.8 } else { 0.85 };
                assert!(cosine(n, p) > least, "{n:?} at {p:?}");
                // Not at the ends of the range, but slightly inside.
                let trajectory = spectrum.trajectory(v);
                let [_, inner @ .., _] = trajectory else { continue };
                let Some(i) = inner.iter().position(|knot| knot.rank == rank) else { continue };
                if c == spectrum.isovalues()[rank as usize] {
                    let knot = spectrum.first_knot()[v as usize] as usize + 1 + i;
                    let at_knot = normal::decode(normals.codes()[knot]);
                    assert!(cosine(&at_knot, n) > 0.9999, "{at_knot:?} instead of {n:?} at {c}");
                }
            }
        }
    }
}

#[test]
fn a_vertex_whose_triangles_live_between_its_knots_has_their_normal() {
    // Trajectories begin long before the triangles and end long after them.
    let n = 5;
    let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let knots = corners.iter();
    let patch = Patch {
        isovalues: (0..n).map(f64::from).collect(),
        first_knot: vec![0, 2, 4, 6],
        knots: knots
            .flat_map(|&position| [0, n - 1].map(|rank| Knot { rank: rank as u32, position }))
            .collect(),
        triangles: vec![Triangle { vertices: [0, 1, 2], birth: 2, death: 3, cap: false }],
        collapses: Vec::new(),
    };
    let spectrum = Spectrum::new(small().into_parts().0, patch).expect("valid");
    let wanted = normal::encode([1.0; 3]);
    assert_eq!(Normals::of(&spectrum).codes(), [wanted; 6]);
}

#[test]
fn normals_do_not_depend_on_the_order_of_triangles() {
    let spectrum = capped();
    let turned = spectrum.clone().changed(|_, patch| {
        patch.triangles.reverse();
        for (i, triangle) in patch.triangles.iter_mut().enumerate() {
            triangle.vertices.rotate_left(i % 3);
        }
    });
    let turned = turned.expect("valid");
    assert_eq!(Normals::of(&turned), Normals::of(&spectrum));
}

/// One triangle that moves along z with the isovalue.
fn patch(isovalues: &[f64]) -> Patch {
    let n = isovalues.len() as u32;
    let knot = |v: u32, rank: u32| Knot { rank, position: [v as f32, (v * v) as f32, rank as f32] };
    Patch {
        isovalues: isovalues.to_vec(),
        first_knot: vec![0, 2, 4, 6],
        knots: (0..3).flat_map(|v| [knot(v, 0), knot(v, n - 1)]).collect(),
        triangles: vec![Triangle { vertices: [0, 1, 2], birth: 0, death: n - 1, cap: false }],
        collapses: vec![],
    }
}

fn spectrum_of(patch: Patch) -> isospectrum::Result<Spectrum> {
    Spectrum::from_patch(About::new(volume_info(), (0.0, 10.0), 0.1), patch)
}

#[test]
fn unreferenced_isovalues_are_left_out() {
    // Only a lifetime ends at 2; nothing refers to 3.
    let mut patch = patch(&[-0.0, 2.0, 3.0, 5.0]);
    patch.triangles[0].death = 1;
    let spectrum = spectrum_of(patch).expect("valid");
    assert_eq!(spectrum.isovalues(), [0.0, 2.0, 5.0]);
    assert!(spectrum.isovalues()[0].is_sign_positive());
    assert_eq!(spectrum.first_knot(), [0, 2, 4, 6]);
    assert!(spectrum.trajectory(0).iter().map(|k| k.rank).eq([0, 2]));
    let lifetimes: Vec<_> =
        spectrum.triangles().iter().map(|t| (t.vertices, t.birth, t.death)).collect();
    assert_eq!(lifetimes, [([0, 1, 2], 0, 1)]);
}

#[test]
fn a_patch_that_breaks_an_invariant_is_an_error() {
    let mut broken = patch(&[0.0, 1.0]);
    broken.triangles[0].vertices[1] = 7;
    let error = spectrum_of(broken).expect_err("vertex 7 of 3");
    assert_eq!(error.to_string(), "triangle 0: vertex 7, expected one of 3");
}

#[test]
fn an_empty_spectrum_has_empty_meshes() {
    let spectrum = spectrum_of(Patch::default()).expect("valid");
    assert_eq!(spectrum.mesh_at(5.0).expect("inside the range"), Mesh::default());
}

#[test]
fn every_broken_invariant_is_named() {
    type Break = fn(&mut About, &mut Patch);
    let breaks: [(&str, Break); 16] = [
        ("range", |a, _| a.range = (1.0, 0.0)),
        ("range", |a, _| a.range.1 = f64::NAN),
        ("tolerance", |a, _| a.tolerance = f64::INFINITY),
        ("volume", |a, _| a.volume.placement.spacing[1] = 0.0),
        ("event 1", |a, _| a.events[1].isovalue = -9.0),
        ("event 2", |a, _| a.events[2].position[0] = f64::NAN),
        ("isovalue 3", |_, p| p.isovalues[3] = p.isovalues[2]),
        ("trajectories", |_, p| *p.first_knot.last_mut().expect("some") -= 1),
        ("vertex 1", |_, p| p.first_knot[1] = p.first_knot[2] + 1),
        ("vertex 0: knot 1", |_, p| p.knots[1].rank = p.knots[0].rank),
        ("vertex 0: knot 0", |_, p| p.knots[0].position[2] = f32::NAN),
        ("triangle 0: vertices", |_, p| p.triangles[0].vertices[1] = p.triangles[0].vertices[0]),
        ("triangle 2: lifetime", |_, p| p.triangles[2].death = p.triangles[2].birth),
        ("triangle 3: vertex 99999", |_, p| p.triangles[3].vertices[0] = 99_999),
        ("collapse 0", |_, p| p.collapses[0].target = p.collapses[0].vertex),
        ("collapse 1: rank", |_, p| p.collapses[1].rank = 1000),
    ];
    for (name, break_it) in breaks {
        let error = small().changed(break_it).expect_err(name).to_string();
        assert!(error.starts_with(name), "'{error}' should start with '{name}'");
    }
    let late = small().changed(|_, patch| {
        let born_later = patch.first_knot.len() as u32 - 2;
        patch.triangles[0].vertices = [0, 1, born_later];
    });
    let error = late.expect_err("the vertex is born after the triangle").to_string();
    assert!(error.contains("has no knots from"), "{error}");
}
