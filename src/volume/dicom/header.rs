//! The elements of a DICOM file that describe its image.
//!
//! Source: DICOM PS3.3, C.7.6 (image plane and pixels), C.7.6.16 (functional groups), C.8.8.3 (dose grids).

use std::io;

use super::elements::Visitor;
use super::tags::{self, FUNCTIONAL_GROUPS, GROUP_MACROS, format_tag};
use crate::volume::data_error::invalid;
use crate::volume::text::shortened;

/// Most frames of a file: bounds their memory.
const MAX_FRAMES: usize = 1 << 20;

/// Geometry and rescaling of an image, of all its frames, or of one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Plane {
    pub(super) position: Option<[f64; 3]>,
    /// Directions of a row and of a column.
    pub(super) orientation: Option<[f64; 6]>,
    /// Distances between rows, and between columns.
    pub(super) spacing: Option<[f64; 2]>,
    pub(super) slope: Option<f64>,
    pub(super) intercept: Option<f64>,
}

impl Plane {
    /// These properties, else the other ones.
    pub(super) fn or(self, other: Plane) -> Plane {
        Plane {
            position: self.position.or(other.position),
            orientation: self.orientation.or(other.orientation),
            spacing: self.spacing.or(other.spacing),
            slope: self.slope.or(other.slope),
            intercept: self.intercept.or(other.intercept),
        }
    }

    /// Sets the property of an element, if it is one.
    fn set(&mut self, tag: u32, bytes: &[u8]) -> io::Result<()> {
        match tag {
            tags::IMAGE_POSITION => self.position = numbers(tag, bytes)?,
            tags::IMAGE_ORIENTATION => self.orientation = numbers(tag, bytes)?,
            tags::PIXEL_SPACING => self.spacing = numbers(tag, bytes)?,
            tags::RESCALE_INTERCEPT => self.intercept = numbers(tag, bytes)?.map(|[n]| n),
            // The scaling of a dose grid is a slope.
            tags::RESCALE_SLOPE | tags::DOSE_SCALING => {
                self.slope = numbers(tag, bytes)?.map(|[n]| n);
            }
            _ => {}
        }
        Ok(())
    }
}

/// A slice: a frame of an image, or the whole image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    /// Index of the image.
    pub(super) image: usize,
    pub(super) frame: usize,
    pub(super) plane: Plane,
    /// Temporal position and instance number.
    pub(super) time: (f64, f64),
}

/// The image of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DicomHeader {
    pub(super) series: String,
    pub(super) description: String,
    pub(super) series_number: f64,
    /// TemporalPositionIdentifier.
    pub(super) time: f64,
    pub(super) instance: f64,
    pub(super) photometric: String,
    /// Columns and rows.
    pub(super) size: [usize; 2],
    pub(super) n_frames: Option<usize>,
    /// Numbers per sample.
    pub(super) n_channels: usize,
    /// Whether channels are stored as planes, one after the other.
    pub(super) is_planar: bool,
    pub(super) bits_allocated: u16,
    pub(super) bits_stored: u16,
    pub(super) high_bit: u16,
    pub(super) is_signed: bool,
    pub(super) image: Plane,
    pub(super) shared: Plane,
    pub(super) frames: Vec<Plane>,
    /// Offsets of the frames of a dose grid along the normal.
    pub(super) offsets: Vec<f64>,
    /// Distance between frames, for files in which only the first has a position.
    pub(super) frame_distance: Option<f64>,
    /// Offsets of compressed frames, where the file has 64-bit ones.
    pub(super) frame_offsets: Vec<u64>,
}

/// Elements of an image, outside all sequences.
const IMAGE_TAGS: [u32; 24] = [
    tags::SERIES_DESCRIPTION,
    tags::SPACING_BETWEEN_SLICES,
    tags::SERIES_UID,
    tags::SERIES_NUMBER,
    tags::INSTANCE_NUMBER,
    tags::IMAGE_POSITION,
    tags::IMAGE_ORIENTATION,
    tags::TEMPORAL_POSITION,
    tags::SAMPLES_PER_PIXEL,
    tags::PHOTOMETRIC_INTERPRETATION,
    tags::PLANAR_CONFIGURATION,
    tags::NUMBER_OF_FRAMES,
    tags::ROWS,
    tags::COLUMNS,
    tags::PIXEL_SPACING,
    tags::BITS_ALLOCATED,
    tags::BITS_STORED,
    tags::HIGH_BIT,
    tags::PIXEL_REPRESENTATION,
    tags::RESCALE_INTERCEPT,
    tags::RESCALE_SLOPE,
    tags::GRID_FRAME_OFFSETS,
    tags::DOSE_SCALING,
    tags::EXTENDED_OFFSETS,
];

/// Elements of a plane, in the functional groups.
const PLANE_TAGS: [u32; 5] = [
    tags::IMAGE_POSITION,
    tags::IMAGE_ORIENTATION,
    tags::PIXEL_SPACING,
    tags::RESCALE_INTERCEPT,
    tags::RESCALE_SLOPE,
];

impl Visitor for DicomHeader {
    fn wants(&self, path: &[u32], tag: u32) -> bool {
        match path {
            [] => IMAGE_TAGS.contains(&tag) || FUNCTIONAL_GROUPS.contains(&tag),
            [group] => FUNCTIONAL_GROUPS.contains(group) && GROUP_MACROS.contains(&tag),
            [group, part] => {
                FUNCTIONAL_GROUPS.contains(group)
                    && GROUP_MACROS.contains(part)
                    && PLANE_TAGS.contains(&tag)
            }
            _ => false,
        }
    }

    fn item(&mut self, path: &[u32]) -> io::Result<()> {
        if path == [tags::PER_FRAME_GROUPS] {
            if self.frames.len() == MAX_FRAMES {
                return Err(invalid(format!("more than {MAX_FRAMES} frames")));
            }
            self.frames.push(Plane::default());
        }
        Ok(())
    }

    fn value(&mut self, path: &[u32], tag: u32, bytes: &[u8], big_endian: bool) -> io::Result<()> {
        match path {
            [] => self.set(tag, bytes, big_endian),
            [tags::SHARED_GROUPS, ..] => self.shared.set(tag, bytes),
            _ => self.frames.last_mut().map_or(Ok(()), |frame| frame.set(tag, bytes)),
        }
    }
}

impl DicomHeader {
    fn set(&mut self, tag: u32, bytes: &[u8], big_endian: bool) -> io::Result<()> {
        let short = || match *bytes {
            [a, b] if big_endian => Ok(u16::from_be_bytes([a, b])),
            [a, b] => Ok(u16::from_le_bytes([a, b])),
            _ => Err(invalid(format!("{} has {} bytes, expected 2", format_tag(tag), bytes.len()))),
        };
        match tag {
            tags::SERIES_DESCRIPTION => self.description = text(bytes),
            tags::SERIES_UID => self.series = text(bytes),
            tags::SERIES_NUMBER => self.series_number = numbers(tag, bytes)?.map_or(0.0, |[n]| n),
            // Without a number, files are ordered by name.
            tags::INSTANCE_NUMBER => {
                self.instance = numbers(tag, bytes).ok().flatten().map_or(0.0, |[n]| n);
            }
            tags::TEMPORAL_POSITION => self.time = numbers(tag, bytes)?.map_or(0.0, |[n]| n),
            tags::SAMPLES_PER_PIXEL => self.n_channels = usize::from(short()?),
            tags::PHOTOMETRIC_INTERPRETATION => self.photometric = text(bytes),
            tags::PLANAR_CONFIGURATION => self.is_planar = short()? == 1,
            tags::NUMBER_OF_FRAMES => {
                let n = numbers(tag, bytes)?.map(|[n]| n);
                self.n_frames = n.map(|n| n.clamp(0.0, MAX_FRAMES as f64) as usize);
            }
            tags::ROWS => self.size[1] = usize::from(short()?),
            tags::COLUMNS => self.size[0] = usize::from(short()?),
            tags::BITS_ALLOCATED => self.bits_allocated = short()?,
            tags::BITS_STORED => self.bits_stored = short()?,
            tags::HIGH_BIT => self.high_bit = short()?,
            tags::PIXEL_REPRESENTATION => self.is_signed = short()? == 1,
            tags::SPACING_BETWEEN_SLICES => {
                let distance = numbers(tag, bytes).ok().flatten().map(|[n]| n);
                self.frame_distance = distance.filter(|&n| n > 0.0);
            }
            tags::GRID_FRAME_OFFSETS => self.offsets = list(tag, bytes)?,
            // Compressed files are little endian.
            tags::EXTENDED_OFFSETS => {
                let offsets = bytes.as_chunks().0.iter().map(|&b| u64::from_le_bytes(b));
                self.frame_offsets = offsets.collect();
            }
            _ => self.image.set(tag, bytes)?,
        }
        Ok(())
    }
}

/// Text without padding.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_matches(['\0', ' ']).to_owned()
}

/// The numbers of a value, which are text; empty if the value is.
fn list(tag: u32, bytes: &[u8]) -> io::Result<Vec<f64>> {
    let text = text(bytes);
    if text.is_empty() {
        return Ok(Vec::new());
    }
    let number = |n: &str| n.trim().parse().ok().filter(|n: &f64| n.is_finite());
    let all: Option<Vec<f64>> = text.split('\\').map(number).collect();
    let wrong =
        || invalid(format!("{} is '{}', expected numbers", format_tag(tag), shortened(&text)));
    all.ok_or_else(wrong)
}

/// The `N` numbers of a value; none if the value is empty.
fn numbers<const N: usize>(tag: u32, bytes: &[u8]) -> io::Result<Option<[f64; N]>> {
    let all = list(tag, bytes)?;
    if all.is_empty() {
        return Ok(None);
    }
    let n = all.len();
    let all = <[f64; N]>::try_from(all);
    all.map(Some).map_err(|_| invalid(format!("{} has {n} numbers, expected {N}", format_tag(tag))))
}
