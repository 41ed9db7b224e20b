//! Meshes that a sweep may start from and meshes that it must refuse, around the phantom sphere.

use std::path::PathBuf;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::export::{Border, write};
use crate::kernels::{Backend, Choice};
use crate::progress::Silent;
use crate::spectrum::{Mesh, Spectrum};
use crate::sweep::{Parameters, compute};
use crate::volume::{Placement, Volume, phantom};

/// Of the phantom `sphere:20`: isosurface c is the sphere of radius (1 - c) * 9.5 voxels.
const ISOVALUE: f64 = 0.4;
const RADIUS: f32 = 0.6 * 9.5;
/// The centre of the phantom, voxels: 9.5 * (1 + its shifts of 0.0207, 0.0293 and 0.0157).
const CENTRE: [f32; 3] = [9.696_751, 9.778_179, 9.649_51];

/// A left-handed frame with every part different from the voxel frame's.
const PLACEMENT: Placement = Placement {
    origin: [-30.0, 7.0, 100.0],
    spacing: [2.5; 3],
    direction: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    ..Placement::IDENTITY
};

/// The phantom sphere in the frame of [`PLACEMENT`].
fn sphere() -> Arc<Volume> {
    let volume = phantom("sphere:20").expect("a phantom");
    let samples = volume.samples().clone();
    Arc::new(Volume::new("sphere", volume.dims(), samples, PLACEMENT).expect("a volume"))
}

/// An octahedron, each triangle cut in four three times, on a sphere about the phantom's centre;
/// seen from lower values, that is from outside, its 512 triangles are counter-clockwise.
fn octasphere(radius: f32) -> Mesh {
    let unit = |p: [f32; 3]| {
        let length = p.iter().map(|x| x * x).sum::<f32>().sqrt();
        p.map(|x| x / length)
    };
    let mut points: Vec<[f32; 3]> = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            points.push(std::array::from_fn(|a| if a == axis { sign } else { 0.0 }));
        }
    }
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for octant in 0..8u32 {
        let [x, y, z] = [octant & 1, 2 + (octant >> 1 & 1), 4 + (octant >> 2)];
        let mirrored = octant.count_ones() % 2 == 1;
        triangles.push(if mirrored { [x, z, y] } else { [x, y, z] });
    }
    for _ in 0..3 {
        let mut middle = std::collections::BTreeMap::new();
        let mut cut = Vec::new();
        for t in triangles {
            let m: [u32; 3] = std::array::from_fn(|i| {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let (p, q) = (points[a as usize], points[b as usize]);
                    points.push(unit(std::array::from_fn(|i| p[i] + q[i])));
                    points.len() as u32 - 1
                })
            });
            cut.extend([[t[0], m[0], m[2]], [t[1], m[1], m[0]], [t[2], m[2], m[1]], m]);
        }
        triangles = cut;
    }
    Mesh {
        positions: points
            .iter()
            .map(|p| std::array::from_fn(|a| CENTRE[a] + radius * p[a]))
            .collect(),
        normals: points,
        caps: vec![false; triangles.len()],
        triangles,
    }
}

/// A mesh in a file of its own.
fn file_of(mesh: &Mesh) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("initial.ply");
    write(mesh, &PLACEMENT, Border::Closed, &path).expect("written");
    (folder, path)
}

/// The spectrum near the isovalue, started from a mesh.
fn started_from(mesh: &Mesh, volume: &Arc<Volume>, isovalue: f64) -> Result<Spectrum> {
    let (_folder, path) = file_of(mesh);
    let parameters = Parameters {
        range: Some((isovalue - 0.1, isovalue + 0.1)),
        start: Some(isovalue),
        initial_mesh: Some(path),
        ..Parameters::default()
    };
    let backend = Backend::choose(Choice::Cpu, None).expect("the CPU is there");
    compute(volume, &parameters, &backend, &Silent)
}

/// The error of a mesh that should be refused; it is one line that names the file.
fn refusal(mesh: &Mesh) -> String {
    match started_from(mesh, &sphere(), ISOVALUE) {
        Err(Error::Input(what)) => {
            assert!(what.contains("initial.ply: ") && !what.contains('\n'), "{what}");
            what
        }
        other => panic!("expected an input error, got {:?}", other.map(|s| s.triangles().len())),
    }
}

/// Corners of each triangle, the lowest vertex first, sorted.
fn sorted(triangles: impl IntoIterator<Item = [u32; 3]>) -> Vec<[u32; 3]> {
    let mut sorted: Vec<[u32; 3]> = triangles
        .into_iter()
        .map(|mut t| {
            let lowest = (0..3).min_by_key(|&i| t[i]).expect("three corners");
            t.rotate_left(lowest);
            t
        })
        .collect();
    sorted.sort_unstable();
    sorted
}

/// For each triangle of a spectrum's mesh, its vertices as those of the given mesh nearest to them.
fn as_given(given: &Mesh, mesh: &Mesh) -> Vec<[u32; 3]> {
    let distance = |a: [f32; 3], b: [f32; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f32>();
    let nearest = |p: [f32; 3]| {
        let n = given.positions.len();
        (0..n)
            .min_by(|&a, &b| {
                distance(given.positions[a], p).total_cmp(&distance(given.positions[b], p))
            })
            .expect("vertices") as u32
    };
    sorted(mesh.triangles.iter().map(|t| t.map(|v| nearest(mesh.positions[v as usize]))))
}

#[test]
fn the_spectrum_has_exactly_the_triangles_of_the_initial_mesh_at_its_isovalue() {
    let given = octasphere(RADIUS);
    let spectrum = started_from(&given, &sphere(), ISOVALUE).expect("a good mesh");
    let mesh = spectrum.mesh_at(ISOVALUE).expect("inside the range");
    assert_eq!(mesh.triangles.len(), 512);
    assert_eq!(as_given(&given, &mesh), sorted(given.triangles.iter().copied()));
}

#[test]
fn vertices_a_little_off_are_moved_onto_the_isosurface() {
    let given = octasphere(RADIUS + 0.3);
    let volume = sphere();
    let spectrum = started_from(&given, &volume, ISOVALUE).expect("a good mesh");
    let mesh = spectrum.mesh_at(ISOVALUE).expect("inside the range");
    assert_eq!(as_given(&given, &mesh), sorted(given.triangles.iter().copied()));
    for p in &mesh.positions {
        // Knots are rounded by half a quantum across the surface, 1/256 voxel, and by 1/64 voxel along planes across the normals of the mesh, which
        // are a few degrees off. Values change by 0.105 in a voxel, and the given mesh is 0.3 voxel off.
        let off = (volume.value_at(p.map(f64::from)) - ISOVALUE).abs();
        assert!(off < 1.5 * 0.105 / 256.0, "{p:?} is off by {off}");
    }
}

#[test]
fn a_mesh_that_is_turned_inside_out_is_turned_back() {
    let given = octasphere(RADIUS);
    let mut turned = given.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let spectrum = started_from(&turned, &sphere(), ISOVALUE).expect("a good mesh");
    let mesh = spectrum.mesh_at(ISOVALUE).expect("inside the range");
    assert_eq!(as_given(&given, &mesh), sorted(given.triangles.iter().copied()));
}

#[test]
fn reading_undoes_placing_in_the_world() {
    let given = octasphere(RADIUS);
    let mut triangles = given.triangles.clone();
    triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let positions = given.positions.iter().map(|&p| PLACEMENT.world_of_voxel(p)).collect();
    let ply = crate::ply_reader::PlyMesh { positions, triangles };
    let back = super::in_voxel_frame(ply, &PLACEMENT);
    assert_eq!(back.triangles, given.triangles);
    for (a, b) in back.positions.iter().zip(&given.positions) {
        // Coordinates up to 20 voxels in f32 are off by 1e-6.
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-5), "{a:?} {b:?}");
    }
}

#[test]
fn an_open_mesh_is_refused() {
    let mut mesh = octasphere(RADIUS);
    mesh.triangles.pop();
    mesh.caps.pop();
    assert!(refusal(&mesh).contains("is open"));
}

#[test]
fn a_non_manifold_mesh_is_refused() {
    let mut mesh = octasphere(RADIUS);
    // A third triangle at an edge, then two spheres that share one vertex.
    mesh.triangles.push([0, mesh.triangles[0][1], mesh.triangles[100][0]]);
    mesh.caps.push(false);
    assert!(refusal(&mesh).contains("non-manifold"));
    let mut mesh = octasphere(RADIUS);
    let n = mesh.positions.len() as u32;
    let copy = mesh.clone();
    mesh.positions.extend(copy.positions);
    mesh.normals.extend(copy.normals);
    mesh.caps.extend(copy.caps);
    mesh.triangles.extend(copy.triangles.iter().map(|t| t.map(|v| if v == 0 { 0 } else { v + n })));
    assert!(refusal(&mesh).contains("two fans"));
}

#[test]
fn a_vertex_off_the_isosurface_is_named() {
    let mut mesh = octasphere(RADIUS);
    mesh.positions[37][2] += if mesh.positions[37][2] > CENTRE[2] { 2.0 } else { -2.0 };
    let what = refusal(&mesh);
    assert!(what.contains("vertex 37 has the value"), "{what}");
    assert!(refusal(&octasphere(RADIUS + 0.8)).contains("vertex 0 has the value"));
}

#[test]
fn a_mesh_at_the_border_of_the_volume_is_refused() {
    let mut mesh = octasphere(RADIUS);
    mesh.positions[5] = [9.0, 9.0, 0.0];
    let what = refusal(&mesh);
    assert!(what.contains("vertex 5 lies at") && what.contains("must be extracted"), "{what}");
}

#[test]
fn two_components_on_one_of_the_isosurface_are_refused() {
    let mut mesh = octasphere(RADIUS);
    let n = mesh.positions.len() as u32;
    let inner = octasphere(RADIUS - 0.2);
    mesh.positions.extend(inner.positions);
    mesh.normals.extend(inner.normals);
    mesh.caps.extend(inner.caps);
    mesh.triangles.extend(inner.triangles.iter().map(|t| t.map(|v| v + n)));
    let what = refusal(&mesh);
    assert!(what.contains(&format!("vertices 0 and {n} lie on the same component")), "{what}");
}

#[test]
fn a_mesh_without_one_of_the_components_is_refused() {
    // Two balls of radii 4 and 3 voxels in a linear profile: at 0.4 spheres of radii 2.4 and 1.8.
    let dims = [24, 16, 16];
    let profile = |p: [f32; 3], centre: [f32; 3], radius: f32| {
        1.0 - (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum::<f32>().sqrt() / radius
    };
    let (large, small) = ([7.1, 7.2, 7.3], [16.1, 7.2, 7.3]);
    let mut samples = Vec::new();
    for k in 0..dims[2] {
        for j in 0..dims[1] {
            for i in 0..dims[0] {
                let p = [i as f32, j as f32, k as f32];
                samples.push(profile(p, large, 4.0).max(profile(p, small, 3.0)));
            }
        }
    }
    let samples = crate::volume::Samples::F32(samples);
    let volume = Arc::new(Volume::new("two", dims, samples, PLACEMENT).expect("a volume"));
    let mut one = octasphere(2.4);
    one.positions
        .iter_mut()
        .for_each(|p| *p = std::array::from_fn(|a| p[a] - CENTRE[a] + large[a]));
    let what = started_from(&one, &volume, 0.4).expect_err("a component is missing").to_string();
    assert!(what.contains("1 found, expected 2"), "{what}");
    assert!(
        what.contains("initial.ply: no component for the one of the isosurface at (1"),
        "{what}"
    );
}

#[test]
fn an_initial_mesh_without_its_isovalue_is_a_usage_error() {
    let (_folder, path) = file_of(&octasphere(RADIUS));
    let backend = Backend::choose(Choice::Cpu, None).expect("the CPU is there");
    for start in [None, Some(1e9)] {
        let parameters =
            Parameters { start, initial_mesh: Some(path.clone()), ..Parameters::default() };
        let result = compute(&sphere(), &parameters, &backend, &Silent);
        assert!(matches!(result, Err(Error::Usage(_))), "{start:?}");
    }
}
