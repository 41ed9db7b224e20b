//! The GPU against its CPU twin: the same formulas in the same order, so only fused
//! multiplications, division and square roots may round otherwise.

use crate::common::random::Random;
use crate::common::shapes::{Mesh, noise, sampled};
use crate::kernels::suite::{n_failed, project, relaxed};
use crate::kernels::{PIPELINES, cpu, gpu};
use glam::{DVec3, Vec3};
use isospectrum::unstable::field::Status;
use isospectrum::unstable::kernels::{Kernels, Relaxation};
use isospectrum::volume::Volume;
use std::sync::Arc;

/// Positions may differ by this many voxels. Near coordinate 16 an ulp is 1.9e-6; the distance along
/// a ray carries the rounding of some thirty operations on values of order one (2e-6), divided by
/// a slope that may be a tenth of its mean.
const POSITION_TOLERANCE: f32 = 2e-5;

/// Share of vertices of a noise field for which rounding may change a decision (another piece of the cubic, another cell at an
/// edge). A decision is a tie to within about 1e-5, and each vertex takes fewer than ten.
const UNDECIDED: f64 = 1e-3;

/// Normals of faces of size one at coordinates up to 32: spokes carry no rounding at all, cross
/// products and their sums a few ulps.
const NORMAL_TOLERANCE: f32 = 2e-6;

/// Iterated relaxation adds a rounding of a position per iteration, here 12 of them, and the
/// umbrella averages rather than amplifies it.
const RELAXED_TOLERANCE: f32 = 12.0 * POSITION_TOLERANCE;

fn pair(volume: &Arc<Volume>, mesh: &Mesh) -> [Box<dyn Kernels + Send>; 2] {
    [cpu, gpu].map(|backend| {
        let mut kernels = backend(volume);
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        kernels
    })
}

fn largest_difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(p, q)| Vec3::from(*p).distance(Vec3::from(*q))).fold(0.0, f32::max)
}

fn ball() -> (Arc<Volume>, Mesh) {
    let center = DVec3::new(15.5, 16.0, 15.0);
    let volume = sampled([32, 33, 31], [1.0; 3], |p| {
        let q = DVec3::from_array(p) - center;
        -q.length() - 0.3 * (1.1 * q.x).sin() * (0.9 * q.y).cos()
    });
    (volume, Mesh::sphere(center.as_vec3(), 9.0, 32))
}

#[test]
fn the_gpu_suite_runs_on_a_gpu() {
    let name = PIPELINES.gpu().name();
    assert!(["vulkan", "metal", "dx12"].iter().any(|b| name.contains(b)), "{name}");
}

#[test]
fn normals_agree() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    let [a, b] = [&mut a, &mut b].map(|k| project(&mut **k, &[], 1.0).normals);
    let difference = largest_difference(&a, &b);
    assert!(difference < NORMAL_TOLERANCE, "{difference}");
}

#[test]
fn projection_agrees_on_a_smooth_field() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    for isovalue in [-9.5, -9.0, -8.25, -9.75] {
        let [p, q] = [&mut a, &mut b].map(|k| project(&mut **k, &[isovalue], 2.0));
        assert_eq!(n_failed(&p), 0);
        assert_eq!(p.status, q.status);
        let difference = largest_difference(&p.positions, &q.positions);
        assert!(difference < 4.0 * POSITION_TOLERANCE, "{difference} after up to 4 steps");
    }
}

#[test]
fn projection_agrees_on_noise() {
    let mut random = Random(23);
    let volume = noise([24, 24, 24], &mut random);
    let (low, high) = (Vec3::splat(2.0), Vec3::splat(21.0));
    let mesh = Mesh::tetrahedra(3000, low, high, 0.4, &mut random);
    let [mut a, mut b] = pair(&volume, &mesh);
    let advanced = [&mut a, &mut b].map(|k| project(&mut **k, &[121.3], 1.5));
    let failed = advanced.each_ref().map(|a| n_failed(a) as f64);
    let n = mesh.positions.len() as f64;
    assert!(failed[0] > 0.0, "noise has unreachable places");
    assert!((failed[0] - failed[1]).abs() <= UNDECIDED * n, "{failed:?} of {n} failed");
    let statuses = advanced.each_ref().map(|a| &a.status);
    let positions = advanced.each_ref().map(|a| &a.positions);
    let mut n_apart = 0;
    for i in 0..mesh.positions.len() {
        let [p, q] = [Vec3::from(positions[0][i]), Vec3::from(positions[1][i])];
        // Up to 16 gradient steps accumulate the difference of the first one.
        let steps = if statuses[0][i] == Status::ReachedByGradient { 16.0 } else { 1.0 };
        let same = statuses[0][i] == statuses[1][i];
        n_apart += usize::from(!same || p.distance(q) > steps * POSITION_TOLERANCE);
    }
    assert!((n_apart as f64) <= UNDECIDED * n, "{n_apart} of {n} differ");
}

/// A relaxation of the ball.
const RELAXATION: Relaxation =
    Relaxation { isovalue: -9.0, strength: 0.6, threshold: 1e-9, max_iterations: 12 };

/// The backends' kernels, with vertices on an isosurface of the ball.
fn projected_pair() -> [Box<dyn Kernels + Send>; 2] {
    let (volume, mesh) = ball();
    let mut pair = pair(&volume, &mesh);
    for kernels in &mut pair {
        assert_eq!(n_failed(&project(&mut **kernels, &[RELAXATION.isovalue], 2.0)), 0);
    }
    pair
}

#[test]
fn deviation_agrees() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    let [a, b] = [&mut a, &mut b].map(|k| k.deviation(-9.1, 1.0).expect("deviation"));
    assert_eq!(a.len(), mesh.connectivity.faces.len());
    assert!(a.iter().any(|&d| d > 0.05), "the mesh is not on this isosurface");
    for (x, y) in a.iter().zip(&b) {
        assert!((x - y).abs() < POSITION_TOLERANCE, "{x} and {y}");
    }
}

#[test]
fn relaxation_agrees() {
    let [p, q] = projected_pair().map(|mut k| relaxed(&mut *k, RELAXATION).positions);
    let difference = largest_difference(&p, &q);
    assert!(difference < RELAXED_TOLERANCE, "{difference}");
}

#[test]
fn relaxation_tests_the_force_every_eighth_iteration() {
    let after = |threshold: f32, max_iterations: u32| {
        let relaxation = Relaxation { threshold, max_iterations, ..RELAXATION };
        projected_pair().map(|mut k| relaxed(&mut *k, relaxation).positions)
    };
    // Every force is below the first threshold, none below the second.
    let (ended, went_on) = (after(1e9, 20), after(0.0, 20));
    assert_eq!(ended, after(0.0, 8));
    assert!((0..2).all(|i| ended[i] != went_on[i]));
    // With fewer iterations there is no test.
    assert_eq!(after(1e9, 7), after(0.0, 7));
}
