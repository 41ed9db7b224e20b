//! The header of a spectrum file, and section `INFO`.

use serde::{Deserialize, Serialize};

use super::section::Section;
use crate::error::{Error, Result};
use crate::spectrum::{About, Event, Knot, Metadata, Size, Spectrum, VolumeInfo};

/// The first bytes of every spectrum file. As those of PNG, they are not text and detect transfers that
/// change line ends or clear the eighth bit.
pub const MAGIC: [u8; 8] = *b"\x89ISP\r\n\x1a\n";

/// The newest version of the format; this library reads all. A file has the oldest version that describes it: 2 if a spacing is more
/// than 1.5 times the smallest ([`Placement::is_stretched`](crate::Placement::is_stretched)), else 1, where both are the same.
pub const VERSION: u32 = 2;

/// Bytes before the first section: magic, version, checksum of both.
pub(super) const HEADER_LENGTH: usize = 16;

/// Most bytes of section `INFO`, which usually has a few hundred. Parsed JSON takes up to a hundred times its length.
pub(super) const MAX_INFO: usize = 1 << 20;

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
    pub(super) fn volume(&self) -> &VolumeInfo {
        &self.volume
    }

    /// The description with the events.
    pub(super) fn into_about(self, events: Vec<Event>) -> About {
        let Info { volume, range, tolerance, parameters, .. } = self;
        About { parameters, events, ..About::new(volume, range, tolerance) }
    }
}

/// Writes section `INFO`: JSON.
pub(super) fn write_info(spectrum: &Spectrum) -> Result<Vec<u8>> {
    let info = Info {
        volume: spectrum.volume(),
        range: spectrum.range(),
        tolerance: spectrum.tolerance(),
        parameters: spectrum.parameters(),
        size: Size::of(spectrum),
    };
    serde_json::to_vec(&info).map_err(|e| Error::input(e.to_string()))
}

/// The oldest version that describes spectra of a volume.
pub(super) fn version_of(volume: &VolumeInfo) -> u32 {
    if volume.placement.is_stretched() { 2 } else { 1 }
}

/// The frame of the positions in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    /// Size of a cell.
    pub(super) cell_size: [f64; 3],
    /// Factor to the voxel frame along each axis.
    to_voxel: [f64; 3],
}

impl Frame {
    /// The frame of a version: in version 1 cells are as long as their spacing, without a limit.
    pub(super) fn of(version: u32, volume: &VolumeInfo) -> Frame {
        let placement = &volume.placement;
        let in_voxel_frame = placement.cell_size();
        if version > 1 || !placement.is_stretched() {
            return Frame { cell_size: in_voxel_frame, to_voxel: [1.0; 3] };
        }
        let cell_size = placement.spacing.map(|s| s / placement.voxel());
        let to_voxel = std::array::from_fn(|a| in_voxel_frame[a] / cell_size[a]);
        Frame { cell_size, to_voxel }
    }

    /// Converts the positions of knots to the voxel frame.
    pub(super) fn convert_knots(self, knots: &mut [Knot]) {
        if self.to_voxel == [1.0; 3] {
            return;
        }
        for knot in knots {
            knot.position =
                std::array::from_fn(|a| (f64::from(knot.position[a]) * self.to_voxel[a]) as f32);
        }
    }

    /// Converts the positions of events to the voxel frame.
    pub(super) fn convert_events(self, events: &mut [Event]) {
        for event in events {
            event.position = std::array::from_fn(|a| event.position[a] * self.to_voxel[a]);
        }
    }
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

/// The bytes before the first section of a file of a version.
pub(super) fn header(version: u32) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// Checks the header of a file and returns its version and the bytes after it.
pub(super) fn after_header(bytes: &[u8]) -> Result<(u32, &[u8])> {
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
    if !(1..=VERSION).contains(&version) {
        return Err(Error::input(format!(
            "format version {version}, expected 1 to {VERSION}; a newer isospectrum may read it"
        )));
    }
    Ok((version, rest))
}

/// Adds the name of the section to an error.
pub(super) fn in_section(section: &str) -> impl Fn(Error) -> Error + '_ {
    move |error| match error {
        Error::Input(what) => Error::input(format!("section {section}: {what}")),
        other => other,
    }
}
