//! Attributes of XML tags, and errors of the XML parser.

use std::io;

use quick_xml::events::BytesStart;

use crate::volume::data_error::invalid;

pub(super) fn wrong_xml(message: &str) -> io::Error {
    let text: String = message.chars().filter(|c| !c.is_control()).take(120).collect();
    invalid(format!("invalid XML: {text}"))
}

/// An attribute of a tag; none if it does not have it.
pub(super) fn attribute(tag: &BytesStart<'_>, name: &str) -> io::Result<Option<String>> {
    let found = tag.try_get_attribute(name).map_err(|e| wrong_xml(&e.to_string()))?;
    found
        .map(|value| {
            let value =
                quick_xml::escape::unescape(&value.value).map_err(|e| wrong_xml(&e.to_string()))?;
            Ok(value.into_owned())
        })
        .transpose()
}
