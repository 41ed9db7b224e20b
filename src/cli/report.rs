//! Reports on stdout: a table for people, or JSON that programs can rely on.

use isospectrum::{Error, Result};
use serde::Serialize;

use super::{output, terminal};

/// Raised when a field of a JSON report changes its meaning or goes away; new fields do not count.
const VERSION: u32 = 2;

#[derive(Serialize)]
struct Versioned<'a, T> {
    report: &'a str,
    version: u32,
    #[serde(flatten)]
    body: &'a T,
}

/// Prints `body` as JSON, with the name and the version of the report.
pub(super) fn print_json(name: &str, body: &impl Serialize) -> Result<()> {
    let versioned = Versioned { report: name, version: VERSION, body };
    let text = serde_json::to_string_pretty(&versioned)
        .map_err(|error| Error::input(format!("the {name} report has no JSON form: {error}")))?;
    // JSON's own escapes leave out DEL and the second set of control characters.
    let is_bare = |c: char| c.is_control() && c != '\n';
    let escaped = |c: char| format!("\\u{:04x}", u32::from(c));
    output::print(&text.chars().fold(String::with_capacity(text.len()), |mut safe, c| {
        if is_bare(c) {
            safe += &escaped(c);
        } else {
            safe.push(c);
        }
        safe
    }))
}

/// Tells a text of several lines on stderr: a message is one line.
pub(super) fn tell(text: &str) {
    text.lines().for_each(|line| log::info!("{line}"));
}

/// Rows of a table: names left, values right of them, as [`terminal::value`] makes them.
pub(super) fn table(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let row = |name: &str, value: &str| format!("{name:width$}  {}\n", terminal::value(value));
    rows.iter().map(|(name, value)| row(name, value)).collect()
}

/// A number with as many digits as tell something.
pub(super) fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    // Five significant digits, never fewer than the whole part has.
    let digits = (4 - x.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A share as a percentage.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share))
}

/// As [`number`], or a dash.
pub(super) fn number_or_dash(x: Option<f64>) -> String {
    x.map_or_else(|| "-".to_owned(), number)
}

/// Counts that are not 0, by name: `arcs 45, steps 69`.
pub(super) fn counts(counts: &serde_json::Value) -> String {
    let Some(counts) = counts.as_object() else { return "-".to_owned() };
    let counted = counts.iter().filter(|(_, value)| **value != 0);
    let parts: Vec<String> = counted.map(|(name, value)| format!("{name} {value}")).collect();
    if parts.is_empty() { "-".to_owned() } else { parts.join(", ") }
}

/// Bytes in units people read.
pub(super) fn bytes(n: u64) -> String {
    indicatif::HumanBytes(n).to_string()
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
        ] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn counts_above_zero_are_listed_by_name() {
        let found = serde_json::json!({ "steps": 3, "refused": 0, "arcs": 1 });
        assert_eq!(counts(&found), "arcs 1, steps 3");
        assert_eq!(counts(&serde_json::Value::Null), "-");
    }

    #[test]
    fn values_of_a_table_line_up() {
        let rows = [("a", "1".to_owned()), ("long", "2".to_owned())];
        assert_eq!(table(&rows), "a     1\nlong  2\n");
    }
}
