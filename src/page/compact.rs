//! Leaves out what a browser does not need of a script: comments, and white space that separates nothing. Four words, and
//! fractions, are written shorter. Names stay as they are, and so do strings, templates and regular expressions.
//!
//! # Invariants
//!
//! No statement is empty: a block does not end in `while (x);`, whose semicolon would be lost.
//!
//! A line break stays where a statement may end without a semicolon: after a word, a closing bracket, a string or a number.

/// The words after which a slash begins a regular expression.
const BEFORE_EXPRESSION: [&str; 6] = ["return", "typeof", "case", "in", "of", "void"];

/// Appends a script without its comments and needless white space.
pub(super) fn push_compact(text: &str, script: &mut String) {
    let mut rest = text;
    let mut space = "";
    while let Some(first) = rest.chars().next() {
        let length = match first {
            c if c.is_whitespace() => {
                let end = rest.find(|c: char| !c.is_whitespace()).unwrap_or(rest.len());
                space = if rest[..end].contains('\n') || space == "\n" { "\n" } else { " " };
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
            '"' | '\'' => quoted(rest, first),
            '`' => template(rest),
            '/' if begins_expression(script) => regular_expression(rest),
            c if is_word(c) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        if is_needed(space, script, first) {
            script.push_str(space);
        }
        space = "";
        // Neither a comma nor a semicolon is needed before what closes a list or a block; `for (;;)` has no block.
        if ")]}".contains(first) && script.ends_with(',') || first == '}' && script.ends_with(';') {
            script.pop();
        }
        let (token, after) = rest.split_at(length);
        // The zero of `0.5`.
        let is_zero = token == "0"
            && after
                .strip_prefix('.')
                .is_some_and(|digits| digits.starts_with(|c: char| c.is_ascii_digit()));
        if !is_zero {
            script.push_str(shorter(token));
        }
        rest = after;
    }
    script.push('\n');
}

/// The same in fewer bytes, for a script that does not assign to constants and has no such property names.
fn shorter(token: &str) -> &str {
    match token {
        "const" => "let",
        "true" => "!0",
        "false" => "!1",
        "undefined" => "void 0",
        _ => token,
    }
}

/// Whether white space between the end of a script and a character separates anything.
fn is_needed(space: &str, script: &str, next: char) -> bool {
    let Some(last) = script.chars().next_back() else { return false };
    match space {
        "" => false,
        "\n" => {
            // No statement ends after an operator or an opening bracket, or before a closing one or a point.
            let is_step = script.ends_with("++") || script.ends_with("--");
            let goes_on = ";,{([=<>&|?:+-*!\n".contains(last) && !is_step;
            !(goes_on || ";,)]}.?:&|=*".contains(next))
        }
        _ => (is_word(last) && is_word(next)) || ("+-".contains(last) && last == next),
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || "_$#".contains(c)
}

/// Whether a slash after this text begins a regular expression; else it divides.
fn begins_expression(script: &str) -> bool {
    let Some(last) = script.trim_end().chars().next_back() else { return true };
    let word = script.trim_end().rsplit(|c| !is_word(c)).next().unwrap_or("");
    BEFORE_EXPRESSION.contains(&word) || !(is_word(last) || ")]}\"'`".contains(last))
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

/// The length of a template, with the expressions in it.
fn template(text: &str) -> usize {
    let mut at = 1;
    while let Some(c) = text[at..].chars().next() {
        at += match c {
            '\\' => 1 + text[at + 1..].chars().next().map_or(0, char::len_utf8),
            '`' => return at + 1,
            '$' if text[at..].starts_with("${") => 2 + braced(&text[at + 2..]),
            c => c.len_utf8(),
        };
    }
    text.len()
}

/// The length of an expression up to the brace that closes it, inclusive.
fn braced(text: &str) -> usize {
    let (mut at, mut depth) = (0, 1);
    while let Some(c) = text[at..].chars().next() {
        at += match c {
            '"' | '\'' => quoted(&text[at..], c),
            '`' => template(&text[at..]),
            c => c.len_utf8(),
        };
        depth += i32::from(c == '{') - i32::from(c == '}');
        if depth == 0 {
            return at;
        }
    }
    text.len()
}

/// The length of a regular expression without its flags.
fn regular_expression(text: &str) -> usize {
    let mut is_in_class = false;
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            '\\' => _ = characters.next(),
            '[' => is_in_class = true,
            ']' => is_in_class = false,
            '/' if !is_in_class => return at + 1,
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compact(text: &str) -> String {
        let mut script = String::new();
        push_compact(text, &mut script);
        script
    }

    #[test]
    fn comments_and_needless_white_space_are_left_out() {
        let text = "// One.\n\n/** Two. */\nlet a = b + +c; // three\n    /*\n     * Four.\n     */\n    g( a , [ 1 ] );\n";
        assert_eq!(compact(text), "let a=b+ +c;g(a,[1]);\n");
        assert_eq!(
            compact("return x in y;\nclass A {\n    #b;\n}\n"),
            "return x in y;class A{#b}\n"
        );
    }

    #[test]
    fn words_and_fractions_are_written_shorter() {
        assert_eq!(
            compact("const a = true ? 0.5 : -0.25 + 10.5 + 0;\n"),
            "let a=!0?.5:-.25+10.5+0;\n"
        );
        assert_eq!(compact("return 0.5 * a[0].b;\n"), "return .5*a[0].b;\n");
        assert_eq!(compact("a = b === undefined ? undefined : c;\n"), "a=b===void 0?void 0:c;\n");
    }

    #[test]
    fn strings_templates_and_regular_expressions_stay_as_they_are() {
        for text in [
            "f(\"a  // b\");\n",
            "f('it\\'s  /* c */');\n",
            "f(`a  ${b + `  ${c[\"}\"]}` }  d`);\n",
            "x.match(/[/ ]  \\/ \"/);\n",
            "return/a  b/;\n",
        ] {
            assert_eq!(compact(text), text);
        }
        assert_eq!(compact("a = b / c / d;\ne = (f) / 2;\n"), "a=b/c/d;e=(f)/2;\n");
    }

    #[test]
    fn a_line_break_that_ends_a_statement_stays() {
        assert_eq!(
            compact("const a = {\n  b: 1,\n}\nlet c = d\nc++\ne\n"),
            "let a={b:1}\nlet c=d\nc++\ne\n"
        );
        assert_eq!(compact("a\n    .b()\n    ?.c;\nd = e\n    && f;\n"), "a.b()?.c;d=e&&f;\n");
    }
}
