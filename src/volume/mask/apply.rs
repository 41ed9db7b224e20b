//! Applies a mask to a volume: surfaces end where it ends.
//!
//! # Theory
//!
//! If all samples outside a mask were low, the isosurface would include a wall at the end of the mask. Here the samples of
//! the cells in which the mask ends keep their values, so the isosurface of the volume continues for a cell beyond the mask.
//! Farther away samples fall with the distance to the lowest value (or rise to the highest, depending on the layer around
//! the volume), which closes the surface. The part of the surface that is nearer to a sample outside the mask than to one
//! inside can then be left out, like caps ([`Volume::is_masked_out`]).
//!
//! Samples fall over several voxels because a staircase cannot be tracked: with a fall over one cell, 22 % of the area of
//! nucleon, cut by an oblique plane, was tracked.
//!
//! # Invariants
//!
//! The samples inside do not change, and their range becomes that of the volume. Memory: 2 bytes per sample.

use num_traits::AsPrimitive;

use super::Mask;
use crate::error::{Error, Result};
use crate::volume::grid::{Outside, Volume};
use crate::volume::placement::{Space, Unit};
use crate::volume::samples::{Samples, with_samples};

/// Distance to a sample inside, in samples, up to which samples keep their values: the diagonal of a cell, so all corners
/// of the cells in which the mask ends.
const KEPT_DISTANCE: f64 = 1.7321;

/// Distance to the mask, in samples, from which on all samples have the value of the layer's side.
const FALL_DISTANCE: usize = 6;

/// Largest distance in voxels between a corner of a mask and that of its volume, where both have a position.
const MAX_OFFSET: f64 = 0.5;

impl Mask {
    /// The mask of the samples of a volume that are not zero.
    pub fn of(volume: &Volume) -> Mask {
        let n = volume.samples().len();
        let inside = (0..n).map(|i| volume.samples().get(i) != 0.0).collect();
        Mask { name: volume.name().to_owned(), dims: volume.dims(), inside }
    }

    /// Checks that a mask fits a volume: the same dimensions, and the same placement if both have one.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if it does not.
    pub fn check(mask: &Volume, volume: &Volume) -> Result<()> {
        check_dims(mask.name(), mask.dims(), volume)?;
        let (own, other) = (mask.placement(), volume.placement());
        if [own, other].iter().any(|p| p.space == Space::Unknown || p.unit == Unit::Unknown) {
            return Ok(());
        }
        // Both in millimetres.
        let side = if own.space == other.space { 1.0 } else { -1.0 };
        let offsets = mask.corners().into_iter().zip(volume.corners()).map(|(p, q)| {
            let [x, y, z] = [side * p[0] - q[0], side * p[1] - q[1], p[2] - q[2]];
            (x * x + y * y + z * z).sqrt()
        });
        let offset = offsets.fold(0.0, f64::max) / other.voxel();
        if offset > MAX_OFFSET {
            return Err(Error::input(format!(
                "{}: the mask is up to {offset:.1} voxels away from {}, expected the same placement",
                mask.name(),
                volume.name()
            )));
        }
        Ok(())
    }

    /// Per sample the squared distance to the nearest one inside, in samples, at most [`FALL_DISTANCE`]^2.
    fn squared_distances(&self) -> Vec<u8> {
        let far = (FALL_DISTANCE * FALL_DISTANCE) as u8;
        let mut squares: Vec<u8> = self.inside.iter().map(|&i| if i { 0 } else { far }).collect();
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        // A squared distance is the sum of those along the axes.
        for (stride, n) in strides.into_iter().zip(self.dims) {
            let before = squares.clone();
            for (i, square) in squares.iter_mut().enumerate().filter(|(_, square)| **square > 0) {
                let at = i / stride % n;
                for d in 1..FALL_DISTANCE {
                    let along = (d * d) as u8;
                    if along >= *square {
                        break;
                    }
                    let down = (at >= d).then(|| before[i - d * stride]);
                    let up = (at + d < n).then(|| before[i + d * stride]);
                    let nearest = down.into_iter().chain(up).min().unwrap_or(far);
                    *square = (*square).min(along.saturating_add(nearest));
                }
            }
        }
        squares
    }

    /// Applies the mask to a volume, see the module.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if no sample is inside, and those of [`Volume::new`] for the new samples.
    pub(in crate::volume) fn apply_to(self, volume: &Volume) -> Result<Volume> {
        if self.n_inside() == 0 {
            let (mask, volume) = (&self.name, volume.name());
            return Err(Error::input(format!("{mask}: no sample of {volume} is inside the mask")));
        }
        let squares = self.squared_distances();
        let is_low = volume.outside() == Outside::Low;
        let share = |square: u8| match f64::from(square).sqrt() {
            d if d <= KEPT_DISTANCE => 1.0,
            d => ((FALL_DISTANCE as f64 - d) / (FALL_DISTANCE as f64 - KEPT_DISTANCE)).max(0.0),
        };
        let shares: Vec<f64> = (0..=(FALL_DISTANCE * FALL_DISTANCE) as u8).map(share).collect();
        let samples = with_samples!(volume.samples(), all => {
            let inside = all.iter().zip(&self.inside).filter(|(_, inside)| **inside);
            let (low, high) = range_of(inside.map(|(&v, _)| v)).unwrap_or((all[0], all[0]));
            let masked = all.iter().zip(&squares).map(|(&v, &square)| {
                let v = if v < low { low } else if v > high { high } else { v };
                interpolate(v, if is_low { low } else { high }, shares[usize::from(square)])
            });
            Samples::from(masked.collect::<Vec<_>>())
        });
        Ok(volume.with_samples(samples)?.with_mask(self))
    }
}

/// Smallest and largest of some numbers.
fn range_of<T: Copy + PartialOrd>(mut values: impl Iterator<Item = T>) -> Option<(T, T)> {
    let first = values.next()?;
    Some(values.fold((first, first), |(low, high), v| {
        (if v < low { v } else { low }, if v > high { v } else { high })
    }))
}

/// Interpolates from an end of the range to a sample.
fn interpolate<T: Copy + AsPrimitive<f64>>(sample: T, end: T, share: f64) -> T
where
    f64: AsPrimitive<T>,
{
    if share == 1.0 {
        return sample;
    }
    let (from, to): (f64, f64) = (end.as_(), sample.as_());
    (from + share * (to - from)).as_()
}

/// Checks that mask and volume have the same dimensions.
pub(super) fn check_dims(name: &str, dims: [usize; 3], volume: &Volume) -> Result<()> {
    if dims == volume.dims() {
        return Ok(());
    }
    let shown = |[x, y, z]: [usize; 3]| format!("{x}x{y}x{z}");
    let (found, expected) = (shown(dims), shown(volume.dims()));
    let volume = volume.name();
    Err(Error::input(format!(
        "{name}: a mask of {found} samples, expected {expected} as {volume} has"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Placement;

    fn volume(dims: [usize; 3], samples: Vec<u8>) -> Volume {
        Volume::new("v", dims, Samples::U8(samples), Placement::default()).expect("a volume")
    }

    /// A grid with one sample that is not zero.
    fn one_inside(dims: [usize; 3], at: usize) -> Mask {
        let mut samples = vec![0; dims.iter().product()];
        samples[at] = 3;
        Mask::of(&volume(dims, samples))
    }

    #[test]
    fn samples_next_to_the_mask_stay_in_the_range_of_those_inside_and_fall_farther_out() {
        let dims = [16, 3, 3];
        let given = volume(dims, (0..144).map(|i| (10 * (i % 16)) as u8).collect());
        let inside = (0..144).map(|i| u8::from((3..6).contains(&(i % 16)))).collect();
        let mask = Mask::of(&volume(dims, inside));
        let row = |outside| {
            let given = given.clone().with_outside(outside);
            let laid = mask.clone().apply_to(&given).expect("a volume");
            assert_eq!(laid.range(), (30.0, 50.0));
            assert!(laid.is_masked_out([2.4, 1.0, 1.0]) && !laid.is_masked_out([2.6, 1.0, 1.0]));
            (0..16).map(|x| laid.sample(x, 1, 1)).collect::<Vec<_>>()
        };
        let low = row(Outside::Low);
        assert_eq!(low[..7], [30.0, 30.0, 30.0, 30.0, 40.0, 50.0, 50.0]);
        assert!(low[6..12].windows(2).all(|w| w[0] > w[1]), "{low:?}");
        assert_eq!(low[11..], [30.0; 5]);
        let high = row(Outside::High);
        assert_eq!((high[2], high[3], high[4], high[15]), (30.0, 30.0, 40.0, 50.0));
        assert!(high[..3].windows(2).all(|w| w[0] > w[1]), "{high:?}");
    }

    #[test]
    fn distances_are_those_to_the_nearest_sample_inside() {
        let dims = [9, 8, 7];
        let mask = one_inside(dims, 2 + 9 * (3 + 8 * 5));
        for (i, square) in mask.squared_distances().into_iter().enumerate() {
            let [x, y, z] = [i % 9, i / 9 % 8, i / 72].map(|x| x as i64);
            let expected = (x - 2).pow(2) + (y - 3).pow(2) + (z - 5).pow(2);
            assert_eq!(i64::from(square), expected.min(36), "{x}, {y}, {z}");
        }
    }

    #[test]
    fn a_mask_with_another_placement_is_rejected() {
        let at = |origin, space| {
            let placement = Placement { origin, space, unit: Unit::Mm, ..Placement::default() };
            let samples = Samples::U8((0..8).collect());
            Volume::new("v", [2; 3], samples, placement).expect("a volume")
        };
        let given = at([5.0, 6.0, 7.0], Space::Lps);
        assert!(Mask::check(&at([5.0, 6.3, 7.0], Space::Lps), &given).is_ok());
        assert!(Mask::check(&at([5.0, 6.6, 7.0], Space::Lps), &given).is_err());
        assert!(Mask::check(&at([0.0; 3], Space::Unknown), &given).is_ok());
        // RAS: x and y the other way round, and so are the axes of this one.
        let mut turned = *at([-5.0, -6.0, 7.0], Space::Ras).placement();
        turned.direction[0][0] = -1.0;
        turned.direction[1][1] = -1.0;
        let samples = Samples::U8((0..8).collect());
        let turned = Volume::new("v", [2; 3], samples, turned).expect("a volume");
        assert!(Mask::check(&turned, &given).is_ok());
        assert!(Mask::check(&at([-5.0, -6.0, 7.0], Space::Ras), &given).is_err());
    }

    #[test]
    fn regions_and_blocks_of_a_mask() {
        let mask = one_inside([6, 4, 4], 1 + 6 * (2 + 4 * 3));
        let part = mask.cropped([[1, 6], [2, 4], [2, 4]]);
        assert_eq!((part.dims(), part.n_inside()), ([5, 2, 2], 1));
        assert!(part.is_inside(5 * 2));
        assert_eq!(mask.downsampled(2).n_inside(), 0);
        let all = Mask { inside: vec![true; 96], ..mask };
        assert_eq!(all.downsampled(2).n_inside(), 12);
        let none = Mask { inside: vec![false; 12], dims: [3, 2, 2], ..all };
        assert!(none.apply_to(&volume([3, 2, 2], (0..12).collect())).is_err());
    }
}
