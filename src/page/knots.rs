//! Removes knots of trajectories within a tolerance.
//!
//! # Theory
//!
//! Douglas and Peucker, "Algorithms for the reduction of the number of points required to represent a digitized line or its
//! caricature" (1973), with the isovalue as the parameter of the line.

use crate::spectrum::{Knot, Patch, Spectrum};

/// The spectrum with fewer knots: every removed knot is within `distance` voxels of the remaining trajectory at its isovalue. The
/// first and the last knot of each trajectory remain.
pub fn with_fewer_knots(spectrum: &Spectrum, distance: f64) -> Spectrum {
    let mut knots = Vec::new();
    let mut first_knot = vec![0];
    for v in 0..spectrum.n_vertices() as u32 {
        let trajectory = spectrum.trajectory(v);
        if let Some(first) = trajectory.first() {
            knots.push(*first);
            push_kept(trajectory, spectrum.isovalues(), distance, &mut knots);
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

/// Appends the knots of a trajectory that remain, without the first one.
fn push_kept(trajectory: &[Knot], isovalues: &[f64], distance: f64, kept: &mut Vec<Knot>) {
    // A stack of parts whose ends remain; the first part is on top.
    let mut parts = vec![(0, trajectory.len() - 1)];
    while let Some((first, last)) = parts.pop() {
        if first == last {
            continue;
        }
        let worst = (first + 1..last)
            .map(|i| {
                (i, deviation(&trajectory[first], &trajectory[i], &trajectory[last], isovalues))
            })
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match worst {
            Some((i, deviation)) if deviation > distance => parts.extend([(i, last), (first, i)]),
            _ => kept.push(trajectory[last]),
        }
    }
}

/// The distance of a knot from the straight line between two others, at its isovalue, voxels.
fn deviation(before: &Knot, knot: &Knot, after: &Knot, isovalues: &[f64]) -> f64 {
    let half = |k: &Knot| 0.5 * isovalues[k.rank as usize];
    let t = (half(knot) - half(before)) / (half(after) - half(before));
    let t = if t.is_finite() { t } else { 0.0 };
    let squares = (0..3).map(|a| {
        let [p, x, q] = [before, knot, after].map(|k| f64::from(k.position[a]));
        (p + t * (q - p) - x).powi(2)
    });
    squares.sum::<f64>().sqrt()
}
