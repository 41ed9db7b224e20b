//! A page that has its isovalues in a spectrum file on a server, and fetches what it needs of it by HTTP range requests.
//!
//! The page has the URL of the file, the places of its tables and the checksum of its index, by which it refuses any other file.
//! `page/ranges.js` and `page/linked.js` read them.

use std::path::Path;

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::file::TablePlaces;

/// A link from a page to a spectrum file.
#[derive(Clone, Debug)]
pub struct Link {
    url: String,
    /// What the page's content security policy allows connections to.
    origin: String,
    places: TablePlaces,
}

impl Link {
    /// A link by a URL, relative to that of the page or with `http` or `https`, to a spectrum file. `path` is where it is now.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for another URL; [`Error::Io`]; [`Error::Input`] if `path` is not a spectrum file.
    pub fn new(url: &str, path: &Path) -> Result<Link> {
        let origin = origin(url).ok_or_else(|| {
            Error::Usage(format!(
                "link '{url}', expected a path relative to the page, or a URL that begins with http:// or https://"
            ))
        })?;
        Ok(Link { url: url.to_owned(), origin, places: TablePlaces::read(path)? })
    }

    pub(super) fn origin(&self) -> &str {
        &self.origin
    }

    /// The bytes of the file.
    pub(super) fn n_bytes(&self) -> usize {
        usize::try_from(self.places.rest.end).unwrap_or(usize::MAX)
    }

    /// As `page/ranges.js` reads it.
    pub(super) fn to_json(&self) -> Value {
        let TablePlaces { info, rest, index_crc } = &self.places;
        json!({
            "url": self.url,
            "info": [info.start, info.end],
            "isovalues": rest.start,
            "end": rest.end,
            "crc32": index_crc,
        })
    }
}

/// The origin of a URL as a content security policy has it; `None` for one that a page may not fetch.
fn origin(url: &str) -> Option<String> {
    let has_scheme = url.split(['/', '?', '#']).next().is_some_and(|start| start.contains(':'));
    let is_relative = !has_scheme && !url.starts_with("//") && !url.contains('\\');
    if is_relative {
        let is_file =
            !url.is_empty() && !url.starts_with(['?', '#']) && !url.contains(char::is_control);
        return is_file.then(|| "'self'".to_owned());
    }
    let (scheme, rest) = url.split_once("://")?;
    let host = rest.split(['/', '?', '#']).next()?;
    let is_host = |c: char| c.is_ascii_alphanumeric() || "-._:[]".contains(c);
    let is_known =
        ["http", "https"].contains(&scheme) && !host.is_empty() && host.chars().all(is_host);
    is_known.then(|| format!("{scheme}://{host}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_relative_or_has_an_origin() {
        for url in ["scan.isp", "data/scan.isp", "../a b.isp?v=1", "/scan.isp", "a/b:c.isp"] {
            assert_eq!(origin(url).as_deref(), Some("'self'"), "{url}");
        }
        for (url, expected) in [
            ("https://data.example.org/a/scan.isp", "https://data.example.org"),
            ("http://127.0.0.1:8000/scan.isp", "http://127.0.0.1:8000"),
            ("https://[::1]:80?a", "https://[::1]:80"),
        ] {
            assert_eq!(origin(url).as_deref(), Some(expected), "{url}");
        }
        for url in [
            "",
            "#a",
            "?a",
            "//example.org/scan.isp",
            "javascript:alert(1)",
            "data:,a",
            "file:///scan.isp",
            "c:\\scan.isp",
            "/\\example.org",
            "https://",
            "https:///scan.isp",
            "https://a;b/scan.isp",
            "https://a b/",
            "https://user@host/",
            "ftp://a/b",
            "a\nb",
        ] {
            assert_eq!(origin(url), None, "{url}");
        }
    }
}
