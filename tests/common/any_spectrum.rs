//! Random spectra for property tests.

use isospectrum::spectrum::{About, Knot, Patch, Spectrum, Triangle};
use proptest::prelude::*;

use super::synthetic::{Numbers, volume_info};

/// Random spectra that pass the check but are no surfaces: any three vertices make a triangle.
pub(crate) fn any_spectrum() -> impl Strategy<Value = Spectrum> {
    let isovalues = prop::collection::vec(1u32..1000, 2..12);
    (isovalues, any::<u64>(), 0usize..12, 0usize..30).prop_map(
        |(steps, seed, n_vertices, n_triangles)| {
            let mut numbers = Numbers(seed);
            let mut sum = -2000.0;
            let table = steps.iter().map(|&step| {
                sum += f64::from(step) / 7.0;
                sum
            });
            let isovalues: Vec<f64> = table.collect();
            let n_ranks = isovalues.len() as u32;
            let (mut first_knot, mut knots) = (vec![0], Vec::new());
            for _ in 0..n_vertices {
                for rank in (0..n_ranks).filter(|_| numbers.below(3) > 0).collect::<Vec<_>>() {
                    let mut x = || numbers.below(1 << 20) as f32 / 4096.0 - 3.0;
                    let position = [x(), x(), x()];
                    knots.push(Knot { rank, position });
                }
                first_knot.push(knots.len() as u32);
            }
            let mut triangles = Vec::new();
            for _ in 0..if n_vertices < 3 { 0 } else { n_triangles } {
                let vertices = [(); 3].map(|()| numbers.below(n_vertices as u32));
                let trajectories = vertices.map(|v| {
                    &knots[first_knot[v as usize] as usize..first_knot[v as usize + 1] as usize]
                });
                let first =
                    trajectories.iter().map(|t| t.first().map_or(n_ranks, |k| k.rank)).max();
                let last = trajectories.iter().map(|t| t.last().map_or(0, |k| k.rank)).min();
                let (first, last) = (first.expect("three"), last.expect("three"));
                let [a, b, c] = vertices;
                if a == b || b == c || c == a || first >= last {
                    continue;
                }
                let birth = first + numbers.below(last - first);
                let death = birth + 1 + numbers.below(last - birth);
                triangles.push(Triangle { vertices, birth, death, cap: numbers.below(4) == 0 });
            }
            let range = (isovalues[0], isovalues[isovalues.len() - 1]);
            let collapses = Vec::new();
            let patch = Patch { isovalues, first_knot, knots, triangles, collapses };
            Spectrum::new(About::new(volume_info(), range, 0.1), patch).expect("valid")
        },
    )
}
