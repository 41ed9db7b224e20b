//! Regions of a volume.

use std::str::FromStr;

use super::length::Length;
use crate::error::{Error, Result};
use crate::volume::Volume;

/// A part of an axis, written as `10:60`, `5:30mm`, `:60` or `:`. Numbers of samples are from the first up to, not including, the
/// last; lengths are measured from the first sample and include samples at both ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisRange {
    /// Where the part begins; `None` for the start of the axis.
    pub from: Option<Length>,
    /// Where the part ends; `None` for the end of the axis.
    pub to: Option<Length>,
}

impl AxisRange {
    fn is_valid(self) -> bool {
        let is_whole = |end: Length| end.unit.is_some() || end.value.fract() == 0.0;
        [self.from, self.to].into_iter().flatten().all(is_whole)
    }
}

impl FromStr for AxisRange {
    type Err = Error;

    /// Parses one axis.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let expected =
            || Error::Usage(format!("'{text}', expected a part such as 10:60 or 5:30mm"));
        let (from, to) = text.trim().split_once(':').ok_or_else(expected)?;
        let read = |text: &str| -> Result<Option<Length>> {
            if text.is_empty() { Ok(None) } else { text.parse().map(Some) }
        };
        let (mut from, to) = (read(from)?, read(to)?);
        // `10:60mm` is 10 mm to 60 mm.
        if let (Some(from), Some(to)) = (&mut from, to) {
            from.unit = from.unit.or(to.unit);
        }
        let range = AxisRange { from, to };
        if range.is_valid() { Ok(range) } else { Err(expected()) }
    }
}

/// A box of a volume, written as three parts along x, y, z: `10:60,:,0:25`.
///
/// ```
/// use isospectrum::settings::Region;
/// use isospectrum::volume::phantom;
///
/// let region: Region = "2:7,:,1:".parse()?;
/// assert_eq!(region.resolve(&phantom("sphere:8")?)?, [[2, 7], [0, 8], [1, 8]]);
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Region([AxisRange; 3]);

impl Region {
    /// A region from its parts along x, y, z.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a number of samples that is not whole.
    pub fn new(axes: [AxisRange; 3]) -> Result<Region> {
        if axes.iter().all(|axis| axis.is_valid()) {
            return Ok(Region(axes));
        }
        Err(Error::Usage("a region of fractions of samples, expected whole numbers".to_owned()))
    }

    /// For each axis of a volume the first sample and the one after the last; not checked against the dimensions.
    ///
    /// # Errors
    ///
    /// Those of [`Length::in_steps`].
    pub fn resolve(self, volume: &Volume) -> Result<[[usize; 2]; 3]> {
        let (placement, dims) = (volume.placement(), volume.dims());
        let mut region = [[0; 2]; 3];
        for (a, AxisRange { from, to }) in self.0.into_iter().enumerate() {
            let samples = |length: Length| length.in_steps(placement, placement.spacing[a]);
            let first = from.map(samples).transpose()?.map_or(0.0, f64::ceil);
            let end = match to {
                None => dims[a] as f64,
                Some(to) if to.unit.is_some() => (samples(to)?.floor() + 1.0).min(dims[a] as f64),
                Some(to) => to.value,
            };
            region[a] = [first as usize, end as usize];
        }
        Ok(region)
    }
}

impl FromStr for Region {
    type Err = Error;

    /// Parses three parts separated by commas.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let expected = || {
            Error::Usage(format!(
                "'{text}', expected three parts such as 10:60,:,0:25 or 5:30mm,:,:"
            ))
        };
        let parts: Vec<&str> = text.split(',').collect();
        let parts: [&str; 3] = parts.try_into().map_err(|_| expected())?;
        let mut axes = [AxisRange::default(); 3];
        for (axis, part) in axes.iter_mut().zip(parts) {
            *axis = part.parse()?;
        }
        Ok(Region(axes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Placement, Samples, Unit};

    #[test]
    fn regions_are_samples_or_lengths() {
        let placement =
            Placement { spacing: [0.5, 1.0, 2.0], unit: Unit::Mm, ..Placement::default() };
        let samples = Samples::U16((0..10 * 8 * 6).collect());
        let volume = Volume::new("v", [10, 8, 6], samples, placement).expect("a valid volume");
        let of = |text: &str| {
            let region: Region = text.parse().expect("a region");
            region.resolve(&volume).expect("a length")
        };
        assert_eq!(of("2:7,:,1:"), [[2, 7], [0, 8], [1, 6]]);
        // 1 mm to 3 mm: samples 2 to 6; 500 um to 3 mm: 1 to 3; up to 99 mm: all.
        assert_eq!(of("1:3mm,500um:3mm,:99mm"), [[2, 7], [1, 4], [0, 6]]);
        for wrong in ["", "1:2", "1,2,3", "a:2,:,:", "1.5:3,:,:", "1:2ft,:,:", "-1:3,:,:"] {
            assert!(wrong.parse::<Region>().is_err(), "{wrong}");
        }
        let half = Length { value: 1.5, unit: None };
        let axis = AxisRange { from: Some(half), to: None };
        assert!(Region::new([axis, AxisRange::default(), AxisRange::default()]).is_err());
    }
}
