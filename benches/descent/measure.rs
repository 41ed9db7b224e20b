//! Measures of moved vertices, and of the mesh after the last step.

use glam::Vec3;
use isospectrum::unstable::field::{Field, face_deviation};
use isospectrum::unstable::mesh::{Connectivity, area, normal, radius_ratio};

use crate::methods::REACH;

/// A face with a smaller radius ratio is counted as bad.
const MIN_RATIO: f32 = 0.1;

/// A smaller face has no reliable normal, square voxels; as in a sweep.
const MIN_AREA: f32 = 1e-3;

/// Points at which the field is compared with the interval along the segment of a moved vertex.
const N_POINTS: u16 = 32;

/// How far the field may leave the interval, as a share of it: a segment cuts off the corners of a bent path.
const INTERVAL_TOLERANCE: f32 = 0.01;

/// Measures of one method, over all steps of all pairs.
#[derive(Default)]
pub struct Tally {
    distances: Vec<f32>,
    barycentres: Vec<f32>,
    ratios: Vec<f32>,
    n_failed: usize,
    n_jumped: usize,
    n_turned: usize,
}

impl Tally {
    /// Adds a vertex that was moved from `p` to `q`, or not, before relaxation: relaxation projects again.
    pub fn add_vertex(&mut self, field: &Field, p: Vec3, q: Option<Vec3>, isovalue: f32) {
        let Some(q) = q else {
            self.n_failed += 1;
            return;
        };
        let slope = field.inner_slope(q).max(1e-12);
        self.distances.push((field.value(q) - isovalue).abs() / slope);
        self.n_jumped += usize::from(has_jumped(field, p, q, isovalue));
    }

    /// Adds the faces of a mesh after the last step, unless a vertex is constrained.
    pub fn add_mesh(&mut self, field: &Field, mesh: &Connectivity, at: &[Vec3], isovalue: f32) {
        let is_free = |f: &&[u32; 3]| f.iter().all(|&v| mesh.constrained[v as usize] == 0);
        for face in mesh.faces.iter().filter(is_free) {
            let t @ [a, b, c] = face.map(|v| at[v as usize]);
            self.ratios.push(radius_ratio(t));
            self.barycentres.push(face_deviation(field, a, b, c, isovalue, REACH));
            let is_turned = normal(t).dot(field.gradient((a + b + c) / 3.0)) > 0.0;
            self.n_turned += usize::from(is_turned && area(t) >= MIN_AREA);
        }
    }

    /// The columns of the table: distances of vertices and barycentres, shape, and shares of failures, jumps and turned
    /// faces.
    pub fn columns(mut self) -> String {
        let n_moves = self.distances.len() + self.n_failed;
        let [median, most, max] = [0.5, 0.99, 1.0].map(|q| quantile(&mut self.distances, q));
        let [middle, far] = [0.5, 0.99].map(|q| quantile(&mut self.barycentres, q));
        format!(
            "{median:.0e}, {most:.0e}, {max:.0e} | {middle:.4}, {far:.3} | {} | {} | {} | {}",
            self.shape(),
            percent(self.n_failed, n_moves),
            percent(self.n_jumped, n_moves),
            percent(self.n_turned, self.ratios.len()),
        )
    }

    /// The mean radius ratio, and the share of bad faces.
    pub fn shape(&self) -> String {
        let n_faces = self.ratios.len();
        let n_bad = self.ratios.iter().filter(|&&r| r < MIN_RATIO).count();
        let mean = self.ratios.iter().map(|&r| f64::from(r)).sum::<f64>() / n_faces as f64;
        format!("{mean:.3}, {}", percent(n_bad, n_faces))
    }
}

/// A share in percent.
fn percent(n: usize, of: usize) -> String {
    format!("{:.3}", 100.0 * n as f64 / of as f64)
}

/// Whether the field leaves the interval between its value at `p` and the isovalue on the segment from `p` to `q`.
fn has_jumped(field: &Field, p: Vec3, q: Vec3, isovalue: f32) -> bool {
    let start = field.value(p);
    let slack = INTERVAL_TOLERANCE * (isovalue - start).abs() + field.slab_tolerance();
    let (low, high) = (start.min(isovalue) - slack, start.max(isovalue) + slack);
    // The end is measured by its distance.
    (1..N_POINTS).any(|i| {
        let value = field.value(p.lerp(q, f32::from(i) / f32::from(N_POINTS)));
        value < low || value > high
    })
}

/// A quantile of some numbers, which are reordered; 0 if there are none.
fn quantile(numbers: &mut [f32], share: f64) -> f32 {
    if numbers.is_empty() {
        return 0.0;
    }
    let i = ((numbers.len() - 1) as f64 * share) as usize;
    *numbers.select_nth_unstable_by(i, f32::total_cmp).1
}
