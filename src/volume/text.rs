//! Samples and headers that are text.

use std::io::{self, BufRead, Read as _};
use std::str::FromStr;

use super::decode::{SampleType, exact_f64, invalid, reserve};
use crate::volume::Samples;

/// The start of a text, so that a damaged file cannot fill the screen.
pub(crate) fn shortened(text: &str) -> String {
    let start: String = text.chars().take(40).flat_map(char::escape_default).collect();
    if text.chars().nth(40).is_some() { start + "..." } else { start }
}

/// Longest line and longest word of a header or of samples, bytes: numbers of any format are far shorter.
const LONGEST: usize = 1 << 16;

/// A text that is read as it comes: lines first, then words, which white space or commas part.
pub(crate) struct Stream<R> {
    reader: R,
    text: Vec<u8>,
}

impl<R: BufRead> Stream<R> {
    pub(crate) fn new(reader: R) -> Self {
        Stream { reader, text: Vec::new() }
    }

    /// The bytes of the next line, without its end.
    ///
    /// # Errors
    ///
    /// `InvalidData` where there is none, or one that is too long.
    pub(crate) fn line_bytes(&mut self) -> io::Result<&[u8]> {
        self.text.clear();
        let most = LONGEST as u64;
        if self.reader.by_ref().take(most).read_until(b'\n', &mut self.text)? == 0 {
            return Err(invalid("the file ends before its samples"));
        }
        if self.text.len() == LONGEST && self.text.last() != Some(&b'\n') {
            return Err(invalid(format!("a line of more than {LONGEST} bytes")));
        }
        Ok(self.text.trim_ascii_end())
    }

    /// The next line, without what is around it.
    ///
    /// # Errors
    ///
    /// As [`Stream::line_bytes`], and where it is no text.
    pub(crate) fn line(&mut self) -> io::Result<&str> {
        let bytes = self.line_bytes()?;
        std::str::from_utf8(bytes).map(str::trim).map_err(|_| invalid("a line that is not text"))
    }

    /// The next word, on whatever line; none at the end.
    ///
    /// # Errors
    ///
    /// `InvalidData` where it is no text, or too long.
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
            if self.text.len() > LONGEST {
                return Err(invalid(format!("a word of more than {LONGEST} bytes")));
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

/// The names of a pattern of C's printf with one whole number; `None` if it is none, or tells more than `most`.
pub(crate) fn numbered(pattern: &str, numbers: [&str; 3], most: usize) -> Option<Vec<String>> {
    let [first, last, step] = numbers.map(|n| n.parse::<u32>().ok());
    let (first, last, step) = (first?, last?, step.filter(|&s| s > 0)?);
    let (before, rest) = pattern.split_once('%')?;
    let (width, after) = rest.split_once('d')?;
    let is_padded = width.starts_with('0');
    let width: usize = if width.is_empty() { 0 } else { width.parse().ok().filter(|&w| w < 20)? };
    let n = (last.checked_sub(first)? / step) as usize + 1;
    if n > most.min(1 << 16) {
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
