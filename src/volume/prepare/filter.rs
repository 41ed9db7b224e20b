//! Filters on grids. Samples are mirrored at the border: d c b a | a b c d | d c b a.
//!
//! Gaussians are cut off at four standard deviations and their weights sum up to 1. Results are float32, or float64 if
//! float32 cannot represent the samples. Slices are independent, so results do not depend on the number of threads.

use num_traits::AsPrimitive;
use rayon::prelude::*;

use crate::volume::samples::{Samples, with_samples};

/// Cut-off of a Gaussian, in standard deviations.
const CUT_OFF: f64 = 4.0;

/// A Gaussian filter with the given standard deviations along x, y, z, in samples.
pub(super) fn gaussian(samples: &Samples, dims: [usize; 3], sigma: [f64; 3]) -> Samples {
    if samples.is_wide() {
        let values = with_samples!(samples, s => s.iter().map(|v| v.as_()).collect());
        return Samples::F64(smoothed(values, dims, sigma, |v| v, |v| v));
    }
    let values: Vec<f32> = with_samples!(samples, s => s.iter().map(|v| v.as_()).collect());
    Samples::F32(smoothed(values, dims, sigma, f64::from, |v| v as f32))
}

/// Smooths along one axis after the other.
fn smoothed<T: Copy + Send + Sync>(
    mut values: Vec<T>,
    dims: [usize; 3],
    sigma: [f64; 3],
    wide: impl Fn(T) -> f64 + Sync,
    narrow: impl Fn(f64) -> T + Sync,
) -> Vec<T> {
    let [nx, ny, nz] = dims;
    let slice = nx * ny;
    for axis in [0, 1].into_iter().filter(|&axis| sigma[axis] > 0.0) {
        let weights = weights(sigma[axis]);
        let (n, stride, starts) = if axis == 0 { (nx, 1, ny) } else { (ny, nx, nx) };
        values.par_chunks_exact_mut(slice).for_each(|slice| {
            let mut line = vec![0.0; n];
            for start in 0..starts {
                let first = if axis == 0 { start * nx } else { start };
                let at = |i: usize| first + i * stride;
                (0..n).for_each(|i| line[i] = wide(slice[at(i)]));
                for i in 0..n {
                    slice[at(i)] = narrow(weighted(&weights, i, n, |j| line[j]));
                }
            }
        });
    }
    if sigma[2] > 0.0 {
        let weights = weights(sigma[2]);
        let before = values.clone();
        values.par_chunks_exact_mut(slice).enumerate().for_each(|(k, to)| {
            for (i, to) in to.iter_mut().enumerate() {
                *to = narrow(weighted(&weights, k, nz, |j| wide(before[i + slice * j])));
            }
        });
    }
    values
}

/// Weights of samples at distances 0, 1, 2, ...
fn weights(sigma: f64) -> Vec<f64> {
    let reach = (CUT_OFF * sigma + 0.5) as usize;
    let weights: Vec<f64> =
        (0..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    weights.into_iter().map(|w| w / sum).collect()
}

/// The weighted mean around sample `i` of `n`.
fn weighted(weights: &[f64], i: usize, n: usize, value: impl Fn(usize) -> f64) -> f64 {
    let mut sum = weights[0] * value(i);
    for (away, weight) in weights.iter().enumerate().skip(1) {
        let (below, above) = if away <= i && i + away < n {
            (i - away, i + away)
        } else {
            (mirrored(i as i64 - away as i64, n), mirrored((i + away) as i64, n))
        };
        sum += weight * (value(below) + value(above));
    }
    sum
}

/// The index of the mirrored sample for an index beyond the border.
fn mirrored(i: i64, n: usize) -> usize {
    let n = n as i64;
    let within = i.rem_euclid(2 * n);
    (if within < n { within } else { 2 * n - 1 - within }) as usize
}

/// A median filter over a cube of samples.
pub(super) fn median(samples: &Samples, dims: [usize; 3], radius: usize) -> Samples {
    with_samples!(samples, s => Samples::from(medians(s, dims, radius)))
}

fn medians<T: Copy + Send + Sync + PartialOrd>(values: &[T], dims: [usize; 3], r: usize) -> Vec<T> {
    let [nx, ny, nz] = dims;
    let near = |i: usize, n: usize| -> Vec<usize> {
        (0..=2 * r).map(|d| mirrored(i as i64 + d as i64 - r as i64, n)).collect()
    };
    let mut medians = values.to_vec();
    medians.par_chunks_exact_mut(nx * ny).enumerate().for_each(|(k, slice)| {
        let slices = near(k, nz);
        let mut cube = Vec::with_capacity((2 * r + 1).pow(3));
        for j in 0..ny {
            let rows = near(j, ny);
            for i in 0..nx {
                let columns = near(i, nx);
                cube.clear();
                for &z in &slices {
                    for &y in &rows {
                        cube.extend(columns.iter().map(|&x| values[x + nx * (y + ny * z)]));
                    }
                }
                let middle = cube.len() / 2;
                let order = |a: &T, b: &T| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal);
                slice[i + nx * j] = *cube.select_nth_unstable_by(middle, order).1;
            }
        }
    });
    medians
}

/// Means of blocks of n samples along every axis; float64 if float32 cannot represent the samples.
pub(super) fn block_means(samples: &Samples, dims: [usize; 3], n: usize) -> Samples {
    let means = with_samples!(samples, s => means(s, dims, n));
    if samples.is_wide() {
        Samples::F64(means)
    } else {
        Samples::F32(means.into_iter().map(|v| v as f32).collect())
    }
}

fn means<T: AsPrimitive<f64> + Sync>(values: &[T], [nx, ny, nz]: [usize; 3], n: usize) -> Vec<f64> {
    let [mx, my, mz] = [nx / n, ny / n, nz / n];
    let mut means = vec![0.0; mx * my * mz];
    means.par_chunks_exact_mut(mx * my).enumerate().for_each(|(k, slice)| {
        for z in n * k..n * (k + 1) {
            for y in 0..n * my {
                let row = nx * (y + ny * z);
                for x in 0..n * mx {
                    slice[x / n + mx * (y / n)] += values[row + x].as_();
                }
            }
        }
        let size = (n * n * n) as f64;
        slice.iter_mut().for_each(|mean| *mean /= size);
    });
    means
}
