//! Text: samples, header lines, numbers.

use std::io::{self, BufRead, Read as _};
use std::str::FromStr;

use super::data_error::invalid;
use super::decode::exact_f64;
use super::layout::SampleType;
use super::memory::try_filled_vec;
use super::samples::Samples;

/// The first 40 characters of a text from a file, escaped, for messages.
pub(crate) fn shortened(text: &str) -> String {
    let start: String = text.chars().take(40).flat_map(char::escape_default).collect();
    if text.chars().nth(40).is_some() { start + "..." } else { start }
}

/// Longest line and longest word in bytes: numbers of any format are far shorter.
const MAX_LINE_BYTES: usize = 1 << 16;

/// Longest header accepted, in bytes: bounds the memory for a file without line ends.
const MAX_HEADER_BYTES: u64 = 1 << 20;

/// The lines of a text header.
pub(super) struct HeaderLines<'a, R> {
    reader: io::Take<&'a mut R>,
}

impl<'a, R: BufRead> HeaderLines<'a, R> {
    pub(super) fn new(reader: &'a mut R) -> Self {
        HeaderLines { reader: reader.take(MAX_HEADER_BYTES) }
    }

    /// The next line without white space at its end; none at the end of the file.
    ///
    /// # Errors
    ///
    /// For a header that is too long, without the name of the file.
    pub(super) fn next(&mut self) -> Result<Option<String>, String> {
        let mut line = Vec::new();
        let n = self.reader.read_until(b'\n', &mut line).map_err(|e| e.to_string())?;
        if n > 0 && line.last() != Some(&b'\n') && self.reader.limit() == 0 {
            return Err(format!("the header is longer than {MAX_HEADER_BYTES} bytes"));
        }
        Ok((n > 0).then(|| String::from_utf8_lossy(&line).trim_end().to_owned()))
    }
}

/// Reads a text without keeping it: first lines, then words, which are separated by white space or commas.
pub(crate) struct TextReader<R> {
    reader: R,
    text: Vec<u8>,
}

impl<R: BufRead> TextReader<R> {
    pub(crate) fn new(reader: R) -> Self {
        TextReader { reader, text: Vec::new() }
    }

    /// The bytes of the next line, without its end.
    ///
    /// # Errors
    ///
    /// `InvalidData` at the end of the file, and for a line that is too long.
    pub(crate) fn line_bytes(&mut self) -> io::Result<&[u8]> {
        self.text.clear();
        let limit = MAX_LINE_BYTES as u64;
        if self.reader.by_ref().take(limit).read_until(b'\n', &mut self.text)? == 0 {
            return Err(invalid("the file ends before its samples"));
        }
        if self.text.len() == MAX_LINE_BYTES && self.text.last() != Some(&b'\n') {
            return Err(invalid(format!("a line of more than {MAX_LINE_BYTES} bytes")));
        }
        Ok(self.text.trim_ascii_end())
    }

    /// The next line, trimmed.
    pub(crate) fn line(&mut self) -> io::Result<&str> {
        let bytes = self.line_bytes()?;
        std::str::from_utf8(bytes).map(str::trim).map_err(|_| invalid("a line that is not text"))
    }

    /// The next word; none at the end of the file.
    ///
    /// # Errors
    ///
    /// `InvalidData` for a word that is not UTF-8 or too long.
    pub(crate) fn word(&mut self) -> io::Result<Option<&str>> {
        let is_space = |b: u8| b.is_ascii_whitespace() || b == b',';
        self.text.clear();
        loop {
            let ready = self.reader.fill_buf()?;
            let at_end = ready.is_empty();
            let start = match self.text.is_empty() {
                true => ready.iter().position(|&b| !is_space(b)).unwrap_or(ready.len()),
                false => 0,
            };
            let end = ready[start..].iter().position(|&b| is_space(b));
            let end = end.map_or(ready.len(), |end| start + end);
            self.text.extend_from_slice(&ready[start..end]);
            let is_whole = end < ready.len();
            self.reader.consume(end);
            if self.text.len() > MAX_LINE_BYTES {
                return Err(invalid(format!("a word of more than {MAX_LINE_BYTES} bytes")));
            }
            if at_end || is_whole {
                break;
            }
        }
        if self.text.is_empty() {
            return Ok(None);
        }
        let text = std::str::from_utf8(&self.text);
        text.map(Some).map_err(|_| invalid("a word that is not text"))
    }
}

/// Exactly `n` samples as text in the last `length` bytes of a file.
pub(super) fn read_samples(
    reader: &mut impl BufRead,
    length: u64,
    sample_type: SampleType,
    n: usize,
    description: &str,
) -> io::Result<Samples> {
    check_text_length(length, n, description)?;
    let mut bytes = try_filled_vec(usize::try_from(length).unwrap_or(usize::MAX), 0u8)?;
    reader.read_exact(&mut bytes)?;
    samples(&bytes, sample_type, n, description)
}

/// Checks that `n` numbers fit `length` bytes of text: a number and a separator take at least two.
///
/// # Errors
///
/// `InvalidData` if they do not.
pub(super) fn check_text_length(length: u64, n: usize, description: &str) -> io::Result<()> {
    if n as u64 <= length / 2 + 1 {
        return Ok(());
    }
    Err(invalid(format!("{length} bytes of text, too few for {description}")))
}

/// Exactly `n` samples separated by white space or commas.
///
/// # Errors
///
/// `InvalidData` for more or fewer, and for other than numbers of the type. `what` describes the samples.
pub(crate) fn samples(
    bytes: &[u8],
    sample_type: SampleType,
    n: usize,
    what: &str,
) -> io::Result<Samples> {
    check_text_length(bytes.len() as u64, n, what)?;
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
    let mut values = try_filled_vec(n, T::default())?;
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

/// The first number of a word and the rest of the word. Numbers of Fortran programs fill their columns, so that a minus sign may be
/// all that separates two of them; exponents may begin with D, and if they have three digits, have no letter: `1.5-105`.
pub(crate) fn split_number(word: &str) -> Option<(f64, &str)> {
    if let Ok(value) = word.parse() {
        return Some((value, ""));
    }
    let bytes = word.as_bytes();
    let is_sign = |i: usize| matches!(bytes.get(i), Some(b'+' | b'-'));
    let digits_end = |start: usize| {
        let n = bytes[start.min(bytes.len())..].iter().take_while(|b| b.is_ascii_digit()).count();
        start + n
    };
    let start = usize::from(is_sign(0));
    let whole = digits_end(start);
    let has_point = bytes.get(whole) == Some(&b'.');
    let mantissa = if has_point { digits_end(whole + 1) } else { whole };
    let has_letter = matches!(bytes.get(mantissa), Some(b'e' | b'E' | b'd' | b'D'));
    let exponent = mantissa + usize::from(has_letter);
    let first_digit = exponent + usize::from(is_sign(exponent));
    let end = digits_end(first_digit);
    let is_exponent = if has_letter {
        end > first_digit
    } else {
        let is_next_point = bytes.get(end) == Some(&b'.');
        has_point && is_sign(exponent) && end - first_digit == 3 && !is_next_point
    };
    let (value, end) = if is_exponent {
        let text = format!("{}e{}", &word[..mantissa], &word[exponent..end]);
        (text.parse().ok()?, end)
    } else {
        (word[..mantissa].parse().ok()?, mantissa)
    };
    (end == word.len() || is_sign(end)).then(|| (value, &word[end..]))
}

/// The finite numbers of a line of a Fortran program, if there are exactly `N`.
pub(crate) fn columns<const N: usize>(line: &str) -> Option<[f64; N]> {
    let mut values = Vec::new();
    for mut word in line.split_whitespace() {
        while !word.is_empty() {
            let (value, rest) = split_number(word)?;
            values.push(value);
            word = rest;
        }
    }
    let values: [f64; N] = values.try_into().ok()?;
    values.iter().all(|v| v.is_finite()).then_some(values)
}

/// The numbers of a text if it consists of exactly `N`.
pub(crate) fn exactly<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let values: Option<Vec<T>> = text.split_whitespace().map(|v| v.parse().ok()).collect();
    values?.try_into().ok()
}

/// As [`exactly`], for finite numbers.
pub(crate) fn finite<const N: usize>(text: &str) -> Option<[f64; N]> {
    exactly(text).filter(|values: &[f64; N]| values.iter().all(|v| v.is_finite()))
}

/// The names of a printf pattern with one `%d` for first, last and step; `None` for other patterns and for more than
/// `max` names.
pub(crate) fn numbered(pattern: &str, numbers: [&str; 3], max: usize) -> Option<Vec<String>> {
    let [first, last, step] = numbers.map(|n| n.parse::<u32>().ok());
    let (first, last, step) = (first?, last?, step.filter(|&s| s > 0)?);
    let (before, rest) = pattern.split_once('%')?;
    let (width, after) = rest.split_once('d')?;
    let is_padded = width.starts_with('0');
    let width: usize = if width.is_empty() { 0 } else { width.parse().ok().filter(|&w| w < 20)? };
    let n = (last.checked_sub(first)? / step) as usize + 1;
    if n > max.min(1 << 16) {
        return None;
    }
    let name = |i: usize| {
        let number = first + i as u32 * step;
        let digits =
            if is_padded { format!("{number:0width$}") } else { format!("{number:width$}") };
        format!("{before}{digits}{after}")
    };
    Some((0..n).map(name).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(mut word: &str) -> Option<Vec<f64>> {
        let mut values = Vec::new();
        while !word.is_empty() {
            let (value, rest) = split_number(word)?;
            values.push(value);
            word = rest;
        }
        Some(values)
    }

    #[test]
    fn numbers_of_fortran_programs_are_separated_and_have_all_exponents() {
        for (word, expected) in [
            ("1", &[1.0][..]),
            ("-1.00000E-003-2.00000E-003-3.0E+002", &[-1e-3, -2e-3, -300.0]),
            ("1.50000-105", &[1.5e-105]),
            ("-1.5+101-2.5-110", &[-1.5e101, -2.5e-110]),
            ("-12.000000-100.500000", &[-12.0, -100.5]),
            ("-1.5-105.25", &[-1.5, -105.25]),
            ("0.25D-02", &[0.0025]),
            ("2.5d+02-.5D0", &[250.0, -0.5]),
            ("5.", &[5.0]),
        ] {
            assert_eq!(all(word).as_deref(), Some(expected), "{word}");
        }
        for wrong in ["x", "-", "1.5x", "1-2x", "********", "1e", "1.5D", "--1", "1.0E-", "é1"] {
            assert_eq!(all(wrong), None, "{wrong}");
        }
    }
}
