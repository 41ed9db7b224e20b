//! What draining leaves of corners and rims smoothed: as in `smooth`, but the field gets no extremum which it did not have before.
//!
//! # Theory
//!
//! Each sample goes to the mean of its neighbours, within its bounds (Gauss-Seidel, projected). One that moves past a neighbour may become an extremum, or leave one beside it. Such a move ends before
//! that neighbour: the monotonicity constraints of Weinkauf, Gingold, Sorkine (2010), Jacobson, Weinkauf, Sorkine
//! (2012) and Guenther, Jacobson, Reininghaus, Seidel, Sorkine-Hornung, Weinkauf (2014), which there come from a
//! tree that is chosen first, and here from what the samples are at each move. So no iteration makes an extremum,
//! whenever it ends, and those that there are may move, or vanish into a neighbour.
//!
//! Threads change nothing: every third plane moves at a time, and reads no further than the two planes on either side.

use num_traits::AsPrimitive;
use rayon::prelude::*;

use super::lattice::{Grain, Lattice, Order};

/// How a field is relaxed.
#[derive(Clone, Copy)]
pub(super) struct Relaxation {
    /// How far a sample may come from the given one; those that are farther already come no farther.
    pub(super) radius: f64,
    /// Iterations.
    pub(super) passes: usize,
}

/// Relaxes a field; `given` tells the samples that it must stay near to.
pub(super) fn relax<G: AsPrimitive<f64> + Sync>(
    lattice: &mut Lattice,
    given: &[G],
    relaxation: Relaxation,
) {
    let (dims, order, grain) = (lattice.dims, lattice.order, lattice.grain);
    for _ in 0..relaxation.passes {
        for turn in 0..3.min(dims[2]) {
            let planes = &mut lattice.planes;
            let plane_size = dims[0] * dims[1];
            let mut moving: Vec<(usize, Vec<f64>)> =
                (turn..dims[2]).step_by(3).map(|z| (z, std::mem::take(&mut planes[z]))).collect();
            let still = &*planes;
            moving.par_iter_mut().for_each(|(z, plane)| {
                Slab { dims, z: *z, plane, still, order, grain }
                    .relax(&given[*z * plane_size..], relaxation);
            });
            for (z, plane) in moving {
                planes[z] = plane;
            }
        }
    }
}

/// A plane that moves among those that do not.
struct Slab<'a> {
    dims: [usize; 3],
    z: usize,
    plane: &'a mut [f64],
    still: &'a [Vec<f64>],
    order: Order,
    grain: Grain,
}

/// The neighbours that a sample has: number and value.
struct Around {
    of: [(usize, f64); 6],
    n: usize,
}

impl Slab<'_> {
    fn relax<G: AsPrimitive<f64>>(&mut self, given: &[G], relaxation: Relaxation) {
        let [nx, ny, nz] = self.dims;
        let still = self.still;
        let is_inner = self.z > 0 && self.z + 1 < nz;
        for y in 0..ny {
            let row = y * nx;
            for x in 0..nx {
                let i = row + x;
                if !(is_inner && y > 0 && y + 1 < ny && x > 0 && x + 1 < nx) {
                    let around = self.around(self.z * nx * ny + i);
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
    fn move_one(&mut self, i: usize, neighbours: &[f64], given: f64, relaxation: Relaxation) {
        let mean = neighbours.iter().sum::<f64>() / neighbours.len() as f64;
        let value = self.plane[i];
        let wanted = mean
            .max((given - relaxation.radius).min(value))
            .min((given + relaxation.radius).max(value));
        let wanted = self.grain.round(wanted);
        let (low, high) = (wanted.min(value), wanted.max(value));
        // Most samples pass no neighbour.
        let n_passed: usize = neighbours.iter().map(|&x| usize::from(low <= x && x <= high)).sum();
        if n_passed == 0 {
            self.plane[i] = wanted;
        } else if wanted != value {
            let sample = self.z * self.plane.len() + i;
            let around = self.around(sample);
            self.plane[i] = self.allowed(sample, value, wanted, &around.of[..around.n]);
        }
    }

    /// How far a sample may go on its way: all of it, or half-way to the nearest neighbour that it must not pass.
    fn allowed(&self, sample: usize, value: f64, wanted: f64, neighbours: &[(usize, f64)]) -> f64 {
        let rises = wanted > value;
        // Turned so that the way goes up.
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
        // The layer may lie ahead of it.
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
        // In the plane of the sample or beside it: no division.
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
    fn around(&self, sample: usize) -> Around {
        let [nx, ny, nz] = self.dims;
        let size = nx * ny;
        let z = sample / size;
        let i = sample - z * size;
        let y = i / nx;
        let x = i - y * nx;
        let plane = |z: usize| if z == self.z { &*self.plane } else { self.still[z].as_slice() };
        let own = plane(z);
        let mut around = Around { of: [(0, 0.0); 6], n: 0 };
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
