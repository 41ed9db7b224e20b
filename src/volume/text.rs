//! Samples and headers that are text.

use std::io;
use std::str::FromStr;

use super::decode::{SampleType, exact_f64, invalid, reserve};
use crate::volume::Samples;

/// The start of a text, so that a damaged file cannot fill the screen.
pub(crate) fn shortened(text: &str) -> String {
    let start: String = text.chars().take(40).flat_map(char::escape_default).collect();
    if text.chars().nth(40).is_some() { start + "..." } else { start }
}

/// Exactly `n` samples separated by white space or commas.
///
/// # Errors
///
/// `InvalidData` where they are more, fewer, or no numbers of their type; `what` they are.
pub(crate) fn samples(
    bytes: &[u8],
    sample_type: SampleType,
    n: usize,
    what: &str,
) -> io::Result<Samples> {
    // A number and the space behind it take two bytes.
    if n > bytes.len() / 2 + 1 {
        return Err(invalid(format!("{} bytes of text, too few for {what}", bytes.len())));
    }
    let text = std::str::from_utf8(bytes)
        .map_err(|_| invalid("text samples that are not text".to_owned()))?;
    Ok(match sample_type {
        SampleType::U8 => Samples::U8(numbers(text, n, what)?),
        SampleType::I8 => Samples::I8(numbers(text, n, what)?),
        SampleType::U16 => Samples::U16(numbers(text, n, what)?),
        SampleType::I16 => Samples::I16(numbers(text, n, what)?),
        SampleType::U32 => Samples::U32(numbers(text, n, what)?),
        SampleType::I32 => Samples::I32(numbers(text, n, what)?),
        SampleType::F16 | SampleType::F32 => Samples::F32(numbers(text, n, what)?),
        SampleType::F64 => Samples::F64(numbers(text, n, what)?),
        SampleType::I64 | SampleType::U64 => {
            let wide: Vec<i128> = numbers(text, n, what)?;
            Samples::F64(wide.into_iter().map(exact_f64).collect::<io::Result<_>>()?)
        }
    })
}

/// Exactly `n` numbers separated by white space or commas.
fn numbers<T: FromStr + Copy + Default>(text: &str, n: usize, what: &str) -> io::Result<Vec<T>> {
    let mut values = reserve(n, T::default())?;
    let mut words =
        text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|w| !w.is_empty());
    for (i, value) in values.iter_mut().enumerate() {
        let word =
            words.next().ok_or_else(|| invalid(format!("{i} numbers, expected {n} for {what}")))?;
        *value = word.parse().map_err(|_| {
            let start = shortened(word);
            invalid(format!("'{start}' as number {i} of the text, expected one of {what}"))
        })?;
    }
    if words.next().is_some() {
        return Err(invalid(format!("more than the {n} numbers of {what}")));
    }
    Ok(values)
}

/// All numbers of a text, exactly `N`; `None` if it is anything else.
pub(crate) fn exactly<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let values: Option<Vec<T>> = text.split_whitespace().map(|v| v.parse().ok()).collect();
    values?.try_into().ok()
}

/// As [`exactly`] for numbers that are finite.
pub(crate) fn finite<const N: usize>(text: &str) -> Option<[f64; N]> {
    exactly(text).filter(|values: &[f64; N]| values.iter().all(|v| v.is_finite()))
}
