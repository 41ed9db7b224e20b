//! Removes dust from a volume before the sweep: parts that never become large.
//!
//! # Theory
//!
//! For descending isovalues, each maximum starts a part of {f > c}, which grows until it meets another. The smaller of the
//! two ends there, and its number of samples is its *extinction value* by volume (Vachier, Meyer 1995). A part with a too
//! small value is flattened to the value at which it meets the larger one: an opening by volume (Vincent 1993) that
//! preserves the tops of all other parts. Minima, whose parts are cavities, are treated in the same way in -f, afterwards.
//! Parts are found by joining samples from the highest to the lowest (union-find, as Meijster and Wilkinson 2002 for area
//! openings).
//!
//! Samples are connected along lattice edges. The trilinear field also connects samples across faces and cells: a diagonal
//! thread that is thinner than a voxel is many parts here, and is flattened where these are small.
//!
//! # Invariants
//!
//! Samples of parts that stay keep their exact values; all others get the value of another sample, so the type of the
//! samples stays too. Parts at the border belong to the layer around the volume if they are on its side.
//! Memory: 16 bytes per sample, and 20 per sample of the most frequent value.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::disjoint_sets::DisjointSets;
use crate::error::{Error, Result};
use crate::volume::with_samples;
use crate::volume::{Outside, Samples, Volume};

/// Version of the method, which a spectrum stores: another version gives another volume.
pub const DUST_METHOD: u32 = 1;

/// The size of parts that are connected to the layer around the volume.
const WITH_LAYER: u32 = u32::MAX;

/// The changes of [`without_dust`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Dust {
    /// [`DUST_METHOD`].
    pub method: u32,
    /// Parts of fewer samples (voxels) are removed.
    pub voxels: u32,
    /// Number of removed parts of high values.
    pub parts: usize,
    /// Number of filled cavities of low values.
    pub cavities: usize,
    /// Number of changed samples.
    pub samples: usize,
    /// The largest change of a sample.
    pub largest_change: f64,
    /// Parts and cavities that are too small again, after a later simplification by persistence.
    pub left: usize,
}

/// Removes the parts and cavities that have fewer than `voxels` samples when they meet a larger one.
///
/// # Errors
///
/// [`Error::Input`] for volumes of more than 2^32 samples; those of [`Volume::new`] if nothing is left.
pub fn without_dust(volume: &Volume, voxels: u32) -> Result<(Volume, Dust)> {
    if u32::try_from(volume.samples().len()).is_err() {
        return Err(Error::input(format!("{}: more than 2^32 samples", volume.name())));
    }
    let mut done = Dust { method: DUST_METHOD, voxels, ..Dust::default() };
    let layer_is_high = volume.outside() == Outside::High;
    let samples = with_samples!(volume.samples(), given => {
        let mut samples = given.clone();
        for is_high in [true, false] {
            let before = samples.clone();
            let is_joined_by_layer = is_high == layer_is_high;
            GrowingParts::of(&before, volume.dims(), is_high, is_joined_by_layer).flatten(voxels, &mut samples);
            let changed: Vec<bool> = before.iter().zip(&samples).map(|(a, b)| a != b).collect();
            let n = n_connected(changed, volume.dims());
            *(if is_high { &mut done.parts } else { &mut done.cavities }) = n;
        }
        Samples::from(samples)
    });
    for i in 0..samples.len() {
        let change = (samples.get(i) - volume.samples().get(i)).abs();
        done.samples += usize::from(change > 0.0);
        done.largest_change = done.largest_change.max(change);
    }
    Ok((volume.with_samples(samples)?, done))
}

/// The parts during the union-find.
struct GrowingParts<'a, T> {
    values: &'a [T],
    dims: [usize; 3],
    /// Samples in the order in which they join.
    order: Vec<u32>,
    /// Whether samples at the border belong to the layer around the volume.
    is_joined_by_layer: bool,
    sets: DisjointSets,
    /// Per root: number of samples of its part, or [`WITH_LAYER`]. 0 for samples that have not joined.
    size: Vec<u32>,
    /// The next sample of the same part, in a ring.
    next: Vec<u32>,
}

/// A part next to samples of the current value.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Touched {
    /// Root of the part after the samples of the value have joined.
    whole: u32,
    /// Number of samples before.
    size: u32,
    /// Root before.
    root: u32,
}

impl<'a, T: Copy + PartialOrd + Sync> GrowingParts<'a, T> {
    fn of(values: &'a [T], dims: [usize; 3], is_high: bool, is_joined_by_layer: bool) -> Self {
        let n = values.len() as u32;
        let mut order: Vec<u32> = (0..n).collect();
        let ascending = |&a: &u32, &b: &u32| {
            let of_values = values[a as usize].partial_cmp(&values[b as usize]);
            of_values.unwrap_or(Ordering::Equal).then(b.cmp(&a))
        };
        order.sort_unstable_by(ascending);
        if is_high {
            order.reverse();
        }
        GrowingParts {
            values,
            dims,
            order,
            is_joined_by_layer,
            sets: DisjointSets::new(n as usize),
            size: vec![0; n as usize],
            next: (0..n).collect(),
        }
    }

    /// Sets the samples of parts of fewer than `min_size` samples to the value at which they meet a larger one. All samples
    /// of one value join at once, and sizes are those before.
    fn flatten(mut self, min_size: u32, samples: &mut [T]) {
        let order = std::mem::take(&mut self.order);
        let values = self.values;
        let (mut touched, mut joined) = (Vec::new(), Vec::new());
        for level in order.chunk_by(|&a, &b| values[a as usize] == values[b as usize]) {
            touched.clear();
            for &at in level {
                for n in neighbours(self.dims, at).0.into_iter().flatten() {
                    if self.size[n as usize] > 0 {
                        let root = self.sets.find(n);
                        touched.push(Touched { whole: at, size: self.size[root as usize], root });
                    }
                }
            }
            joined.clear();
            for &at in level {
                let (around, is_at_border) = neighbours(self.dims, at);
                let is_outside = is_at_border && self.is_joined_by_layer;
                self.size[at as usize] = if is_outside { WITH_LAYER } else { 1 };
                for n in around.into_iter().flatten() {
                    if self.size[n as usize] > 0 {
                        joined.extend(self.unite(n, at));
                    }
                }
            }
            for one in &mut touched {
                one.whole = self.sets.find(one.whole);
            }
            touched.sort_unstable();
            touched.dedup();
            for met in touched.chunk_by(|a, b| a.whole == b.whole) {
                // The last part is the largest and does not end, unless the value also joins the layer.
                let is_layer = self.size[met[0].whole as usize] == WITH_LAYER;
                let n_ending =
                    met.len() - usize::from(!is_layer || met[met.len() - 1].size == WITH_LAYER);
                for ending in met[..n_ending].iter().filter(|part| part.size < min_size) {
                    self.fill(ending.root, values[level[0] as usize], samples);
                }
            }
            for &(a, b) in &joined {
                self.next.swap(a as usize, b as usize);
            }
        }
    }

    /// Sets all samples of a part to a value.
    fn fill(&self, root: u32, value: T, samples: &mut [T]) {
        let mut at = root;
        loop {
            samples[at as usize] = value;
            at = self.next[at as usize];
            if at == root {
                return;
            }
        }
    }

    /// Unites the parts of two samples, except for their rings. Returns the roots if they were two parts.
    fn unite(&mut self, a: u32, b: u32) -> Option<(u32, u32)> {
        let (a, b) = (self.sets.find(a), self.sets.find(b));
        if a == b {
            return None;
        }
        // Union by size keeps paths short.
        let [n_a, n_b] = [a, b].map(|r| self.size[r as usize]);
        let (root, other) = if n_a >= n_b { (a, b) } else { (b, a) };
        self.sets.absorb(root, other);
        self.size[root as usize] = n_a.saturating_add(n_b);
        Some((a, b))
    }
}

/// The neighbours of a sample along lattice edges, and whether the sample is at the border.
fn neighbours(dims: [usize; 3], sample: u32) -> ([Option<u32>; 6], bool) {
    let sample = sample as usize;
    let [nx, ny, _] = dims;
    let position = [sample % nx, sample / nx % ny, sample / (nx * ny)];
    let mut found = [None; 6];
    for (a, stride) in [1, nx, nx * ny].into_iter().enumerate() {
        found[2 * a] = (position[a] > 0).then(|| (sample - stride) as u32);
        found[2 * a + 1] = (position[a] + 1 < dims[a]).then(|| (sample + stride) as u32);
    }
    (found, found.contains(&None))
}

/// Number of connected components of the marked samples.
fn n_connected(mut marked: Vec<bool>, dims: [usize; 3]) -> usize {
    let mut n = 0;
    let mut stack = Vec::new();
    for first in 0..marked.len() {
        if !std::mem::take(&mut marked[first]) {
            continue;
        }
        n += 1;
        stack.push(first as u32);
        while let Some(at) = stack.pop() {
            for next in neighbours(dims, at).0.into_iter().flatten() {
                if std::mem::take(&mut marked[next as usize]) {
                    stack.push(next);
                }
            }
        }
    }
    n
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::volume::Placement;

    fn volume(dims: [usize; 3], samples: Vec<u8>) -> Volume {
        Volume::new("v", dims, Samples::U8(samples), Placement::default()).expect("a volume")
    }

    /// Zeros but for some rows along x: first sample, number of samples, value.
    fn rows(dims: [usize; 3], background: u8, rows: &[([usize; 3], usize, u8)]) -> Volume {
        let mut samples = vec![background; dims.iter().product()];
        for &([x, y, z], n, value) in rows {
            let first = x + dims[0] * (y + dims[1] * z);
            samples[first..first + n].fill(value);
        }
        volume(dims, samples)
    }

    #[test]
    fn parts_and_cavities_that_are_too_small_go_and_all_else_stays() {
        let dims = [12, 7, 7];
        let given = rows(
            dims,
            10,
            &[
                ([1, 1, 1], 3, 50),
                ([1, 3, 3], 5, 50),
                // A small peak on a large part meets nothing larger than itself until it is large.
                ([3, 3, 3], 1, 90),
                ([8, 3, 3], 1, 0),
            ],
        );
        let (after, done) = without_dust(&given, 4).expect("dust");
        let expected = rows(dims, 10, &[([1, 3, 3], 5, 50), ([3, 3, 3], 1, 90)]);
        assert_eq!(after.samples(), expected.samples());
        assert_eq!((done.parts, done.cavities, done.samples), (1, 1, 4));
        assert_eq!(done.largest_change, 40.0);
        assert_eq!(without_dust(&given, 1).expect("nothing").1.samples, 0);
    }

    #[test]
    fn border_samples_on_the_side_of_the_layer_belong_to_it() {
        // A low sample at the border is outside, not a cavity; with the layer high, so is a high one.
        let large = [([3, 2, 2], 4, 60), ([3, 4, 4], 4, 5)];
        let rows_of = [large[0], large[1], ([0, 2, 2], 1, 0), ([4, 2, 0], 1, 50)];
        let given = rows([8, 5, 5], 10, &rows_of);
        let (after, done) = without_dust(&given, 3).expect("dust");
        assert_eq!((done.parts, done.cavities), (1, 0));
        assert_eq!(after.sample(0, 2, 2), 0.0);
        let given = given.with_outside(Outside::High);
        let (after, done) = without_dust(&given, 3).expect("dust");
        assert_eq!((done.parts, done.cavities), (0, 1));
        assert_eq!(after.sample(4, 2, 0), 50.0);
    }

    /// The parts of samples above an isovalue, or not above it: for each sample the first of its part.
    fn parts(volume: &Volume, isovalue: f64, is_high: bool) -> Vec<Option<usize>> {
        let n = volume.samples().len();
        let is_in = |i: usize| (volume.samples().get(i) > isovalue) == is_high;
        let mut first = vec![None; n];
        for start in 0..n {
            if !is_in(start) || first[start].is_some() {
                continue;
            }
            let mut stack = vec![start];
            first[start] = Some(start);
            while let Some(at) = stack.pop() {
                for next in neighbours(volume.dims(), at as u32).0.into_iter().flatten() {
                    let next = next as usize;
                    if is_in(next) && first[next].is_none() {
                        first[next] = Some(start);
                        stack.push(next);
                    }
                }
            }
        }
        first
    }

    #[test]
    fn no_part_meets_a_larger_one_before_it_is_large_enough() {
        const LEAST: usize = 6;
        const N_LEVELS: u32 = 12;
        let dims = [9, 8, 7];
        for seed in 0..6 {
            let mut random = Random::new(seed);
            let sample = |_| (random.next_u64() >> 40) as u32 % N_LEVELS;
            let given = volume(dims, (0..504).map(sample).map(|v| v as u8).collect());
            let (after, done) = without_dust(&given, LEAST as u32).expect("dust");
            assert!(done.parts > 0 && done.cavities > 0);
            for level in (1..N_LEVELS).map(f64::from) {
                // Going down from above the level to below it.
                let (above, below) = (parts(&after, level, true), parts(&after, level - 1.0, true));
                let count = |firsts: &[Option<usize>], first| {
                    firsts.iter().filter(|f| **f == Some(first)).count()
                };
                for part in (0..504).filter(|&i| above[i] == Some(i)) {
                    let whole = below[part].expect("it grows");
                    let n = count(&above, part);
                    let others = (0..504)
                        .filter(|&i| i != part && above[i] == Some(i) && below[i] == Some(whole));
                    let meets_larger = others.map(|i| count(&above, i)).any(|m| m > n);
                    assert!(n >= LEAST || !meets_larger, "seed {seed}, level {level}: {n} samples");
                }
            }
        }
    }
}
