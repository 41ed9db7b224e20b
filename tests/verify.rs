//! Verification finds what is wrong with a spectrum, and nothing with a right one.

use isospectrum::extract::extract;
use isospectrum::spectrum::{Knot, Spectrum, Triangle, VolumeInfo, normal};
use isospectrum::topology::exact::ExactField;
use isospectrum::verify::{Limits, Report, Sampling, verify};
use isospectrum::volume::{Volume, phantom};

/// The isosurface c of the phantom `sphere:16` is the sphere of radius 7.5 (1 - c) voxels.
const ISOVALUE: f64 = 0.4;

/// Half of a range so narrow that an unmoving mesh is right all over it: 7.5e-3 voxel.
const HALF_RANGE: f64 = 1e-3;

fn sphere() -> Volume {
    phantom("sphere:16").expect("a phantom")
}

/// A spectrum with one unmoving mesh: the isosurface in the middle of its range.
fn unmoving(volume: &Volume) -> Spectrum {
    let field = ExactField::new(volume).expect("a small volume");
    let mesh = extract(&field, ISOVALUE);
    let knots = mesh.positions.iter().flat_map(|&position| {
        [0, 1].map(|rank| Knot { rank, position, normal: normal::encode([0.0, 0.0, 1.0]) })
    });
    let range = (ISOVALUE - HALF_RANGE, ISOVALUE + HALF_RANGE);
    Spectrum {
        volume: VolumeInfo {
            name: volume.name().to_owned(),
            dims: volume.dims(),
            sample_type: volume.samples().type_name().to_owned(),
            range: volume.range(),
            placement: *volume.placement(),
            outside: volume.outside(),
        },
        range,
        tolerance: 0.1,
        parameters: serde_json::Value::Null,
        events: Vec::new(),
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
    }
}

fn report(spectrum: &Spectrum) -> Report {
    let sampling = Sampling { n_random: 3, n_events: 0, seed: 1 };
    verify(spectrum, &sphere(), sampling, Limits::default(), &mut |_| true).expect("verifiable")
}

fn failures(spectrum: &Spectrum) -> String {
    let report = report(spectrum);
    assert!(!report.passed);
    report.failures.join("; ")
}

#[test]
fn a_right_spectrum_passes() {
    let report = report(&unmoving(&sphere()));
    assert!(report.passed, "{:?}", report.failures);
    let totals = &report.totals;
    assert_eq!((totals.isovalues, totals.topology_right, totals.manifold), (3, 3, 3));
    assert_eq!((totals.self_intersecting_share, totals.inverted_share), (0.0, 0.0));
    // Vertices on lattice edges are exact to f32 and to how far the surface moves over the range;
    // those inside cells are not on the isosurface, but nearer than a flat triangle's middle.
    assert!(totals.vertex_deviation.p99.is_some_and(|d| d < 0.1));
    assert_eq!(totals.tracked_share, Some(1.0));
}

#[test]
fn a_missing_triangle_is_found() {
    let mut spectrum = unmoving(&sphere());
    spectrum.triangles.pop();
    let said = failures(&spectrum);
    assert!(said.contains("topology is wrong at 3 of 3"), "{said}");
    assert!(said.contains("no closed oriented manifold at 3 of 3"), "{said}");
}

#[test]
fn a_turned_triangle_is_found() {
    let mut spectrum = unmoving(&sphere());
    spectrum.triangles[0].vertices.swap(0, 1);
    let said = failures(&spectrum);
    assert!(said.contains("no closed oriented manifold") && !said.contains("topology"), "{said}");
}

#[test]
fn a_mesh_that_faces_the_wrong_side_is_told() {
    let mut spectrum = unmoving(&sphere());
    spectrum.triangles.iter_mut().for_each(|t| t.vertices.swap(0, 1));
    assert_eq!(report(&spectrum).totals.inverted_share, 1.0);
}

#[test]
fn a_mesh_beside_the_isosurface_is_found() {
    let mut spectrum = unmoving(&sphere());
    // A third of a voxel along x is more than the tolerance nearly everywhere.
    spectrum.knots.iter_mut().for_each(|knot| knot.position[0] += 0.33);
    let said = failures(&spectrum);
    assert!(said.contains("99th percentile of the deviation"), "{said}");
    assert!(!said.contains("topology"), "{said}");
}

#[test]
fn a_vertex_pulled_through_the_sphere_crosses_triangles() {
    let mut spectrum = unmoving(&sphere());
    let middle = [7.5f32; 3];
    for knot in &mut spectrum.knots[..2] {
        let opposite = |a: usize| middle[a] - 1.3 * (knot.position[a] - middle[a]);
        knot.position = std::array::from_fn(opposite);
    }
    assert!(report(&spectrum).totals.self_intersecting_share > 0.0);
}

#[test]
fn a_vertex_that_is_nowhere_is_found() {
    let mut spectrum = unmoving(&sphere());
    spectrum.knots[0].position[1] = f32::NAN;
    spectrum.knots[1].position[1] = f32::NAN;
    assert!(failures(&spectrum).contains("positions are not finite"));
}

#[test]
fn stopping_is_an_interruption() {
    let spectrum = unmoving(&sphere());
    let stopped =
        verify(&spectrum, &sphere(), Sampling::default(), Limits::default(), &mut |_| false);
    assert!(matches!(stopped, Err(isospectrum::Error::Interrupted)));
}
