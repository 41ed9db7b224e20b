//! Isovalues as people type them, and how they are shown and stepped through.

use crate::volume::{Isovalue, Statistics};

/// The isovalue that `text` means.
///
/// # Errors
///
/// A line that says what was expected.
pub(super) fn isovalue(
    text: &str,
    (low, high): (f64, f64),
    samples: Option<&Statistics>,
) -> Result<f64, String> {
    let written: Result<Isovalue, _> = text.parse();
    let isovalue = written.and_then(|written| written.resolve((low, high), samples));
    let isovalue = isovalue.map_err(|error| error.to_string())?;
    if low <= isovalue && isovalue <= high {
        Ok(isovalue)
    } else {
        Err(format!("{isovalue} lies outside {low} to {high}"))
    }
}

/// A number with as many digits as one wants to read.
pub(super) fn shown(x: f64) -> String {
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

/// A number as one reads it at a glance: four digits.
pub(super) fn short(x: f64) -> String {
    if x == 0.0 || !(1e-4..1e9).contains(&x.abs()) {
        return shown(x);
    }
    let step = 10f64.powf(x.abs().log10().floor() - 3.0);
    // Whole numbers keep all their digits.
    shown(if step > 1.0 { x.round() } else { (x / step).round() * step })
}

/// The step of an isovalue over a range: 1, 2 or 5 times a power of ten, about 200 of them.
pub(super) fn step((low, high): (f64, f64)) -> f64 {
    let raw = high / 200.0 - low / 200.0;
    let decade = 10f64.powf(raw.log10().floor());
    let nearest = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade);
    let step = nearest.into_iter().min_by(|a, b| {
        let off = |x: f64| (x / raw).ln().abs();
        off(*a).total_cmp(&off(*b))
    });
    step.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(f64::MIN_POSITIVE)
}

/// `n` steps on from `isovalue`, on multiples of the step, within the range.
pub(super) fn stepped(isovalue: f64, n: f64, step: f64, (low, high): (f64, f64)) -> f64 {
    let on = isovalue / step;
    // A value beside a multiple, by rounding, is that multiple.
    let from = if (on - on.round()).abs() < 1e-6 {
        on.round()
    } else if n > 0.0 {
        on.floor()
    } else {
        on.ceil()
    };
    let target = from + n;
    // Dividing by the inverse of a power of ten gives the nearest short decimal.
    let value = if step < 1.0 { target / (1.0 / step) } else { target * step };
    // A range of one isovalue has no steps.
    if value.is_finite() { value.clamp(low, high) } else { isovalue }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_outside_or_is_no_isovalue_is_refused() {
        let at = |text: &str| isovalue(text, (0.0, 80.0), None);
        assert_eq!([at("37.2"), at(" 50 % ")], [Ok(37.2), Ok(40.0)]);
        for wrong in ["", "x", "p", "p101", "81", "-1", "nan", "101%"] {
            assert!(at(wrong).is_err(), "{wrong}");
        }
        assert!(at("p50").expect_err("no samples").contains("needs the samples"));
    }

    #[test]
    fn numbers_at_a_glance_have_four_digits() {
        let texts = [0.0, 12.3456789, -0.012345678, 123_456.7, 3.0].map(short);
        assert_eq!(texts, ["0", "12.35", "-0.01235", "123457", "3"]);
    }

    #[test]
    fn steps_are_round_numbers_and_stay_in_the_range() {
        assert_eq!(step((0.0, 255.0)), 1.0);
        // Powers of ten are rounded once.
        assert!((step((-0.07, 0.07)) - 0.0005).abs() < 1e-18);
        assert_eq!(stepped(37.2, 1.0, 1.0, (0.0, 255.0)), 38.0);
        assert_eq!(stepped(37.2, -1.0, 1.0, (0.0, 255.0)), 37.0);
        assert_eq!(stepped(37.0, -1.0, 0.1, (0.0, 255.0)), 36.9);
        assert_eq!(stepped(254.5, 3.0, 1.0, (0.0, 255.0)), 255.0);
        assert_eq!(stepped(0.3, 1.0, 0.1, (0.0, 1.0)), 0.4);
        assert_eq!(stepped(3.0, 1.0, step((3.0, 3.0)), (3.0, 3.0)), 3.0);
    }

    #[test]
    fn shown_numbers_are_short() {
        for (x, text) in [(0.0, "0"), (37.2, "37.2"), (-1.5, "-1.5"), (1.0 / 3.0, "0.3333333")] {
            assert_eq!(shown(x), text);
        }
    }
}
