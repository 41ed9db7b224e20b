//! Numbers as text in messages: two that differ never look equal, and none has hundreds of zeros.

/// Most significant digits of a number: as many distinguish any two.
const MAX_DIGITS: usize = 17;

/// Least significant digits of [`distinct`] numbers.
const MIN_DIGITS: usize = 5;

/// Writes a number with the fewest digits that are read back as the same number, with an exponent if it is very small or large.
pub fn exact(x: f64) -> String {
    with_digits(x, MAX_DIGITS)
}

/// Writes numbers with the fewest significant digits, five at least, that distinguish those that differ.
pub fn distinct<const N: usize>(numbers: [f64; N]) -> [String; N] {
    let text = |digits: usize| numbers.map(|x| with_digits(x, digits));
    let is_clear = |text: &[String; N]| {
        (0..N).all(|a| (0..a).all(|b| numbers[a] == numbers[b] || text[a] != text[b]))
    };
    (MIN_DIGITS..MAX_DIGITS).map(text).find(is_clear).unwrap_or_else(|| text(MAX_DIGITS))
}

/// Writes a number with so many significant digits, with an exponent where that is shorter.
fn with_digits(x: f64, digits: usize) -> String {
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    let (plain, scientific) = (rounded.to_string(), format!("{rounded:e}"));
    if plain.len() <= scientific.len().max(digits + 6) { plain } else { scientific }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_one_unit_in_the_last_place_apart_look_different() {
        for x in [1.0, 0.1, -22.999_999_999_999_996, 1e12, 3e-40, 5e-324, 1e300, f64::MAX] {
            let [a, b] = distinct([x, x.next_down()]);
            assert_ne!(a, b);
            for (number, text) in [(x, exact(x)), (x.next_down(), exact(x.next_down()))] {
                assert_eq!(text.parse::<f64>(), Ok(number));
                assert!(text.len() <= 24, "{text}");
            }
        }
    }

    #[test]
    fn numbers_that_differ_early_are_short() {
        assert_eq!(distinct([0.123_456_789, 255.0]), ["0.12346", "255"]);
        assert_eq!(distinct([1.0, 1.0, 1.000_000_1]), ["1", "1", "1.0000001"]);
        assert_eq!(exact(-32767.0), "-32767");
        assert_eq!(exact(0.000_25), "0.00025");
        assert_eq!(exact(3e-40), "3e-40");
    }
}
