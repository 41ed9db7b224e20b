//! How large a spectrum may become: a warning before the work begins, or a refusal.

use std::str::FromStr;

use clap::Args;
use isospectrum::forecast::Forecast;
use isospectrum::topology::Topology;
use isospectrum::topology::exact::ExactField;
use isospectrum::volume::Volume;
use isospectrum::{Error, Result};

use super::report;

/// Triangles above which a warning is given where no flag says otherwise.
const TRIANGLES: f64 = 20e6;

/// Memory above which a warning is given where no flag says otherwise.
const MEMORY: Bytes = Bytes(16.0 * 1024.0 * 1024.0 * 1024.0);

/// The flags of the budget.
#[derive(Args, Debug)]
pub(super) struct BudgetArguments {
    /// Refuse to begin where more triangles are expected [default: warn above 20 million]
    #[arg(long, value_name = "N", value_parser = super::compute::positive, allow_negative_numbers = true)]
    max_triangles: Option<f64>,
    /// Refuse to begin where more memory is expected, e.g. 8GB [default: warn above 16GiB]
    #[arg(long, value_name = "SIZE")]
    max_memory: Option<Bytes>,
}

impl BudgetArguments {
    /// What to expect of a sweep; warns where that is beyond the budget.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where it is beyond one that was given as a flag.
    pub(super) fn check(&self, volume: &Volume, range: (f64, f64), error: f64) -> Result<Forecast> {
        let field = ExactField::new(volume)?;
        let forecast = Forecast::of(&field, &Topology::compute(&field)?, range, error);
        log::debug!("{forecast:?}");
        let most_memory = self.max_memory.unwrap_or(MEMORY).0;
        let beyond = [
            (
                self.max_triangles.is_some(),
                forecast.triangles,
                self.max_triangles.unwrap_or(TRIANGLES),
            ),
            (self.max_memory.is_some(), forecast.memory, most_memory),
        ];
        let expected = format!(
            "about {} triangles and {} of memory expected for {} events, more than {} and {}; {}",
            rounded(forecast.triangles),
            report::bytes(forecast.memory as u64),
            forecast.events,
            rounded(beyond[0].2),
            report::bytes(most_memory as u64),
            advice(&forecast)
        );
        if beyond.iter().any(|&(is_given, expected, most)| is_given && expected > most) {
            return Err(Error::Usage(format!("{}: {expected}", volume.name())));
        }
        if beyond.iter().any(|&(_, expected, most)| expected > most) {
            log::warn!("{}: {expected}", volume.name());
        }
        Ok(forecast)
    }
}

fn advice(forecast: &Forecast) -> &'static str {
    if forecast.is_mostly_events() {
        "--persistence 5% takes noise out, --range takes a part"
    } else {
        "--error 0.2 makes larger triangles, --range takes a part"
    }
}

/// Two significant digits: more would claim what nobody knows.
fn rounded(x: f64) -> String {
    let unit = 10f64.powf((x.max(1.0).log10().floor() - 1.0).max(0.0));
    format!("{}", (x / unit).round() * unit)
}

/// A number of bytes: `800000`, `8GB`, `16GiB`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bytes(f64);

impl FromStr for Bytes {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let unit = match text[digits.len()..].to_ascii_lowercase().as_str() {
            "" | "b" => Some(1.0),
            "kb" | "k" => Some(1e3),
            "mb" | "m" => Some(1e6),
            "gb" | "g" => Some(1e9),
            "tb" | "t" => Some(1e12),
            "kib" => Some(1024.0),
            "mib" => Some(1024f64.powi(2)),
            "gib" => Some(1024f64.powi(3)),
            "tib" => Some(1024f64.powi(4)),
            _ => None,
        };
        let number = digits.trim().parse::<f64>().ok().filter(|&x| x.is_finite() && x > 0.0);
        let bytes = number.zip(unit).map(|(number, unit)| Bytes(number * unit));
        bytes.ok_or_else(|| format!("'{text}', expected a size such as 8GB or 500MiB"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units_of_a_thousand_or_of_1024() {
        let of = |text: &str| text.parse::<Bytes>().map(|b| b.0);
        assert_eq!(of("1500"), Ok(1500.0));
        assert_eq!(of("1.5kB"), Ok(1500.0));
        assert_eq!(of("8 GB"), Ok(8e9));
        assert_eq!(of("2MiB"), Ok(2_097_152.0));
        for wrong in ["", "GB", "-1GB", "0", "8XB", "inf"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn two_digits_are_told() {
        assert_eq!(rounded(123_456_789.0), "120000000");
        assert_eq!(rounded(7.0), "7");
    }
}
