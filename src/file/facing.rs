//! What positions are counted in: along the surface in coarser units than across it.
//!
//! # Theory
//!
//! A vertex that lies a little elsewhere on the surface leaves the surface as it is, and most of what
//! tells a position is where along the surface it lies. So a vertex has an axis that it *faces*, the one that
//! its normal is nearest to; its coordinate there is counted in units, the other two in `along` units each.
//! Where these are rounded, the vertex moves in its tangent plane. A file has `along` 1.

use glam::DVec3;

use super::LAST_WITHOUT_STATIONS;
use super::samples::Samples;
use crate::error::{Error, Result};
use crate::spectrum::{FINEST_QUANTUM, Knot, MAX_COORDINATE, Normals, Spectrum, normal, quantum};

/// What positions are counted in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Units {
    /// Units of a position per voxel.
    pub(super) per_voxel: f64,
    /// Units in one of a coordinate along the surface.
    pub(super) along: i64,
    /// Units in 1 of a coordinate of a spectrum that is rounded to them.
    stored: f64,
}

/// Units in 1 of a coordinate where a spectrum is rounded for a page, whatever they are: as many can be told from each other
/// wherever a coordinate may be.
const STORED_OF_PAGE: f64 = 256.0;

impl Units {
    /// Those of a file of a version, of a spectrum of a tolerance, voxels.
    pub(super) fn of_file(version: u32, tolerance: f64) -> Units {
        let is_old = version <= LAST_WITHOUT_STATIONS;
        let per_voxel = 1.0 / if is_old { FINEST_QUANTUM } else { quantum(tolerance) };
        Units { per_voxel, along: 1, stored: per_voxel }
    }

    /// Units of a `step`, voxels, and `along` of them along the surface.
    pub(crate) fn of_page(step: f64, along: i64) -> Units {
        Units { per_voxel: 1.0 / step, along, stored: STORED_OF_PAGE }
    }

    /// Where a knot of a spectrum that is rounded to them lies.
    pub(super) fn of(self, knot: &Knot) -> [i32; 3] {
        knot.position.map(|x| self.of_coordinate(x))
    }

    /// How many units a coordinate is.
    pub(super) fn of_coordinate(self, x: f32) -> i32 {
        (f64::from(x) * self.stored).round() as i32
    }

    /// The coordinate of so many units.
    pub(super) fn coordinate(self, x: i32) -> f32 {
        (f64::from(x) / self.stored) as f32
    }

    /// Whether it makes a difference what a vertex faces.
    pub(super) fn has_facing(self) -> bool {
        self.along > 1
    }

    /// The spectrum with positions rounded to these units, as [`Units::of`] finds them.
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
            let mut places: Vec<DVec3> = trajectory.iter().map(|k| self.place(k).round()).collect();
            let is_lattice = match places.as_slice() {
                [start, end] => {
                    let place = |p: &DVec3| p.to_array().map(|x| x as i32);
                    samples.way_of([place(start), place(end)]).is_some()
                }
                _ => false,
            };
            let first = spectrum.first_knot()[v as usize] as usize;
            if !is_lattice {
                let codes = &normals.codes()[first..first + trajectory.len()];
                let normals: Vec<DVec3> =
                    codes.iter().map(|&n| DVec3::from(normal::decode(n).map(f64::from))).collect();
                let axis = axis_of(&normals);
                let along = |(knot, &n)| self.rounded_along(self.place(knot), n, axis);
                places = trajectory.iter().zip(&normals).map(along).collect();
            }
            for (knot, place) in rounded.knots[first..].iter_mut().zip(places) {
                knot.position = (place / self.stored).to_array().map(|x| x as f32);
                if place.abs().max_element() / self.stored > f64::from(MAX_COORDINATE) {
                    let (step, place) = (1.0 / self.per_voxel, place / self.per_voxel);
                    return Err(Error::Usage(format!(
                        "step of {step} voxels, expected more: at {place} there are too many"
                    )));
                }
            }
        }
        Ok(Spectrum::unchecked(about, rounded))
    }

    /// Where a knot lies, units.
    fn place(self, knot: &Knot) -> DVec3 {
        DVec3::from(knot.position.map(f64::from)) * self.per_voxel
    }

    /// A place rounded along the surface whose normal is `n`, for a vertex that faces an axis.
    fn rounded_along(self, exact: DVec3, n: DVec3, axis: usize) -> DVec3 {
        let along = self.along as f64;
        let mut place = (exact / along).round() * along;
        let mut off = place - exact;
        off[axis] = 0.0;
        // Back into the tangent plane, unless the normal has turned away from the axis since.
        let back = (-off.dot(n) / n[axis]).clamp(-along, along);
        place[axis] = (exact[axis] + if back.is_finite() { back } else { 0.0 }).round();
        place
    }

    /// The axis that a vertex with rounded positions faces: the first one beside which they are whole in both
    /// others.
    pub(super) fn facing(self, trajectory: &[Knot]) -> usize {
        let is_whole = |knot: &Knot, a: usize| i64::from(self.of(knot)[a % 3]) % self.along == 0;
        let faces = |&a: &usize| {
            trajectory.iter().all(|knot| is_whole(knot, a + 1) && is_whole(knot, a + 2))
        };
        (0..3).find(faces).unwrap_or(0)
    }
}

/// The axis of the largest component of normals, ignoring signs.
fn axis_of(normals: &[DVec3]) -> usize {
    let sum: DVec3 = normals.iter().map(|n| n.abs()).sum();
    sum.max_position()
}

#[cfg(test)]
mod tests {
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
            let place = PAGE.rounded_along(exact, n, 2);
            assert!((place.x / 4.0).fract() == 0.0 && (place.y / 4.0).fract() == 0.0);
            let off = place - exact;
            assert!(off.x.abs() <= 2.0 && off.y.abs() <= 2.0, "{off}");
            // Half a unit along the axis.
            let across = off.dot(n);
            assert!(across.abs() <= 0.5 * 0.8 + 1e-9, "{across} units off the surface");
            let knot = Knot { rank: 0, position: (place / STORED_OF_PAGE).as_vec3().to_array() };
            assert!([0, 1, 2].contains(&PAGE.facing(&[knot])));
            let other = Knot { position: [1.0, 1.0, 1.0 / STORED_OF_PAGE as f32], ..knot };
            assert_eq!(PAGE.facing(&[knot, other]), 2);
        }
    }
}
