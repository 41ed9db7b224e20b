//! The precision of stored positions.
//!
//! A file stores positions as multiples of a [`quantum`]. [`Spectrum::quantised`] rounds to exactly the positions that are read
//! from a file, so that the stored spectrum is the one that is verified.
//!
//! A vertex that moves along the surface leaves the surface as it is, and most of the bits of a position say where along the surface it
//! is. So a vertex *faces* the axis that its normals are nearest to: its coordinate there is counted in quanta, the other two in multiples
//! of [`ALONG`] quanta. Where these are rounded, the vertex moves in its tangent plane ([`rounded_along`]).
//!
//! A quantum is a power of two and independent of the size of the volume. Integers (the samples of an isotropic
//! volume) stay exact.

use glam::DVec3;

use super::data::Spectrum;

/// The smallest quantum, voxels: coordinates of 2^20 voxels are at most 2^30 of them.
pub const FINEST_QUANTUM: f64 = 1.0 / 1024.0;

/// The largest quantum, voxels.
const COARSEST_QUANTUM: f64 = 1.0 / 32.0;

/// Least number of quanta in a tolerance, so that rounding moves positions by at most 1/24 of it.
const MIN_QUANTA_PER_TOLERANCE: f64 = 12.0;

/// Coordinates along the surface are multiples of this many units: moving a vertex along the surface by a few hundredths of a voxel
/// does not change the surface.
pub(crate) const ALONG: i64 = 4;

/// The axis that a vertex with these normals faces: that of their largest component, ignoring signs.
pub(crate) fn facing(normals: impl IntoIterator<Item = DVec3>) -> usize {
    let sum: DVec3 = normals.into_iter().map(|n| n.abs()).sum();
    sum.max_position()
}

/// A position, in units, rounded along the surface, for a vertex with normal `n` that faces an axis.
pub(crate) fn rounded_along(exact: DVec3, n: DVec3, axis: usize) -> DVec3 {
    let along = ALONG as f64;
    let mut position = (exact / along).round() * along;
    let mut moved = position - exact;
    moved[axis] = 0.0;
    // Back into the tangent plane, unless the normal of this knot is far from the axis.
    let back = (-moved.dot(n) / n[axis]).clamp(-along, along);
    position[axis] = (exact[axis] + if back.is_finite() { back } else { 0.0 }).round();
    position
}

/// Positions of a spectrum with a tolerance (voxels) are stored as multiples of so many voxels: 1/128 for the default
/// tolerance of 0.1 voxel.
pub fn quantum(tolerance: f64) -> f64 {
    let mut step = COARSEST_QUANTUM;
    while step > FINEST_QUANTUM && step * MIN_QUANTA_PER_TOLERANCE > tolerance {
        step *= 0.5;
    }
    step
}

impl Spectrum {
    /// The spectrum with positions rounded as by the file: those of trajectories to the [`quantum`], those of events to
    /// [`FINEST_QUANTUM`]. Idempotent.
    pub fn quantised(mut self) -> Spectrum {
        let step = quantum(self.tolerance());
        // Every `f32` that a multiple of the step cannot be is larger than any coordinate, or a multiple itself.
        let rounded = |x: f32| ((f64::from(x) / step).round() * step) as f32;
        for knot in &mut self.patch_mut().knots {
            knot.position = knot.position.map(rounded);
        }
        for event in &mut self.about_mut().events {
            event.position = event.position.map(|x| (x / FINEST_QUANTUM).round() * FINEST_QUANTUM);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_faces_the_axis_of_most_of_its_normals() {
        assert_eq!(facing([]), 0);
        assert_eq!(facing([DVec3::new(0.2, -0.9, 0.1)]), 1);
        let turning = [[0.0, 0.6, 0.8], [0.0, -0.8, 0.6], [0.1, 0.9, 0.2]];
        assert_eq!(facing(turning.map(DVec3::from)), 1);
    }

    #[test]
    fn rounding_along_the_surface_stays_in_the_tangent_plane() {
        for i in 0..200 {
            let t = f64::from(i);
            let (s, c) = (1.3 * t).sin_cos();
            let n = DVec3::new(0.6 * s, 0.6 * c, 0.8);
            let exact = 64.0 * DVec3::new(0.137 * t, 20.0 - 0.071 * t, 3.0 + s);
            let position = rounded_along(exact, n, 2);
            assert!((position.x / 4.0).fract() == 0.0 && (position.y / 4.0).fract() == 0.0);
            let moved = position - exact;
            assert!(moved.x.abs() <= 2.0 && moved.y.abs() <= 2.0, "{moved}");
            // Half a unit along the axis.
            let across = moved.dot(n);
            assert!(across.abs() <= 0.5 * 0.8 + 1e-9, "{across} units off the surface");
        }
    }

    #[test]
    fn quanta_are_powers_of_two_and_at_most_a_twelfth_of_the_tolerance() {
        assert_eq!(quantum(0.1), 1.0 / 128.0);
        assert_eq!(quantum(0.4), 1.0 / 32.0);
        assert_eq!([10.0, 1e-9, 0.0].map(quantum), [1.0 / 32.0, 1.0 / 1024.0, 1.0 / 1024.0]);
        for i in 20..200 {
            let tolerance = f64::from(i) * 2e-3;
            let step = quantum(tolerance);
            assert!(step.log2().fract() == 0.0 && 12.0 * step <= tolerance, "{tolerance}");
            assert!(24.0 * step > tolerance || step == COARSEST_QUANTUM, "{tolerance}");
        }
    }
}
