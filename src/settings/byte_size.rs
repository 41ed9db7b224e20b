//! Sizes of memory.

use std::str::FromStr;

use crate::error::{Error, Result};

/// A number of bytes, written as `800000`, `8GB` or `16GiB`.
///
/// ```
/// use isospectrum::settings::ByteSize;
///
/// assert_eq!("2MiB".parse::<ByteSize>()?.bytes(), 2_097_152.0);
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByteSize(f64);

impl ByteSize {
    /// A size from its number of bytes.
    pub const fn new(bytes: f64) -> ByteSize {
        ByteSize(bytes)
    }

    /// The number of bytes.
    pub const fn bytes(self) -> f64 {
        self.0
    }
}

impl FromStr for ByteSize {
    type Err = Error;

    /// Parses a positive number and a unit: none or `B`, `kB`, `MB`, `GB`, `TB` of 1000, `KiB` to `TiB` of 1024, in any case and
    /// without the `B` as well.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any other text.
    fn from_str(text: &str) -> Result<Self> {
        let trimmed = text.trim();
        let digits = trimmed.trim_end_matches(|c: char| c.is_ascii_alphabetic());
        let unit = match trimmed[digits.len()..].to_ascii_lowercase().as_str() {
            "" | "b" => Some(1.0),
            "kb" | "k" => Some(1e3),
            "mb" | "m" => Some(1e6),
            "gb" | "g" => Some(1e9),
            "tb" | "t" => Some(1e12),
            "kib" | "ki" => Some(1024.0),
            "mib" | "mi" => Some(1024f64.powi(2)),
            "gib" | "gi" => Some(1024f64.powi(3)),
            "tib" | "ti" => Some(1024f64.powi(4)),
            _ => None,
        };
        let number = digits.trim().parse::<f64>().ok().filter(|&x| x.is_finite() && x > 0.0);
        let size = number.zip(unit).map(|(number, unit)| ByteSize(number * unit));
        size.ok_or_else(|| Error::Usage(format!("'{text}', expected a size such as 8GB or 500MiB")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_powers_of_1000_or_1024() {
        let of = |text: &str| text.parse::<ByteSize>().map(ByteSize::bytes).ok();
        assert_eq!(of("1500"), Some(1500.0));
        assert_eq!(of("1.5kB"), Some(1500.0));
        assert_eq!(of("8 GB"), Some(8e9));
        assert_eq!(of("2MiB"), Some(2_097_152.0));
        assert_eq!(of(" 1e+3 Ki"), Some(1_024_000.0));
        for wrong in ["", "GB", "-1GB", "0", "8XB", "inf"] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }
}
