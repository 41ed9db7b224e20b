//! Settings for the removal of noise.

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::prepared::Noise;
use crate::volume::Volume;

/// A threshold of persistence: a difference of values, written as `1.5`, or a share of the volume's range, written as `5%`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Persistence {
    /// A difference of values of the field.
    Absolute(f64),
    /// A percentage of the range.
    Percent(f64),
}

impl Persistence {
    /// The difference of values, for a volume with values in the range.
    pub fn resolve(self, (low, high): (f64, f64)) -> f64 {
        match self {
            Persistence::Absolute(value) => value,
            Persistence::Percent(percent) => (high - low) * (percent / 100.0),
        }
    }
}

impl FromStr for Persistence {
    type Err = Error;

    /// Parses a number above 0 with or without a percent sign.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let (digits, is_percent) = match text.trim().strip_suffix('%') {
            Some(digits) => (digits, true),
            None => (text, false),
        };
        let value = digits.trim().parse().ok().filter(|&x: &f64| x.is_finite() && x > 0.0);
        let value = value.ok_or_else(|| {
            Error::Usage(format!("'{text}', expected a number above 0 or a percentage such as 5%"))
        })?;
        Ok(if is_percent { Persistence::Percent(value) } else { Persistence::Absolute(value) })
    }
}

/// Settings for the removal of noise from a prepared volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoiseSettings {
    /// Persistence below which minima and maxima are removed.
    pub persistence: Option<Persistence>,
    /// Number of samples below which components and cavities are removed.
    pub min_component: Option<u32>,
}

impl NoiseSettings {
    /// True if no noise is removed.
    pub fn is_none(&self) -> bool {
        *self == NoiseSettings::default()
    }

    /// The settings in values of a prepared volume. Percentages refer to its range before any noise is removed.
    pub fn resolve(&self, volume: &Volume) -> Noise {
        let persistence = self.persistence.map(|p| p.resolve(volume.range()));
        Noise { persistence, min_component: self.min_component }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_persistence_is_a_value_or_a_percentage_of_the_range() {
        let of = |text: &str| text.parse::<Persistence>().map(|p| p.resolve((-10.0, 30.0))).ok();
        assert_eq!(of("1.5"), Some(1.5));
        assert_eq!(of("5%"), Some(2.0));
        for wrong in ["", "%", "0", "-1", "-5%", "nan", "inf", "much"] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }
}
