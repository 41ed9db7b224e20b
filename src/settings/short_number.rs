//! Numbers as reports and the labels of pictures show them.

/// Formats a number with five significant digits, never fewer than its integer part; very small or large ones with exponent.
pub fn short_number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let exponent = x.abs().log10().floor() as i32;
    if !(-6..15).contains(&exponent) {
        let text = format!("{x:.4e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{exponent}", without_zeros(digits));
    }
    without_zeros(&format!("{x:.*}", (4 - exponent).clamp(0, 12) as usize)).to_owned()
}

/// Removes zeros at the end of a decimal fraction.
fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_five_significant_digits() {
        for (x, text) in [
            (0.0, "0"),
            (128.0, "128"),
            (0.1, "0.1"),
            (-1.5, "-1.5"),
            (1.0 / 3.0, "0.33333"),
            (123_456.7, "123457"),
            (0.000_123_456, "0.00012346"),
            (2.316_274_613e-16, "2.3163e-16"),
            (-1e-7, "-1e-7"),
            (1e18, "1e18"),
        ] {
            assert_eq!(short_number(x), text);
        }
    }
}
