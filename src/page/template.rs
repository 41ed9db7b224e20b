//! Puts text into the page's template.

use super::Page;

const TEMPLATE: &str = include_str!("../../page/page.html");
const STYLE: &str = include_str!("../../page/page.css");
const WGSL: &str = include_str!("../../shaders/surface.wgsl");
const CUT: &str = include_str!("../../shaders/cut.wgsl");
const OCCLUSION: &str = include_str!("../../shaders/occlusion.wgsl");
const OCCLUSION_GLSL: &str = include_str!("../../page/occlusion.frag.glsl");
const VERTEX_GLSL: &str = include_str!("../../page/surface.vert.glsl");
const FRAGMENT_GLSL: &str = include_str!("../../page/surface.frag.glsl");

/// What fills the template.
pub(super) struct Parts<'a> {
    pub(super) page: &'a Page<'a>,
    /// JSON.
    pub(super) about: &'a str,
    /// Letters; empty where there is no first mesh.
    pub(super) first: &'a str,
    /// Letters.
    pub(super) data: &'a str,
    pub(super) script: &'a str,
    /// Whether isovalues are fetched from files beside the page.
    pub(super) is_split: bool,
    /// Base64 of a PNG; empty where there is none.
    pub(super) still: &'a str,
}

/// The page.
pub(super) fn filled(parts: &Parts) -> String {
    let Page { title, caption, credit, isovalue, .. } = *parts.page;
    let element = |name: &str, text: Option<&str>| match text {
        Some(text) => format!("<p class=\"{name}\">{}</p>", linked(text)),
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
    fill(TEMPLATE, |name| match name {
        "title" => escaped(title),
        "caption" => element("caption", caption),
        "credit" => element("credit", credit),
        "isovalue" => isovalue.to_string(),
        "version" => env!("CARGO_PKG_VERSION").into(),
        "still" => still.clone(),
        "style" => STYLE.into(),
        "wgsl" => WGSL.into(),
        "cut" => CUT.into(),
        "occlusion" => OCCLUSION.into(),
        "occlusion-glsl" => OCCLUSION_GLSL.into(),
        "vertex" => VERTEX_GLSL.into(),
        "fragment" => FRAGMENT_GLSL.into(),
        // In JSON a '<' stands in strings only, where it has another spelling that ends no script.
        "about" => parts.about.replace('<', "\\u003c"),
        "first" => parts.first.into(),
        "data" => parts.data.into(),
        "script" => parts.script.into(),
        "connect" if parts.is_split => " connect-src 'self';".into(),
        "connect" => String::new(),
        _ => unreachable!("a test looks at every name in the template"),
    })
}

/// The template with every `{{name}}` replaced by its value, in one pass: what is put in is not
/// looked at again.
fn fill(template: &str, value: impl Fn(&str) -> String) -> String {
    let mut filled = String::new();
    let mut rest = template;
    while let Some((before, name, after)) = placeholder(rest) {
        filled.push_str(before);
        filled.push_str(&value(name));
        rest = after;
    }
    filled.push_str(rest);
    filled
}

/// What stands before the next placeholder, its name, and what comes after.
fn placeholder(text: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = text.split_once("{{")?;
    let (name, after) = rest.split_once("}}")?;
    Some((before, name, after))
}

/// Text in which addresses of the web lead there.
fn linked(text: &str) -> String {
    let mut linked = String::with_capacity(text.len());
    for word in text.split_inclusive(char::is_whitespace) {
        let start = word.find("https://").or_else(|| word.find("http://"));
        let (before, address) = word.split_at(start.unwrap_or(word.len()));
        let end = address.find(|c: char| c.is_whitespace() || "<>\"'`".contains(c));
        // A sentence may end behind it.
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

/// Text as it stands in elements and quoted attributes.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // Control characters are no text in HTML.
            c if c.is_control() && !c.is_whitespace() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{Color, ScaleEnds};
    use crate::render::Camera;
    use crate::spectrum::Keep;

    #[test]
    fn every_name_in_the_template_is_filled_and_values_are_not_looked_at_again() {
        let page = Page {
            title: "{{caption}} <b>&'\"",
            caption: Some("</script>"),
            credit: None,
            isovalue: 0.0,
            step: 1.0,
            open: false,
            camera: Camera::default(),
            color: Color::None,
            map: None,
            ends: ScaleEnds::default(),
            field: None,
            axes: false,
            look: crate::page::Look::default(),
            keep: Keep::default(),
            samples: None,
            statistics: None,
            marks: &[],
            still: None,
        };
        let text = filled(&Parts {
            page: &page,
            about: "{\"a\":\"</script>\"}",
            first: "",
            data: "AAAA",
            script: "",
            is_split: false,
            still: "",
        });
        assert!(text.contains("<h1>{{caption}} &lt;b&gt;&amp;&#39;&quot;</h1>"), "the title");
        assert!(text.contains("<p class=\"caption\">&lt;/script&gt;</p>"), "the caption");
        assert!(text.contains("{\"a\":\"\\u003c/script>\"}"), "the JSON");
    }

    #[test]
    fn addresses_in_texts_are_links_and_nothing_else_is() {
        let link = |address: &str| {
            format!("<a href=\"{address}\" target=\"_blank\" rel=\"noopener\">{address}</a>")
        };
        assert_eq!(linked("no link\nhere"), "no link\nhere");
        assert_eq!(
            linked("(see https://a.org/x?y=1&z=2)."),
            format!("(see {}).", link("https://a.org/x?y=1&amp;z=2"))
        );
        assert_eq!(linked("http://b.de, and"), format!("{}, and", link("http://b.de")));
        assert_eq!(linked("https://"), "https://");
        assert_eq!(linked("javascript:alert(1) <b>"), "javascript:alert(1) &lt;b&gt;");
        assert_eq!(
            linked("https://c.d\"><i>"),
            format!("{}&quot;&gt;&lt;i&gt;", link("https://c.d"))
        );
    }

    #[test]
    fn nothing_that_is_put_into_a_script_element_ends_it() {
        for text in [WGSL, CUT, VERTEX_GLSL, FRAGMENT_GLSL, &super::super::script()] {
            let text = text.to_ascii_lowercase();
            assert!(!text.contains("</script") && !text.contains("<!--"));
        }
        assert!(!STYLE.to_ascii_lowercase().contains("</style"));
    }
}
