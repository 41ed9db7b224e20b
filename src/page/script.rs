//! The scripts of a page as one, without what who reads the page has no use for: comments, indentation, and spaces that part
//! nothing.
//!
//! Names that are declared at the top become short (`names`), others stay, and so do ends of lines behind which a statement may
//! end: JavaScript puts semicolons there, and this knows no statements. Texts, templates and regular expressions stay as they are. `const` becomes the shorter `let`. A semicolon before a bracket that
//! ends a block goes; of a loop without a body, which no script has, nothing would be left that a browser reads.

use super::names;

/// The scripts, in the order in which they stand in the page; one subject each. One that begins comes last.
const SCRIPTS: [&str; 35] = [
    include_str!("../../page/letters.js"),
    include_str!("../../page/file.js"),
    include_str!("../../page/coder.js"),
    include_str!("../../page/connectivity.js"),
    include_str!("../../page/samples.js"),
    include_str!("../../page/trajectories.js"),
    include_str!("../../page/active.js"),
    include_str!("../../page/normals.js"),
    include_str!("../../page/surface.js"),
    include_str!("../../page/mesh.js"),
    include_str!("../../page/components.js"),
    include_str!("../../page/camera.js"),
    include_str!("../../page/colors.js"),
    include_str!("../../page/occlusion.js"),
    include_str!("../../page/webgpu.js"),
    include_str!("../../page/webgl2.js"),
    include_str!("../../page/elements.js"),
    include_str!("../../page/plot.js"),
    include_str!("../../page/overlay.js"),
    include_str!("../../page/cube.js"),
    include_str!("../../page/picture.js"),
    include_str!("../../page/webm.js"),
    include_str!("../../page/film.js"),
    include_str!("../../page/download.js"),
    include_str!("../../page/saves.js"),
    include_str!("../../page/isovalue.js"),
    include_str!("../../page/hand.js"),
    include_str!("../../page/look_panel.js"),
    include_str!("../../page/panel.js"),
    include_str!("../../page/embed.js"),
    include_str!("../../page/scene.js"),
    include_str!("../../page/viewer.js"),
    include_str!("../../page/address.js"),
    include_str!("../../page/decode.js"),
    include_str!("../../page/main.js"),
];

/// Begins a page that holds its isovalues.
const START: &str = include_str!("../../page/start.js");

/// Begins a page whose isovalues lie in files beside it.
const SPLIT: &str = include_str!("../../page/split.js");

/// All scripts as one, which leaves no name behind.
pub fn script() -> String {
    joined(START)
}

/// As [`script`], of a page whose isovalues lie in files beside it.
pub(super) fn of_split() -> String {
    joined(SPLIT)
}

fn joined(last: &str) -> String {
    let mut script = String::from("(()=>{\"use strict\";");
    script.push_str(&names::shortened(&shortened(&[&SCRIPTS.concat(), last].concat())));
    script.push_str("})();\n");
    script
}

/// A script without comments, and without spaces and ends of lines where they part nothing.
fn shortened(script: &str) -> String {
    let mut shorter = String::with_capacity(script.len());
    let mut gap = None;
    let mut rest = script;
    while let Some(c) = rest.chars().next() {
        let length = match c {
            _ if c.is_whitespace() => {
                gap = gap.filter(|&gap| gap == '\n').or(Some(if c == '\n' { c } else { ' ' }));
                rest = &rest[c.len_utf8()..];
                continue;
            }
            _ if rest.starts_with("//") => {
                rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
                continue;
            }
            _ if rest.starts_with("/*") => {
                rest = rest.split_once("*/").map_or("", |(_, after)| after);
                gap = gap.or(Some(' '));
                continue;
            }
            _ => length_of_piece(&shorter, rest),
        };
        shorter.extend(gap.take().filter(|&gap| is_needed(gap, &shorter, c)));
        if c == '}' && shorter.ends_with(';') {
            shorter.pop();
        }
        shorter.push_str(if &rest[..length] == "const" { "let" } else { &rest[..length] });
        rest = &rest[length..];
    }
    shorter
}

/// Bytes of the name, literal or character at the start of `rest`, which is not empty; `before` is the script up to there.
pub(super) fn length_of_piece(before: &str, rest: &str) -> usize {
    match rest.chars().next() {
        Some(mark @ ('"' | '\'')) => quoted(rest, mark),
        Some('`') => template(rest),
        Some('/') if begins_expression(before) => regular_expression(rest),
        Some(c) if is_of_name(c) => rest.find(|c| !is_of_name(c)).unwrap_or(rest.len()),
        c => c.map_or(0, char::len_utf8),
    }
}

pub(super) fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '$'
}

/// Whether a gap parts what is before it from the character after it.
fn is_needed(gap: char, before: &str, after: char) -> bool {
    let Some(last) = before.chars().next_back() else { return false };
    match gap {
        // No statement ends behind these, nor before those.
        '\n' => !("{([,;:?=&|<".contains(last) || "})],.?:&|=<>".contains(after)),
        // What would become one name, `++` or `--`.
        _ => (is_of_name(last) && is_of_name(after)) || ("+-".contains(last) && last == after),
    }
}

/// Whether a slash behind this begins a regular expression; else it divides.
fn begins_expression(before: &str) -> bool {
    let word = before.rsplit(|c| !is_of_name(c)).next().unwrap_or_default();
    match word {
        "" => !before.ends_with([')', ']', '}']),
        word => ["return", "typeof", "case", "in", "of"].contains(&word),
    }
}

/// Bytes of a text in quotation marks at the start of `rest`.
fn quoted(rest: &str, mark: char) -> usize {
    let mut is_escaped = false;
    let end = rest.char_indices().skip(1).find(|&(_, c)| {
        let ends = c == mark && !is_escaped;
        is_escaped = c == '\\' && !is_escaped;
        ends
    });
    end.map_or(rest.len(), |(at, c)| at + c.len_utf8())
}

/// Bytes of a template at the start of `rest`, with what is put into it.
fn template(rest: &str) -> usize {
    let mut at = 1;
    while let Some(c) = rest[at..].chars().next() {
        at += match c {
            '`' => return at + 1,
            '\\' => 1 + rest[at + 1..].chars().next().map_or(0, char::len_utf8),
            '$' if rest[at..].starts_with("${") => 2 + put_in(&rest[at + 2..]),
            _ => c.len_utf8(),
        };
    }
    at
}

/// Bytes of what is put into a template, up to the bracket that ends it.
fn put_in(rest: &str) -> usize {
    let (mut at, mut depth) = (0, 1);
    while let Some(c) = rest[at..].chars().next() {
        at += match c {
            '`' => template(&rest[at..]),
            '"' | '\'' => quoted(&rest[at..], c),
            _ => c.len_utf8(),
        };
        depth += i32::from(c == '{') - i32::from(c == '}');
        if depth == 0 {
            break;
        }
    }
    at
}

/// Bytes of a regular expression at the start of `rest`; a slash in brackets does not end it.
fn regular_expression(rest: &str) -> usize {
    let (mut is_escaped, mut is_class) = (false, false);
    let end = rest.char_indices().skip(1).find(|&(_, c)| {
        let ends = c == '/' && !is_escaped && !is_class;
        match c {
            '[' if !is_escaped => is_class = true,
            ']' if !is_escaped => is_class = false,
            _ => {}
        }
        is_escaped = c == '\\' && !is_escaped;
        ends
    });
    end.map_or(rest.len(), |(at, c)| at + c.len_utf8())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_parts_nothing_goes_and_texts_stay() {
        for (script, shorter) in [
            ("f(a, b, \"c, d\", ['e, f', g])", "f(a,b,\"c, d\",['e, f',g])"),
            ("x = `${a}, b // c`, c", "x=`${a}, b // c`,c"),
            ("`${ `a ${ {b: 1} } ` } `  + c", "`${ `a ${ {b: 1} } ` } `+c"),
            ("/[\"', /] /.test(a), b / c / d", "/[\"', /] /.test(a),b/c/d"),
            ("return /a b/g.exec(c) / 2;", "return/a b/g.exec(c)/2;"),
            ("a + +b - -c; d ++ ;", "a+ +b- -c;d++;"),
            ("/** Says\n * why. */\nlet a = 1 // one\nlet b", "let a=1\nlet b"),
            ("f({\n    a,\n    b: 'it\\'s // c',\n})\n", "f({a,b:'it\\'s // c',})"),
            ("return\n(a)\nb", "return\n(a)\nb"),
            ("typeof x in  y", "typeof x in y"),
            ("{ const a = 'const'; f(a); }", "{let a='const';f(a)}"),
            ("a\n    .b()\n    ?? c", "a.b()??c"),
        ] {
            assert_eq!(shortened(script), shorter, "{script}");
        }
    }
}
