//! Three methods that move a vertex onto the next isosurface (thesis section 3.4).

use std::time::{Duration, Instant};

use glam::{IVec3, Vec3};
use isospectrum::unstable::extract::extract_cell;
use isospectrum::unstable::field::ray::{PARALLEL, Slab, Walk, walk};
use isospectrum::unstable::field::{Field, project_point};
use isospectrum::unstable::topology::exact::ExactField;

/// How far a vertex moves in one step at most, voxels; as in a sweep.
pub const REACH: f32 = 2.5;

/// Longest step of the descent, voxels: a quarter of a cell, as the gradient turns inside it.
const MAX_DESCENT: f32 = 0.25;

/// How often a step of the descent is halved at most until it reduces the difference from the isovalue.
const MAX_HALVINGS: u32 = 4;

/// How far outside a triangle a hit still counts, in barycentric coordinates: a ray through an edge must not pass between
/// two triangles.
const EDGE_TOLERANCE: f32 = 1e-4;

/// A method of moving one vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Along the normal while the field stays between start and isovalue, else along the gradient.
    Projection,
    /// To the nearest root of the cubic along the normal, on either side.
    Nearest,
    /// To the nearest triangle of the cells along the normal, on either side, then by steepest descent.
    Descent,
}

impl Method {
    /// All methods; the first is the one that times are relative to.
    pub const ALL: [Method; 3] = [Method::Projection, Method::Nearest, Method::Descent];

    /// The name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Method::Projection => "projection",
            Method::Nearest => "cubic, nearest",
            Method::Descent => "triangles + descent",
        }
    }
}

/// Moves vertices of a mesh.
pub struct Mover<'a> {
    /// The field that vertices move in.
    pub field: &'a Field,
    /// The same field, for triangles of cells.
    pub exact: &'a ExactField<'a>,
    /// Number of steps of the descent at most.
    pub descent_steps: u32,
    /// Time spent on triangles of cells so far.
    pub extraction: Duration,
}

impl Mover<'_> {
    /// The position of the vertex at `p` with unit normal `n` (towards lower values) on the isosurface; `None` if the
    /// method does not reach it.
    pub fn moved(&mut self, method: Method, p: Vec3, n: Vec3, isovalue: f64) -> Option<Vec3> {
        let c = self.field.isovalue(isovalue);
        match method {
            Method::Projection => project_point(self.field, p, n, c, REACH),
            Method::Nearest => {
                let sign = self.sign(p, c);
                let slab = Slab { isovalue: c, sign, lowest: f32::MIN };
                nearest(p, n * -sign, |direction, reach| {
                    match walk(self.field, p, direction, slab, reach) {
                        Walk::Reached(t) => Some(t),
                        Walk::Left | Walk::Ended => None,
                    }
                })
            }
            Method::Descent => {
                let uphill = n * -self.sign(p, c);
                let hit = nearest(p, uphill, |direction, reach| {
                    self.first_triangle(p, direction, isovalue, reach)
                })?;
                Some(self.descended(hit, c))
            }
        }
    }

    /// 1 if the field at `p` is below the isovalue, else -1.
    fn sign(&self, p: Vec3, c: f32) -> f32 {
        if self.field.value(p) < c { 1.0 } else { -1.0 }
    }

    /// The distance from `p` along a unit vector to the first triangle of the cells on the way (Amanatides and Woo 1987).
    fn first_triangle(&mut self, p: Vec3, direction: Vec3, c: f64, reach: f32) -> Option<f32> {
        let x = p * self.field.inverse_cell_size();
        let d = direction * self.field.inverse_cell_size();
        let mut cell = x.floor().as_ivec3();
        let mut entry = 0.0f32;
        while cell.cmpge(IVec3::NEG_ONE).all() && cell.cmplt(self.field.dims()).all() {
            let (axis, exit) = exit_of(cell, x, d);
            // A ray that starts on a face leaves the first cell at once.
            if exit > entry
                && let Some(t) = self.first_in_cell(cell, p, direction, c)
            {
                return (t <= reach).then_some(t);
            }
            if exit >= reach {
                return None;
            }
            entry = entry.max(exit);
            cell[axis] += if d[axis] > 0.0 { 1 } else { -1 };
        }
        None
    }

    /// The distance to the first triangle of one cell.
    fn first_in_cell(&mut self, cell: IVec3, p: Vec3, direction: Vec3, c: f64) -> Option<f32> {
        let values = self.field.corners(cell);
        let at = self.field.isovalue(c);
        if values.iter().all(|&v| v < at) || values.iter().all(|&v| v > at) {
            return None;
        }
        let started = Instant::now();
        let corner = self.exact.vertex(cell.to_array().map(i64::from));
        let surface = extract_cell(self.exact, corner, c);
        self.extraction += started.elapsed();
        let hits = surface.faces.iter().filter_map(|f| {
            let triangle = f.map(|v| Vec3::from(surface.positions[v as usize]));
            distance_to(triangle, p, direction)
        });
        hits.min_by(f32::total_cmp)
    }

    /// Steepest descent on (f - c)^2 from `q`, with the step after which f would be c if it were linear.
    fn descended(&self, mut q: Vec3, c: f32) -> Vec3 {
        let mut difference = self.field.value(q) - c;
        for _ in 0..self.descent_steps {
            let gradient = self.field.gradient(q);
            let squared = gradient.length_squared();
            if difference.abs() <= self.field.value_noise() || squared == 0.0 {
                break;
            }
            let mut step = (gradient * (-difference / squared)).clamp_length_max(MAX_DESCENT);
            let mut next = self.field.value(q + step) - c;
            for _ in 0..MAX_HALVINGS {
                if next.abs() < difference.abs() {
                    break;
                }
                step *= 0.5;
                next = self.field.value(q + step) - c;
            }
            if next.abs() >= difference.abs() {
                break;
            }
            q += step;
            difference = next;
        }
        q
    }
}

/// The nearer of the hits along `n` and against it, within [`REACH`]. `hit` returns the distance along a direction
/// within a reach.
fn nearest(p: Vec3, n: Vec3, mut hit: impl FnMut(Vec3, f32) -> Option<f32>) -> Option<Vec3> {
    if n == Vec3::ZERO {
        return None;
    }
    let ahead = hit(n, REACH);
    let behind = hit(-n, ahead.unwrap_or(REACH));
    behind.map(|t| p - n * t).or_else(|| ahead.map(|t| p + n * t))
}

/// The axis of the face through which a ray leaves a cell, and the distance to it from the start; `x` and `d` in cells.
fn exit_of(cell: IVec3, x: Vec3, d: Vec3) -> (usize, f32) {
    let mut first = (0, f32::MAX);
    for a in (0..3).filter(|&a| d[a].abs() > PARALLEL) {
        let plane = (cell[a] + i32::from(d[a] > 0.0)) as f32;
        let t = (plane - x[a]) / d[a];
        if t < first.1 {
            first = (a, t);
        }
    }
    first
}

/// The distance from `p` along a direction to a triangle (Möller and Trumbore 1997).
fn distance_to([a, b, c]: [Vec3; 3], p: Vec3, direction: Vec3) -> Option<f32> {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let across = direction.cross(ac);
    let determinant = ab.dot(across);
    if determinant == 0.0 {
        return None;
    }
    let along = ap.cross(ab);
    let u = ap.dot(across) / determinant;
    let v = direction.dot(along) / determinant;
    let t = ac.dot(along) / determinant;
    let is_inside = u.min(v).min(1.0 - u - v) >= -EDGE_TOLERANCE;
    (is_inside && t >= 0.0).then_some(t)
}
