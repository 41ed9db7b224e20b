//! Parsers for flags that take one number of a limited range.

/// Parses a finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    number_where(text, |x| x > 0.0, "a number above 0")
}

/// Parses a finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    number_where(text, |_| true, "a number")
}

/// Parses a finite number of at least 0.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    number_where(text, |x| x >= 0.0, "a number of at least 0")
}

/// Parses a number from 0 to 1.
pub(super) fn fraction(text: &str) -> Result<f64, String> {
    number_where(text, |x| (0.0..=1.0).contains(&x), "a number from 0 to 1")
}

fn number_where(text: &str, holds: fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|&x| x.is_finite() && holds(x));
    number.ok_or_else(|| format!("expected {expected}"))
}
