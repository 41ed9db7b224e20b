//! The contour spectrum: what the isosurface is like, over the isovalue.
//!
//! # Theory
//!
//! Bajaj, Pascucci, Schikore, "The contour spectrum" (Visualization 1997): area and enclosed
//! volume of the isosurface as curves by which isovalues are chosen. Components, Euler
//! characteristic, genus and cavities come from the events, exactly.
//!
//! Area and volume are those inside the volume (caps and the layer are left out). Every cell is
//! cut into 24 tetrahedra, each from its centre, the centre of a face and an edge of that face,
//! whose values the trilinear field gives. In a tetrahedron with linear field the volume above c
//! is a cubic in c between the four values, and the area is |gradient| times its derivative, so
//! each isovalue gets the exact area and volume of the piecewise linear field.
//!
//! Accuracy: of second order in the cell size. Samples of the distance from a sphere of r voxels
//! radius give an area too small by 1 / (3 r^2) and a volume too small by 1 / (2 r^2), 0.3 % and
//! 0.5 % at r = 10; that is the trilinear field itself, the tetrahedra add less than a fifth of it
//! (tested).

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::topology::Topology;
use crate::volume::{Outside, Placement, Volume};

/// How many isovalues a contour spectrum has by default.
pub const N_ISOVALUES: usize = 256;

/// Curves over evenly spaced isovalues; every list has one entry per isovalue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContourSpectrum {
    /// Isovalues, ascending: the centres of equal intervals of the range of the volume.
    pub isovalues: Vec<f64>,
    /// Components of the closed isosurface.
    pub n_components: Vec<u32>,
    /// Euler characteristic of the closed isosurface.
    pub euler: Vec<i64>,
    /// Tunnels: the sum of the genera of all components, `n_components - euler / 2`.
    pub genus: Vec<i64>,
    /// Enclosed cavities: regions on the layer's side of the isosurface that do not reach the
    /// layer. With the layer below: components of {f <= c} that are surrounded by {f > c}.
    /// `n_components - n_cavities` is the number of solid parts around them.
    pub n_cavities: Vec<u32>,
    /// Area inside the volume, in square world units.
    pub area: Vec<f64>,
    /// Volume of {f > c} inside the volume, in cubic world units.
    pub volume: Vec<f64>,
}

impl ContourSpectrum {
    /// The contour spectrum of a volume at `n` isovalues.
    pub fn new(volume: &Volume, topology: &Topology, n: usize) -> Self {
        let (low, high) = volume.range();
        let step = (high - low) / n as f64;
        let isovalues: Vec<f64> = (0..n).map(|i| low + (i as f64 + 0.5) * step).collect();
        let n_components: Vec<u32> =
            isovalues.iter().map(|&c| topology.n_components_at(c)).collect();
        let euler: Vec<i64> = isovalues.iter().map(|&c| topology.euler_at(c)).collect();
        let genus = n_components.iter().zip(&euler).map(|(&b, e)| b as i64 - e / 2).collect();
        let n_cavities = isovalues
            .iter()
            .map(|&c| match (volume.outside(), topology.n_sides_at(c)) {
                (Outside::Low, (below, _)) => below - 1,
                (Outside::High, (_, above)) => above - 1,
            })
            .collect();
        let Measure { area, volume } = measure(volume, &isovalues);
        ContourSpectrum { isovalues, n_components, euler, genus, n_cavities, area, volume }
    }
}

/// Area and volume per isovalue.
struct Measure {
    area: Vec<f64>,
    volume: Vec<f64>,
}

/// Sums over all cells; slab by slab in order, so that rounding does not depend on the threads.
fn measure(volume: &Volume, isovalues: &[f64]) -> Measure {
    let n = isovalues.len();
    let slabs: Vec<Slab<'_>> = (0..volume.dims()[2] - 1)
        .into_par_iter()
        .map(|z| {
            let mut slab = Slab {
                isovalues,
                spacing: volume.placement().spacing,
                metric: Metric::of(volume.placement()),
                area: vec![0.0; n],
                partial: vec![0.0; n],
                whole: vec![0.0; n + 1],
            };
            slab.visit(volume, z);
            slab
        })
        .collect();
    let mut measure = Measure { area: vec![0.0; n], volume: vec![0.0; n] };
    for slab in slabs {
        let mut whole = 0.0;
        for i in (0..n).rev() {
            whole += slab.whole[i + 1];
            measure.volume[i] += whole + slab.partial[i];
            measure.area[i] += slab.area[i];
        }
    }
    measure
}

/// How lengths and volumes of the world follow from those along the axes.
#[derive(Clone, Copy)]
struct Metric {
    /// Volume that the axes' directions span.
    span: f64,
    /// The inverse of the directions' scalar products, where they are not perpendicular.
    inverse: Option<DMat3>,
}

impl Metric {
    fn of(placement: &Placement) -> Self {
        if !placement.is_sheared() {
            return Metric { span: 1.0, inverse: None };
        }
        let directions = DMat3::from_cols_array_2d(&placement.direction);
        let products = directions.transpose() * directions;
        Metric { span: placement.span().abs(), inverse: Some(products.inverse()) }
    }

    /// Length of the gradient with these slopes along the axes.
    fn length(&self, slopes: [f64; 3]) -> f64 {
        let slopes = DVec3::from_array(slopes);
        match self.inverse {
            None => slopes.length(),
            Some(inverse) => slopes.dot(inverse * slopes).max(0.0).sqrt(),
        }
    }
}

/// The cells between two z.
struct Slab<'a> {
    isovalues: &'a [f64],
    spacing: [f64; 3],
    metric: Metric,
    area: Vec<f64>,
    /// Volume above each isovalue in tetrahedra that it cuts.
    partial: Vec<f64>,
    /// Entry k: volume that lies wholly above the first k isovalues and not above more.
    whole: Vec<f64>,
}

impl Slab<'_> {
    fn visit(&mut self, volume: &Volume, z: usize) {
        let [nx, ny, _] = volume.dims();
        let cell = self.spacing.iter().product::<f64>() * self.metric.span;
        for y in 0..ny - 1 {
            for x in 0..nx - 1 {
                let v: [f64; 8] = std::array::from_fn(|c| {
                    volume.sample(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))
                });
                let low = v.iter().copied().fold(f64::INFINITY, f64::min);
                let high = v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                if self.n_below(low) == self.n_below(high) {
                    let n = self.n_below(low);
                    self.whole[n] += cell;
                } else {
                    self.visit_cell(&v, cell / 24.0);
                }
            }
        }
    }

    /// How many isovalues lie below a value. They are evenly spaced, so the guess is at most one
    /// off by rounding.
    fn n_below(&self, value: f64) -> usize {
        let n = self.isovalues.len();
        let first = self.isovalues[0];
        let step = if n > 1 { (self.isovalues[n - 1] - first) / (n - 1) as f64 } else { 1.0 };
        let mut guess = ((value - first) / step).ceil().clamp(0.0, n as f64) as usize;
        while guess > 0 && self.isovalues[guess - 1] >= value {
            guess -= 1;
        }
        while guess < n && self.isovalues[guess] < value {
            guess += 1;
        }
        guess
    }

    /// The 24 tetrahedra of a cell with corners x + 2 y + 4 z, each of volume `size`.
    fn visit_cell(&mut self, v: &[f64; 8], size: f64) {
        let centre = v.iter().sum::<f64>() / 8.0;
        for axis in 0..3 {
            let (s, t) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in 0..2usize {
                let corner = |i: usize, j: usize| v[side << axis | i << s | j << t];
                let face = (corner(0, 0) + corner(1, 0) + corner(0, 1) + corner(1, 1)) / 4.0;
                let outwards = self.spacing[axis] * (side as f64 - 0.5);
                let normal = (face - centre) / outwards;
                for end in 0..2 {
                    for (a, b, along, across) in [
                        (corner(0, end), corner(1, end), s, t),
                        (corner(end, 0), corner(end, 1), t, s),
                    ] {
                        let slope = (b - a) / self.spacing[along];
                        let towards = self.spacing[across] * (end as f64 - 0.5);
                        let rise = ((a + b) / 2.0 - face) / towards;
                        let mut gradient = [0.0; 3];
                        (gradient[axis], gradient[along], gradient[across]) = (normal, slope, rise);
                        let gradient = self.metric.length(gradient);
                        self.visit_tetrahedron([centre, face, a, b], gradient, size);
                    }
                }
            }
        }
    }

    fn visit_tetrahedron(&mut self, mut v: [f64; 4], gradient: f64, size: f64) {
        v.sort_unstable_by(f64::total_cmp);
        let first = self.n_below(v[0]);
        let end = self.n_below(v[3]);
        self.whole[first] += size;
        for i in first..end {
            let (below, density) = fraction_below(&v, self.isovalues[i]);
            self.partial[i] += size * (1.0 - below);
            self.area[i] += size * gradient * density;
        }
    }
}

/// The part of a tetrahedron with the linear field of ascending corner values `v` in which the
/// field is below `c`, v[0] <= c < v[3], and the derivative of that part by `c`.
///
/// Between the middle values the part below is cut into three tetrahedra; all factors lie in
/// [0, 1], so nothing cancels.
fn fraction_below(v: &[f64; 4], c: f64) -> (f64, f64) {
    let part = |a: usize, b: usize| (c - v[a]) / (v[b] - v[a]);
    if c < v[1] {
        let below = part(0, 1) * part(0, 2) * part(0, 3);
        return (below, 3.0 * part(0, 1) * part(0, 2) / (v[3] - v[0]));
    }
    if c >= v[2] {
        let part = |a: usize| (v[3] - c) / (v[3] - v[a]);
        return (1.0 - part(0) * part(1) * part(2), 3.0 * part(1) * part(2) / (v[3] - v[0]));
    }
    let (a, b, d, e) = (part(0, 2), part(0, 3), part(1, 2), part(1, 3));
    let below = d * e + a * e * (1.0 - d) + a * b * (1.0 - e);
    // The derivative is the quadratic B-spline with the values as knots.
    let density = 3.0 * (a * (1.0 - d) + (1.0 - e) * d) / (v[3] - v[0]);
    (below, density)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a handful of operations on numbers of order one.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn density_is_the_derivative_of_the_fraction() {
        // Central differences of a piecewise cubic: the error is its third derivative (at most 6
        // over the product of three differences, here below 200) times the step squared over 6,
        // plus rounding over the step.
        let step = 1e-5;
        let tolerance = 200.0 / 6.0 * step * step + ROUNDING / step;
        for v in
            [[0.0, 0.3, 0.7, 1.0], [0.0, 0.0, 0.5, 1.0], [0.0, 0.5, 0.5, 1.0], [0.0, 0.4, 1.0, 1.0]]
        {
            for i in 1..20 {
                // Off the corner values, where the derivative may jump.
                let c = i as f64 / 20.0 + 0.003;
                let (_, density) = fraction_below(&v, c);
                let difference = fraction_below(&v, c + step).0 - fraction_below(&v, c - step).0;
                let slope = difference / (2.0 * step);
                assert!((density - slope).abs() < tolerance, "{v:?} at {c}: {density} {slope}");
            }
        }
    }

    #[test]
    fn fraction_runs_from_zero_to_one_without_a_gap_at_the_corner_values() {
        let v = [0.0, 0.3, 0.7, 1.0];
        assert!(fraction_below(&v, 0.0).0.abs() < ROUNDING);
        assert!((fraction_below(&v, 1.0 - ROUNDING).0 - 1.0).abs() < ROUNDING);
        for c in [0.3, 0.7] {
            let gap = fraction_below(&v, c).0 - fraction_below(&v, c - ROUNDING).0;
            // The density is below 3 / (v3 - v0) = 3.
            assert!(gap.abs() < 4.0 * ROUNDING, "{gap}");
        }
    }
}
