//! Smooths the corners and rims that draining leaves, without new extrema.
//!
//! # Theory
//!
//! Each sample moves to the mean of its neighbours, within its bounds (projected Gauss-Seidel). A sample that moves past a
//! neighbour may become an extremum, or make the neighbour one. Such a move ends before that neighbour: the monotonicity
//! constraints of Weinkauf, Gingold, Sorkine (2010), Jacobson, Weinkauf, Sorkine (2012) and Guenther, Jacobson,
//! Reininghaus, Seidel, Sorkine-Hornung, Weinkauf (2014), which derive them from a tree chosen in advance. Here they come
//! from the current samples at each move. So no move makes an extremum; existing ones may move or vanish.
//!
//! The result does not depend on threads: every third plane moves at a time, and reads only the two planes on either side.

use num_traits::AsPrimitive;
use rayon::prelude::*;

use super::lattice::{Grain, Lattice, TieOrder};

/// Parameters of [`relax`].
#[derive(Clone, Copy)]
pub(super) struct RelaxParameters {
    /// Largest distance of a sample from the given one; samples that are farther away do not move farther.
    pub(super) radius: f64,
    pub(super) iterations: usize,
}

/// Relaxes a field near the `given` samples.
pub(super) fn relax<G: AsPrimitive<f64> + Sync>(
    lattice: &mut Lattice,
    given: &[G],
    relaxation: RelaxParameters,
) {
    let (dims, order, grain) = (lattice.dims, lattice.order, lattice.grain);
    for _ in 0..relaxation.iterations {
        for turn in 0..3.min(dims[2]) {
            let planes = &mut lattice.planes;
            let plane_size = dims[0] * dims[1];
            let mut moving: Vec<(usize, Vec<f64>)> =
                (turn..dims[2]).step_by(3).map(|z| (z, std::mem::take(&mut planes[z]))).collect();
            let still = &*planes;
            moving.par_iter_mut().for_each(|(z, plane)| {
                MovingPlane { dims, z: *z, plane, still, order, grain }
                    .relax(&given[*z * plane_size..], relaxation);
            });
            for (z, plane) in moving {
                planes[z] = plane;
            }
        }
    }
}

/// A moving plane among planes that do not move.
struct MovingPlane<'a> {
    dims: [usize; 3],
    z: usize,
    plane: &'a mut [f64],
    still: &'a [Vec<f64>],
    order: TieOrder,
    grain: Grain,
}

/// The neighbours of a sample: index and value.
struct Neighbours {
    of: [(usize, f64); 6],
    n: usize,
}

impl MovingPlane<'_> {
    fn relax<G: AsPrimitive<f64>>(&mut self, given: &[G], relaxation: RelaxParameters) {
        let [nx, ny, nz] = self.dims;
        let still = self.still;
        let is_inner = self.z > 0 && self.z + 1 < nz;
        for y in 0..ny {
            let row = y * nx;
            for x in 0..nx {
                let i = row + x;
                if !(is_inner && y > 0 && y + 1 < ny && x > 0 && x + 1 < nx) {
                    let around = self.neighbours(self.z * nx * ny + i);
                    let mut values = [0.0; 6];
                    around.of.iter().zip(&mut values).for_each(|(&(_, x), value)| *value = x);
                    self.move_one(i, &values[..around.n], given[i].as_(), relaxation);
                    continue;
                }
                let (below, above) = (&still[self.z - 1], &still[self.z + 1]);
                let plane = &*self.plane;
                let values =
                    [plane[i - 1], plane[i + 1], plane[i - nx], plane[i + nx], below[i], above[i]];
                self.move_one(i, &values, given[i].as_(), relaxation);
            }
        }
    }

    /// Moves a sample of the plane towards the mean of its neighbours.
    #[inline]
    fn move_one(&mut self, i: usize, neighbours: &[f64], given: f64, relaxation: RelaxParameters) {
        let mean = neighbours.iter().sum::<f64>() / neighbours.len() as f64;
        let value = self.plane[i];
        let wanted = mean
            .max((given - relaxation.radius).min(value))
            .min((given + relaxation.radius).max(value));
        let wanted = self.grain.round(wanted);
        let (low, high) = (wanted.min(value), wanted.max(value));
        // Most samples do not pass a neighbour.
        let n_passed: usize = neighbours.iter().map(|&x| usize::from(low <= x && x <= high)).sum();
        if n_passed == 0 {
            self.plane[i] = wanted;
        } else if wanted != value {
            let sample = self.z * self.plane.len() + i;
            let around = self.neighbours(sample);
            self.plane[i] = self.allowed(sample, value, wanted, &around.of[..around.n]);
        }
    }

    /// The allowed value on the way from `value` to `wanted`: all of it, or half-way to the nearest neighbour that the sample
    /// must not pass.
    fn allowed(&self, sample: usize, value: f64, wanted: f64, neighbours: &[(usize, f64)]) -> f64 {
        let rises = wanted > value;
        // Negated where the sample falls.
        let up = |x: f64| if rises { x } else { -x };
        let mut limit = f64::INFINITY;
        let (mut had_one_ahead, mut has_one_ahead) = (false, false);
        let mut last = f64::NEG_INFINITY;
        for &(n, at_n) in neighbours {
            let was_ahead = self.order.is_lower(value, sample, at_n, n) == rises;
            let is_ahead = self.order.is_lower(wanted, sample, at_n, n) == rises;
            if was_ahead {
                had_one_ahead = true;
                last = last.max(up(at_n));
            }
            has_one_ahead |= is_ahead;
            if was_ahead && !is_ahead && !self.has_other(n, at_n, sample, rises) {
                limit = limit.min(up(at_n));
            }
        }
        // The layer may be ahead of it.
        let layer_is_ahead = neighbours.len() < 6 && self.order.layer_is_low != rises;
        if had_one_ahead && !has_one_ahead && !layer_is_ahead {
            limit = limit.min(last);
        }
        if limit == f64::INFINITY {
            return wanted;
        }
        let from = up(value);
        let middle = self.grain.round(from + 0.5 * (limit - from));
        if middle > from && middle < limit { up(middle) } else { value }
    }

    /// Whether sample `n` has a neighbour besides `sample` below it (`below`) or above it, the layer included.
    fn has_other(&self, n: usize, at_n: f64, sample: usize, below: bool) -> bool {
        let [nx, ny, nz] = self.dims;
        let size = nx * ny;
        // In the plane of the sample or next to it: no division.
        let z = if n >= (self.z + 1) * size {
            self.z + 1
        } else if n < self.z * size {
            self.z - 1
        } else {
            self.z
        };
        let i = n - z * size;
        let y = i / nx;
        let x = i - y * nx;
        let plane = |z: usize| if z == self.z { &*self.plane } else { self.still[z].as_slice() };
        let own = plane(z);
        let counts = |other: usize, value: f64| {
            other != sample && self.order.is_lower(value, other, at_n, n) == below
        };
        let at_border = x == 0 || y == 0 || z == 0 || x + 1 == nx || y + 1 == ny || z + 1 == nz;
        (at_border && self.order.layer_is_low == below)
            || (x > 0 && counts(n - 1, own[i - 1]))
            || (x + 1 < nx && counts(n + 1, own[i + 1]))
            || (y > 0 && counts(n - nx, own[i - nx]))
            || (y + 1 < ny && counts(n + nx, own[i + nx]))
            || (z > 0 && counts(n - size, plane(z - 1)[i]))
            || (z + 1 < nz && counts(n + size, plane(z + 1)[i]))
    }

    #[inline]
    fn neighbours(&self, sample: usize) -> Neighbours {
        let [nx, ny, nz] = self.dims;
        let size = nx * ny;
        let z = sample / size;
        let i = sample - z * size;
        let y = i / nx;
        let x = i - y * nx;
        let plane = |z: usize| if z == self.z { &*self.plane } else { self.still[z].as_slice() };
        let own = plane(z);
        let mut around = Neighbours { of: [(0, 0.0); 6], n: 0 };
        let mut add = |there: bool, n: usize, values: &[f64], i: usize| {
            if there {
                around.of[around.n] = (n, values[i]);
                around.n += 1;
            }
        };
        add(x > 0, sample.wrapping_sub(1), own, i.wrapping_sub(1));
        add(x + 1 < nx, sample + 1, own, i + 1);
        add(y > 0, sample.wrapping_sub(nx), own, i.wrapping_sub(nx));
        add(y + 1 < ny, sample + nx, own, i + nx);
        if z > 0 {
            add(true, sample - size, plane(z - 1), i);
        }
        if z + 1 < nz {
            add(true, sample + size, plane(z + 1), i);
        }
        around
    }
}
