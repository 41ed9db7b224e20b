//! What the elements of a DICOM file tell of its image.
//!
//! Source: DICOM PS3.3, C.7.6 (image plane and pixels), C.7.6.16 (groups of frames), C.8.8.3 (frames of a dose).

use std::io;

use super::elements::{Visitor, shown};
use crate::volume::decode::invalid;
use crate::volume::text::shortened;

/// What all frames of a file share, and what each has: sequences.
pub(super) const GROUPS_OF_FRAMES: [u32; 2] = [SHARED, PER_FRAME];
const SHARED: u32 = 0x5200_9229;
const PER_FRAME: u32 = 0x5200_9230;
/// Position, orientation, pixel measures and transformation of values: sequences in these.
pub(super) const PARTS_OF_GROUPS: [u32; 4] = [0x0020_9113, 0x0020_9116, 0x0028_9110, 0x0028_9145];

/// Most frames of a file.
const MOST_FRAMES: usize = 1 << 20;

/// What is told of an image, of all frames, or of one.
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
    /// This where it tells, else the other.
    pub(super) fn or(self, other: Plane) -> Plane {
        Plane {
            position: self.position.or(other.position),
            orientation: self.orientation.or(other.orientation),
            spacing: self.spacing.or(other.spacing),
            slope: self.slope.or(other.slope),
            intercept: self.intercept.or(other.intercept),
        }
    }

    /// Keeps a value that is one of a plane's.
    fn take(&mut self, tag: u32, bytes: &[u8]) -> io::Result<()> {
        match tag {
            0x0020_0032 => self.position = numbers(tag, bytes)?,
            0x0020_0037 => self.orientation = numbers(tag, bytes)?,
            0x0028_0030 => self.spacing = numbers(tag, bytes)?,
            0x0028_1052 => self.intercept = numbers(tag, bytes)?.map(|[n]| n),
            // The scaling of a dose is a slope.
            0x0028_1053 | 0x3004_000e => self.slope = numbers(tag, bytes)?.map(|[n]| n),
            _ => {}
        }
        Ok(())
    }
}

/// The image of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Header {
    pub(super) series: String,
    pub(super) description: String,
    pub(super) series_number: f64,
    /// Number of the time (TemporalPositionIdentifier), and of the file among those of the series.
    pub(super) time: f64,
    pub(super) instance: f64,
    pub(super) photometric: String,
    /// Columns and rows.
    pub(super) size: [usize; 2],
    pub(super) n_frames: Option<usize>,
    /// Numbers of each sample.
    pub(super) n_channels: usize,
    /// Whether these are planes one behind the other.
    pub(super) is_planar: bool,
    pub(super) bits_allocated: u16,
    pub(super) bits_stored: u16,
    pub(super) high_bit: u16,
    pub(super) is_signed: bool,
    pub(super) image: Plane,
    pub(super) shared: Plane,
    pub(super) frames: Vec<Plane>,
    /// Distances of the frames of a dose along the normal.
    pub(super) offsets: Vec<f64>,
}

const IMAGE: [u32; 22] = [
    0x0008_103e,
    0x0020_000e,
    0x0020_0011,
    0x0020_0013,
    0x0020_0032,
    0x0020_0037,
    0x0020_0100,
    0x0028_0002,
    0x0028_0004,
    0x0028_0006,
    0x0028_0008,
    0x0028_0010,
    0x0028_0011,
    0x0028_0030,
    0x0028_0100,
    0x0028_0101,
    0x0028_0102,
    0x0028_0103,
    0x0028_1052,
    0x0028_1053,
    0x3004_000c,
    0x3004_000e,
];

const PLANE: [u32; 5] = [0x0020_0032, 0x0020_0037, 0x0028_0030, 0x0028_1052, 0x0028_1053];

impl Visitor for Header {
    fn wants(&self, path: &[u32], tag: u32) -> bool {
        match path {
            [] => IMAGE.contains(&tag) || GROUPS_OF_FRAMES.contains(&tag),
            [group] => GROUPS_OF_FRAMES.contains(group) && PARTS_OF_GROUPS.contains(&tag),
            [group, part] => {
                GROUPS_OF_FRAMES.contains(group)
                    && PARTS_OF_GROUPS.contains(part)
                    && PLANE.contains(&tag)
            }
            _ => false,
        }
    }

    fn item(&mut self, path: &[u32]) -> io::Result<()> {
        if path == [PER_FRAME] {
            if self.frames.len() == MOST_FRAMES {
                return Err(invalid(format!("more than {MOST_FRAMES} frames")));
            }
            self.frames.push(Plane::default());
        }
        Ok(())
    }

    fn value(&mut self, path: &[u32], tag: u32, bytes: &[u8], big_endian: bool) -> io::Result<()> {
        match path {
            [] => self.take(tag, bytes, big_endian),
            [SHARED, ..] => self.shared.take(tag, bytes),
            _ => self.frames.last_mut().map_or(Ok(()), |frame| frame.take(tag, bytes)),
        }
    }
}

impl Header {
    fn take(&mut self, tag: u32, bytes: &[u8], big_endian: bool) -> io::Result<()> {
        let short = || match *bytes {
            [a, b] if big_endian => Ok(u16::from_be_bytes([a, b])),
            [a, b] => Ok(u16::from_le_bytes([a, b])),
            _ => Err(invalid(format!("{} has {} bytes, expected 2", shown(tag), bytes.len()))),
        };
        match tag {
            0x0008_103e => self.description = text(bytes),
            0x0020_000e => self.series = text(bytes),
            0x0020_0011 => self.series_number = numbers(tag, bytes)?.map_or(0.0, |[n]| n),
            // Where it is no number the order of names counts.
            0x0020_0013 => {
                self.instance = numbers(tag, bytes).ok().flatten().map_or(0.0, |[n]| n);
            }
            0x0020_0100 => self.time = numbers(tag, bytes)?.map_or(0.0, |[n]| n),
            0x0028_0002 => self.n_channels = usize::from(short()?),
            0x0028_0004 => self.photometric = text(bytes),
            0x0028_0006 => self.is_planar = short()? == 1,
            0x0028_0008 => {
                let n = numbers(tag, bytes)?.map(|[n]| n);
                self.n_frames = n.map(|n| n.clamp(0.0, MOST_FRAMES as f64) as usize);
            }
            0x0028_0010 => self.size[1] = usize::from(short()?),
            0x0028_0011 => self.size[0] = usize::from(short()?),
            0x0028_0100 => self.bits_allocated = short()?,
            0x0028_0101 => self.bits_stored = short()?,
            0x0028_0102 => self.high_bit = short()?,
            0x0028_0103 => self.is_signed = short()? == 1,
            0x3004_000c => self.offsets = list(tag, bytes)?,
            _ => self.image.take(tag, bytes)?,
        }
        Ok(())
    }
}

/// Text without what it is filled up with.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_matches(['\0', ' ']).to_owned()
}

/// Numbers as text; none where the value is empty.
fn list(tag: u32, bytes: &[u8]) -> io::Result<Vec<f64>> {
    let text = text(bytes);
    if text.is_empty() {
        return Ok(Vec::new());
    }
    let number = |n: &str| n.trim().parse().ok().filter(|n: &f64| n.is_finite());
    let all: Option<Vec<f64>> = text.split('\\').map(number).collect();
    let wrong = || invalid(format!("{} is '{}', expected numbers", shown(tag), shortened(&text)));
    all.ok_or_else(wrong)
}

/// So many numbers as text; none where the value is empty.
fn numbers<const N: usize>(tag: u32, bytes: &[u8]) -> io::Result<Option<[f64; N]>> {
    let all = list(tag, bytes)?;
    if all.is_empty() {
        return Ok(None);
    }
    let n = all.len();
    let all = <[f64; N]>::try_from(all);
    all.map(Some).map_err(|_| invalid(format!("{} has {n} numbers, expected {N}", shown(tag))))
}
