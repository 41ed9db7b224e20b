//! Fills the template of the page, `page/page.html`.

use super::options::Page;
use crate::keys::{KEYS, KeyHelp, Place};

const TEMPLATE: &str = include_str!("../../page/page.html");
const STYLE: &str = include_str!("../../page/page.css");
const WGSL: &str = include_str!("../../shaders/surface.wgsl");
const CUT: &str = include_str!("../../shaders/cut.wgsl");
const OCCLUSION: &str = include_str!("../../shaders/occlusion.wgsl");
const OCCLUSION_GLSL: &str = include_str!("../../page/occlusion.frag.glsl");
const VERTEX_GLSL: &str = include_str!("../../page/surface.vert.glsl");
const FRAGMENT_GLSL: &str = include_str!("../../page/surface.frag.glsl");

/// The values of the template.
pub(super) struct Parts<'a> {
    pub(super) page: &'a Page<'a>,
    /// JSON.
    pub(super) about: &'a str,
    /// Base64 of a raw deflate stream; empty if there is no first range.
    pub(super) first: &'a str,
    /// Base64 of a raw deflate stream; empty if the page is linked to a file.
    pub(super) data: &'a str,
    pub(super) script: &'a str,
    /// The origin to which the page may connect, if any.
    pub(super) connect: Option<&'a str>,
    /// Base64 of a PNG; empty if there is none.
    pub(super) still: &'a str,
    /// Base64 of a raw deflate stream; empty if the page shows no slices.
    pub(super) slice: &'a str,
}

/// Fills the template.
pub(super) fn fill(parts: &Parts) -> String {
    let Page { title, caption, credit, isovalue, .. } = *parts.page;
    let paragraph = |class: &str, text: Option<&str>| match text {
        Some(text) => format!("<p class=\"{class}\">{}</p>", with_links(text)),
        None => String::new(),
    };
    let still = match parts.still {
        "" => String::new(),
        png => format!(
            "<figure><img alt=\"Still picture of {}\" src=\"data:image/png;base64,{png}\">\
             <figcaption>At isovalue {isovalue}</figcaption></figure>",
            escaped(title)
        ),
    };
    replace_names(TEMPLATE, |name| match name {
        "title" => escaped(title),
        "caption" => paragraph("caption", caption),
        "credit" => paragraph("credit", credit),
        "isovalue" => isovalue.to_string(),
        "version" => env!("CARGO_PKG_VERSION").into(),
        "still" => still.clone(),
        "style" => STYLE.into(),
        "keys" => key_rows(),
        "wgsl" => WGSL.into(),
        "cut" => CUT.into(),
        "occlusion" => OCCLUSION.into(),
        "occlusion-glsl" => OCCLUSION_GLSL.into(),
        "vertex" => VERTEX_GLSL.into(),
        "fragment" => FRAGMENT_GLSL.into(),
        // JSON has '<' in strings only. Escaped, it cannot end the script element.
        "about" => parts.about.replace('<', "\\u003c"),
        "first" => parts.first.into(),
        "data" => parts.data.into(),
        "slice" => parts.slice.into(),
        "script" => parts.script.into(),
        // A link has only letters, digits and -._:[] in its origin.
        "connect" => {
            parts.connect.map_or_else(String::new, |origin| format!(" connect-src {origin};"))
        }
        _ => unreachable!("a test fills every name of the template"),
    })
}

/// The rows of the help.
fn key_rows() -> String {
    // Every other part is between backticks.
    let with_keys = |text: &str| {
        let parts = text.split('`').enumerate().map(|(i, part)| match i % 2 {
            0 => escaped(part),
            _ => format!("<kbd>{}</kbd>", escaped(part)),
        });
        parts.collect::<String>()
    };
    let row = |KeyHelp { input, meaning, .. }: &KeyHelp| {
        format!("<tr><th>{}</th><td>{}</td></tr>\n", with_keys(input), with_keys(meaning))
    };
    KEYS.iter().filter(|key| key.place != Place::Window).map(row).collect()
}

/// Replaces every `{{name}}` of a template by its value, in one pass: names within values are not replaced.
fn replace_names(template: &str, value: impl Fn(&str) -> String) -> String {
    let mut filled = String::new();
    let mut rest = template;
    while let Some((before, name, after)) = split_at_name(rest) {
        filled.push_str(before);
        filled.push_str(&value(name));
        rest = after;
    }
    filled.push_str(rest);
    filled
}

/// The text before the next `{{name}}`, the name, and the text after it.
fn split_at_name(text: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = text.split_once("{{")?;
    let (name, after) = rest.split_once("}}")?;
    Some((before, name, after))
}

/// Escapes text and makes links of its web addresses.
fn with_links(text: &str) -> String {
    let mut linked = String::with_capacity(text.len());
    for word in text.split_inclusive(char::is_whitespace) {
        let start = word.find("https://").or_else(|| word.find("http://"));
        let (before, address) = word.split_at(start.unwrap_or(word.len()));
        let end = address.find(|c: char| c.is_whitespace() || "<>\"'`".contains(c));
        // Punctuation after an address is not part of it.
        let address_only = address[..end.unwrap_or(address.len())]
            .trim_end_matches(['.', ',', ';', ':', '!', '?', ')', ']']);
        let after = &address[address_only.len()..];
        linked += &escaped(before);
        if address_only.split_once("://").is_some_and(|(_, place)| !place.is_empty()) {
            let address = escaped(address_only);
            linked +=
                &format!("<a href=\"{address}\" target=\"_blank\" rel=\"noopener\">{address}</a>");
        } else {
            linked += &escaped(address_only);
        }
        linked += &escaped(after);
    }
    linked
}

/// Escapes text for elements and quoted attributes.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // HTML forbids control characters.
            c if c.is_control() && !c.is_whitespace() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::keys_of;
    use crate::page::script::script;

    #[test]
    fn every_key_of_the_help_is_in_the_script() {
        let script = include_str!("../../page/input.js");
        for key in KEYS.iter().filter(|key| key.place != Place::Window) {
            for name in keys_of(key.input).chain(keys_of(key.meaning)) {
                let name = match name {
                    "Ctrl" | "Shift" | "1" | "2" | "3" | "4" | "5" | "6" => continue,
                    "Space" => " ".to_owned(),
                    letter if letter.len() == 1 => letter.to_lowercase(),
                    other => other.replace(' ', ""),
                };
                let [plain, quoted] =
                    [format!("\n        {name}: "), format!("\n        \"{name}\": ")];
                assert!(script.contains(&plain) || script.contains(&quoted), "{name}");
            }
        }
    }

    #[test]
    fn every_name_in_the_template_is_replaced_and_names_in_values_are_not() {
        let page = Page::new("{{caption}} <b>&'\"", 0.0).with_caption("</script>");
        let text = fill(&Parts {
            page: &page,
            about: "{\"a\":\"</script>\"}",
            first: "",
            data: "AAAA",
            script: "",
            connect: None,
            still: "",
            slice: "",
        });
        assert!(text.contains("<h1>{{caption}} &lt;b&gt;&amp;&#39;&quot;</h1>"), "the title");
        assert!(text.contains("<p class=\"caption\">&lt;/script&gt;</p>"), "the caption");
        assert!(text.contains("{\"a\":\"\\u003c/script>\"}"), "the JSON");
    }

    #[test]
    fn web_addresses_in_texts_become_links_and_nothing_else_does() {
        let link = |address: &str| {
            format!("<a href=\"{address}\" target=\"_blank\" rel=\"noopener\">{address}</a>")
        };
        assert_eq!(with_links("no link\nhere"), "no link\nhere");
        assert_eq!(
            with_links("(see https://a.org/x?y=1&z=2)."),
            format!("(see {}).", link("https://a.org/x?y=1&amp;z=2"))
        );
        assert_eq!(with_links("http://b.de, and"), format!("{}, and", link("http://b.de")));
        assert_eq!(with_links("https://"), "https://");
        assert_eq!(with_links("javascript:alert(1) <b>"), "javascript:alert(1) &lt;b&gt;");
        assert_eq!(
            with_links("https://c.d\"><i>"),
            format!("{}&quot;&gt;&lt;i&gt;", link("https://c.d"))
        );
    }

    #[test]
    fn no_script_or_style_closes_its_own_element() {
        let shaders = [WGSL, CUT, OCCLUSION, OCCLUSION_GLSL, VERTEX_GLSL, FRAGMENT_GLSL];
        for text in shaders.into_iter().chain([&*script(false), &*script(true)]) {
            let text = text.to_ascii_lowercase();
            assert!(!text.contains("</script") && !text.contains("<!--"));
        }
        assert!(!STYLE.to_ascii_lowercase().contains("</style"));
    }
}
