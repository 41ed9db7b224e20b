//! Makes text safe for a terminal: file names, fields of headers and names in spectra can contain anything, including escape
//! sequences that move the cursor or rename the window.
//!
//! Every message, error and table passes through [`plain`]. Data (meshes, pictures, JSON, which has its own escapes) does not.

use std::io::Write as _;

/// Maximum number of characters of a name in a file; longer ones lose their middle.
const MAX_NAME: usize = 80;

/// Maximum number of characters of a word in a message.
const MAX_WORD: usize = 160;

/// Maximum number of characters of a value in a table.
const MAX_VALUE: usize = 500;

/// Maximum number of characters of a message: both ends of a long one are enough to understand it.
const MAX_LINE: usize = 1500;

/// Escapes control characters and those that change the direction of writing: returns one line of visible text.
pub(super) fn plain(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match is_harmless(c) {
            true => safe.push(c),
            false => safe.extend(c.escape_default()),
        }
    }
    safe
}

fn is_harmless(c: char) -> bool {
    let is_format =
        matches!(c, '\u{200e}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    !c.is_control() && !is_format
}

/// Makes a value of a table safe, and shortens it.
pub(super) fn value(text: &str) -> String {
    plain(&shortened(text, MAX_VALUE))
}

/// Makes a name from a file safe, and shortens it.
pub(super) fn name(text: &str) -> String {
    plain(&shortened(text, MAX_NAME))
}

/// Makes a message safe and one line, and shortens long words.
pub(crate) fn line(text: &str) -> String {
    let words: Vec<String> =
        text.split_whitespace().map(|word| shortened(word, MAX_WORD)).collect();
    plain(&shortened(&words.join(" "), MAX_LINE))
}

/// Removes the middle of a long text: a path ends with its name, a message with what was expected.
fn shortened(text: &str, max: usize) -> String {
    let n = text.chars().count();
    if n <= max {
        return text.to_owned();
    }
    let end = max / 3;
    let head: String = text.chars().take(max - 1 - end).collect();
    let tail: String = text.chars().skip(n - end).collect();
    format!("{head}…{tail}")
}

/// Prints a message on stderr; a failure cannot be reported anywhere.
pub(crate) fn print_message(text: &str) {
    let _ = writeln!(std::io::stderr(), "isospectrum: {text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        let text = "a\u{1b}]0;b\u{7}\n\r\u{9b}2J\u{202e}\u{7f}é漢";
        let safe = plain(text);
        assert_eq!(safe, "a\\u{1b}]0;b\\u{7}\\n\\r\\u{9b}2J\\u{202e}\\u{7f}é漢");
        assert!(!safe.chars().any(char::is_control));
    }

    #[test]
    fn long_words_and_long_messages_keep_both_ends() {
        let long = format!("begin{}end", "x".repeat(900_000));
        let message = line(&format!("type '{long}', expected uint8"));
        assert!(
            message.starts_with("type 'beginx") && message.ends_with("xend', expected uint8"),
            "{message}"
        );
        assert!(message.chars().count() < 250, "{message}");
        let words = line(&format!("a.nrrd: {}: expected three", "word ".repeat(100_000)));
        assert!(words.starts_with("a.nrrd: word") && words.ends_with("expected three"));
        assert_eq!(words.chars().count(), MAX_LINE);
        assert_eq!(value(&long).chars().count(), MAX_VALUE);
        assert_eq!(line("a\n  b"), "a b");
    }
}
