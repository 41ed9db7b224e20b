//! Smooths a field near a given one; extrema may move.
//!
//! # Theory
//!
//! Of all fields between two bounds, the one with the least Dirichlet energy (the sum of squared differences along lattice
//! edges) has few saddles: a sample that no bound constrains is the mean of its neighbours, and not an extremum. It is found
//! by projected successive over-relaxation: each sample moves to the mean and somewhat beyond, within its bounds.
//!
//! Where a bound constrains a single sample, the field has a spike with saddles around it. Bounds around the given field
//! leave many of them. So the bounds are P / 2 on either side of a *middle*, the given field slightly blurred within P,
//! which do not constrain single samples. Remaining extrema are drained afterwards.
//!
//! # Invariants
//!
//! No sample is farther than 1.5 P from the given one. The result does not depend on threads: every second plane moves at a
//! time, and reads only the adjacent planes; in a plane every second sample moves, then the others.

use num_traits::AsPrimitive;
use rayon::prelude::*;

use super::lattice::{Grain, Lattice};

/// Number of blurs of the middle with weights 1/4, 1/2, 1/4 along each axis: a standard deviation of one voxel. One blur
/// leaves bonsai 22,004 handles instead of 15,752 (of 112,402); four move it farther from the given field.
const BLURS: usize = 2;

/// Width of the bounds on either side of the middle, over P. 1 leaves as many events, farther from the given field.
const WIDTH: f64 = 0.5;

/// Largest width over the range of the middle: with half of the range the field could become constant.
const MAX_WIDTH_OVER_RANGE: f64 = 0.25;

/// Over-relaxation factor.
const OVER_RELAXATION: f64 = 1.5;

/// Iterations with over-relaxation, then without: an overshoot at the end makes handles. With 20 as many events remain, but
/// more to drain, and isosurfaces are rougher where there was noise.
const ITERATIONS: [usize; 2] = [40, 2];

/// Steps per P of the offset between middle and given sample.
const OFFSET_STEPS: f64 = i16::MAX as f64;

/// Smooths a lattice that equals the given field; `radius` is P.
pub(super) fn smooth<G: AsPrimitive<f64> + Sync>(lattice: &mut Lattice, given: &[G], radius: f64) {
    let dims @ [nx, ny, _] = lattice.dims;
    for _ in 0..BLURS {
        lattice.planes.par_iter_mut().for_each(|plane| blur_plane(plane, dims));
        blur_across(&mut lattice.planes);
    }
    let unit = radius / OFFSET_STEPS;
    let offset = |(&x, given): (&f64, &G)| {
        ((x - given.as_()) / unit).clamp(-OFFSET_STEPS, OFFSET_STEPS).round() as i16
    };
    let offsets: Vec<Vec<i16>> = lattice
        .planes
        .par_iter()
        .zip(given.par_chunks(nx * ny))
        .map(|(plane, given)| plane.iter().zip(given).map(offset).collect())
        .collect();
    let width =
        (WIDTH * radius).min(MAX_WIDTH_OVER_RANGE * range_of_middles(given, &offsets, unit));
    for (iterations, over) in ITERATIONS.into_iter().zip([OVER_RELAXATION, 1.0]) {
        for _ in 0..iterations {
            let motion = Motion { unit, width, over, grain: lattice.grain };
            iterate(lattice, given, &offsets, motion);
        }
    }
}

/// The range of the middle.
fn range_of_middles<G: AsPrimitive<f64> + Sync>(
    given: &[G],
    offsets: &[Vec<i16>],
    unit: f64,
) -> f64 {
    let n = offsets.first().map_or(1, Vec::len);
    let of_plane = |(offsets, given): (&Vec<i16>, &[G])| {
        let middles = offsets.iter().zip(given).map(|(&o, given)| middle(given.as_(), o, unit));
        middles.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (x.min(l), x.max(h)))
    };
    let ranges = offsets.par_iter().zip(given.par_chunks(n)).map(of_plane);
    let (low, high) =
        ranges.reduce(|| (f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    high - low
}

/// The middle of a sample's bounds.
#[inline]
fn middle(given: f64, offset: i16, unit: f64) -> f64 {
    given + unit * f64::from(offset)
}

/// Blurs a plane along x and along y; samples beyond the border equal those at it.
fn blur_plane(plane: &mut [f64], [nx, ny, _]: [usize; 3]) {
    for row in plane.chunks_mut(nx) {
        let mut before = row[0];
        for x in 0..nx {
            let (value, after) = (row[x], row[(x + 1).min(nx - 1)]);
            row[x] = blurred(before, value, after);
            before = value;
        }
    }
    let mut before = plane[..nx].to_vec();
    for y in 0..ny {
        for x in 0..nx {
            let i = y * nx + x;
            let (value, after) = (plane[i], plane[(y + 1).min(ny - 1) * nx + x]);
            plane[i] = blurred(before[x], value, after);
            before[x] = value;
        }
    }
}

/// Blurs planes along z.
fn blur_across(planes: &mut [Vec<f64>]) {
    let mut before = planes[0].clone();
    for z in 0..planes.len() {
        let (own, after) = planes.split_at_mut(z + 1);
        let own = &mut own[z];
        match after.first() {
            Some(after) => {
                let neighbours = before.par_iter_mut().zip(after);
                own.par_iter_mut().zip(neighbours).for_each(|(own, (before, &after))| {
                    let value = *own;
                    *own = blurred(*before, value, after);
                    *before = value;
                });
            }
            None => own.par_iter_mut().zip(&before).for_each(|(own, &before)| {
                *own = blurred(before, *own, *own);
            }),
        }
    }
}

#[inline]
fn blurred(before: f64, value: f64, after: f64) -> f64 {
    0.25 * before + 0.5 * value + 0.25 * after
}

/// Parameters of the motion of samples.
#[derive(Clone, Copy)]
struct Motion {
    /// Unit of the offsets of the middle.
    unit: f64,
    /// Largest distance of a sample from the middle.
    width: f64,
    over: f64,
    grain: Grain,
}

impl Motion {
    /// The new value of a sample.
    #[inline]
    fn moved(self, value: f64, mean: f64, (given, offset): (f64, i16)) -> f64 {
        let wanted = value + self.over * (mean - value);
        let middle = middle(given, offset, self.unit);
        self.grain.round(wanted.max(middle - self.width).min(middle + self.width))
    }
}

/// One iteration.
fn iterate<G: AsPrimitive<f64> + Sync>(
    lattice: &mut Lattice,
    given: &[G],
    offsets: &[Vec<i16>],
    motion: Motion,
) {
    let dims @ [nx, ny, nz] = lattice.dims;
    for turn in 0..2.min(nz) {
        let planes = &mut lattice.planes;
        let mut moving: Vec<(usize, Vec<f64>)> =
            (turn..nz).step_by(2).map(|z| (z, std::mem::take(&mut planes[z]))).collect();
        let still = &*planes;
        moving.par_iter_mut().for_each(|(z, plane)| {
            let z = *z;
            let given = &given[z * nx * ny..(z + 1) * nx * ny];
            let adjacent = [z.checked_sub(1), Some(z + 1)]
                .map(|z| z.and_then(|z| still.get(z)).map(Vec::as_slice));
            let mut slab = SmoothedPlane { dims, plane, adjacent, given, offsets: &offsets[z] };
            for colour in 0..2 {
                (0..ny).for_each(|y| slab.row(y, (colour + y + z) % 2, motion));
            }
        });
        for (z, plane) in moving {
            planes[z] = plane;
        }
    }
}

/// A moving plane between two that do not move.
struct SmoothedPlane<'a, G> {
    dims: [usize; 3],
    plane: &'a mut [f64],
    adjacent: [Option<&'a [f64]>; 2],
    given: &'a [G],
    offsets: &'a [i16],
}

impl<G: AsPrimitive<f64>> SmoothedPlane<'_, G> {
    /// Moves every second sample of a row, from `first` on.
    fn row(&mut self, y: usize, first: usize, motion: Motion) {
        let [nx, ny, _] = self.dims;
        let (Some(below), Some(above)) = (self.adjacent[0], self.adjacent[1]) else {
            (first..nx).step_by(2).for_each(|x| self.at_border(x, y, motion));
            return;
        };
        for x in (first..nx).step_by(2) {
            if y == 0 || y + 1 == ny || x == 0 || x + 1 == nx {
                self.at_border(x, y, motion);
                continue;
            }
            let i = y * nx + x;
            let plane = &*self.plane;
            let sum = plane[i - 1] + plane[i + 1] + plane[i - nx] + plane[i + nx];
            let mean = (sum + below[i] + above[i]) * (1.0 / 6.0);
            let middle = (self.given[i].as_(), self.offsets[i]);
            self.plane[i] = motion.moved(self.plane[i], mean, middle);
        }
    }

    /// Moves a sample that has fewer than six neighbours.
    fn at_border(&mut self, x: usize, y: usize, motion: Motion) {
        let [nx, ny, _] = self.dims;
        let i = y * nx + x;
        let plane = &*self.plane;
        let in_plane = [
            (x > 0).then(|| plane[i - 1]),
            (x + 1 < nx).then(|| plane[i + 1]),
            (y > 0).then(|| plane[i - nx]),
            (y + 1 < ny).then(|| plane[i + nx]),
        ];
        let across = self.adjacent.map(|plane| plane.map(|plane| plane[i]));
        let (mut sum, mut n) = (0.0, 0.0);
        for value in in_plane.into_iter().chain(across).flatten() {
            sum += value;
            n += 1.0;
        }
        // A volume of one sample has none.
        if n > 0.0 {
            let middle = (self.given[i].as_(), self.offsets[i]);
            self.plane[i] = motion.moved(self.plane[i], sum / n, middle);
        }
    }
}
