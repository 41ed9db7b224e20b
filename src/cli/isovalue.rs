//! How isovalues are written on the command line: a number, or a percentage of the range.

use std::str::FromStr;

/// An isovalue as it was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Isovalue {
    /// A value of the field.
    Absolute(f64),
    /// `50%`: that share of the way from the low to the high end of the range.
    Percent(f64),
}

impl Isovalue {
    /// The value of the field this means in a range.
    pub(super) fn in_range(self, (low, high): (f64, f64)) -> f64 {
        match self {
            Isovalue::Absolute(value) => value,
            // Weighted, so that 0% and 100% are the ends exactly.
            Isovalue::Percent(percent) => low * (1.0 - percent / 100.0) + high * (percent / 100.0),
        }
    }
}

impl FromStr for Isovalue {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("'{text}', expected a number or a percentage such as 50%");
        let (digits, percent) = match text.strip_suffix('%') {
            Some(digits) => (digits, true),
            None => (text, false),
        };
        let value: f64 = digits.trim().parse().map_err(|_| expected())?;
        if !value.is_finite() {
            return Err(expected());
        }
        Ok(if percent { Isovalue::Percent(value) } else { Isovalue::Absolute(value) })
    }
}

/// `LO:HI`, each an [`Isovalue`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct IsovalueRange {
    low: Isovalue,
    high: Isovalue,
}

impl IsovalueRange {
    /// The two values of the field this means in a volume's range.
    ///
    /// # Errors
    ///
    /// Usage, where nothing lies between them.
    pub(super) fn in_range(self, range: (f64, f64)) -> isospectrum::Result<(f64, f64)> {
        let (low, high) = (self.low.in_range(range), self.high.in_range(range));
        if low < high {
            return Ok((low, high));
        }
        Err(isospectrum::Error::Usage(format!(
            "--range {low}:{high}, expected the lower isovalue first"
        )))
    }
}

impl FromStr for IsovalueRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (low, high) =
            text.split_once(':').ok_or_else(|| format!("'{text}', expected LOW:HIGH"))?;
        Ok(IsovalueRange { low: low.parse()?, high: high.parse()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn isovalues_are_numbers_or_percentages() {
        let at = |text: &str| text.parse::<Isovalue>().map(|c| c.in_range((-10.0, 30.0)));
        assert_eq!(at("-1.5e1"), Ok(-15.0));
        assert_eq!(at("50%"), Ok(10.0));
        assert_eq!(at("0%"), Ok(-10.0));
        assert_eq!(at("100%"), Ok(30.0));
        for wrong in ["", "%", "half", "nan", "inf", "1:2"] {
            assert!(at(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_range_has_a_lower_and_a_higher_end() {
        let of = |text: &str| text.parse::<IsovalueRange>().map(|r| r.in_range((0.0, 200.0)).ok());
        assert_eq!(of("-5:5"), Ok(Some((-5.0, 5.0))));
        assert_eq!(of("10%:50%"), Ok(Some((20.0, 100.0))));
        assert_eq!(of("5:5"), Ok(None));
        assert!(of("5").is_err());
    }
}
