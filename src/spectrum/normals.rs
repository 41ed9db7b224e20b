//! Normals of meshes, and of the knots of a spectrum, which does not store any.
//!
//! # Theory
//!
//! The normal of a vertex is the area-weighted mean of its triangles' normals (thesis section 3.2). At a knot these
//! are the triangles that are alive at its isovalue. At the two ends of a trajectory the triangles around a vertex may have
//! no area, where it appears at a point or moves onto another vertex; so the normal there is that at [`END_OFFSET`] of the
//! distance to the next knot. If no triangle is alive, it is that in the middle of the nearest lifetime. Pictures and saved
//! meshes have the normals of their own mesh ([`of_mesh`]); normals of knots are for code that has only knots. Caps count only if a vertex
//! has no other triangles, so that they do not round the edge at the border of a volume.
//!
//! # Invariants
//!
//! For knots, sums over triangles are sums of integers: they do not depend on the order of the triangles or on which
//! corner comes first, so a spectrum has the same normals before and after it was written to a
//! file.

use glam::DVec3;
use rayon::prelude::*;

use super::data::Spectrum;
use super::elements::Knot;
use super::interpolate::fraction;
use super::normal;

/// Distance from the end of a trajectory at which its normal is computed, as a share of the distance in isovalue to the next
/// knot.
const END_OFFSET: f64 = 0.125;

/// Areas are integers in units of so many square voxels.
const AREA_UNIT: f64 = 1.0 / (1u64 << 24) as f64;

/// Vertices per task.
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

/// Writes the normals of a mesh to `normals`, as [`Mesh::normals`] describes them.
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
        let of_caps = || unit(*of_caps.get(v)?);
        // A vertex whose triangles have no area is not visible.
        *normal = unit(*normal).or_else(of_caps).unwrap_or([0.0, 0.0, 1.0]);
    }
}

/// A triangle's normal, as long as twice its area.
#[inline]
fn area_of([p, q, r]: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b] = [q, r].map(|x| [x[0] - p[0], x[1] - p[1], x[2] - p[2]]);
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The direction of a vector, if its squared length is a normal number.
#[inline]
fn unit(v: [f32; 3]) -> Option<[f32; 3]> {
    let squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let scale = 1.0 / squared.sqrt();
    (squared >= f32::MIN_POSITIVE).then(|| v.map(|x| x * scale))
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
    let sampled_at = |i: usize| match i {
        _ if last == 0 => isovalue(i),
        0 => between(isovalue(0), isovalue(1)),
        _ if i == last => between(isovalue(last), isovalue(last - 1)),
        _ => isovalue(i),
    };
    let at = |i: usize| {
        let isovalue = sampled_at(i);
        // The isovalues near the ends are not in the table.
        let rank =
            if i == 0 || i == last { spectrum.rank_at(isovalue)? } else { trajectory[i].rank };
        let at = nearest_life(spectrum, triangles.of(v), (rank, isovalue))?;
        area_vector(spectrum, triangles.of(v), v, at).map(normal::encode)
    };
    let mut codes: Vec<Option<[i16; 2]>> = (0..trajectory.len()).map(at).collect();
    // Without area, the normal of the nearest knot that has one.
    for i in 1..codes.len() {
        codes[i] = codes[i].or(codes[i - 1]);
    }
    for i in (1..codes.len()).rev() {
        codes[i - 1] = codes[i - 1].or(codes[i]);
    }
    codes.into_iter().map(|code| code.unwrap_or_default()).collect()
}

/// The given rank and isovalue if one of the triangles is alive there, else those of the middle of the nearest
/// lifetime; none without triangles. Vertices of the exact extraction have knots at values of samples, which may be far from the lifetimes
/// of their triangles.
fn nearest_life(
    spectrum: &Spectrum,
    triangles: &[u32],
    (rank, isovalue): (u32, f64),
) -> Option<(u32, f64)> {
    let distance = |&i: &u32| {
        let triangle = &spectrum.triangles()[i as usize];
        let before = triangle.birth.saturating_sub(rank);
        // The last rank of a lifetime is the one before its death.
        let after = (rank + 1).saturating_sub(triangle.death);
        (before.max(after), triangle.birth, triangle.death)
    };
    let (distance, birth, death) = triangles.iter().map(distance).min()?;
    if distance == 0 {
        return Some((rank, isovalue));
    }
    let [start, end] = [birth, death].map(|rank| spectrum.isovalues()[rank as usize]);
    let middle = 0.5 * start + 0.5 * end;
    Some((spectrum.rank_at(middle)?, middle))
}

/// The isovalue at the share [`END_OFFSET`] from one to another.
fn between(from: f64, to: f64) -> f64 {
    (1.0 - END_OFFSET) * from + END_OFFSET * to
}

/// The sum of the triangles' normals around a vertex at a rank and its isovalue, each as long as twice the triangle's area; that of
/// the caps if the other triangles have no area. None if all have no area.
fn area_vector(
    spectrum: &Spectrum,
    triangles: &[u32],
    v: u32,
    (rank, isovalue): (u32, f64),
) -> Option<[f32; 3]> {
    let mut sums = [[0i128; 3]; 2];
    let here = position_at(spectrum, v, rank, isovalue);
    for &i in triangles {
        let triangle = &spectrum.triangles()[i as usize];
        if !(triangle.birth..triangle.death).contains(&rank) {
            continue;
        }
        let at = triangle.vertices.iter().position(|&u| u == v).unwrap_or(0);
        let corner = |k: usize| triangle.vertices[(at + k) % 3];
        let [a, b] = [1, 2].map(|k| position_at(spectrum, corner(k), rank, isovalue) - here);
        let sum = &mut sums[usize::from(triangle.cap)];
        for (sum, area) in sum.iter_mut().zip(a.cross(b).to_array()) {
            *sum += (area / AREA_UNIT).round() as i128;
        }
    }
    let sum = sums.into_iter().find(|sum| *sum != [0; 3])?;
    Some(sum.map(|x| x as f32))
}

/// The position of a vertex at a rank and its isovalue, voxel frame, in double precision.
fn position_at(spectrum: &Spectrum, v: u32, rank: u32, isovalue: f64) -> DVec3 {
    let [before, after] = spectrum.knots_around(v, rank).map(|i| &spectrum.knots()[i]);
    let position = |knot: &Knot| DVec3::from(knot.position.map(f64::from));
    let isovalue_of = |knot: &Knot| spectrum.isovalues()[knot.rank as usize];
    let t = fraction(isovalue, isovalue_of(before), isovalue_of(after));
    position(before) + t * (position(after) - position(before))
}
