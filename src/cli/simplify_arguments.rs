//! How noise is taken out of a volume before anything else, as said on the command line.

use std::str::FromStr;

use clap::Args;
use isospectrum::Result;
use isospectrum::topology::simplify::{Census, Simplification, simplify};
use isospectrum::volume::Volume;

use super::report::number;

/// The argument wherever a volume can be simplified.
#[derive(Args, Debug)]
pub(super) struct SimplifyArguments {
    /// Take noise out first: no minimum or maximum is left that is closer than P in value to the saddle that ends
    /// it; samples change by up to about 2 P; a value, or a percentage of the volume's range such as 5%
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    persistence: Option<Persistence>,
}

impl SimplifyArguments {
    /// The volume to go on with, and what was done to it where something was.
    pub(super) fn apply(&self, volume: Volume) -> Result<(Volume, Option<Simplification>)> {
        let Some(persistence) = self.persistence else {
            return Ok((volume, None));
        };
        let (simplified, done) = simplify(&volume, persistence.of_range(volume.range()))?;
        log::info!("{}", sentence(&done));
        Ok((simplified, Some(done)))
    }
}

/// What was done, for people.
fn sentence(done: &Simplification) -> String {
    let Simplification { before, after, .. } = done;
    let pair = |of: fn(&Census) -> usize| format!("{} -> {}", of(before), of(after));
    format!(
        "simplified: extrema of a persistence below {}: minima {}, maxima {}; in all critical points {}, minima {}, maxima {}, handles {}; samples changed by up to {} (mean {})",
        number(done.persistence),
        pair(|c| c.minima_below),
        pair(|c| c.maxima_below),
        pair(|c| c.critical_points),
        pair(|c| c.minima),
        pair(|c| c.maxima),
        pair(|c| c.handles),
        number(done.largest_change),
        number(done.mean_change),
    )
}

/// A persistence as it was written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Persistence {
    /// A difference of values of the field.
    Absolute(f64),
    /// `5%`: that share of the range.
    Percent(f64),
}

impl Persistence {
    fn of_range(self, (low, high): (f64, f64)) -> f64 {
        match self {
            Persistence::Absolute(value) => value,
            Persistence::Percent(percent) => (high - low) * (percent / 100.0),
        }
    }
}

impl FromStr for Persistence {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (digits, percent) = match text.strip_suffix('%') {
            Some(digits) => (digits, true),
            None => (text, false),
        };
        let value: Option<f64> = digits.trim().parse().ok();
        let value = value.filter(|&x: &f64| x.is_finite() && x > 0.0).ok_or_else(|| {
            format!("'{text}', expected a number above 0 or a percentage such as 5%")
        })?;
        Ok(if percent { Persistence::Percent(value) } else { Persistence::Absolute(value) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_persistence_is_a_value_or_a_percentage_of_the_range() {
        let of = |text: &str| text.parse::<Persistence>().map(|p| p.of_range((-10.0, 30.0)));
        assert_eq!(of("1.5"), Ok(1.5));
        assert_eq!(of("5%"), Ok(2.0));
        for wrong in ["", "%", "0", "-1", "-5%", "nan", "inf", "much"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
