//! The GPU against its CPU twin: the same formulas in the same order, so only fused
//! multiplications, division and square roots may round otherwise.

use crate::random::Random;
use crate::shapes::{Mesh, noise, sampled};
use crate::{cpu, gpu};
use glam::{DVec3, Vec3};
use isospectrum::inside::kernels::{Kernels, Status};
use isospectrum::volume::Volume;
use std::sync::Arc;

/// Positions may differ by this many voxels. Near coordinate 16 an ulp is 1.9e-6; the distance along
/// a ray carries the rounding of some thirty operations on values of order one (2e-6), divided by
/// a slope that may be a tenth of its mean.
const POSITION_TOLERANCE: f32 = 2e-5;

/// Share of vertices of a noise field that rounding may send another way (another piece of the
/// cubic, another cell at an edge). Such a vertex is decided within about 1e-5 of a tie, and each
/// takes fewer than ten decisions.
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
fn the_gpu_suite_runs_on_a_gpu_back_end() {
    let (volume, _) = ball();
    let name = gpu(&volume).name();
    assert!(["vulkan", "metal", "dx12"].iter().any(|b| name.contains(b)), "{name}");
    assert_eq!(cpu(&volume).name(), "cpu");
}

#[test]
fn normals_agree() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    let [a, b] = [a.normals().expect("normals"), b.normals().expect("normals")];
    let difference = largest_difference(&a, &b);
    assert!(difference < NORMAL_TOLERANCE, "{difference}");
}

#[test]
fn projection_agrees_on_a_smooth_field() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    for isovalue in [-9.5, -9.0, -8.25, -9.75] {
        let failed = [&mut a, &mut b].map(|k| k.project(isovalue, 2.0).expect("projects"));
        assert_eq!(failed, [0, 0]);
        assert_eq!(a.status().expect("status"), b.status().expect("status"));
        let [p, q] = [a.positions().expect("positions"), b.positions().expect("positions")];
        let difference = largest_difference(&p, &q);
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
    let failed = [&mut a, &mut b].map(|k| f64::from(k.project(121.3, 1.5).expect("projects")));
    let n = mesh.positions.len() as f64;
    assert!(failed[0] > 0.0, "noise has unreachable places");
    assert!((failed[0] - failed[1]).abs() <= UNDECIDED * n, "{failed:?} of {n} failed");
    let statuses = [a.status().expect("status"), b.status().expect("status")];
    let positions = [a.positions().expect("positions"), b.positions().expect("positions")];
    let mut n_apart = 0;
    for i in 0..mesh.positions.len() {
        let [p, q] = [Vec3::from(positions[0][i]), Vec3::from(positions[1][i])];
        // Up to 16 gradient steps carry on what the first rounds otherwise.
        let steps = if statuses[0][i] == Status::ReachedByGradient { 16.0 } else { 1.0 };
        let same = statuses[0][i] == statuses[1][i];
        n_apart += usize::from(!same || p.distance(q) > steps * POSITION_TOLERANCE);
    }
    assert!((n_apart as f64) <= UNDECIDED * n, "{n_apart} of {n} differ");
}

#[test]
fn deviation_agrees() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    let [a, b] = [&mut a, &mut b].map(|k| k.deviation(-9.1, 1.0).expect("deviation"));
    assert_eq!(a.len(), mesh.connectivity.faces.len());
    for (x, y) in a.iter().zip(&b) {
        assert!((x - y).abs() < POSITION_TOLERANCE, "{x} and {y}");
    }
}

#[test]
fn relaxation_agrees() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    for kernels in [&mut a, &mut b] {
        kernels.project(-9.0, 2.0).expect("projects");
    }
    let done = [&mut a, &mut b].map(|k| k.relax(-9.0, 0.6, 1e-9, 12).expect("relaxes"));
    assert_eq!(done.map(|d| d.iterations), [12, 12]);
    let difference = (done[0].largest_force - done[1].largest_force).abs();
    assert!(difference < RELAXED_TOLERANCE, "{done:?}");
    let [p, q] = [a.positions().expect("positions"), b.positions().expect("positions")];
    let difference = largest_difference(&p, &q);
    assert!(difference < RELAXED_TOLERANCE, "{difference}");
}

#[test]
fn relaxation_looks_at_the_force_after_the_same_iterations() {
    let (volume, mesh) = ball();
    let [mut a, mut b] = pair(&volume, &mesh);
    for kernels in [&mut a, &mut b] {
        kernels.project(-9.0, 2.0).expect("projects");
    }
    // Any force is below this threshold: the first look ends it.
    let done = [&mut a, &mut b].map(|k| k.relax(-9.0, 0.6, 1e9, 100).expect("relaxes"));
    assert_eq!(done[0].iterations, done[1].iterations);
    let odd = [&mut a, &mut b].map(|k| k.relax(-9.0, 0.6, 0.0, 3).expect("relaxes"));
    assert_eq!(odd.map(|d| d.iterations), [3, 3]);
}

#[test]
fn the_living_triangles_agree() {
    use crate::PIPELINES;
    use isospectrum::inside::kernels::compact::{Compaction, Draw, alive};
    let mut random = Random(5);
    // More than one workgroup, and no multiple of one; lifetimes up to a fifth of the ranks.
    let lifetimes: Vec<[u32; 2]> = (0..10_007)
        .map(|_| {
            let birth = (random.unit() * 1000.0) as u32;
            [birth, birth + 1 + (random.unit() * 200.0) as u32]
        })
        .collect();
    let gpu = PIPELINES.gpu();
    let compaction = Compaction::new(gpu, &lifetimes).expect("compiles");
    for rank in [0, 1, 500, 999, 1300] {
        let expected = alive(&lifetimes, rank);
        let draw = compaction.run(gpu, rank).expect("runs");
        let n_corners = 3 * expected.len() as u32;
        assert_eq!(draw, Draw { n_corners, n_instances: 1, ..Draw::default() });
        let mut found = compaction.alive(gpu).expect("reads");
        found.sort_unstable();
        assert_eq!(found, expected, "rank {rank}");
    }
}
