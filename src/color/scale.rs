//! Normalization of values to the range of a colour map.

use std::str::FromStr;

use crate::error::{Error, Result};

/// One end of a scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScaleEnd {
    /// This value.
    At(f64),
    /// This percentile of the values, 0 to 100.
    Percentile(f64),
}

impl FromStr for ScaleEnd {
    type Err = Error;

    /// Reads `37.2` or `p99`.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let text = text.trim();
        let number = |digits: &str| digits.parse().ok().filter(|x: &f64| x.is_finite());
        let percentile = text.strip_prefix('p').and_then(number);
        let percentile = percentile.filter(|p| (0.0..=100.0).contains(p)).map(ScaleEnd::Percentile);
        percentile.or_else(|| number(text).map(ScaleEnd::At)).ok_or_else(|| {
            Error::Usage(format!("end of a scale '{text}', expected a number or p0 to p100"))
        })
    }
}

/// The requested ends of a [`Scale`]; those that are `None` follow from the values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScaleEnds {
    /// Value of the first colour.
    pub low: Option<ScaleEnd>,
    /// Value of the last colour.
    pub high: Option<ScaleEnd>,
    /// Value of the middle colour; makes the scale symmetric around it.
    pub center: Option<f64>,
}

impl ScaleEnds {
    /// Checks that all values are finite and all percentiles from 0 to 100.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if one is not.
    pub fn check(&self) -> Result<()> {
        let center = self.center.map(ScaleEnd::At);
        for end in self.low.into_iter().chain(self.high).chain(center) {
            match end {
                ScaleEnd::At(x) if !x.is_finite() => {
                    return Err(Error::Usage(format!("scale with {x}, expected finite numbers")));
                }
                ScaleEnd::Percentile(p) if !(0.0..=100.0).contains(&p) => {
                    return Err(Error::Usage(format!("scale with p{p}, expected p0 to p100")));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// From one value to another.
    pub fn between(low: f64, high: f64) -> Self {
        ScaleEnds { low: Some(ScaleEnd::At(low)), high: Some(ScaleEnd::At(high)), center: None }
    }
}

impl FromStr for ScaleEnds {
    type Err = Error;

    /// Reads `LOW:HIGH`, each a [`ScaleEnd`]; an empty one follows from the values.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let (low, high) = text
            .split_once(':')
            .ok_or_else(|| Error::Usage(format!("scale '{text}', expected LOW:HIGH")))?;
        let end = |text: &str| match text.trim() {
            "" => Ok(None),
            text => text.parse().map(Some),
        };
        let ends = ScaleEnds { low: end(low)?, high: end(high)?, center: None };
        if let (Some(ScaleEnd::At(low)), Some(ScaleEnd::At(high))) = (ends.low, ends.high)
            && low >= high
        {
            return Err(Error::Usage(format!("scale '{text}', expected the lower end first")));
        }
        Ok(ends)
    }
}

/// The values of the first and the last colour of a map; `low < high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Value of the first colour.
    pub low: f64,
    /// Value of the last colour.
    pub high: f64,
}

impl Scale {
    /// The scale of the finite values by the requested ends, then by the default ends, then by the minimum and maximum.
    ///
    /// # Errors
    ///
    /// Those of [`ScaleEnds::check`].
    pub fn of(
        values: impl Iterator<Item = f64>,
        requested: ScaleEnds,
        default: ScaleEnds,
    ) -> Result<Self> {
        requested.check()?;
        default.check()?;
        Ok(Scale::of_checked(values, requested, default))
    }

    /// As [`Scale::of`], of ends that are known to be valid.
    pub(super) fn of_checked(
        values: impl Iterator<Item = f64>,
        requested: ScaleEnds,
        default: ScaleEnds,
    ) -> Self {
        let mut values: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        let mut value_of = |end: Option<ScaleEnd>, percent: f64| match end {
            Some(ScaleEnd::At(x)) => x,
            Some(ScaleEnd::Percentile(p)) => percentile(&mut values, p),
            None => percentile(&mut values, percent),
        };
        let mut low = value_of(requested.low.or(default.low), 0.0);
        let mut high = value_of(requested.high.or(default.high), 100.0);
        if let Some(center) = requested.center.or(default.center) {
            let radius = (low - center).abs().max((high - center).abs());
            (low, high) = (center - radius, center + radius);
        }
        if low < high {
            return Scale { low, high };
        }
        // A single value, or ends that percentiles put in the wrong order: their middle becomes the middle of the scale.
        let radius = 0.5 * low.abs().max(1.0);
        let middle = 0.5 * low + 0.5 * high;
        Scale { low: middle - radius, high: middle + radius }
    }

    /// The position of a value on the scale, clamped to 0 to 1; `None` for NaN.
    pub fn fraction(&self, value: f64) -> Option<f32> {
        // Halved first, so that the widest range does not overflow.
        let fraction = (0.5 * value - 0.5 * self.low) / (0.5 * self.high - 0.5 * self.low);
        (!fraction.is_nan()).then(|| fraction.clamp(0.0, 1.0) as f32)
    }
}

/// A percentile of the values; 0 for no values.
fn percentile(values: &mut [f64], percent: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let at = (values.len() - 1) as f64 * percent / 100.0;
    *values.select_nth_unstable_by(at.round() as usize, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_has_the_requested_ends_or_those_of_the_values() {
        let of = |requested: &str, center| {
            let values = (0..=100).map(f64::from).chain([f64::NAN, f64::INFINITY]);
            let requested = ScaleEnds { center, ..requested.parse().expect("ends") };
            let scale = Scale::of(values, requested, ScaleEnds::default());
            let Scale { low, high } = scale.expect("valid ends");
            (low, high)
        };
        assert_eq!(of(":", None), (0.0, 100.0));
        assert_eq!(of("p5:p95", None), (5.0, 95.0));
        assert_eq!(of("-3:", None), (-3.0, 100.0));
        assert_eq!(of("p5:95", Some(30.0)), (-35.0, 95.0));
        for wrong in ["", "5", "a:b", "p101:3", "5:5", "nan:1"] {
            assert!(wrong.parse::<ScaleEnds>().is_err(), "{wrong}");
        }
        let nan = ScaleEnds { center: Some(f64::NAN), ..ScaleEnds::default() };
        let p101 = ScaleEnds { low: Some(ScaleEnd::Percentile(101.0)), ..ScaleEnds::default() };
        for wrong in [nan, p101, ScaleEnds::between(0.0, f64::INFINITY)] {
            let made = Scale::of([7.0].into_iter(), wrong, ScaleEnds::default());
            assert!(matches!(made, Err(Error::Usage(_))), "{wrong:?}");
        }
        let default = ScaleEnds::default();
        let one = Scale::of([7.0].into_iter(), default, default).expect("valid ends");
        assert!(one.low < 7.0 && 7.0 < one.high, "{one:?}");
        let none = Scale::of([].into_iter(), default, default).expect("valid ends");
        assert!(none.low < none.high);
    }

    #[test]
    fn fractions_are_clamped_and_nan_has_none() {
        let scale = Scale { low: -1.0, high: 3.0 };
        assert_eq!([-2.0, 1.0, 9.0].map(|x| scale.fraction(x)), [Some(0.0), Some(0.5), Some(1.0)]);
        assert_eq!(scale.fraction(f64::NAN), None);
        let wide = Scale { low: -f64::MAX, high: f64::MAX };
        assert_eq!(wide.fraction(0.0), Some(0.5));
    }
}
