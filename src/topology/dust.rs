//! Dust taken out of a volume before the sweep: parts that never become large.
//!
//! # Theory
//!
//! Going down, each maximum begins a part of {f > c}, which grows until it meets another. The smaller of the two ends there,
//! and the samples that it has then are its *extinction value* by volume (Vachier, Meyer 1995). A part whose value is too
//! small is flattened to where it meets the larger one: an opening by volume (Vincent 1993) that leaves the tops of all
//! other parts as they are. Minima, whose parts are cavities, go likewise in -f, afterwards. Parts are found by joining
//! samples from the highest to the lowest (union-find, as Meijster and Wilkinson 2002 do for openings by area).
//!
//! Two samples belong together where a lattice edge joins them. The trilinear field also joins samples across the middle of
//! a face or a cell: a thread that is thinner than a voxel and runs diagonally is many parts here and one there, and is
//! flattened where these are small.
//!
//! # Invariants
//!
//! Samples of parts that stay keep their values, to the bit; all others get the value of a sample nearby, so the type of
//! the samples stays too. What touches the border belongs to the layer around the volume where the layer lies on its side.
//! Memory: 16 bytes per sample, and 20 per sample of the most frequent value.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::disjoint_sets::DisjointSets;
use crate::error::{Error, Result};
use crate::volume::with_samples;
use crate::volume::{Outside, Samples, Volume};

/// Which way dust is taken out: spectra name it, so that none is taken for what another way gives.
pub const DUST_METHOD: u32 = 1;

/// The size of what is one with the layer around the volume.
const ENDLESS: u32 = u32::MAX;

/// What [`without_dust`] did to a volume.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Dust {
    /// [`DUST_METHOD`].
    pub method: u32,
    /// Parts of fewer samples (voxels) are gone.
    pub voxels: u32,
    /// How many parts of high values are gone.
    pub parts: usize,
    /// How many cavities of low values are filled.
    pub cavities: usize,
    /// Samples that changed.
    pub samples: usize,
    /// The largest change of a sample.
    pub largest_change: f64,
    /// Parts and cavities that are too small again, once noise has been taken out by persistence afterwards.
    pub left: usize,
}

/// The volume without the parts, and without the cavities, that never have `voxels` samples before they meet a larger one.
///
/// # Errors
///
/// [`Error::Input`] for volumes of more than 2^32 samples; those of [`Volume::new`] where nothing is left.
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
            Parts::of(&before, volume.dims(), is_high, is_joined_by_layer).flatten(voxels, &mut samples);
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

/// Parts while they grow.
struct Parts<'a, T> {
    values: &'a [T],
    dims: [usize; 3],
    /// Samples in the order in which they join.
    order: Vec<u32>,
    /// Whether those at the border belong to the layer around the volume.
    is_joined_by_layer: bool,
    sets: DisjointSets,
    /// Of the sample that stands for a part: how many it has, [`ENDLESS`] with the layer. Of samples that have not joined: 0.
    size: Vec<u32>,
    /// The next sample of the same part, in a ring.
    next: Vec<u32>,
}

/// A part that samples of a level touch.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Touched {
    /// What stands for all that the level makes one.
    whole: u32,
    /// How many samples it had before.
    size: u32,
    /// What stood for it.
    root: u32,
}

impl<'a, T: Copy + PartialOrd + Sync> Parts<'a, T> {
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
        Parts {
            values,
            dims,
            order,
            is_joined_by_layer,
            sets: DisjointSets::new(n as usize),
            size: vec![0; n as usize],
            next: (0..n).collect(),
        }
    }

    /// Gives the samples of parts of fewer than `least` samples the value at which they meet a larger one. What is equal
    /// joins at a time: parts that meet there have never had more samples than before.
    fn flatten(mut self, least: u32, samples: &mut [T]) {
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
                self.size[at as usize] = if is_outside { ENDLESS } else { 1 };
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
                // The last is the largest, and goes on, unless the layer is among what it meets.
                let is_layer = self.size[met[0].whole as usize] == ENDLESS;
                let n_ending =
                    met.len() - usize::from(!is_layer || met[met.len() - 1].size == ENDLESS);
                for ending in met[..n_ending].iter().filter(|part| part.size < least) {
                    self.fill(ending.root, values[level[0] as usize], samples);
                }
            }
            for &(a, b) in &joined {
                self.next.swap(a as usize, b as usize);
            }
        }
    }

    /// Gives all samples of a part a value.
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

    /// Makes the parts of two samples one, but for their rings; what stood for them, where they were two.
    fn unite(&mut self, a: u32, b: u32) -> Option<(u32, u32)> {
        let (a, b) = (self.sets.find(a), self.sets.find(b));
        if a == b {
            return None;
        }
        // The larger stands for both, so ways to it stay short.
        let [n_a, n_b] = [a, b].map(|r| self.size[r as usize]);
        let (stands, other) = if n_a >= n_b { (a, b) } else { (b, a) };
        self.sets.absorb(stands, other);
        self.size[stands as usize] = n_a.saturating_add(n_b);
        Some((a, b))
    }
}

/// The samples along the lattice edges of one, and whether it lies at the border.
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

/// How many parts the samples that are marked form.
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
                // A small peak on a large part: it meets nothing larger than itself until it is large.
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
    fn what_lies_on_the_side_of_the_layer_is_joined_by_it() {
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

    /// The parts of samples above an isovalue, or not above it: for each sample the first one of its part.
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
