//! Splits a script into tokens: words, signs, and texts that stay as they are. Comments are left out.
//!
//! A template is split at its expressions, whose tokens are between its parts: `` `a${ ``, the expression, `` }b` ``.

use std::borrow::Cow;

/// The words after which a slash begins a regular expression.
const BEFORE_EXPRESSION: [&str; 6] = ["return", "typeof", "case", "in", "of", "void"];

/// The white space before a token, in which comments count as nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Space {
    None,
    Blank,
    /// With a line break, which may end a statement.
    Break,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A name, a word of the language or the digits of a number.
    Word,
    /// One character.
    Sign,
    /// A string, a regular expression or a part of a template.
    Text,
}

#[derive(Clone, Debug)]
pub(super) struct Token<'a> {
    pub(super) text: Cow<'a, str>,
    pub(super) kind: Kind,
    pub(super) space: Space,
}

impl Token<'_> {
    /// Whether this is the sign `sign`.
    pub(super) fn is(&self, sign: char) -> bool {
        self.kind == Kind::Sign && self.text.starts_with(sign)
    }

    /// Whether an expression or a list begins after this token.
    pub(super) fn opens(&self) -> bool {
        match self.kind {
            Kind::Sign => self.text.starts_with(['(', '[', '{']),
            Kind::Text => self.text.ends_with("${") && self.text.starts_with(['`', '}']),
            Kind::Word => false,
        }
    }

    /// Whether the expression or list that was begun last ends with this token. A part of a template may begin the next one.
    pub(super) fn closes(&self) -> bool {
        match self.kind {
            Kind::Sign => self.text.starts_with([')', ']', '}']),
            Kind::Text => self.text.starts_with('}'),
            Kind::Word => false,
        }
    }
}

/// Splits a script.
pub(super) fn tokens(script: &str) -> Vec<Token<'_>> {
    let mut tokens: Vec<Token> = Vec::new();
    // For each open brace, whether it is in a template.
    let mut braces = Vec::new();
    let (mut rest, mut space) = (script, Space::None);
    while let Some(first) = rest.chars().next() {
        let (kind, length) = match first {
            c if c.is_whitespace() => {
                let end = rest.find(|c: char| !c.is_whitespace()).unwrap_or(rest.len());
                let is_break = rest[..end].contains('\n') || space == Space::Break;
                space = if is_break { Space::Break } else { Space::Blank };
                rest = &rest[end..];
                continue;
            }
            '/' if rest.starts_with("//") => {
                rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
                continue;
            }
            '/' if rest.starts_with("/*") => {
                rest = rest.split_once("*/").map_or("", |(_, after)| after);
                continue;
            }
            '"' | '\'' => (Kind::Text, quoted(rest, first)),
            '`' => (Kind::Text, template_part(rest)),
            '}' if braces.pop() == Some(true) => (Kind::Text, template_part(rest)),
            '/' if begins_expression(tokens.last()) => (Kind::Text, regular_expression(rest)),
            c if is_word(c) => (Kind::Word, rest.find(|c| !is_word(c)).unwrap_or(rest.len())),
            c => (Kind::Sign, c.len_utf8()),
        };
        let (text, after) = rest.split_at(length);
        let token = Token { text: text.into(), kind, space };
        if token.is('{') || kind == Kind::Text && token.opens() {
            braces.push(kind == Kind::Text);
        }
        tokens.push(token);
        (rest, space) = (after, Space::None);
    }
    tokens
}

pub(super) fn is_word(c: char) -> bool {
    c.is_alphanumeric() || "_$#".contains(c)
}

/// Whether a slash after this token begins a regular expression; else it divides.
fn begins_expression(last: Option<&Token>) -> bool {
    let Some(Token { text, kind, .. }) = last else { return true };
    match kind {
        Kind::Word => BEFORE_EXPRESSION.contains(&&**text),
        Kind::Sign => !text.starts_with([')', ']', '}']),
        Kind::Text => text.ends_with("${"),
    }
}

/// The length of a string.
fn quoted(text: &str, quote: char) -> usize {
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            '\\' => _ = characters.next(),
            _ if c == quote => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// The length of a template up to its end or its next expression.
fn template_part(text: &str) -> usize {
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            '\\' => _ = characters.next(),
            '`' => return at + 1,
            '$' if text[at..].starts_with("${") => return at + 2,
            _ => {}
        }
    }
    text.len()
}

/// The length of a regular expression with its flags.
fn regular_expression(text: &str) -> usize {
    let mut is_in_class = false;
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            '\\' => _ = characters.next(),
            '[' => is_in_class = true,
            ']' => is_in_class = false,
            '/' if !is_in_class => {
                let flags = text[at + 1..].find(|c| !is_word(c));
                return flags.map_or(text.len(), |n| at + 1 + n);
            }
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(script: &str) -> Vec<String> {
        tokens(script).into_iter().map(|token| token.text.into_owned()).collect()
    }

    #[test]
    fn strings_templates_and_regular_expressions_are_whole() {
        assert_eq!(texts("f(\"a  // b\")"), ["f", "(", "\"a  // b\"", ")"]);
        assert_eq!(texts("'it\\'s  /* c */'"), ["'it\\'s  /* c */'"]);
        assert_eq!(
            texts("x.match(/[/ ]  \\/ \"/g)"),
            ["x", ".", "match", "(", "/[/ ]  \\/ \"/g", ")"]
        );
        assert_eq!(texts("a / b / c"), ["a", "/", "b", "/", "c"]);
        assert_eq!(texts("(f) / 2 /* c */ // d"), ["(", "f", ")", "/", "2"]);
        assert_eq!(texts("return /a  b/"), ["return", "/a  b/"]);
    }

    #[test]
    fn the_expressions_of_a_template_are_between_its_parts() {
        assert_eq!(
            texts("`a  ${b + `${c({ d: \"}\" })}`}  e` + {}"),
            [
                "`a  ${", "b", "+", "`${", "c", "(", "{", "d", ":", "\"}\"", "}", ")", "}`",
                "}  e`", "+", "{", "}"
            ]
        );
    }
}
