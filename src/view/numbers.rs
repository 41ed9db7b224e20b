//! Parsing, formatting and stepping of isovalues.

use crate::numbers::distinct;
use crate::volume::{Isovalue, Statistics};

/// Parses an isovalue of the range: a number, a percentage, or a percentile of the samples.
///
/// # Errors
///
/// A message of one line.
pub(super) fn parse_isovalue(
    text: &str,
    (low, high): (f64, f64),
    samples: Option<&Statistics>,
) -> Result<f64, String> {
    let parsed: Result<Isovalue, _> = text.parse();
    let isovalue = parsed.and_then(|parsed| parsed.resolve((low, high), samples));
    let isovalue = isovalue.map_err(|error| error.to_string())?;
    if low <= isovalue && isovalue <= high {
        Ok(isovalue)
    } else {
        let [isovalue, low, high] = distinct([isovalue, low, high]);
        Err(format!("{isovalue} is outside of {low} to {high}"))
    }
}

/// Formats a number with seven significant digits.
pub(super) fn format_number(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e9).contains(&x.abs()) {
        return format!("{x:.5e}");
    }
    let digits = (6 - x.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{x:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Formats a number with four significant digits; integers keep all digits.
pub(super) fn format_short(x: f64) -> String {
    if x == 0.0 || !(1e-4..1e9).contains(&x.abs()) {
        return format_number(x);
    }
    let step = 10f64.powf(x.abs().log10().floor() - 3.0);
    format_number(if step > 1.0 { x.round() } else { (x / step).round() * step })
}

/// The step of isovalues in a range: 1, 2 or 5 times a power of ten, about 200 steps in total.
pub(super) fn step_size((low, high): (f64, f64)) -> f64 {
    let raw = high / 200.0 - low / 200.0;
    let decade = 10f64.powf(raw.log10().floor());
    let candidates = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade);
    let step = candidates.into_iter().min_by(|a, b| {
        let distance = |x: f64| (x / raw).ln().abs();
        distance(*a).total_cmp(&distance(*b))
    });
    step.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(f64::MIN_POSITIVE)
}

/// Moves `isovalue` by `n` steps, to multiples of the step within the range.
pub(super) fn step_isovalue(isovalue: f64, n: f64, step: f64, (low, high): (f64, f64)) -> f64 {
    let position = isovalue / step;
    // A value within rounding errors of a multiple counts as that multiple.
    let from = if (position - position.round()).abs() < 1e-6 {
        position.round()
    } else if n > 0.0 {
        position.floor()
    } else {
        position.ceil()
    };
    let target = from + n;
    // Dividing by the inverse of a power of ten gives the nearest short decimal.
    let value = if step < 1.0 { target / (1.0 / step) } else { target * step };
    // Not finite in a range of one isovalue.
    if value.is_finite() { value.clamp(low, high) } else { isovalue }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_that_are_no_isovalue_of_the_range_are_errors() {
        let at = |text: &str| parse_isovalue(text, (0.0, 80.0), None);
        assert_eq!([at("37.2"), at(" 50 % ")], [Ok(37.2), Ok(40.0)]);
        for wrong in ["", "x", "p", "p101", "81", "-1", "nan", "101%"] {
            assert!(at(wrong).is_err(), "{wrong}");
        }
        assert!(at("p50").expect_err("no samples").contains("needs statistics of the samples"));
    }

    #[test]
    fn short_numbers_have_four_digits() {
        let texts = [0.0, 12.3456789, -0.012345678, 123_456.7, 3.0].map(format_short);
        assert_eq!(texts, ["0", "12.35", "-0.01235", "123457", "3"]);
    }

    #[test]
    fn steps_are_round_numbers_and_stay_in_the_range() {
        assert_eq!(step_size((0.0, 255.0)), 1.0);
        // Powers of ten are rounded once.
        assert!((step_size((-0.07, 0.07)) - 0.0005).abs() < 1e-18);
        assert_eq!(step_isovalue(37.2, 1.0, 1.0, (0.0, 255.0)), 38.0);
        assert_eq!(step_isovalue(37.2, -1.0, 1.0, (0.0, 255.0)), 37.0);
        assert_eq!(step_isovalue(37.0, -1.0, 0.1, (0.0, 255.0)), 36.9);
        assert_eq!(step_isovalue(254.5, 3.0, 1.0, (0.0, 255.0)), 255.0);
        assert_eq!(step_isovalue(0.3, 1.0, 0.1, (0.0, 1.0)), 0.4);
        assert_eq!(step_isovalue(3.0, 1.0, step_size((3.0, 3.0)), (3.0, 3.0)), 3.0);
    }

    #[test]
    fn numbers_have_no_trailing_zeros() {
        for (x, text) in [(0.0, "0"), (37.2, "37.2"), (-1.5, "-1.5"), (1.0 / 3.0, "0.3333333")] {
            assert_eq!(format_number(x), text);
        }
    }
}
