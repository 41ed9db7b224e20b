//! Rounds positions of a spectrum to the units of a page: along the surface to coarser ones than across it, as a sweep does
//! (`spectrum/quantise.rs`).

use glam::DVec3;

use super::samples::Samples;
use super::units::Units;
use crate::error::{Error, Result};
use crate::spectrum::{Knot, MAX_COORDINATE, Normals, Spectrum, facing, normal, rounded_along};

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
                let axis = facing(normals.iter().copied());
                let round = |(knot, &n)| rounded_along(self.position(knot), n, axis);
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
}
