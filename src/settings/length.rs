//! Lengths with and without a unit.

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::volume::{Placement, Unit};

/// A number of samples or voxels, written as `2`, or a length, written as `1.5mm`.
///
/// ```
/// use isospectrum::settings::Length;
/// use isospectrum::volume::{Placement, Unit};
///
/// let placement = Placement { spacing: [0.5, 1.0, 2.0], unit: Unit::Mm, ..Placement::default() };
/// // Steps of 0.5 in the unit of the volume.
/// assert_eq!("2000um".parse::<Length>()?.in_steps(&placement, 0.5)?, 4.0);
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    /// The number, 0 or above.
    pub value: f64,
    /// The unit; `None` for samples or voxels.
    pub unit: Option<Unit>,
}

impl Length {
    /// The length in steps of `step`, which is in the unit of the volume; the number itself if it has no unit.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a length with a unit if the unit of the volume is unknown.
    pub fn in_steps(self, placement: &Placement, step: f64) -> Result<f64> {
        let Some(unit) = self.unit else { return Ok(self.value) };
        let (Some(own), Some(mm)) = (placement.unit.in_mm(), unit.in_mm()) else {
            return Err(Error::Usage(format!(
                "a length in {unit}, but the volume has no unit, expected a number without one"
            )));
        };
        Ok(self.value * mm / (own * step))
    }
}

impl FromStr for Length {
    type Err = Error;

    /// Parses a number and an optional unit.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a negative number, an unknown unit and any other text.
    fn from_str(text: &str) -> Result<Self> {
        let digits = text.trim_end().trim_end_matches(|c: char| c.is_alphabetic());
        let unit = match text[digits.len()..].trim() {
            "" => None,
            name => Some(Unit::from_name(name).ok_or_else(|| {
                Error::Usage(format!("'{text}', expected a unit such as mm, um or angstrom"))
            })?),
        };
        let value = digits.trim().parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0);
        let value = value.ok_or_else(|| {
            Error::Usage(format!("'{text}', expected a number of at least 0 such as 1.5 or 2mm"))
        })?;
        Ok(Length { value, unit })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_need_a_volume_with_a_unit() {
        let mm = Placement { unit: Unit::Mm, ..Placement::default() };
        let length: Length = "2mm".parse().expect("a length");
        assert_eq!(length.in_steps(&mm, 0.5).expect("mm"), 4.0);
        assert!(matches!(length.in_steps(&Placement::default(), 1.0), Err(Error::Usage(_))));
        assert_eq!("1.5".parse().ok(), Some(Length { value: 1.5, unit: None }));
        for wrong in ["", "mm", "-1", "nan", "1 parsec"] {
            assert!(wrong.parse::<Length>().is_err(), "{wrong}");
        }
    }
}
