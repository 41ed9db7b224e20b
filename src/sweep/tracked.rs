//! How much of the isosurface a spectrum shows by tracked triangles, and how much by the exact extraction.

use rayon::prelude::*;

use crate::spectrum::{Spectrum, Triangle};

/// Isovalues at which the areas are compared, in the middle of equal parts of the range.
const N_ISOVALUES: usize = 64;

/// Triangles that are summed up at once: sums do not depend on the number of threads.
const CHUNK: usize = 1 << 14;

/// The isovalues that have an isosurface, ascending, each with the share of its area, caps left out, that the first
/// `n_tracked` triangles show.
pub(super) fn tracked_area_shares(spectrum: &Spectrum, n_tracked: usize) -> Vec<(f64, f64)> {
    let (low, high) = spectrum.range;
    let at = |i: usize| {
        let share = (i as f64 + 0.5) / N_ISOVALUES as f64;
        low * (1.0 - share) + high * share
    };
    let ranked: Vec<(f64, u32)> =
        (0..N_ISOVALUES).map(at).filter_map(|c| Some((c, spectrum.rank_at(c)?))).collect();
    let tracked = areas(spectrum, &spectrum.triangles[..n_tracked], &ranked);
    let others = areas(spectrum, &spectrum.triangles[n_tracked..], &ranked);
    let areas = tracked.iter().zip(&others).zip(&ranked);
    areas
        .filter(|((t, o), _)| *t + *o > 0.0)
        .map(|((t, o), (isovalue, _))| (*isovalue, t / (t + o)))
        .collect()
}

/// The area of some triangles, without caps, at each of some isovalues with their ranks.
fn areas(spectrum: &Spectrum, triangles: &[Triangle], ranked: &[(f64, u32)]) -> Vec<f64> {
    let of_chunk = |chunk: &[Triangle]| {
        let mut sums = vec![0.0; ranked.len()];
        for triangle in chunk.iter().filter(|t| !t.cap) {
            let first = ranked.partition_point(|&(_, rank)| rank < triangle.birth);
            let end = ranked.partition_point(|&(_, rank)| rank < triangle.death);
            for (sum, &(isovalue, rank)) in sums[first..end].iter_mut().zip(&ranked[first..end]) {
                let corner = |v| glam::Vec3::from(spectrum.vertex_at(v, rank, isovalue));
                let [a, b, c] = triangle.vertices.map(corner);
                *sum += 0.5 * f64::from((b - a).cross(c - a).length());
            }
        }
        sums
    };
    let chunks: Vec<Vec<f64>> = triangles.par_chunks(CHUNK).map(of_chunk).collect();
    let mut all = vec![0.0; ranked.len()];
    for sums in chunks {
        all.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
    }
    all
}
