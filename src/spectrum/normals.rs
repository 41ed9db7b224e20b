//! Normals of meshes, and of knots: those of the mesh there. No spectrum holds any.
//!
//! # Theory
//!
//! The normal of a vertex is the area-weighted mean of its triangles' normals (thesis section 3.2). At a knot these
//! are the triangles that live at its isovalue. At the two ends of a trajectory the mesh around a vertex may have
//! no area, where it appears at a point or glides onto another vertex; so it is looked at [`INSIDE`] of the
//! way to the next knot. Where no triangle lives, the middle of the nearest lifetime is looked at. What is drawn
//! and saved has the normals of its own mesh ([`of_mesh`]); these here are for what knows only knots. Caps count where a vertex has nothing else, so that they do not round
//! the border of a volume.
//!
//! # Invariants
//!
//! Sums over triangles are whole numbers where they belong to knots: neither the order of the triangles nor which
//! corner of one comes first makes a difference, so a spectrum has the same normals before and after it was a
//! file.

use glam::DVec3;
use rayon::prelude::*;

use super::query::fraction;
use super::{Knot, Spectrum, normal};

/// How far inside its lifetime the ends of a trajectory are looked at, as a part of the way to the next
/// knot.
const INSIDE: f64 = 0.125;

/// Areas are counted in this part of a square voxel.
const AREA_UNIT: f64 = 1.0 / (1u64 << 24) as f64;

/// Vertices that one thread looks at at a time.
const VERTICES_PER_TASK: usize = 1 << 12;

/// The normals of all knots of a spectrum.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Normals(Vec<[i16; 2]>);

impl Normals {
    /// The normals of a spectrum, which must pass [`Spectrum::check`].
    pub fn of(spectrum: &Spectrum) -> Self {
        let triangles = TrianglesAt::new(spectrum);
        let n_vertices = spectrum.n_vertices();
        let starts: Vec<usize> = (0..n_vertices).step_by(VERTICES_PER_TASK).collect();
        let normals = |&start: &usize| -> Vec<[i16; 2]> {
            let vertices = start as u32..(start + VERTICES_PER_TASK).min(n_vertices) as u32;
            vertices.flat_map(|v| normals_of(spectrum, &triangles, v)).collect()
        };
        let normals: Vec<Vec<[i16; 2]>> = starts.par_iter().map(normals).collect();
        Normals(normals.concat())
    }

    /// One octahedral code ([`super::normal`]) for each of [`Spectrum::knots`].
    pub fn codes(&self) -> &[[i16; 2]] {
        &self.0
    }
}

/// Writes the normals of a mesh to `normals`, as [`SurfaceMesh::normals`] describes them.
pub(super) fn of_mesh(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    caps: &[bool],
    normals: &mut Vec<[f32; 3]>,
) {
    normals.clear();
    normals.resize(positions.len(), [0.0; 3]);
    let mut of_caps = if caps.contains(&true) { normals.clone() } else { Vec::new() };
    for (corners, &is_cap) in triangles.iter().zip(caps) {
        let area = area_of(corners.map(|v| positions[v as usize]));
        let sums = if is_cap { &mut of_caps } else { &mut *normals };
        for &v in corners {
            let sum = &mut sums[v as usize];
            *sum = [sum[0] + area[0], sum[1] + area[1], sum[2] + area[2]];
        }
    }
    for (v, normal) in normals.iter_mut().enumerate() {
        let least = f32::MIN_POSITIVE;
        let of_caps = || unit(*of_caps.get(v)?, least);
        // A vertex around which nothing has an area is not seen.
        *normal = unit(*normal, least).or_else(of_caps).unwrap_or([0.0, 0.0, 1.0]);
    }
}

/// A triangle's normal, as long as twice its area.
#[inline]
fn area_of([p, q, r]: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b] = [q, r].map(|x| [x[0] - p[0], x[1] - p[1], x[2] - p[2]]);
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A vector's direction, if its squared length is at least `least`.
#[inline]
fn unit(v: [f32; 3], least: f32) -> Option<[f32; 3]> {
    let squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let scale = 1.0 / squared.sqrt();
    (squared >= least).then(|| v.map(|x| x * scale))
}

/// The triangles at each vertex.
struct TrianglesAt {
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl TrianglesAt {
    fn new(spectrum: &Spectrum) -> Self {
        let mut first = vec![0u32; spectrum.n_vertices() + 1];
        let corners = || spectrum.triangles().iter().map(|t| t.vertices);
        for v in corners().flatten() {
            first[v as usize + 1] += 1;
        }
        for v in 1..first.len() {
            first[v] += first[v - 1];
        }
        let mut next = first.clone();
        let mut triangles = vec![0; first[first.len() - 1] as usize];
        for (i, corners) in corners().enumerate() {
            for v in corners {
                triangles[next[v as usize] as usize] = i as u32;
                next[v as usize] += 1;
            }
        }
        TrianglesAt { first, triangles }
    }

    fn of(&self, v: u32) -> &[u32] {
        &self.triangles[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}

/// The codes of the normals at the knots of one vertex.
fn normals_of(spectrum: &Spectrum, triangles: &TrianglesAt, v: u32) -> Vec<[i16; 2]> {
    let trajectory = spectrum.trajectory(v);
    let isovalue = |i: usize| spectrum.isovalues()[trajectory[i].rank as usize];
    let last = trajectory.len().saturating_sub(1);
    let looked_at = |i: usize| match i {
        _ if last == 0 => isovalue(i),
        0 => between(isovalue(0), isovalue(1)),
        _ if i == last => between(isovalue(last), isovalue(last - 1)),
        _ => isovalue(i),
    };
    let at = |i: usize| {
        let isovalue = looked_at(i);
        // None of a trajectory's knots lies between its first two or last two.
        let rank =
            if i == 0 || i == last { spectrum.rank_at(isovalue)? } else { trajectory[i].rank };
        let time = nearest_life(spectrum, triangles.of(v), (rank, isovalue))?;
        area_vector(spectrum, triangles.of(v), v, time).map(normal::encode)
    };
    let mut codes: Vec<Option<[i16; 2]>> = (0..trajectory.len()).map(at).collect();
    // Where all around has no area, the nearest knot that has some.
    for i in 1..codes.len() {
        codes[i] = codes[i].or(codes[i - 1]);
    }
    for i in (1..codes.len()).rev() {
        codes[i - 1] = codes[i - 1].or(codes[i]);
    }
    codes.into_iter().map(|code| code.unwrap_or_default()).collect()
}

/// The rank and isovalue nearest to one at which a triangle lives: those themselves, or the middle of the nearest
/// lifetime. The vertices of the exact extraction have knots at samples, far from where their triangles live. None
/// where there are no triangles.
fn nearest_life(
    spectrum: &Spectrum,
    triangles: &[u32],
    (rank, isovalue): (u32, f64),
) -> Option<(u32, f64)> {
    let away = |&i: &u32| {
        let triangle = &spectrum.triangles()[i as usize];
        let before = triangle.birth.saturating_sub(rank);
        // The last rank of a lifetime is the one before its death.
        let after = (rank + 1).saturating_sub(triangle.death);
        (before.max(after), triangle.birth, triangle.death)
    };
    let (away, birth, death) = triangles.iter().map(away).min()?;
    if away == 0 {
        return Some((rank, isovalue));
    }
    let [start, end] = [birth, death].map(|rank| spectrum.isovalues()[rank as usize]);
    let middle = 0.5 * start + 0.5 * end;
    Some((spectrum.rank_at(middle)?, middle))
}

/// The isovalue [`INSIDE`] of the way from one to another.
fn between(from: f64, to: f64) -> f64 {
    (1.0 - INSIDE) * from + INSIDE * to
}

/// The sum of the triangles' normals around a vertex at an isovalue, each as long as twice its area; that of
/// the caps where there is nothing else. None of no area.
fn area_vector(
    spectrum: &Spectrum,
    triangles: &[u32],
    v: u32,
    (rank, isovalue): (u32, f64),
) -> Option<[f32; 3]> {
    let mut sums = [[0i128; 3]; 2];
    let here = place_at(spectrum, v, rank, isovalue);
    for &i in triangles {
        let triangle = &spectrum.triangles()[i as usize];
        if !(triangle.birth..triangle.death).contains(&rank) {
            continue;
        }
        let at = triangle.vertices.iter().position(|&u| u == v).unwrap_or(0);
        let corner = |k: usize| triangle.vertices[(at + k) % 3];
        let [a, b] = [1, 2].map(|k| place_at(spectrum, corner(k), rank, isovalue) - here);
        let sum = &mut sums[usize::from(triangle.cap)];
        for (sum, area) in sum.iter_mut().zip(a.cross(b).to_array()) {
            *sum += (area / AREA_UNIT).round() as i128;
        }
    }
    let sum = sums.into_iter().find(|sum| *sum != [0; 3])?;
    Some(sum.map(|x| x as f32))
}

/// Where a vertex is at an isovalue of its lifetime and the isovalue's rank, voxel frame.
fn place_at(spectrum: &Spectrum, v: u32, rank: u32, isovalue: f64) -> DVec3 {
    let [before, after] = spectrum.knots_around(v, rank).map(|i| &spectrum.knots()[i]);
    let place = |knot: &Knot| DVec3::from(knot.position.map(f64::from));
    let time = |knot: &Knot| spectrum.isovalues()[knot.rank as usize];
    let t = fraction(isovalue, time(before), time(after));
    place(before) + t * (place(after) - place(before))
}
