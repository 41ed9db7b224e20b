//! Ranges of isovalues.

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::volume::{Isovalue, Statistics};

/// A range of isovalues, written as `LOW:HIGH`; each end is an [`Isovalue`].
///
/// ```
/// use isospectrum::settings::IsovalueRange;
///
/// let range: IsovalueRange = "10%:50%".parse()?;
/// assert_eq!(range.resolve((0.0, 200.0), None)?, (20.0, 100.0));
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsovalueRange {
    /// The lower end.
    pub low: Isovalue,
    /// The upper end.
    pub high: Isovalue,
}

impl IsovalueRange {
    /// The two ends as numbers, for a volume with values in `range`.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if the lower end is not below the upper one, or an end needs the statistics of the samples and they are
    /// unknown.
    pub fn resolve(self, range: (f64, f64), samples: Option<&Statistics>) -> Result<(f64, f64)> {
        let (low, high) = (self.low.resolve(range, samples)?, self.high.resolve(range, samples)?);
        if low < high {
            return Ok((low, high));
        }
        Err(Error::Usage(format!("range {low}:{high}, expected the lower isovalue first")))
    }
}

impl FromStr for IsovalueRange {
    type Err = Error;

    /// Parses `LOW:HIGH`.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let ends = split_at_colons(text);
        let [low, high] = ends[..] else {
            return Err(Error::Usage(format!("'{text}', expected LOW:HIGH")));
        };
        Ok(IsovalueRange { low: low.parse()?, high: high.parse()? })
    }
}

/// The parts of a text between its colons; the colon of `top:1%` does not count.
pub fn split_at_colons(text: &str) -> Vec<&str> {
    let separates = |&at: &usize| !text[..at].trim_end().to_ascii_lowercase().ends_with("top");
    let mut parts = Vec::new();
    let mut from = 0;
    for at in text.match_indices(':').map(|(at, _)| at).filter(separates) {
        parts.push(&text[from..at]);
        from = at + 1;
    }
    parts.push(&text[from..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_has_a_lower_and_a_higher_end() {
        let of = |text: &str| {
            text.parse::<IsovalueRange>().map(|r| r.resolve((0.0, 200.0), None).ok()).ok()
        };
        assert_eq!(of("-5:5"), Some(Some((-5.0, 5.0))));
        assert_eq!(of("10%:50%"), Some(Some((20.0, 100.0))));
        assert_eq!(of("5:5"), Some(None));
        assert_eq!(of("5"), None);
        let ends: IsovalueRange = "top:5%:top:1%".parse().expect("a range");
        assert_eq!((ends.low, ends.high), (Isovalue::Percentile(95.0), Isovalue::Percentile(99.0)));
        assert_eq!(of("p1:p99"), Some(None), "the samples are unknown");
    }
}
