//! Text on its way to a terminal: file names, fields of headers and names in spectra are whatever
//! somebody wrote there, escape sequences that move the cursor or rename the window included.
//!
//! Every message, error and table passes through [`plain`]; what is data (meshes, pictures, JSON, which
//! has its own escapes) does not.

use std::io::Write as _;

/// Characters of a name out of a file, of a word in a message, and of a value in a table; longer ones
/// lose their middle.
const LONGEST_NAME: usize = 80;
const LONGEST_WORD: usize = 160;
const LONGEST_VALUE: usize = 500;

/// Characters of a message; a path has 4,096 at most, but in a message of two both ends tell enough.
const LONGEST_LINE: usize = 1500;

/// The text with every control character in its escaped form, and those that turn the direction of
/// writing around: one line that a terminal only shows.
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

/// A value of a table: plain, and not longer than a reader wants.
pub(super) fn value(text: &str) -> String {
    plain(&shortened(text, LONGEST_VALUE))
}

/// A name that a file gives to something.
pub(super) fn name(text: &str) -> String {
    plain(&shortened(text, LONGEST_NAME))
}

/// A message on one line: plain, with words that nobody reads to their end shortened.
pub(crate) fn line(text: &str) -> String {
    let words: Vec<String> =
        text.split_whitespace().map(|word| shortened(word, LONGEST_WORD)).collect();
    plain(&shortened(&words.join(" "), LONGEST_LINE))
}

/// The text, or its beginning and its end: a path ends with the name, a message with what was
/// expected.
fn shortened(text: &str, longest: usize) -> String {
    let n = text.chars().count();
    if n <= longest {
        return text.to_owned();
    }
    let end = longest / 3;
    let head: String = text.chars().take(longest - 1 - end).collect();
    let tail: String = text.chars().skip(n - end).collect();
    format!("{head}…{tail}")
}

/// Prints a message on stderr. Where that cannot be done there is nobody to tell.
pub(crate) fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "isospectrum: {text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_a_terminal_obeys_is_left() {
        let text = "a\u{1b}]0;b\u{7}\n\r\u{9b}2J\u{202e}\u{7f}é漢";
        let safe = plain(text);
        assert_eq!(safe, "a\\u{1b}]0;b\\u{7}\\n\\r\\u{9b}2J\\u{202e}\\u{7f}é漢");
        assert!(!safe.chars().any(char::is_control));
    }

    #[test]
    fn long_words_and_long_messages_keep_both_ends() {
        let long = format!("begin{}end", "x".repeat(900_000));
        let said = line(&format!("type '{long}', expected uint8"));
        assert!(
            said.starts_with("type 'beginx") && said.ends_with("xend', expected uint8"),
            "{said}"
        );
        assert!(said.chars().count() < 250, "{said}");
        let words = line(&format!("a.nrrd: {}: expected three", "word ".repeat(100_000)));
        assert!(words.starts_with("a.nrrd: word") && words.ends_with("expected three"));
        assert_eq!(words.chars().count(), LONGEST_LINE);
        assert_eq!(value(&long).chars().count(), LONGEST_VALUE);
        assert_eq!(line("a\n  b"), "a b");
    }
}
