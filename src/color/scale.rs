//! From numbers to shares of a colour map.

use std::str::FromStr;

use crate::error::{Error, Result};

/// One end of a scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// This number.
    At(f64),
    /// What this percentage of the numbers does not exceed.
    Percentile(f64),
}

impl FromStr for End {
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
        let percentile = percentile.filter(|p| (0.0..=100.0).contains(p)).map(End::Percentile);
        percentile.or_else(|| number(text).map(End::At)).ok_or_else(|| {
            Error::Usage(format!("end of a scale '{text}', expected a number or p0 to p100"))
        })
    }
}

/// Which numbers the ends of a map stand for; what is not said follows from what is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ends {
    /// The first colour.
    pub low: Option<End>,
    /// The last colour.
    pub high: Option<End>,
    /// The middle colour: the ends are then as far from it, one as the other.
    pub center: Option<f64>,
}

impl Ends {
    /// All numbers that are told.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        let of = |end: End| match end {
            End::At(x) | End::Percentile(x) => x,
        };
        self.low.into_iter().chain(self.high).map(of).chain(self.center)
    }

    /// From one number to another.
    pub fn between(low: f64, high: f64) -> Self {
        Ends { low: Some(End::At(low)), high: Some(End::At(high)), center: None }
    }
}

impl FromStr for Ends {
    type Err = Error;

    /// Reads `LOW:HIGH`, each an [`End`]; an empty one follows from what is shown.
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
            told => told.parse().map(Some),
        };
        let ends = Ends { low: end(low)?, high: end(high)?, center: None };
        if let (Some(End::At(low)), Some(End::At(high))) = (ends.low, ends.high)
            && low >= high
        {
            return Err(Error::Usage(format!("scale '{text}', expected the lower end first")));
        }
        Ok(ends)
    }
}

/// The numbers that the two ends of a map stand for; `low < high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Of the first colour.
    pub low: f64,
    /// Of the last colour.
    pub high: f64,
}

impl Scale {
    /// The scale of finite numbers (others are passed over) by what is told of its ends; where nothing is, by
    /// `otherwise`.
    pub fn of(values: impl Iterator<Item = f64>, told: Ends, otherwise: Ends) -> Self {
        let mut values: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        let mut at = |end: Option<End>, other: Option<End>, percent: f64| match end
            .or(other)
            .unwrap_or(End::Percentile(percent))
        {
            End::At(x) => x,
            End::Percentile(p) => percentile(&mut values, p),
        };
        let (mut low, mut high) =
            (at(told.low, otherwise.low, 0.0), at(told.high, otherwise.high, 100.0));
        if let Some(center) = told.center.or(otherwise.center) {
            let reach = (low - center).abs().max((high - center).abs());
            (low, high) = (center - reach, center + reach);
        }
        if low < high {
            return Scale { low, high };
        }
        // One number, or ends that percentiles put the wrong way around: it is in the middle.
        let around = 0.5 * low.abs().max(1.0);
        let middle = 0.5 * low + 0.5 * high;
        Scale { low: middle - around, high: middle + around }
    }

    /// Where a number lies from the first end to the last, 0 to 1; none of what is no number.
    pub fn share(&self, value: f64) -> Option<f32> {
        let share = (0.5 * value - 0.5 * self.low) / (0.5 * self.high - 0.5 * self.low);
        (!share.is_nan()).then(|| share.clamp(0.0, 1.0) as f32)
    }
}

/// What a percentage of the numbers does not exceed; 0 of none.
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
    fn a_scale_has_the_ends_it_is_told_or_those_of_the_numbers() {
        let of = |told: &str, center| {
            let values = (0..=100).map(f64::from).chain([f64::NAN, f64::INFINITY]);
            let told = Ends { center, ..told.parse().expect("ends") };
            let Scale { low, high } = Scale::of(values, told, Ends::default());
            (low, high)
        };
        assert_eq!(of(":", None), (0.0, 100.0));
        assert_eq!(of("p5:p95", None), (5.0, 95.0));
        assert_eq!(of("-3:", None), (-3.0, 100.0));
        assert_eq!(of("p5:95", Some(30.0)), (-35.0, 95.0));
        for wrong in ["", "5", "a:b", "p101:3", "5:5", "nan:1"] {
            assert!(wrong.parse::<Ends>().is_err(), "{wrong}");
        }
        let one = Scale::of([7.0].into_iter(), Ends::default(), Ends::default());
        assert!(one.low < 7.0 && 7.0 < one.high, "{one:?}");
        let none = Scale::of([].into_iter(), Ends::default(), Ends::default());
        assert!(none.low < none.high);
    }

    #[test]
    fn shares_are_clamped_and_none_of_no_number() {
        let scale = Scale { low: -1.0, high: 3.0 };
        assert_eq!([-2.0, 1.0, 9.0].map(|x| scale.share(x)), [Some(0.0), Some(0.5), Some(1.0)]);
        assert_eq!(scale.share(f64::NAN), None);
        let wide = Scale { low: -f64::MAX, high: f64::MAX };
        assert_eq!(wide.share(0.0), Some(0.5));
    }
}
