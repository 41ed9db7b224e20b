//! Fewer knots, within a distance.

use crate::spectrum::{Knot, Patch, Spectrum};

/// The spectrum without the knots that straight steps between the remaining ones replace: no knot
/// that is left out was further than `distance` voxels from the trajectory that remains. The first
/// and the last knot of a trajectory stay (Douglas and Peucker 1973, with the isovalue as time).
pub fn with_fewer_knots(spectrum: &Spectrum, distance: f64) -> Spectrum {
    let mut knots = Vec::new();
    let mut first_knot = vec![0];
    for v in 0..spectrum.n_vertices() as u32 {
        let trajectory = spectrum.trajectory(v);
        if let Some(first) = trajectory.first() {
            knots.push(*first);
            between(trajectory, spectrum.isovalues(), distance, &mut knots);
        }
        first_knot.push(knots.len() as u32);
    }
    let patch = Patch {
        isovalues: spectrum.isovalues().to_vec(),
        first_knot,
        knots,
        triangles: spectrum.triangles().to_vec(),
        collapses: spectrum.collapses().to_vec(),
    };
    Spectrum::unchecked(spectrum.about().clone(), patch)
}

/// Appends what has to stay of a trajectory after its first knot.
fn between(trajectory: &[Knot], isovalues: &[f64], distance: f64, kept: &mut Vec<Knot>) {
    // Parts whose ends stay, the first on top.
    let mut parts = vec![(0, trajectory.len() - 1)];
    while let Some((first, last)) = parts.pop() {
        if first == last {
            continue;
        }
        let worst = (first + 1..last)
            .map(|i| (i, miss(&trajectory[first], &trajectory[i], &trajectory[last], isovalues)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match worst {
            Some((i, miss)) if miss > distance => parts.extend([(i, last), (first, i)]),
            _ => kept.push(trajectory[last]),
        }
    }
}

/// How far a knot lies from the straight step between two others, at its isovalue.
fn miss(before: &Knot, knot: &Knot, after: &Knot, isovalues: &[f64]) -> f64 {
    let half = |k: &Knot| 0.5 * isovalues[k.rank as usize];
    let t = (half(knot) - half(before)) / (half(after) - half(before));
    let t = if t.is_finite() { t } else { 0.0 };
    let squares = (0..3).map(|a| {
        let [p, x, q] = [before, knot, after].map(|k| f64::from(k.position[a]));
        (p + t * (q - p) - x).powi(2)
    });
    squares.sum::<f64>().sqrt()
}
