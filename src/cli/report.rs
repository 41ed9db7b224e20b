//! Reports on stdout: a table for people, or JSON in a stable form for programs.

pub(super) use isospectrum::settings::short_number as number;
use isospectrum::unstable::numbers::distinct;
use isospectrum::{Error, Result};
use serde::Serialize;

use super::{output, terminal};

/// Version of the JSON reports; raised when a field is removed or changes its meaning, not for new fields.
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
    // JSON does not escape DEL and the control characters from U+0080.
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

/// Logs a text line by line, as a message is one line.
pub(super) fn log_lines(text: &str) {
    text.lines().for_each(|line| log::info!("{line}"));
}

/// Returns a table with names on the left and values, safe for a terminal, on the right.
pub(super) fn table(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let row = |name: &str, value: &str| format!("{name:width$}  {}\n", terminal::value(value));
    rows.iter().map(|(name, value)| row(name, value)).collect()
}

/// Formats both ends of a range as [`number`], with as many digits more as distinguish them.
pub(super) fn range((low, high): (f64, f64)) -> String {
    let mut ends = [low, high].map(number);
    if low != high && ends[0] == ends[1] {
        ends = distinct([low, high]);
    }
    let [low, high] = ends;
    format!("{low} to {high}")
}

/// Formats a fraction as a percentage.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share))
}

/// Formats a number, or a dash for none.
pub(super) fn number_or_dash(x: Option<f64>) -> String {
    x.map_or_else(|| "-".to_owned(), number)
}

/// Lists counts that are not 0 by name, for people: `arcs 45, steps 69`.
pub(super) fn counts(counts: &serde_json::Value) -> String {
    let counts = counts.as_object().into_iter().flatten().filter(|(_, value)| **value != 0);
    let counts: Vec<String> = counts.map(|(name, value)| format!("{name} {value}")).collect();
    if counts.is_empty() { "-".to_owned() } else { counts.join(", ") }
}

/// Formats a number of bytes with a unit.
pub(super) fn bytes(n: u64) -> String {
    indicatif::HumanBytes(n).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_a_range_look_different_if_they_are() {
        assert_eq!(range((0.0, 1.0 / 3.0)), "0 to 0.33333");
        assert_eq!(range((1.0, 1.000_000_000_000_000_2)), "1 to 1.0000000000000002");
        assert_eq!(range((2.999_999_999_999_999_4e-40, 3e-40)), "2.999999999999999e-40 to 3e-40");
        assert_eq!(range((7.0, 7.0)), "7 to 7");
    }

    #[test]
    fn counts_are_listed_by_name() {
        let value = serde_json::json!({ "steps": 3, "arcs": 45, "refused": 0 });
        assert_eq!(counts(&value), "arcs 45, steps 3");
        assert_eq!(counts(&serde_json::Value::Null), "-");
    }

    #[test]
    fn values_of_a_table_line_up() {
        let rows = [("a", "1".to_owned()), ("long", "2".to_owned())];
        assert_eq!(table(&rows), "a     1\nlong  2\n");
    }
}
