//! The axes of a NRRD array: three of space, and of a 4-D array one of channels or frames.

use super::fields::NrrdFields;
use crate::volume::text::{exactly, shortened};

/// The axis of a 4-D array that is not one of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FourthAxis {
    /// Its number of entries.
    pub(super) n: usize,
    /// Whether it is the fastest, so that the entries of a sample are adjacent; else it is the slowest.
    pub(super) is_fastest: bool,
}

/// Fields with a value for each axis.
const PER_AXIS: [&str; 9] = [
    "sizes",
    "kinds",
    "spacings",
    "axis mins",
    "axis maxs",
    "centers",
    "units",
    "thicknesses",
    "space directions",
];

/// The fields without the values of an axis that is not one of space, the number of samples along the others, and that axis.
pub(super) fn axes(
    mut fields: NrrdFields,
) -> Result<(NrrdFields, [usize; 3], Option<FourthAxis>), String> {
    let dimension: usize = fields.number("dimension")?.ok_or("no 'dimension' field")?;
    match dimension {
        3 => {
            check_kinds(&fields)?;
            let dims = fields.three::<usize>("sizes")?.ok_or("no 'sizes' field")?;
            Ok((fields, dims, None))
        }
        4 => {
            let text = fields.get("sizes").ok_or("no 'sizes' field")?;
            let sizes: [usize; 4] = exactly(text)
                .ok_or_else(|| format!("'sizes' is '{}', expected 4 numbers", shortened(text)))?;
            let at = fourth_axis(&fields)?;
            let is_fastest = match at {
                0 => true,
                3 => false,
                _ => {
                    return Err(format!(
                        "axis {at} is not of space, expected the first or the last"
                    ));
                }
            };
            for name in PER_AXIS {
                fields.replace(name, |text| without_value(text, at));
            }
            check_kinds(&fields)?;
            let dims = fields.three::<usize>("sizes")?.ok_or("no 'sizes' field")?;
            Ok((fields, dims, Some(FourthAxis { n: sizes[at], is_fastest })))
        }
        _ => Err(format!("'dimension' is {dimension}, expected 3, or 4 with --frame or --channel")),
    }
}

/// The axis of a 4-D array that is not one of space: that without a direction, or of another kind; without either the last.
fn fourth_axis(fields: &NrrdFields) -> Result<usize, String> {
    let directions = values(fields.get("space directions").unwrap_or_default());
    let without: Vec<usize> =
        (0..directions.len()).filter(|&a| !directions[a].starts_with('(')).collect();
    let kinds = values(fields.get("kinds").unwrap_or_default());
    let is_space = |kind: &str| matches!(kind.to_ascii_lowercase().as_str(), "domain" | "space");
    let others: Vec<usize> = (0..kinds.len()).filter(|&a| !is_space(&kinds[a])).collect();
    match (&without[..], &others[..]) {
        (&[axis], _) if directions.len() == 4 => Ok(axis),
        (_, &[axis]) if kinds.len() == 4 => Ok(axis),
        ([], [] | [_, _, _, _]) if directions.is_empty() => Ok(3),
        _ => Err("axes of a 4-D array, expected three of space".to_owned()),
    }
}

/// The values of a field: words, vectors in parentheses, and texts in quotes.
fn values(text: &str) -> Vec<String> {
    let (mut all, mut value) = (Vec::new(), String::new());
    let (mut is_vector, mut is_quoted) = (false, false);
    for c in text.chars() {
        match c {
            '(' => is_vector = true,
            ')' => is_vector = false,
            '"' => is_quoted = !is_quoted,
            _ => {}
        }
        let is_space = c.is_whitespace();
        let is_new = c == '(' && !value.is_empty();
        if (is_space && !is_vector && !is_quoted || is_new) && !value.is_empty() {
            all.push(std::mem::take(&mut value));
        }
        if !is_space || is_quoted {
            value.push(c);
        }
    }
    if !value.is_empty() {
        all.push(value);
    }
    all
}

/// A field without the value of an axis.
fn without_value(text: &str, axis: usize) -> String {
    let mut all = values(text);
    if axis < all.len() {
        all.remove(axis);
    }
    all.join(" ")
}

/// Checks that samples can be interpolated along each axis: a 3-D array may also be a colour image.
fn check_kinds(fields: &NrrdFields) -> Result<(), String> {
    for kind in fields.get("kinds").unwrap_or_default().split_whitespace() {
        let lower = kind.to_ascii_lowercase();
        if !matches!(lower.as_str(), "domain" | "space" | "time" | "none" | "???") {
            return Err(format!("axis of kind '{}', expected a scalar volume", shortened(kind)));
        }
    }
    Ok(())
}
