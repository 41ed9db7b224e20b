//! Rounds positions of a spectrum: along the surface to coarser units than across it.
//!
//! # Theory
//!
//! A vertex that moves along the surface leaves the surface as it is, and most of the bits of
//! a position say where along the surface it is. So a vertex *faces* the axis that
//! its normal is nearest to; its coordinate there is counted in units, the other two in multiples of `along` units.
//! Where these are rounded, the vertex moves in its tangent plane. In a file `along` is 1.

use glam::DVec3;

use super::samples::Samples;
use super::units::Units;
use crate::error::{Error, Result};
use crate::spectrum::{Knot, MAX_COORDINATE, Normals, Spectrum, normal};

impl Units {
    /// The spectrum with positions rounded to these units, so that [`Units::of`] returns them exactly.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if a coordinate has too many units.
    pub(crate) fn rounded(self, spectrum: &Spectrum) -> Result<Spectrum> {
        let (about, mut rounded) = spectrum.clone().into_parts();
        let normals = Normals::of(spectrum);
        let samples = Samples::new(spectrum.volume(), self);
        for v in 0..spectrum.n_vertices() as u32 {
            let trajectory = spectrum.trajectory(v);
            let mut positions: Vec<DVec3> =
                trajectory.iter().map(|k| self.position(k).round()).collect();
            let is_lattice = match positions.as_slice() {
                [start, end] => {
                    let integers = |p: &DVec3| p.to_array().map(|x| x as i32);
                    samples.edge_between([integers(start), integers(end)]).is_some()
                }
                _ => false,
            };
            let first = spectrum.first_knot()[v as usize] as usize;
            if !is_lattice {
                let codes = &normals.codes()[first..first + trajectory.len()];
                let normals: Vec<DVec3> =
                    codes.iter().map(|&n| DVec3::from(normal::decode(n).map(f64::from))).collect();
                let axis = axis_of(&normals);
                let round = |(knot, &n)| self.rounded_along(self.position(knot), n, axis);
                positions = trajectory.iter().zip(&normals).map(round).collect();
            }
            for (knot, position) in rounded.knots[first..].iter_mut().zip(positions) {
                knot.position = (position / self.stored).to_array().map(|x| x as f32);
                if position.abs().max_element() / self.stored > f64::from(MAX_COORDINATE) {
                    let (step, position) = (1.0 / self.per_voxel, position / self.per_voxel);
                    return Err(Error::Usage(format!(
                        "a step of {step} voxels is too small for positions as far as {position}"
                    )));
                }
            }
        }
        Ok(Spectrum::unchecked(about, rounded))
    }

    /// The position of a knot in units, not rounded.
    fn position(self, knot: &Knot) -> DVec3 {
        DVec3::from(knot.position.map(f64::from)) * self.per_voxel
    }

    /// A position rounded along the surface, for a vertex with normal `n` that faces an axis.
    fn rounded_along(self, exact: DVec3, n: DVec3, axis: usize) -> DVec3 {
        let along = self.along as f64;
        let mut position = (exact / along).round() * along;
        let mut moved = position - exact;
        moved[axis] = 0.0;
        // Back into the tangent plane, unless the normal of this knot is far from the axis.
        let back = (-moved.dot(n) / n[axis]).clamp(-along, along);
        position[axis] = (exact[axis] + if back.is_finite() { back } else { 0.0 }).round();
        position
    }
}

/// The axis of the largest component of normals, ignoring signs.
fn axis_of(normals: &[DVec3]) -> usize {
    let sum: DVec3 = normals.iter().map(|n| n.abs()).sum();
    sum.max_position()
}

#[cfg(test)]
mod tests {
    use super::super::units::STORED_OF_PAGE;
    use super::*;

    const PAGE: Units = Units { per_voxel: 64.0, along: 4, stored: STORED_OF_PAGE };

    #[test]
    fn a_vertex_faces_the_axis_of_most_of_its_normals() {
        assert_eq!(axis_of(&[]), 0);
        assert_eq!(axis_of(&[DVec3::new(0.2, -0.9, 0.1)]), 1);
        let turning = [[0.0, 0.6, 0.8], [0.0, -0.8, 0.6], [0.1, 0.9, 0.2]];
        assert_eq!(axis_of(&turning.map(DVec3::from)), 1);
    }

    #[test]
    fn rounding_along_the_surface_stays_in_the_tangent_plane() {
        for i in 0..200 {
            let t = f64::from(i);
            let (s, c) = (1.3 * t).sin_cos();
            let n = DVec3::new(0.6 * s, 0.6 * c, 0.8);
            let exact = 64.0 * DVec3::new(0.137 * t, 20.0 - 0.071 * t, 3.0 + s);
            let position = PAGE.rounded_along(exact, n, 2);
            assert!((position.x / 4.0).fract() == 0.0 && (position.y / 4.0).fract() == 0.0);
            let moved = position - exact;
            assert!(moved.x.abs() <= 2.0 && moved.y.abs() <= 2.0, "{moved}");
            // Half a unit along the axis.
            let across = moved.dot(n);
            assert!(across.abs() <= 0.5 * 0.8 + 1e-9, "{across} units off the surface");
            let position = position.to_array().map(|x| x as i32);
            assert!([0, 1, 2].contains(&PAGE.facing(&[position])));
            assert_eq!(PAGE.facing(&[position, [256, 256, 1]]), 2);
        }
    }
}
