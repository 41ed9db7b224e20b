//! Short names in the joined scripts of a page for what they declare at their top.
//!
//! # Theory
//!
//! A name may be another one where every place that has it means the same. That holds for what is declared outside all brackets
//! as long as the name is never a property too: behind a dot, or where an object may be written down or taken apart. A local name
//! that is the same is renamed with it, which changes nothing. Names within templates are not looked for, so whatever occurs in one
//! stays.

use std::collections::BTreeMap;

use super::script::{is_of_name, length_of_piece};

/// What is before the new names: no script has a name that begins with it.
const SIGN: char = '$';

/// What follows it, one letter for those that are used most.
const LETTERS: &[u8] = b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";

/// A script in which names that are declared outside all brackets are short.
pub(super) fn shortened(script: &str) -> String {
    let pieces = pieces(script);
    let declared = declared(&pieces);
    let mut uses: BTreeMap<&str, usize> = declared.iter().map(|&name| (name, 0)).collect();
    for (i, piece) in pieces.iter().enumerate() {
        if let Some(n) = uses.get_mut(piece) {
            *n += 1;
            if is_property(&pieces, i) {
                uses.remove(piece);
            }
        } else if piece.starts_with('`') {
            piece.split(|c| !is_of_name(c)).for_each(|word| {
                uses.remove(word);
            });
        }
    }
    let mut names: Vec<(&str, usize)> = uses.into_iter().collect();
    names.sort_by_key(|&(name, n)| (std::cmp::Reverse(n * name.len()), name));
    let short: BTreeMap<&str, String> =
        names.iter().enumerate().map(|(i, &(name, _))| (name, short_name(i))).collect();
    pieces.iter().map(|&piece| short.get(piece).map_or(piece, String::as_str)).collect()
}

/// Names, literals and single characters, one after the other.
fn pieces(script: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut at = 0;
    while at < script.len() {
        let length = length_of_piece(&script[..at], &script[at..]);
        pieces.push(&script[at..at + length]);
        at += length;
    }
    pieces
}

/// What is declared outside all brackets.
fn declared<'a>(pieces: &[&'a str]) -> Vec<&'a str> {
    let mut depth = 0;
    let mut declared = Vec::new();
    for (i, &piece) in pieces.iter().enumerate() {
        match piece {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            "function" | "class" | "let" if depth == 0 && pieces.get(i + 1) == Some(&" ") => {
                declared.extend(pieces.get(i + 2));
            }
            _ => {}
        }
    }
    declared
}

/// Whether a name may be that of a property: a place among arguments looks the same and counts as one.
fn is_property(pieces: &[&str], i: usize) -> bool {
    let solid = |piece: &&&str| !piece.trim().is_empty();
    let before = pieces[..i].iter().rev().filter(solid).take(2).copied().collect::<Vec<_>>();
    let after = pieces[i + 1..].iter().find(solid).copied().unwrap_or_default();
    match before[..] {
        // Three dots spread what is named.
        [".", "."] => false,
        [".", ..] => true,
        ["{" | ",", ..] => matches!(after, "," | "}" | ":" | "="),
        _ => false,
    }
}

fn short_name(i: usize) -> String {
    let letter = char::from(LETTERS[i % LETTERS.len()]);
    match i / LETTERS.len() {
        0 => format!("{SIGN}{letter}"),
        n => format!("{SIGN}{letter}{n}"),
    }
}

#[cfg(test)]
mod tests {
    use super::shortened;

    #[test]
    fn what_is_declared_at_the_top_is_short_unless_it_may_be_a_property() {
        for (script, shorter) in [
            ("function wanted(a){return a}wanted(1)", "function $a(a){return a}$a(1)"),
            ("let LONG=1\nlet WIDE=2\nf(LONG+WIDE+WIDE)", "let $b=1\nlet $a=2\nf($b+$a+$a)"),
            ("let kept=1\na.kept", "let kept=1\na.kept"),
            ("let kept=1\nf({kept:2})", "let kept=1\nf({kept:2})"),
            ("let kept=1\nf({a,kept})", "let kept=1\nf({a,kept})"),
            ("let kept=1\n`a ${kept}`", "let kept=1\n`a ${kept}`"),
            ("let spread=[]\n[...spread]", "let $a=[]\n[...$a]"),
            ("let there=1\nf('there')", "let $a=1\nf('there')"),
            ("function f(){let inner=1;return inner}", "function $a(){let inner=1;return inner}"),
            ("class Shape{}new Shape()", "class $a{}new $a()"),
        ] {
            assert_eq!(shortened(script), shorter, "{script}");
        }
    }
}
