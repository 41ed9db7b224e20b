//! Verification finds every kind of error in a spectrum, and none in a correct one.

use std::sync::Arc;

use crate::common::spectra::{phantom_spectrum, swept, swept_with};
use isospectrum::spectrum::{About, Event, EventKind, Knot, Patch, Spectrum, Triangle};
use isospectrum::unstable::extract::extract;
use isospectrum::unstable::sweep::TRACKED_AREA_SHARE;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::verify::{Limits, Report, Sampling, check, verify};
use isospectrum::volume::{Placement, ReadOptions, Samples, Volume, phantom, read_volume};
use isospectrum::{Parameters, Progress, Silent};

/// The isosurface c of the phantom `sphere:16` is the sphere of radius 7.5 (1 - c) voxels.
const ISOVALUE: f64 = 0.4;

/// Half of a range so narrow that a mesh that does not move is within the tolerance all over it: 7.5e-3 voxel.
const HALF_RANGE: f64 = 1e-3;

fn sphere() -> Volume {
    phantom("sphere:16").expect("a phantom")
}

/// A spectrum with one unmoving mesh: the isosurface in the middle of its range.
fn unmoving(volume: &Volume) -> Spectrum {
    unmoving_over(volume, HALF_RANGE)
}

/// [`unmoving`] over another range.
fn unmoving_over(volume: &Volume, half_range: f64) -> Spectrum {
    let field = ExactField::new(volume).expect("a small volume");
    let mesh = extract(&field, ISOVALUE);
    let knots =
        mesh.positions.iter().flat_map(|&position| [0, 1].map(|rank| Knot { rank, position }));
    let range = (ISOVALUE - half_range, ISOVALUE + half_range);
    let patch = Patch {
        isovalues: vec![range.0, range.1],
        first_knot: (0..=mesh.positions.len() as u32).map(|v| 2 * v).collect(),
        knots: knots.collect(),
        triangles: mesh
            .faces
            .iter()
            .zip(&mesh.caps)
            .map(|(&vertices, &cap)| Triangle { vertices, birth: 0, death: 1, cap })
            .collect(),
        collapses: Vec::new(),
    };
    Spectrum::new(About::new(volume.info(), range, 0.1), patch).expect("valid")
}

/// [`unmoving`] after a change.
fn unmoving_but(change: impl FnOnce(&mut Patch)) -> Spectrum {
    unmoving(&sphere()).changed(|_, patch| change(patch)).expect("still a spectrum")
}

fn report(spectrum: &Spectrum) -> Report {
    let sampling = Sampling { n_random: 3, n_events: 0, seed: 1, ..Sampling::default() };
    verify(spectrum, &sphere(), sampling, Limits::default(), &Silent).expect("verifiable")
}

fn failures(spectrum: &Spectrum) -> String {
    let report = report(spectrum);
    assert!(!report.passed);
    report.failures.join("; ")
}

#[test]
fn a_correct_spectrum_passes() {
    let report = report(&unmoving(&sphere()));
    assert!(report.passed, "{:?}", report.failures);
    let totals = &report.totals;
    assert_eq!((totals.isovalues, totals.topology_right, totals.manifold), (3, 3, 3));
    assert_eq!((totals.self_intersecting_share, totals.inverted_share), (0.0, 0.0));
    // Vertices on lattice edges are exact up to rounding to f32 and the motion of the surface over the range;
    // those inside cells are not on the isosurface, but nearer than a flat triangle's middle.
    assert!(totals.vertex_deviation.p99.is_some_and(|d| d < 0.1));
    assert_eq!(totals.tracked_share, Some(1.0));
}

#[test]
fn a_promise_that_other_isovalues_may_break_is_uncertain() {
    // The mesh is 0.1 voxel, the tolerance, from the isosurface at this distance from the middle of the range.
    let reach = 0.1 / 7.5;
    let checked = |half_range: f64| {
        let volume = sphere();
        check(&unmoving_over(&volume, half_range), &volume, &Silent).expect("verifiable")
    };
    let near = checked(0.5 * reach);
    assert_eq!((near.broken.len(), near.uncertain.len(), near.summary()), (0, 0, None));
    // Beyond the tolerance is 15 % of the range, and 25 % are allowed: by chance, others have more.
    let close = checked(reach / 0.85);
    assert_eq!(close.broken, [""; 0]);
    let [promise] = &close.uncertain[..] else { panic!("{close:?}") };
    assert!(promise.starts_with("isosurface from mesh, 75 % within: "), "{promise}");
    let summary = close.summary().expect("an uncertain promise");
    assert_eq!(summary, format!("may not keep its promises at other isovalues: {promise}"));
    // 40 % beyond are clearly more.
    let far = checked(reach / 0.6);
    let summary = far.summary().expect("a broken promise");
    assert!(far.broken[0].starts_with("isosurface from mesh, 75 % within: "), "{far:?}");
    assert!(summary.starts_with("does not keep its promises: isosurface from mesh"), "{summary}");
}

#[test]
fn a_missing_triangle_is_found() {
    let spectrum = unmoving_but(|patch| patch.triangles.truncate(patch.triangles.len() - 1));
    let printed = failures(&spectrum);
    assert!(printed.contains("isovalues with wrong topology: 3, expected 0"), "{printed}");
    assert!(printed.contains("no closed oriented manifold: 3, expected 0"), "{printed}");
}

#[test]
fn an_inverted_triangle_is_found() {
    let spectrum = unmoving_but(|patch| patch.triangles[0].vertices.swap(0, 1));
    let printed = failures(&spectrum);
    assert!(
        printed.contains("no closed oriented manifold: 3") && !printed.contains("topology"),
        "{printed}"
    );
}

#[test]
fn a_mesh_that_faces_higher_values_is_found() {
    let spectrum =
        unmoving_but(|patch| patch.triangles.iter_mut().for_each(|t| t.vertices.swap(0, 1)));
    let report = report(&spectrum);
    assert_eq!(report.totals.inverted_share, 1.0);
    assert_eq!(report.failures, ["triangles that face the wrong side: 100 %, expected 5 %"]);
}

#[test]
fn a_mesh_off_the_isosurface_is_found() {
    // A third of a voxel along x is more than the tolerance nearly everywhere.
    let spectrum =
        unmoving_but(|patch| patch.knots.iter_mut().for_each(|knot| knot.position[0] += 0.33));
    let printed = failures(&spectrum);
    assert!(printed.contains("vertices from isosurface, 99 % within"), "{printed}");
    assert!(printed.contains("barycentres from isosurface, 50 % within"), "{printed}");
    assert!(!printed.contains("topology"), "{printed}");
}

#[test]
fn a_vertex_pulled_through_the_sphere_crosses_triangles() {
    let middle = [7.5f32; 3];
    let spectrum = unmoving_but(|patch| {
        for knot in &mut patch.knots[..2] {
            let opposite = |a: usize| middle[a] - 1.3 * (knot.position[a] - middle[a]);
            knot.position = std::array::from_fn(opposite);
        }
    });
    assert!(report(&spectrum).totals.self_intersecting_share > 0.0);
    let printed = failures(&spectrum);
    assert!(
        printed.contains("triangles that cross others") && !printed.contains("jumps"),
        "{printed}"
    );
}

#[test]
fn an_isosurface_that_the_mesh_does_not_cover_is_found() {
    // The lower half of the sphere is folded onto the upper one: every vertex lies on the isosurface, and the mesh is
    // as closed as before.
    let middle = 7.5 * 1.015_738;
    let spectrum = unmoving_but(|patch| {
        for knot in &mut patch.knots {
            knot.position[2] = middle + (knot.position[2] - middle).abs();
        }
    });
    let printed = failures(&spectrum);
    assert!(printed.contains("isosurface from mesh, 99 % within"), "{printed}");
    assert!(
        !printed.contains("vertices from isosurface") && !printed.contains("isovalues"),
        "{printed}"
    );
}

#[test]
fn a_vertex_far_from_the_volume_is_found() {
    // A spectrum with NaN cannot be built; finite positions may be far from the volume.
    let nowhere =
        |y: f32| move |patch: &mut Patch| (0..2).for_each(|i| patch.knots[i].position[1] = y);
    let none = unmoving(&sphere()).changed(|_, patch| nowhere(f32::NAN)(patch));
    assert!(none.is_err_and(|e| e.to_string().contains("vertex 0")));
    let spectrum = unmoving_but(nowhere(1e4));
    assert!(
        failures(&spectrum).contains("positions not finite or not in the volume: 3, expected 0")
    );
}

#[test]
fn stopping_is_an_interruption() {
    let spectrum = unmoving(&sphere());
    struct Stop;
    impl Progress for Stop {
        fn report(&self, _done: f64, _message: &str) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let stopped = verify(&spectrum, &sphere(), Sampling::default(), Limits::default(), &Stop);
    assert!(matches!(stopped, Err(isospectrum::Error::Interrupted)));
}

/// The sphere, replaced in the middle of the range by one that is moved along x.
fn jumping(by: f32) -> Spectrum {
    let spectrum = unmoving(&sphere());
    let (low, high) = spectrum.range();
    let n = spectrum.n_vertices() as u32;
    let moved: Vec<Knot> = (spectrum.knots().iter().enumerate())
        .map(|(i, knot)| {
            let [x, y, z] = knot.position;
            Knot { rank: 1 + i as u32 % 2, position: [x + by, y, z] }
        })
        .collect();
    let jumping = spectrum.changed(|_, patch| {
        patch.isovalues = vec![low, 0.5 * (low + high), high];
        // The first sphere may live to the end as well.
        patch.knots.iter_mut().for_each(|knot| knot.rank *= 2);
        patch.knots.extend(moved);
        patch.first_knot = (0..=2 * n).map(|v| 2 * v).collect();
        let replaced = patch.triangles.clone();
        patch.triangles.iter_mut().for_each(|t| t.death = 1);
        patch.triangles.extend(replaced.into_iter().map(|t| Triangle {
            vertices: t.vertices.map(|v| v + n),
            birth: 1,
            death: 2,
            ..t
        }));
    });
    jumping.expect("valid")
}

#[test]
fn a_jump_away_from_events_is_measured_and_limited() {
    let spectrum = jumping(0.25);
    let sampling = Sampling { n_random: 0, n_events: 4, seed: 1, ..Sampling::default() };
    let limits = Limits { jump: Some(0.1), deviation: Some(1.0), ..Limits::default() };
    let report = verify(&spectrum, &sphere(), sampling, limits, &Silent).expect("verifiable");
    let totals = &report.totals;
    assert_eq!((totals.largest_jump, totals.survived_share), (None, None));
    // Where the sphere faces x it moves by all of 0.25, elsewhere by less.
    let largest = totals.largest_jump_elsewhere.expect("measured");
    assert!((0.2..=0.25 + 1e-6).contains(&largest), "{largest}");
    let p99 = totals.largest_jump_elsewhere_p99.expect("measured");
    assert!(0.1 < p99 && p99 <= largest, "{p99}");
    let [failure] = &report.failures[..] else { panic!("{:?}", report.failures) };
    assert!(failure.starts_with("jumps away from events, 99 % within: 0.2"), "{failure}");
}

#[test]
fn a_jump_of_the_mesh_without_a_jump_of_the_isosurface_fails() {
    let sampling = Sampling { n_random: 0, n_events: 4, seed: 1, ..Sampling::default() };
    let found = |by: f32| {
        let limits = Limits::default();
        verify(&jumping(by), &sphere(), sampling, limits, &Silent).expect("verifiable")
    };
    assert!(found(0.0).passed, "{:?}", found(0.0).failures);
    let failures = found(0.6).failures;
    assert!(
        failures.len() == 1 && failures[0].starts_with("jumps away from events"),
        "{failures:?}"
    );
}

/// Two halves of different values with a thick plateau between them: the isosurface jumps across it.
fn plateau() -> Volume {
    let samples = (0..12 * 8 * 8).map(|i| [0, 1, 2, 5, 5, 5, 5, 5, 8, 9, 10, 0][i % 12]).collect();
    let volume = Volume::new("p", [12, 8, 8], Samples::U8(samples), Placement::default());
    volume.expect("a valid volume")
}

#[test]
fn a_jump_of_the_mesh_with_the_isosurface_passes() {
    let volume = Arc::new(plateau());
    let range = Some((3.0, 7.0));
    let spectrum = swept_with(&volume, &Parameters::default().with_range(range));
    let sampling = Sampling { n_random: 4, n_events: 8, seed: 1, ..Sampling::default() };
    let limits = Limits::default();
    let report = verify(&spectrum, &volume, sampling, limits, &Silent).expect("verifiable");
    let jumps = report.continuity.at_events.iter().chain(&report.continuity.elsewhere);
    let across: Vec<_> = jumps.filter(|j| j.isovalue == 5.0).collect();
    assert!(!across.is_empty(), "{:?}", report.continuity);
    // From one side of the plateau to the other it is four voxels.
    assert!(across.iter().all(|j| j.largest > 3.0 && j.beyond_p99 < 0.25), "{across:?}");
    assert!(report.passed, "{:?}", report.failures);
}

/// Checks that a default spectrum keeps all promises.
fn keeps_its_promises(volume: &Volume, spectrum: &Spectrum) {
    let sampling = Sampling { n_random: 32, n_events: 8, seed: 5, ..Sampling::default() };
    let limits = Limits::default();
    let report = verify(spectrum, volume, sampling, limits, &Silent).expect("verifiable");
    assert!(report.passed, "{}: {:?}", volume.name(), report.failures);
    // Every promise was measured.
    let unmeasured = report.promises.iter().find(|promise| promise.found.is_none());
    assert_eq!(unmeasured, None, "{}", volume.name());
    assert!(
        spectrum.parameters().number(&format!("/{TRACKED_AREA_SHARE}")).is_some_and(|s| s > 0.3)
    );
}

#[test]
fn default_spectra_of_phantoms_keep_every_promise() {
    for spec in ["torus:24", "blobs:24", "noise:10:1", "noise:10:4"] {
        let (volume, spectrum) = phantom_spectrum(spec);
        keeps_its_promises(&volume, &spectrum);
    }
}

#[test]
fn triangles_replaced_at_an_event_do_not_survive_it() {
    let spectrum = jumping(0.0);
    let kept = spectrum.triangles().len() / 4;
    let isovalue = spectrum.isovalues()[1];
    let kind = EventKind::HandleOpen;
    // A quarter of the triangles of the first sphere live on, the rest is replaced.
    let spectrum = spectrum.changed(|about, patch| {
        patch.triangles[..kept].iter_mut().for_each(|triangle| triangle.death = 2);
        about.events = vec![Event { isovalue, position: [8.0; 3], kind, persistence: None }];
    });
    let spectrum = spectrum.expect("valid");
    let report = report(&spectrum);
    let [event] = report.continuity.coherence.events[..] else { panic!("{report:?}") };
    assert_eq!(
        (event.survived, event.before),
        (kept as u64, spectrum.triangles().len() as u64 / 2)
    );
    assert_eq!(report.totals.survived_share, Some(event.survived as f64 / event.before as f64));
}

mod real_volumes {
    use super::*;
    use crate::common::data;

    mod long {
        use super::*;

        #[test]
        #[ignore = "long, needs $ISOSPECTRUM_DATA: run by scripts/test --long"]
        fn a_default_spectrum_of_nucleon_keeps_every_promise() {
            let path = data::file("nucleon_41x41x41_uint8.raw");
            let volume = Arc::new(read_volume(&path, &ReadOptions::default()).expect("a volume"));
            keeps_its_promises(&volume, &swept(&volume));
        }
    }
}

#[test]
fn a_volume_of_another_spacing_is_not_that_of_the_spectrum() {
    let spectrum = unmoving(&sphere());
    let spaced = |spacing: [f64; 3]| {
        let placement = Placement { spacing, ..Placement::default() };
        let volume = Volume::new("v", sphere().dims(), sphere().samples().clone(), placement);
        let volume = volume.expect("a valid volume");
        verify(&spectrum, &volume, Sampling::default(), Limits::default(), &Silent)
    };
    // The voxel frame is the same for all cubic cells.
    assert!(spaced([0.5; 3]).is_ok());
    let error = spaced([1.0, 1.0, 2.0]).expect_err("cells are longer").to_string();
    assert!(error.contains("cells of [1.0, 1.0, 1.5] voxels"), "{error}");
}
