//! Requirements on every backend, tested on analytic fields. One function per requirement; `main.rs` runs
//! each on each backend.

use crate::common::random::Random;
use crate::common::shapes::{Mesh, noise, sampled, volume};
use glam::{DVec3, Vec3};
use isospectrum::unstable::field::{Field, Status, face_deviation};
use isospectrum::unstable::kernels::{Advance, Advanced, Kernels, Relaxation, relax};
use isospectrum::volume::{Samples, Volume};
use std::sync::Arc;

/// Kernels of one backend over a volume.
pub(crate) type Backend = fn(&Arc<Volume>) -> Box<dyn Kernels + Send>;

/// Allowed |f - c| at a projected vertex, in ranges of the volume, near coordinates up to 64: the
/// position is rounded by 4e-6 voxel at most, times a gradient of at most half a range per voxel in
/// these fields, plus the rounding of values (5e-7).
const VALUE_TOLERANCE: f64 = 4e-6;

/// Positions of two correct results may differ by the rounding of coordinates up to 64 (4e-6) and of
/// the distance along a ray with a slope of at least a tenth of its length, ten times that.
const POSITION_TOLERANCE: f32 = 5e-5;

/// No relaxation.
const UNRELAXED: Relaxation =
    Relaxation { isovalue: 0.0, strength: 0.6, threshold: 0.0, max_iterations: 0 };

/// The state of the mesh after projections.
pub(crate) fn project(kernels: &mut dyn Kernels, isovalues: &[f64], reach: f32) -> Advanced {
    let advance = Advance { isovalues, reach, ends: &[], relaxation: UNRELAXED };
    kernels.advance(&advance).expect("projects")
}

/// The state of the mesh after a relaxation.
pub(crate) fn relaxed(kernels: &mut dyn Kernels, relaxation: Relaxation) -> Advanced {
    let advance = Advance { isovalues: &[], reach: 0.0, ends: &[], relaxation };
    kernels.advance(&advance).expect("relaxes")
}

/// The number of vertices that the last projection could not move.
pub(crate) fn n_failed(advanced: &Advanced) -> usize {
    advanced.status.iter().filter(|&&s| s == Status::Failed).count()
}

/// The largest tangential force on a vertex.
pub(crate) fn largest_force(mesh: &Mesh, advanced: &Advanced) -> f32 {
    let positions: Vec<Vec3> = advanced.positions.iter().map(|&p| p.into()).collect();
    let force = |(v, &n): (usize, &[f32; 3])| {
        relax::force(&mesh.connectivity, &positions, n.into(), v).0.length()
    };
    advanced.normals.iter().enumerate().map(force).fold(0.0, f32::max)
}

fn at(v: &Volume, p: [f32; 3]) -> f64 {
    v.value_at(p.map(f64::from))
}

fn range(v: &Volume) -> f64 {
    v.range().1 - v.range().0
}

/// The expected place of a vertex in a linear field of gradient `g` (voxel frame).
fn linear_answer(p: Vec3, n: Vec3, g: Vec3, missing: f32, reach: f32) -> (Option<Vec3>, f32) {
    let slope = n.dot(g);
    let along = missing / slope;
    if slope != 0.0 && along.abs() <= reach {
        return (Some(p + n * along), (along.abs() - reach).abs());
    }
    let straight = g * (missing / g.length_squared());
    let found = straight.length() <= reach;
    let margin = (along.abs() - reach).abs().min((straight.length() - reach).abs());
    (found.then(|| p + straight), margin)
}

pub(crate) fn a_linear_field_is_reached_exactly_along_normals_then_gradient(backend: Backend) {
    for spacing in [[1.0; 3], [0.5, 0.5, 1.25], [3.0, 1.0, 1.7]] {
        let g = Vec3::new(2.0, -1.0, 0.5);
        let v = sampled([24, 20, 16], spacing, |p| DVec3::from_array(p).dot(g.as_dvec3()) + 7.0);
        let size = Vec3::from_array(v.voxel_size().map(|s| s as f32));
        let center = size * Vec3::new(11.5, 9.5, 7.5);
        let mesh = Mesh::sphere(center, 3.0, 12);
        let isovalue = f64::from(g.dot(center) + 7.0 - 4.0);
        let reach = 2.0;
        let mut kernels = backend(&v);
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        let Advanced { normals, .. } = project(&mut *kernels, &[], reach);
        let Advanced { positions: after, status, .. } = project(&mut *kernels, &[isovalue], reach);
        let mut counts = [0; 3];
        for i in 0..after.len() {
            let (p, n) = (Vec3::from(mesh.positions[i]), Vec3::from(normals[i]));
            let missing = isovalue as f32 - (g.dot(p) + 7.0);
            let (expected, margin) = linear_answer(p, n, g, missing, reach);
            // At exactly the maximum distance, rounding decides.
            if margin < 1e-3 {
                continue;
            }
            counts[status[i] as usize] += 1;
            assert_eq!(expected.is_none(), status[i] == Status::Failed, "vertex {i} at {p}");
            let expected = expected.unwrap_or(p);
            let distance = expected.distance(Vec3::from(after[i]));
            assert!(distance < POSITION_TOLERANCE, "vertex {i}: {distance} from {expected}");
        }
        assert!(counts.iter().all(|&n| n > 0), "every outcome occurs: {counts:?}");
    }
}

pub(crate) fn a_sphere_grows_and_shrinks_to_the_right_radius(backend: Backend) {
    let center = DVec3::splat(16.0);
    let v = sampled([33, 33, 33], [1.0; 3], |p| -center.distance(DVec3::from_array(p)));
    let mesh = Mesh::sphere(center.as_vec3(), 8.0, 16);
    let mut kernels = backend(&v);
    kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
    for radius in [8.5, 9.5, 11.0, 10.0, 8.0, 6.5] {
        let advanced = project(&mut *kernels, &[-radius], 2.5);
        assert_eq!(n_failed(&advanced), 0);
        let Advanced { positions, normals, .. } = advanced;
        for &p in &positions {
            assert!((at(&v, p) + radius).abs() < VALUE_TOLERANCE * range(&v));
            // Trilinear interpolation errs by at most (f_xx + f_yy + f_zz) / 8 = 1 / (4 r).
            let distance = center.as_vec3().distance(Vec3::from(p));
            assert!((distance - radius as f32).abs() < 0.25 / 6.0, "{distance} for {radius}");
        }
        for (p, n) in positions.iter().zip(normals) {
            let outward = (Vec3::from(*p) - center.as_vec3()).normalize();
            // The mesh bends by at most edge / radius per edge, 0.15 here; trilinear steps of the
            // surface tilt it by about as much again.
            assert!(Vec3::from(n).dot(outward) > 0.9, "normals point to lower values");
        }
    }
}

pub(crate) fn a_step_along_the_normal_never_leaves_the_slab_before_its_isovalue(backend: Backend) {
    let mut random = Random(7);
    let v = noise([24, 24, 24], &mut random);
    // No step of 1.5 voxels gets into the steep layer around the volume.
    let mesh = Mesh::tetrahedra(1500, Vec3::splat(2.0), Vec3::splat(21.0), 0.4, &mut random);
    let mut kernels = backend(&v);
    let mut n_moved = 0;
    let mut n_by_gradient = 0;
    for isovalue in [90.0, 118.5, 128.0, 140.25] {
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        let Advanced { positions, status, .. } = project(&mut *kernels, &[isovalue], 1.5);
        for (i, p) in positions.into_iter().enumerate() {
            let from = mesh.positions[i];
            if status[i] == Status::Failed {
                assert_eq!(p, from, "a vertex that failed stays");
                continue;
            }
            let error = (at(&v, p) - isovalue).abs() / range(&v);
            assert!(error < VALUE_TOLERANCE, "vertex {i}: {error} ranges");
            assert!(Vec3::from(p).distance(Vec3::from(from)) < 1.5 + POSITION_TOLERANCE);
            n_by_gradient += usize::from(status[i] == Status::ReachedByGradient);
            if status[i] == Status::Reached {
                assert_slab(&v, from, p, isovalue);
                n_moved += 1;
            }
        }
    }
    assert!(n_moved > 2000 && n_by_gradient > 100, "{n_moved} and {n_by_gradient} moved");
}

/// Samples the step densely and independently: the field must stay on the start's side of the
/// isovalue, and not beyond the start, within the slab tolerance.
fn assert_slab(v: &Volume, from: [f32; 3], to: [f32; 3], isovalue: f64) {
    // The kernels' own tolerance of 1e-5 ranges, doubled for the rounding of the end.
    let tolerance = 2e-5 * range(v);
    let (a, b) = (DVec3::from(Vec3::from(from)), DVec3::from(Vec3::from(to)));
    let start = v.value_at(a.to_array());
    let (low, high) = (start.min(isovalue) - tolerance, start.max(isovalue) + tolerance);
    for s in 0..=200 {
        let value = v.value_at(a.lerp(b, f64::from(s) / 200.0).to_array());
        assert!(low <= value && value <= high, "{value} at {s}/200 from {start} to {isovalue}");
    }
}

pub(crate) fn a_step_stays_on_its_own_of_two_close_sheets(backend: Backend) {
    // A wall 0.3 voxel thick at isovalue 0.9 along x = 8: f rises to 1 at x = 8 and falls again.
    let v = sampled([17, 17, 17], [1.0; 3], |p| 1.0 - 0.6666667 * (p[0] - 8.0).abs());
    let mut random = Random(3);
    // Vertices of tetrahedra on the lower side of the wall, thinner than the gap, with arbitrary normals.
    let mesh = Mesh::tetrahedra(
        400,
        Vec3::new(7.6, 3.0, 3.0),
        Vec3::new(7.95, 13.0, 13.0),
        0.2,
        &mut random,
    );
    let mut kernels = backend(&v);
    for isovalue in [0.8, 0.9, 0.95] {
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        let advanced = project(&mut *kernels, &[isovalue], 1.0);
        assert_eq!(n_failed(&advanced), 0, "the gradient leads to the own sheet");
        let own = 8.0 - (1.0 - isovalue as f32) / 0.6666667;
        for p in advanced.positions {
            assert!((p[0] - own).abs() < POSITION_TOLERANCE, "{} instead of {own}", p[0]);
        }
    }
}

/// Noise, and a mesh in it of which about every other vertex is constrained.
fn half_constrained_in_noise(random: &mut Random) -> (Arc<Volume>, Mesh) {
    let v = noise([12, 13, 14], random);
    let top = Vec3::new(11.0, 12.0, 13.0);
    let mut mesh = Mesh::tetrahedra(800, Vec3::ZERO, top, 0.5, random);
    for constrained in &mut mesh.connectivity.constrained {
        *constrained = random.below(2) as u8;
    }
    (v, mesh)
}

pub(crate) fn constrained_vertices_do_not_move(backend: Backend) {
    let (v, mesh) = half_constrained_in_noise(&mut Random(11));
    let mut kernels = backend(&v);
    kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
    let Advanced { status, .. } = project(&mut *kernels, &[127.0], 2.0);
    let relaxation =
        Relaxation { isovalue: 127.0, strength: 0.6, threshold: 1e-6, max_iterations: 5 };
    let Advanced { positions, .. } = relaxed(&mut *kernels, relaxation);
    let mut n_moved = [0; 2];
    for (i, p) in positions.into_iter().enumerate() {
        let constrained = mesh.connectivity.constrained[i];
        n_moved[usize::from(constrained)] += usize::from(p != mesh.positions[i]);
        assert!(constrained == 0 || status[i] == Status::Reached, "vertex {i}: {:?}", status[i]);
    }
    assert!(n_moved[0] > 500 && n_moved[1] == 0, "free and constrained: {n_moved:?} have moved");
}

pub(crate) fn an_advance_is_its_projections_and_its_relaxation(backend: Backend) {
    let (v, mesh) = half_constrained_in_noise(&mut Random(12));
    let mut kernels = backend(&v);
    let relaxation =
        Relaxation { isovalue: 127.0, strength: 0.6, threshold: 1e-6, max_iterations: 1 };
    // 11 iterations are more than one test of the threshold.
    for max_iterations in [0, 3, 6, 11] {
        for isovalues in [&[][..], &[127.0], &[120.0, 127.0], &[118.0, 122.0, 125.0]] {
            kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
            let mut one_by_one = project(&mut *kernels, &[], 2.0);
            for &isovalue in isovalues {
                one_by_one = project(&mut *kernels, &[isovalue], 2.0);
            }
            for _ in 0..max_iterations {
                one_by_one = relaxed(&mut *kernels, relaxation);
            }
            let relaxation = Relaxation { max_iterations, ..relaxation };
            let advance = Advance { isovalues, reach: 2.0, ends: &[], relaxation };
            kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
            let advanced = kernels.advance(&advance).expect("advances");
            assert!(advanced == one_by_one, "not the same after {advance:?}");
        }
    }
}

pub(crate) fn constrained_vertices_move_to_their_ends(backend: Backend) {
    let mut random = Random(13);
    let (v, mesh) = half_constrained_in_noise(&mut random);
    let top = Vec3::new(11.0, 12.0, 13.0);
    let mut end = || std::array::from_fn(|a| random.unit() as f32 * top[a]);
    let ends: Vec<[f32; 3]> = mesh.positions.iter().map(|_| end()).collect();
    let mut kernels = backend(&v);
    for isovalues in [&[127.0][..], &[120.0, 127.0], &[118.0, 122.0, 127.0]] {
        let advance = Advance {
            isovalues,
            reach: 2.0,
            ends: &ends,
            relaxation: Relaxation {
                isovalue: 127.0,
                strength: 0.6,
                threshold: 1e-6,
                max_iterations: 5,
            },
        };
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        let Advanced { positions, status, .. } = kernels.advance(&advance).expect("advances");
        let (mut n_constrained, mut n_reached) = (0, 0);
        for (i, p) in positions.into_iter().enumerate() {
            if mesh.connectivity.constrained[i] != 0 {
                assert_eq!(p, ends[i], "vertex {i} after {isovalues:?}");
                n_constrained += 1;
            } else if status[i] != Status::Failed {
                let off = (at(&v, p) - 127.0).abs();
                assert!(off <= VALUE_TOLERANCE * range(&v) * 10.0, "vertex {i}: {off}");
                n_reached += 1;
            }
        }
        assert!(
            n_constrained > 500 && n_reached > 500,
            "{n_constrained} constrained, {n_reached} reached"
        );
    }
}

pub(crate) fn a_plateau_of_bytes_is_crossed_or_the_vertex_stays(backend: Backend) {
    // 100 below x = 8, 200 from x = 9 on: between them the only slope.
    let samples = (0..16 * 16 * 16).map(|i| if i % 16 <= 8 { 100 } else { 200 }).collect();
    let v = volume([16, 16, 16], [1.0; 3], Samples::U8(samples));
    let mesh = Mesh::sphere(Vec3::new(5.0, 8.0, 8.0), 2.0, 8);
    let mut kernels = backend(&v);
    kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
    let Advanced { normals, .. } = project(&mut *kernels, &[], 5.0);
    let Advanced { positions, status, .. } = project(&mut *kernels, &[150.0], 5.0);
    let mut counts = [0; 3];
    for (i, p) in positions.into_iter().enumerate() {
        counts[status[i] as usize] += 1;
        let n = Vec3::from(normals[i]);
        // The field rises along the inward or the outward normal; the isosurface is at x = 8.5.
        let along = (8.5 - mesh.positions[i][0]) / n.x.abs();
        if status[i] == Status::Failed {
            assert_eq!(p, mesh.positions[i]);
            assert!(along > 4.99, "a hit {along} voxels away was missed");
        } else {
            assert!((p[0] - 8.5).abs() < POSITION_TOLERANCE, "x = {}", p[0]);
        }
    }
    assert!(counts[0] > 0 && counts[1] == 0 && counts[2] > 0, "{counts:?}");
}

pub(crate) fn every_sample_type_gives_the_same_step(backend: Backend) {
    let integers: Vec<i64> = (0..12 * 12 * 12)
        .map(|i: i64| 2 * (i % 12) + 3 * (i / 12 % 12) + 4 * (i / 144) + 1)
        .collect();
    let mesh = Mesh::sphere(Vec3::splat(5.5), 2.0, 8);
    let mut reference: Option<Vec<[f32; 3]>> = None;
    let all = [
        Samples::U8(integers.iter().map(|&i| i as u8).collect()),
        Samples::I8(integers.iter().map(|&i| i as i8).collect()),
        Samples::U16(integers.iter().map(|&i| i as u16).collect()),
        Samples::I16(integers.iter().map(|&i| i as i16).collect()),
        Samples::U32(integers.iter().map(|&i| i as u32).collect()),
        Samples::I32(integers.iter().map(|&i| i as i32).collect()),
        Samples::F32(integers.iter().map(|&i| i as f32).collect()),
        Samples::F64(integers.iter().map(|&i| i as f64).collect()),
    ];
    for samples in all {
        let name = samples.type_name();
        let v = volume([12, 12, 12], [1.0; 3], samples);
        let mut kernels = backend(&v);
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        let Advanced { positions, .. } = project(&mut *kernels, &[52.0], 2.0);
        let reference = reference.get_or_insert_with(|| positions.clone());
        for (p, q) in positions.iter().zip(&*reference) {
            let distance = Vec3::from(*p).distance(Vec3::from(*q));
            assert!(distance < POSITION_TOLERANCE, "{name}: {distance}");
        }
    }
}

pub(crate) fn relaxation_spreads_vertices_and_keeps_them_on_the_isosurface(backend: Backend) {
    let center = DVec3::new(20.0, 20.0, 12.0);
    let v = sampled([41, 41, 25], [1.0; 3], |p| {
        let q = DVec3::from_array(p) - center;
        -((q.truncate().length() - 11.0).powi(2) + q.z * q.z).sqrt()
    });
    let mesh = Mesh::torus(center.as_vec3(), 11.0, 5.0, 48, 24);
    let mut kernels = backend(&v);
    kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
    let projected = project(&mut *kernels, &[-5.0], 1.0);
    assert_eq!(n_failed(&projected), 0);
    let before = shortest_over_longest_edge(&mesh, &projected.positions);
    let relaxation =
        Relaxation { isovalue: -5.0, strength: 0.6, threshold: 2e-2, max_iterations: 200 };
    let advanced = relaxed(&mut *kernels, relaxation);
    let [first, last] = [&projected, &advanced].map(|a| largest_force(&mesh, a));
    assert!(last < 2e-2 && last < 0.5 * first, "forces from {first} to {last}");
    let Advanced { positions, .. } = advanced;
    for p in &positions {
        assert!((at(&v, *p) + 5.0).abs() < VALUE_TOLERANCE * range(&v));
    }
    let after = shortest_over_longest_edge(&mesh, &positions);
    assert!(after > 1.1 * before, "edges from {before} to {after}");
}

/// The mean over faces of shortest edge over longest edge.
fn shortest_over_longest_edge(mesh: &Mesh, positions: &[[f32; 3]]) -> f32 {
    let ratio = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|i| Vec3::from(positions[i as usize]));
        let edges = [a.distance(b), b.distance(c), c.distance(a)];
        edges.iter().copied().fold(f32::MAX, f32::min) / edges.iter().copied().fold(0.0, f32::max)
    };
    let faces = &mesh.connectivity.faces;
    faces.iter().map(ratio).sum::<f32>() / faces.len() as f32
}

pub(crate) fn far_from_the_origin_only_positions_are_rounded(backend: Backend) {
    let mut random = Random(5);
    let samples: Vec<u8> = (0..1030 * 8 * 8).map(|_| (255.0 * random.unit()) as u8).collect();
    let v = volume([1030, 8, 8], [1.0; 3], Samples::U8(samples));
    let (low, high) = (Vec3::new(1016.0, 1.0, 1.0), Vec3::new(1026.0, 6.0, 6.0));
    let mesh = Mesh::tetrahedra(500, low, high, 0.5, &mut random);
    let mut kernels = backend(&v);
    kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
    let Advanced { positions, status, .. } = project(&mut *kernels, &[127.5], 1.0);
    let mut n_reached = 0;
    for (i, p) in positions.into_iter().enumerate() {
        if status[i] != Status::Failed {
            n_reached += 1;
            // Half an ulp of 1024 is 3.1e-5 voxel (6.2e-5 above 1024); a cell of bytes is at most
            // one range per voxel steep along x. y and z add a hundredth of that.
            assert!((at(&v, p) - 127.5).abs() < 7e-5 * range(&v), "vertex {i}");
        }
    }
    assert!(n_reached > 500, "{n_reached}");
}

pub(crate) fn loading_again_replaces_the_mesh(backend: Backend) {
    let v = sampled([16, 16, 16], [1.0; 3], |p| -DVec3::splat(7.5).distance(DVec3::from_array(p)));
    let mut kernels = backend(&v);
    for n in [4, 12, 2, 8] {
        let mesh = Mesh::sphere(Vec3::splat(7.5), 3.0, n);
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        assert_eq!(project(&mut *kernels, &[], 2.0).positions, mesh.positions);
        let advanced = project(&mut *kernels, &[-4.0], 2.0);
        assert_eq!(n_failed(&advanced), 0);
        let lengths = [advanced.positions.len(), advanced.normals.len(), advanced.status.len()];
        assert_eq!(lengths, [mesh.positions.len(); 3]);
    }
}

pub(crate) fn a_mapped_isovalue_is_reached_whatever_the_range(backend: Backend) {
    for (scale, offset) in [(1e300, 0.0), (1e-285, 0.0), (1.0, 1e9), (4e9, -2e9)] {
        let samples = (0..1000)
            .map(|i| scale * (0.1 * (f64::from(i % 10) + 0.5 * f64::from(i / 100))) + offset)
            .collect();
        let v = volume([10, 10, 10], [1.0; 3], Samples::F64(samples));
        let field = Field::new(v.clone());
        let (low, high) = v.range();
        assert_eq!((field.isovalue(low), field.isovalue(high)), (0.0, 1.0));
        let mesh = Mesh::sphere(Vec3::splat(4.5), 2.0, 6);
        let isovalue = low / 2.0 + high / 2.0;
        let mut kernels = backend(&v);
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        let advanced = project(&mut *kernels, &[isovalue], 3.0);
        assert_eq!(n_failed(&advanced), 0);
        for p in advanced.positions {
            assert!((p[0] + 0.5 * p[2] - 6.75).abs() < POSITION_TOLERANCE, "{p:?}");
        }
    }
}

#[test]
fn deviation_is_the_distance_along_the_face_normal() {
    for spacing in [[1.0; 3], [0.5, 0.5, 1.25]] {
        let g = Vec3::new(1.0, 2.0, -0.5);
        let v = sampled([24, 24, 12], spacing, |p| DVec3::from_array(p).dot(g.as_dvec3()));
        let size = Vec3::from_array(v.voxel_size().map(|s| s as f32));
        let center = size * Vec3::new(11.5, 11.5, 5.5);
        let mesh = Mesh::sphere(center, 3.0, 8);
        let isovalue = f64::from(g.dot(center) + 2.0);
        let reach = 2.5;
        let field = Field::new(v);
        let mut n_near = 0;
        for face in &mesh.connectivity.faces {
            let [a, b, c] = face.map(|i| Vec3::from(mesh.positions[i as usize]));
            let d = face_deviation(&field, a, b, c, field.isovalue(isovalue), reach);
            let n = (b - a).cross(c - a).normalize();
            let missing = g.dot((a + b + c) / 3.0) - isovalue as f32;
            let exact = (missing / n.dot(g)).abs();
            n_near += usize::from(exact < reach);
            // A grazing ray multiplies rounding, so the tolerance is relative beyond one voxel.
            let expected = exact.min(reach);
            let slack = POSITION_TOLERANCE * (g.length() / n.dot(g).abs()).clamp(1.0, 10.0);
            assert!((d - expected).abs() < slack, "{d} instead of {expected}");
        }
        assert!(n_near > 50, "{n_near}");
    }
}
