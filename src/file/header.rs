//! The header of a spectrum file, and section `INFO`.

use serde::{Deserialize, Serialize};

use super::section::Section;
use crate::error::{Error, Result};
use crate::spectrum::{About, Event, Metadata, Size, Spectrum, VolumeInfo};

/// The first bytes of every spectrum file. As those of PNG, they are not text and detect transfers that
/// change line ends or clear the eighth bit.
pub const MAGIC: [u8; 8] = *b"\x89ISP\r\n\x1a\n";

/// The version of the format.
pub const VERSION: u32 = 1;

/// Bytes before the first section: magic, version, checksum of both.
pub(super) const HEADER_LENGTH: usize = 16;

/// Most bytes of section `INFO`, which usually has a few hundred. Parsed JSON takes up to a hundred times its length.
const MAX_INFO: usize = 1 << 20;

/// Section `INFO`: the description of a spectrum.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Info<V, P> {
    volume: V,
    range: (f64, f64),
    pub(super) tolerance: f64,
    parameters: P,
    pub(super) size: Size,
}

impl Info<VolumeInfo, Metadata> {
    /// The description with the events.
    pub(super) fn into_about(self, events: Vec<Event>) -> About {
        let Info { volume, range, tolerance, parameters, .. } = self;
        About { parameters, events, ..About::new(volume, range, tolerance) }
    }
}

/// Writes section `INFO`: JSON.
///
/// # Errors
///
/// [`Error::Input`] if it is too long.
pub(super) fn write_info(spectrum: &Spectrum, size: Size) -> Result<Vec<u8>> {
    let info = Info {
        volume: spectrum.volume(),
        range: spectrum.range(),
        tolerance: spectrum.tolerance(),
        parameters: spectrum.parameters(),
        size,
    };
    let info = serde_json::to_vec(&info).map_err(|e| Error::input(e.to_string()))?;
    if info.len() > MAX_INFO {
        let n = info.len();
        return Err(Error::input(format!(
            "the description of the spectrum takes {n} bytes, expected at most {MAX_INFO}"
        )));
    }
    Ok(info)
}

/// Reads section `INFO`.
pub(super) fn read_info(section: &Section<'_>) -> Result<Info<VolumeInfo, Metadata>> {
    let n = section.n_content();
    if !section.is_plain() || n > MAX_INFO {
        return Err(Error::input(format!(
            "section INFO: {n} bytes, expected at most {MAX_INFO}, uncompressed"
        )));
    }
    serde_json::from_slice(section.content()?.bytes()).map_err(|e| {
        // The message may contain keys of the file, which may be long and contain line ends.
        let message = e.to_string();
        let message: String =
            message.chars().take(200).map(|c| if c.is_control() { '?' } else { c }).collect();
        Error::input(format!("section INFO: {message}"))
    })
}

/// The bytes before the first section of a file.
pub(super) fn header() -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// Checks the header of a file and returns the bytes after it.
pub(super) fn after_header(bytes: &[u8]) -> Result<&[u8]> {
    let magic = bytes.get(..MAGIC.len()).unwrap_or(bytes);
    if bytes.is_empty() || !MAGIC.starts_with(magic) {
        return Err(Error::input("not a spectrum file: it does not start with \\x89ISP"));
    }
    let (header, rest) = bytes
        .split_at_checked(HEADER_LENGTH)
        .ok_or_else(|| Error::input("the file ends inside its header"))?;
    let number = |at: usize| u32::from_le_bytes(header[at..at + 4].try_into().expect("four bytes"));
    if crc32fast::hash(&header[..12]) != number(12) {
        return Err(Error::input("the header of the file is damaged: its checksum is wrong"));
    }
    let version = number(8);
    if version != VERSION {
        return Err(Error::input(format!(
            "format version {version}, expected {VERSION}; a newer isospectrum may read it"
        )));
    }
    Ok(rest)
}

/// Adds the name of the section to an error.
pub(super) fn in_section(section: &str) -> impl Fn(Error) -> Error + '_ {
    move |error| match error {
        Error::Input(what) => Error::input(format!("section {section}: {what}")),
        other => other,
    }
}
