//! The list of a series of meshes (`.pvd`) as ParaView and PyVista read it: files next to it, with isovalues as times.

use std::path::Path;

use super::pattern::Pattern;
use crate::error::{Error, Result};

/// Returns the files that a list at `path` names.
///
/// # Errors
///
/// [`Error::Usage`] for a name with characters that XML cannot contain.
pub(crate) fn files(path: &Path) -> Result<Pattern> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if !name.chars().all(is_xml) {
        let shown = path.display();
        return Err(Error::Usage(format!(
            "{shown}: a list in XML cannot name its files, expected a name without control characters"
        )));
    }
    Pattern::listed_by(path, "vtp")
}

/// Returns the list.
pub(crate) fn list(files: &[String], isovalues: &[f64]) -> String {
    let rows = files.iter().zip(isovalues).map(|(file, isovalue)| {
        let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy();
        let name = escaped(&name);
        format!("<DataSet timestep=\"{isovalue}\" part=\"0\" file=\"{name}\"/>\n")
    });
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n\
         <Collection>\n{}</Collection>\n</VTKFile>\n",
        rows.collect::<String>()
    )
}

/// True for the characters that XML 1.0 can contain.
fn is_xml(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r') || c >= ' ' && !matches!(c, '\u{fffe}' | '\u{ffff}')
}

/// Escapes a text for an attribute, whose line breaks and tabs a parser would replace by spaces.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\t' | '\n' | '\r' => escaped.push_str(&format!("&#{};", u32::from(c))),
            _ => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_for_an_attribute() {
        let text = list(&["out/a<b>&\"c\"\t\n-0000.vtp".to_owned()], &[0.5]);
        let row =
            "timestep=\"0.5\" part=\"0\" file=\"a&lt;b&gt;&amp;&quot;c&quot;&#9;&#10;-0000.vtp\"/>";
        assert!(text.contains(row), "{text}");
    }

    #[test]
    fn a_name_that_xml_cannot_contain_is_refused() {
        for name in ["a\u{1}.pvd", "a\u{ffff}.pvd"] {
            assert!(matches!(files(Path::new(name)), Err(Error::Usage(_))), "{name:?}");
        }
        files(Path::new("50%/a %d\u{85}.pvd")).expect("a pattern");
    }
}
