//! Ranges of isovalues on the command line, and what is known of the samples where isovalues are written by them.

use std::str::FromStr;

use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Statistics;

pub(super) use isospectrum::volume::Isovalue;

/// The isovalue that is meant in a spectrum.
///
/// # Errors
///
/// Usage, where it needs the samples and the spectrum tells nothing of them.
pub(super) fn in_spectrum(written: Isovalue, spectrum: &Spectrum) -> isospectrum::Result<f64> {
    written.resolve(spectrum.range(), spectrum.statistics().as_ref())
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
    /// Usage, where nothing lies between them, or the samples are needed and not known.
    pub(super) fn resolve(
        self,
        range: (f64, f64),
        samples: Option<&Statistics>,
    ) -> isospectrum::Result<(f64, f64)> {
        let (low, high) = (self.low.resolve(range, samples)?, self.high.resolve(range, samples)?);
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
        let expected = || format!("'{text}', expected LOW:HIGH");
        let parse = |end: &str| end.parse().map_err(|error: isospectrum::Error| error.to_string());
        let parts = parts_of(text);
        let [low, high] = parts[..] else { return Err(expected()) };
        Ok(IsovalueRange { low: parse(low)?, high: parse(high)? })
    }
}

/// The parts of a text between its colons; `top:1%` has one of its own.
pub(super) fn parts_of(text: &str) -> Vec<&str> {
    let is_between = |&at: &usize| !text[..at].trim_end().to_ascii_lowercase().ends_with("top");
    let mut parts = Vec::new();
    let mut from = 0;
    for at in text.match_indices(':').map(|(at, _)| at).filter(is_between) {
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
        let of =
            |text: &str| text.parse::<IsovalueRange>().map(|r| r.resolve((0.0, 200.0), None).ok());
        assert_eq!(of("-5:5"), Ok(Some((-5.0, 5.0))));
        assert_eq!(of("10%:50%"), Ok(Some((20.0, 100.0))));
        assert_eq!(of("5:5"), Ok(None));
        assert!(of("5").is_err());
        let ends = "top:5%:top:1%".parse().map(|r: IsovalueRange| (r.low, r.high));
        assert_eq!(ends, Ok((Isovalue::Percentile(95.0), Isovalue::Percentile(99.0))));
        assert_eq!(of("p1:p99"), Ok(None), "the samples are not known");
    }
}
