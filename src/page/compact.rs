//! Writes the tokens of a script without white space that separates nothing. Four words, and fractions, are written shorter. Strings,
//! templates and regular expressions stay as they are.
//!
//! # Invariants
//!
//! No statement is empty: a block does not end in `while (x);`, whose semicolon would be lost.
//!
//! A line break stays where a statement may end without a semicolon: after a word, a closing bracket, a string or a number.

use super::tokens::{Space, Token, is_word};

/// A script without needless white space.
pub(super) fn compact(tokens: &[Token]) -> String {
    let mut script = String::new();
    for (i, token) in tokens.iter().enumerate() {
        let first = token.text.chars().next().unwrap_or(' ');
        if is_needed(token.space, &script, first) {
            script.push_str(if token.space == Space::Break { "\n" } else { " " });
        }
        // Neither a comma nor a semicolon is needed before what closes a list or a block; `for (;;)` has no block.
        let is_closing = token.closes() && first == token.text.chars().next_back().unwrap_or(' ');
        if is_closing && (script.ends_with(',') || first == '}' && script.ends_with(';')) {
            script.pop();
        }
        if !is_zero_of_fraction(tokens, i) {
            script.push_str(shorter(&token.text));
        }
    }
    script.push('\n');
    script
}

/// Whether a token is the zero of `0.5`.
fn is_zero_of_fraction(tokens: &[Token], i: usize) -> bool {
    let [zero, point, digits, ..] = &tokens[i..] else { return false };
    let is_next = |token: &Token| token.space == Space::None;
    zero.text == "0"
        && point.is('.')
        && digits.text.starts_with(|c: char| c.is_ascii_digit())
        && is_next(point)
        && is_next(digits)
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
fn is_needed(space: Space, script: &str, next: char) -> bool {
    let Some(last) = script.chars().next_back() else { return false };
    match space {
        Space::None => false,
        Space::Break => {
            // No statement ends after an operator or an opening bracket, or before a closing one or a point.
            let is_step = script.ends_with("++") || script.ends_with("--");
            let goes_on = ";,{([=<>&|?:+-*!\n".contains(last) && !is_step;
            !(goes_on || ";,)]}.?:&|=*".contains(next))
        }
        Space::Blank => (is_word(last) && is_word(next)) || ("+-".contains(last) && last == next),
    }
}

#[cfg(test)]
mod tests {
    use crate::page::tokens::tokens;

    fn compact(text: &str) -> String {
        super::compact(&tokens(text))
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
            "f(`a  ${b+`  ${c[\"}\"]}`}  d`);\n",
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
