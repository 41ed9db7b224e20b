//! The share of the isosurface's area that tracked triangles show; the exact extraction shows the rest.

use rayon::prelude::*;

use super::isovalue_ranks::TASK_ITEMS;
use crate::spectrum::{Spectrum, Triangle};
use crate::volume::between;

/// Key in a spectrum's metadata: the share of the isosurface's area, without caps, whose
/// triangles are tracked, mean over the range.
pub const TRACKED_AREA_SHARE: &str = "tracked_area_share";

/// Key in a spectrum's metadata: that share at isovalues evenly spread over the range, as ascending pairs [isovalue, share].
pub const TRACKED_AREA_SHARES: &str = "tracked_area_shares";

/// Number of isovalues at which areas are measured, in the middle of equal parts of the range.
const N_ISOVALUES: usize = 64;

/// The isovalues at which areas are measured, ascending.
pub(crate) fn area_isovalues(range: (f64, f64)) -> impl Iterator<Item = f64> {
    (0..N_ISOVALUES).map(move |i| between(range, (i as f64 + 0.5) / N_ISOVALUES as f64))
}

/// At each of [`area_isovalues`] the area, without caps, of the first `n_tracked` triangles and of the others.
pub(super) fn shown_areas(spectrum: &Spectrum, n_tracked: usize) -> Vec<[f64; 2]> {
    let ranked: Vec<Option<(f64, u32)>> =
        area_isovalues(spectrum.range()).map(|c| Some((c, spectrum.rank_at(c)?))).collect();
    let known: Vec<(f64, u32)> = ranked.iter().copied().flatten().collect();
    let tracked = areas(spectrum, &spectrum.triangles()[..n_tracked], &known);
    let others = areas(spectrum, &spectrum.triangles()[n_tracked..], &known);
    let mut found = tracked.into_iter().zip(others).map(|(t, o)| [t, o]);
    ranked.iter().map(|r| r.and_then(|_| found.next()).unwrap_or_default()).collect()
}

/// Adds the share of tracked area to a spectrum's metadata, if there is any area.
pub(crate) fn insert_area_shares(spectrum: &mut Spectrum, areas: &[[f64; 2]]) {
    let rounded = |x: f64| (1e4 * x).round() / 1e4;
    let all = area_isovalues(spectrum.range()).zip(areas);
    let shares: Vec<(f64, f64)> =
        all.filter(|(_, [t, o])| t + o > 0.0).map(|(c, [t, o])| (c, t / (t + o))).collect();
    if shares.is_empty() {
        return;
    }
    let mean = shares.iter().map(|s| s.1).sum::<f64>() / shares.len() as f64;
    let shares: Vec<(f64, f64)> = shares.into_iter().map(|(c, s)| (c, rounded(s))).collect();
    let metadata = &mut spectrum.about_mut().parameters;
    metadata.insert(TRACKED_AREA_SHARE, serde_json::json!(rounded(mean)));
    metadata.insert(TRACKED_AREA_SHARES, serde_json::json!(shares));
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
    // Sums must not depend on the number of threads.
    let chunks: Vec<Vec<f64>> = triangles.par_chunks(TASK_ITEMS).map(of_chunk).collect();
    let mut all = vec![0.0; ranked.len()];
    for sums in chunks {
        all.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
    }
    all
}
