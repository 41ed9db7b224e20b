//! How noise is taken out of a volume before anything else, as said on the command line.

use std::str::FromStr;

use clap::Args;
use isospectrum::Result;
use isospectrum::inside::topology::dust::Dust;
use isospectrum::inside::topology::simplify::{Census, Simplification};
use isospectrum::volume::Volume;
use isospectrum::{Cleaned, Noise};

use super::report::number;

/// The arguments wherever noise can be taken out of a volume.
#[derive(Args, Debug)]
#[group(id = "noise", multiple = true)]
pub(super) struct SimplifyArguments {
    /// Take noise out first: no minimum or maximum is left that is closer than P in value to the saddle that ends
    /// it; samples change by up to about 2 P; a value, or a percentage of the volume's range such as 5%
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    persistence: Option<Persistence>,
    /// Leave dust out: parts, and cavities, that never have V voxels before they meet a larger one (before --persistence)
    #[arg(long, value_name = "V", value_parser = clap::value_parser!(u32).range(1..))]
    min_component: Option<u32>,
}

impl SimplifyArguments {
    /// Whether nothing is to be taken out.
    pub(super) fn is_none(&self) -> bool {
        self.persistence.is_none() && self.min_component.is_none()
    }

    /// What is asked for of a volume.
    pub(super) fn noise(&self, volume: &Volume) -> Noise {
        // A share of the range with the dust.
        let persistence = self.persistence.map(|p| p.of_range(volume.range()));
        Noise { persistence, min_component: self.min_component }
    }

    /// The volume to go on with, and what was done to it where something was.
    pub(super) fn apply(&self, volume: Volume) -> Result<(Volume, Cleaned)> {
        let (volume, cleaned) = self.noise(&volume).take_out(volume)?;
        if let Some(done) = &cleaned.dust {
            log::info!("dust: {}", dust_sentence(done));
        }
        if let Some(done) = &cleaned.simplification {
            log::info!("{}", sentence(done));
        }
        Ok((volume, cleaned))
    }
}

/// What was left out as dust, for people.
pub(super) fn dust_sentence(done: &Dust) -> String {
    let Dust { voxels, parts, cavities, samples, largest_change, left, .. } = done;
    let change = number(*largest_change);
    let left = if *left > 0 {
        format!("; {left} are as small after --persistence")
    } else {
        String::new()
    };
    format!(
        "{parts} parts and {cavities} cavities below {voxels} voxels left out: {samples} samples changed, by up to {change}{left}"
    )
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
