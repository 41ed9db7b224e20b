//! Meshes and volumes with known answers.

use super::random::Random;
use glam::Vec3;
use isospectrum::unstable::kernels::Connectivity;
use isospectrum::volume::{Placement, Samples, Volume};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A mesh: the arguments of [`isospectrum::unstable::kernels::Kernels::load`].
pub(crate) struct Mesh {
    pub(crate) connectivity: Connectivity,
    pub(crate) positions: Vec<[f32; 3]>,
}

impl Mesh {
    /// Rings from faces; none is constrained.
    pub(crate) fn new(faces: Vec<[u32; 3]>, positions: Vec<[f32; 3]>) -> Mesh {
        let mut next: Vec<BTreeMap<u32, u32>> = vec![BTreeMap::new(); positions.len()];
        for &[a, b, c] in &faces {
            next[a as usize].insert(b, c);
            next[b as usize].insert(c, a);
            next[c as usize].insert(a, b);
        }
        let mut ring = Vec::new();
        let mut ring_offsets = vec![0];
        for around in &next {
            let first = *around.keys().next().expect("every vertex has faces");
            let mut at = first;
            loop {
                ring.push(at);
                at = around[&at];
                if at == first {
                    break;
                }
            }
            ring_offsets.push(ring.len() as u32);
        }
        let constrained = vec![0; positions.len()];
        Mesh { connectivity: Connectivity { faces, ring_offsets, ring, constrained }, positions }
    }

    /// A sphere: an octahedron, each face divided into `n * n`, vertices pushed onto the radius.
    pub(crate) fn sphere(center: Vec3, radius: f32, n: i32) -> Mesh {
        let mut index: BTreeMap<[i32; 3], u32> = BTreeMap::new();
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        let mut vertex = |k: [i32; 3]| -> u32 {
            *index.entry(k).or_insert_with(|| {
                let direction = Vec3::from_array(k.map(|x| x as f32)).normalize();
                positions.push((center + direction * radius).to_array());
                positions.len() as u32 - 1
            })
        };
        for octant in 0..8 {
            let s: [i32; 3] = std::array::from_fn(|a| 1 - 2 * (octant >> a & 1));
            let flipped = s[0] * s[1] * s[2] < 0;
            let mut face = |corners: [[i32; 3]; 3]| {
                let [a, b, c] = corners.map(|k| vertex([k[0] * s[0], k[1] * s[1], k[2] * s[2]]));
                faces.push(if flipped { [a, c, b] } else { [a, b, c] });
            };
            for i in 0..n {
                for j in 0..n - i {
                    let at = |i: i32, j: i32| [i, j, n - i - j];
                    face([at(i, j), at(i + 1, j), at(i, j + 1)]);
                    if i + j + 1 < n {
                        face([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                    }
                }
            }
        }
        Mesh::new(faces, positions)
    }

    /// Many small tetrahedra at random places of a box: vertices with normals of every direction.
    pub(crate) fn tetrahedra(
        n: usize,
        low: Vec3,
        high: Vec3,
        size: f32,
        random: &mut Random,
    ) -> Mesh {
        let mut faces = Vec::new();
        let mut positions = Vec::new();
        for _ in 0..n {
            let center = low + (high - low) * vector(random);
            let first = positions.len() as u32;
            let mut corners: [Vec3; 4] =
                std::array::from_fn(|_| center + size * (2.0 * vector(random) - 1.0));
            let volume = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .dot(corners[3] - corners[0]);
            if volume > 0.0 {
                corners.swap(0, 1);
            }
            positions.extend(corners.map(|p| p.clamp(low, high).to_array()));
            for face in [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] {
                faces.push(face.map(|i: u32| first + i));
            }
        }
        Mesh::new(faces, positions)
    }

    /// A torus around the z axis through `center`, `n` by `m` vertices, unevenly spread.
    pub(crate) fn torus(center: Vec3, ring: f32, tube: f32, n: u32, m: u32) -> Mesh {
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        for i in 0..n {
            for j in 0..m {
                let u = std::f32::consts::TAU * i as f32 / n as f32;
                let v = std::f32::consts::TAU * j as f32 / m as f32;
                let u = u + 0.25 * u.sin();
                let out = ring + tube * v.cos();
                let p = Vec3::new(out * u.cos(), out * u.sin(), tube * v.sin());
                positions.push((center + p).to_array());
                let at = |i: u32, j: u32| (i % n) * m + j % m;
                let (a, b) = (at(i, j), at(i + 1, j));
                let (c, d) = (at(i, j + 1), at(i + 1, j + 1));
                faces.push([a, b, d]);
                faces.push([a, d, c]);
            }
        }
        Mesh::new(faces, positions)
    }
}

/// A volume of f32 samples of a function of the voxel frame.
pub(crate) fn sampled(
    dims: [usize; 3],
    spacing: [f64; 3],
    f: impl Fn([f64; 3]) -> f64,
) -> Arc<Volume> {
    let size = Placement { spacing, ..Placement::default() }.cell_size();
    let mut samples = Vec::new();
    for k in 0..dims[2] {
        for j in 0..dims[1] {
            for i in 0..dims[0] {
                let p = [i as f64 * size[0], j as f64 * size[1], k as f64 * size[2]];
                samples.push(f(p) as f32);
            }
        }
    }
    volume(dims, spacing, Samples::F32(samples))
}

/// A volume of the given samples.
pub(crate) fn volume(dims: [usize; 3], spacing: [f64; 3], samples: Samples) -> Arc<Volume> {
    let placement = Placement { spacing, ..Placement::default() };
    Arc::new(Volume::new("shape", dims, samples, placement).expect("a valid volume"))
}

/// Bytes of noise, smoothed once along each axis so that it has walls and thin sheets.
pub(crate) fn noise(dims: [usize; 3], random: &mut Random) -> Arc<Volume> {
    let [nx, ny, nz] = dims;
    let n = nx * ny * nz;
    let mut values: Vec<f32> = (0..n).map(|_| (255.0 * random.unit()) as f32).collect();
    for stride in [1, nx, nx * ny] {
        let before = values.clone();
        for i in stride..n - stride {
            values[i] = 0.25 * before[i - stride] + 0.5 * before[i] + 0.25 * before[i + stride];
        }
    }
    volume(dims, [1.0; 3], Samples::U8(values.iter().map(|v| v.round() as u8).collect()))
}

/// Uniform in the unit cube.
fn vector(random: &mut Random) -> Vec3 {
    Vec3::from_array([0; 3].map(|_| random.unit() as f32))
}
