//! Options of reading a volume.

use super::placement::Placement;
use crate::parse_name::named_values;

/// Options of reading a volume, for what its file does not contain.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReadOptions {
    /// Dimensions of a RAW file whose name does not contain them.
    pub dims: Option<[usize; 3]>,
    /// Sample type of a RAW file whose name does not contain it: `uint8`, `float32`, ...
    pub sample_type: Option<String>,
    /// Whether a RAW file is big endian.
    pub big_endian: bool,
    /// Which volume in time, from 0, of a file that holds several.
    pub frame: Option<usize>,
    /// Which number of each sample, from 0, if there are several: a colour, a component of a vector, an orbital.
    pub channel: Option<usize>,
    /// Which array, by its name, of a file that holds several.
    pub array: Option<String>,
    /// Which series of a folder of DICOM files: its number, from 0, or its identifier.
    pub series: Option<String>,
    /// What is read as slices, where a TIFF file has a single slice of several channels or frames.
    pub slices: Option<SliceAxis>,
    /// Replaces the file's spacing.
    pub spacing: Option<[f64; 3]>,
    /// Replaces the file's origin.
    pub origin: Option<[f64; 3]>,
    /// Value in place of NaN and infinities.
    pub nan_as: Option<f64>,
}

/// What is read as slices of a TIFF file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SliceAxis {
    /// Channels.
    Channels,
    /// Frames in time.
    Frames,
}

named_values! {
    SliceAxis, "slices":
    Channels = "channels",
    Frames = "frames",
}

impl ReadOptions {
    /// Whether they give dimensions, sample type or byte order.
    pub(super) fn describes_layout(&self) -> bool {
        self.dims.is_some() || self.sample_type.is_some() || self.big_endian
    }

    /// Whether they suffice to read a file as RAW.
    pub(super) fn describes_raw(&self) -> bool {
        self.dims.is_some() && self.sample_type.is_some()
    }

    /// Replaces spacing and origin if they are given.
    pub(super) fn replace_placement(&self, placement: &mut Placement) {
        placement.spacing = self.spacing.unwrap_or(placement.spacing);
        placement.origin = self.origin.unwrap_or(placement.origin);
    }
}
