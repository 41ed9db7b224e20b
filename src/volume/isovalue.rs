//! Isovalues as users write them: `37.2`, `50%` of the range, `p99` of the samples, `2.5sigma` above their mean, and
//! `top:1%`, which 1 % of the samples exceed. The page has the same rules (`page/isovalue.js`).

use std::str::FromStr;

use super::statistics::Statistics;
use crate::error::{Error, Result};

/// An isovalue as it was written.
///
/// ```
/// use isospectrum::Isovalue;
///
/// assert_eq!("50%".parse::<Isovalue>()?.resolve((0.0, 8.0), None)?, 4.0);
/// // A percentile needs the samples.
/// assert!("p99".parse::<Isovalue>()?.resolve((0.0, 8.0), None).is_err());
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Isovalue {
    /// A value of the field.
    Absolute(f64),
    /// `50%`: that share of the way from the low to the high end of the range.
    Percent(f64),
    /// `p99`: the value that 99 % of the samples do not exceed. `top:1%` is the same.
    Percentile(f64),
    /// `2.5sigma`: 2.5 standard deviations of the samples above their mean.
    Sigma(f64),
}

impl Isovalue {
    /// The value of the field for a range and statistics of the samples.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if statistics are needed and missing.
    pub fn resolve(self, (low, high): (f64, f64), samples: Option<&Statistics>) -> Result<f64> {
        let statistics = |written: String| {
            samples.ok_or_else(|| {
                Error::Usage(format!(
                    "{written} needs statistics of the samples, which are not available; expected a number or a percentage such as 50%"
                ))
            })
        };
        Ok(match self {
            Isovalue::Absolute(value) => value,
            Isovalue::Percent(percent) if (0.0..=100.0).contains(&percent) => {
                between((low, high), percent / 100.0)
            }
            Isovalue::Percent(percent) => low * (1.0 - percent / 100.0) + high * (percent / 100.0),
            Isovalue::Percentile(percent) => statistics(format!("p{percent}"))?.percentile(percent),
            Isovalue::Sigma(n) => {
                let samples = statistics(format!("{n}sigma"))?;
                samples.mean + n * samples.deviation
            }
        })
    }
}

/// The isovalue at a share of a range, 0 to 1. The ends are exact, and rounding never leads out of the range, which may be two
/// neighbouring numbers.
pub(crate) fn between((low, high): (f64, f64), share: f64) -> f64 {
    (low * (1.0 - share) + high * share).clamp(low, high)
}

impl FromStr for Isovalue {
    type Err = Error;

    /// Reads one of the forms.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let expected = || {
            Error::Usage(format!(
                "'{text}', expected a number, 50% of the range, p99 of the samples, 2.5sigma or top:1%"
            ))
        };
        let number = |digits: &str| {
            digits.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(expected)
        };
        let share = |digits: &str| {
            let share = number(digits)?;
            if (0.0..=100.0).contains(&share) { Ok(share) } else { Err(expected()) }
        };
        let written = text.trim().to_ascii_lowercase();
        if let Some(rest) = written.strip_prefix("top:") {
            let share_above = share(rest.strip_suffix('%').ok_or_else(expected)?)?;
            return Ok(Isovalue::Percentile(100.0 - share_above));
        }
        if let Some(digits) = written.strip_suffix("sigma").or_else(|| written.strip_suffix('σ')) {
            return number(digits).map(Isovalue::Sigma);
        }
        if let Some(digits) = written.strip_prefix('p') {
            return share(digits).map(Isovalue::Percentile);
        }
        match written.strip_suffix('%') {
            Some(digits) => number(digits).map(Isovalue::Percent),
            None => number(&written).map(Isovalue::Absolute),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Placement, Samples, Volume};

    #[test]
    fn an_isovalue_between_neighbouring_numbers_is_one_of_them() {
        for low in [1.999_999_999_999_999_8, 0.453_885_879_464_596, 1e-310, -3.7] {
            let range: (f64, f64) = (low, low.next_up());
            for i in 0..=24 {
                let isovalue = between(range, f64::from(i) / 24.0);
                assert!(range.0 <= isovalue && isovalue <= range.1, "{i} of 24 of {range:?}");
            }
        }
    }

    #[test]
    fn isovalues_are_numbers_percentages_percentiles_deviations_and_shares() {
        let samples =
            Samples::U8((0..=250).chain(0..=249).chain(0..=250).map(|i| i as u8).collect());
        let volume =
            Volume::new("v", [188, 2, 2], samples, Placement::default()).expect("a volume");
        let samples = Statistics::of(&volume);
        let at = |text: &str| {
            let written = text.parse::<Isovalue>();
            written
                .and_then(|c| c.resolve((-10.0, 30.0), Some(&samples)))
                .map_err(|e| e.to_string())
        };
        assert_eq!(at("-1.5e1"), Ok(-15.0));
        assert_eq!([at("50%"), at("0%"), at(" 100 % ")], [Ok(10.0), Ok(-10.0), Ok(30.0)]);
        let p90 = at("p90").expect("a percentile");
        assert!((p90 - 225.0).abs() < 0.6, "{p90}");
        assert_eq!([at("P90"), at("top:10%"), at("TOP: 10 %")], [Ok(p90), Ok(p90), Ok(p90)]);
        assert_eq!(at("0sigma"), Ok(samples.mean));
        assert_eq!(at("-2.5 Sigma"), Ok(samples.mean - 2.5 * samples.deviation));
        assert_eq!(at("1σ"), Ok(samples.mean + samples.deviation));
        for wrong in [
            "", "%", "half", "nan", "inf", "1:2", "p", "p101", "p-1", "p9%", "top:1", "top:101%",
            "sigma",
        ] {
            assert!(at(wrong).is_err(), "{wrong}");
        }
        let error = Isovalue::Sigma(2.5).resolve((0.0, 1.0), None).expect_err("no samples");
        assert!(error.to_string().contains("2.5sigma"), "{error}");
    }
}
