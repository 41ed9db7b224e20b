//! Random volumes of floating point samples with few different values, as scans that were rounded, scaled or
//! quantised have: full of ties and plateaus, and with many saddles that are equal but for the rounding of the samples.

use std::collections::BTreeMap;

use isospectrum::volume::{Outside, Placement, Samples, Volume};

use crate::common::random::Random;

/// The number of kinds of values.
const KINDS: u64 = 6;

/// Number of combinations of kinds of values and kinds of places.
pub(crate) const N_KINDS: u64 = 5 * KINDS;

/// A volume of some kind, with at most `most` samples along an axis and 3 to 40 different values.
pub(crate) fn volume(kind: u64, most: u64, random: &mut Random) -> Volume {
    let dims: [usize; 3] = std::array::from_fn(|_| 4 + random.below(most - 3) as usize);
    let values = values(kind % KINDS, 3 + random.below(38), random);
    let mut places = places(kind / KINDS % 5, dims, values.len(), random);
    // So that there are at least two values.
    (places[0], places[1]) = (0, values.len() - 1);
    let samples = Samples::F32(places.into_iter().map(|p| values[p]).collect());
    let outside = if random.below(4) == 0 { Outside::High } else { Outside::Low };
    let volume = Volume::new(format!("kind {kind}"), dims, samples, Placement::default());
    volume.expect("a valid volume").with_outside(outside)
}

/// Ascending values.
fn values(kind: u64, n: u64, random: &mut Random) -> Vec<f32> {
    let step = 0.01 + 0.09 * random.unit();
    let offset = 1000.0 * random.unit();
    let mut values: Vec<f64> = (0..n)
        .map(|k| match kind {
            // Decimal steps, which no floating point number is.
            0 => 0.1 * k as f64,
            1 => step * k as f64,
            // 32 steps rounded to a few decimals, those between rounded to even: 0.031, 0.0625, 0.0935, ...
            2 => (k / 2) as f64 / 16.0 + if k % 2 == 1 { 0.031 } else { 0.0 },
            // Gaps that differ by a thousandth, or by a trace.
            3 => 0.03125 * k as f64 * (1.0 + 1e-3 * random.below(3) as f64),
            4 => offset + step * k as f64 * (1.0 + 1e-8 * random.below(3) as f64),
            _ => random.unit(),
        })
        .collect();
    values.sort_by(f64::total_cmp);
    let mut values: Vec<f32> = values.into_iter().map(|v| v as f32).collect();
    values.dedup();
    values
}

/// Which of `n` values each sample has.
fn places(kind: u64, dims: [usize; 3], n: usize, random: &mut Random) -> Vec<usize> {
    let n_samples = dims.iter().product();
    let at = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
    let any = |random: &mut Random| random.below(n as u64) as usize;
    match kind {
        // White noise.
        0 => (0..n_samples).map(|_| any(random)).collect(),
        // Mostly background.
        1 => (0..n_samples)
            .map(|_| ((-1.5 * (1.0 - random.unit()).ln()) as usize).min(n - 1))
            .collect(),
        // Smooth, in terraces.
        2 | 3 => {
            let scale = if kind == 2 { 1.2 } else { 0.6 };
            let mut waves: Vec<[f64; 4]> = Vec::new();
            waves.resize_with(5, || std::array::from_fn(|_| 2.0 * random.unit() - 1.0));
            let value = |i: usize| {
                let p = at(i).map(|x| scale * x as f64);
                let angle = |w: &[f64; 4]| w[0] * p[0] + w[1] * p[1] + w[2] * p[2] + 3.0 * w[3];
                waves.iter().map(|w| angle(w).sin()).sum::<f64>() / 5.0
            };
            let place = |i| (0.5 * (value(i) + 1.0) * n as f64) as usize;
            (0..n_samples).map(|i| place(i).min(n - 1)).collect()
        }
        // Blocks of eight equal samples.
        _ => {
            let mut blocks: BTreeMap<[usize; 3], usize> = BTreeMap::new();
            let block = |i: usize| at(i).map(|p| p / 2);
            (0..n_samples).map(|i| *blocks.entry(block(i)).or_insert_with(|| any(random))).collect()
        }
    }
}
