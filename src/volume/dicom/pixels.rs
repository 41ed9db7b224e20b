//! The samples of slices: stored bits, and their modality values.
//!
//! Source: DICOM PS3.3, C.7.6.3 (pixels) and C.11.1 (modality); PS3.5, 8 (how they are stored).

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::header::Slice;
use super::image::DicomImage;
use crate::error::Result;
use crate::input;
use crate::volume::data_error::{invalid, read_error};
use crate::volume::decode::rescaled;
use crate::volume::layout::{Channel, SampleLayout};
use crate::volume::read_options::ReadOptions;
use crate::volume::samples::Samples;
use crate::volume::select::one_of;
use crate::volume::stream;
use crate::volume::text::shortened;

/// Transfer syntaxes without compression.
const UNCOMPRESSED: [&str; 4] =
    ["1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.1.99", "1.2.840.10008.1.2.2"];

/// Checks that an image is supported, and has the same format as the first of its series.
///
/// # Errors
///
/// `InvalidData` with the difference.
pub(super) fn check(image: &DicomImage, first: &DicomImage) -> io::Result<()> {
    let header = &image.header;
    let syntax = image.body.syntax.as_str();
    if !syntax.is_empty() && image.codec.is_none() && !UNCOMPRESSED.contains(&syntax) {
        return Err(invalid(format!(
            "samples compressed as {}, which is not supported: gdcmconv --raw decompresses them, and dcm2niix converts a series to NIfTI",
            compression_name(syntax)
        )));
    }
    let photometric = header.photometric.as_str();
    let is_grey = photometric.is_empty() || photometric.starts_with("MONOCHROME");
    let is_colour = matches!(photometric, "RGB" | "YBR_FULL")
        || image.codec.is_some() && matches!(photometric, "YBR_FULL_422" | "YBR_ICT" | "YBR_RCT");
    let is_colour = is_colour && header.n_channels == 3;
    if !(is_grey && header.n_channels == 1 || is_colour) {
        return Err(invalid(format!(
            "samples of {} numbers as '{}', expected MONOCHROME2 of one or RGB of three",
            header.n_channels,
            shortened(photometric)
        )));
    }
    if image.pixels.is_float {
        let allocated = header.bits_allocated;
        if !matches!(allocated, 32 | 64) || image.codec.is_some() {
            return Err(invalid(format!(
                "floating-point samples of {allocated} bits, expected uncompressed ones of 32 or 64"
            )));
        }
        return check_same(image, first);
    }
    let (allocated, stored, high) = (header.bits_allocated, header.bits_stored, header.high_bit);
    if !matches!(allocated, 8 | 16 | 32) || stored == 0 || stored > high + 1 || high >= allocated {
        return Err(invalid(format!(
            "samples of {stored} bits up to bit {high} of {allocated}, expected at most 8, 16 or 32"
        )));
    }
    check_same(image, first)
}

/// Checks that an image has the samples of the first of its series, and that its file has all of them.
fn check_same(image: &DicomImage, first: &DicomImage) -> io::Result<()> {
    let header = &image.header;
    let kind = |image: &DicomImage| {
        let h = &image.header;
        let bits = (h.bits_allocated, h.bits_stored, h.high_bit, h.is_signed);
        let is_float = image.pixels.is_float;
        (h.size, h.n_channels, bits, is_float, image.body.encoding.big_endian, image.codec)
    };
    if kind(image) != kind(first) {
        let [x, y] = header.size;
        let [first_x, first_y] = first.header.size;
        return Err(invalid(format!(
            "a slice of {x}x{y} samples of {} bits, expected {first_x}x{first_y} of {} as {}",
            header.bits_stored,
            first.header.bits_stored,
            first.path.file_name().unwrap_or_default().to_string_lossy()
        )));
    }
    image.check_length()
}

/// Reads the samples of slices in the given order.
///
/// # Errors
///
/// [`crate::Error::Io`] if a file cannot be read; [`crate::Error::Input`] if one ends early, and if a channel must be chosen.
pub(super) fn read(
    path: &Path,
    images: &[DicomImage],
    slices: &[Slice],
    options: &ReadOptions,
) -> Result<Samples> {
    let first = &images[0];
    let of = first.header.n_channels;
    let wrong = |e| read_error(path, e);
    let index = one_of("channel", options.channel, of).map_err(wrong)?;
    let is_planar = first.header.is_planar && of > 1 && first.codec.is_none();
    let [x, y] = first.header.size;
    let layout = SampleLayout {
        dims: [x, y, slices.len()],
        sample_type: first.sample_type(),
        big_endian: first.body.encoding.big_endian,
        channel: if is_planar { Channel::ONLY } else { Channel { index, of } },
        skip: 0,
    };
    layout.size().map_err(wrong)?;
    let n_backed = images.iter().map(|image| image.length).fold(0, u64::saturating_add);
    let plane = if is_planar { Some(index) } else { None };
    let mut frames = FrameReader { images, slices, plane, next: 0, open: None };
    let samples = stream::read_decompressed(&mut frames, n_backed, &layout);
    let at = frames.path();
    let mut samples = samples.map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => read_error(&at, invalid("the file ends inside samples")),
        _ => read_error(&at, e),
    })?;
    extract_stored_bits(&mut samples, first.header.bits_stored, first.header.high_bit);
    if first.header.photometric == "MONOCHROME1" {
        log::info!("MONOCHROME1: the lowest samples are the brightest; samples are read as stored");
    }
    Ok(to_modality_values(samples, slices))
}

/// Extracts the stored bits; the highest is the sign of signed samples.
fn extract_stored_bits(samples: &mut Samples, stored: u16, high: u16) {
    macro_rules! extract {
        ($values:expr, $bits:expr) => {
            if stored < $bits {
                let (up, down) = ($bits - 1 - high, $bits - stored);
                $values.iter_mut().for_each(|v| *v = (*v << up) >> down);
            }
        };
    }
    match samples {
        Samples::U8(values) => extract!(values, 8),
        Samples::I8(values) => extract!(values, 8),
        Samples::U16(values) => extract!(values, 16),
        Samples::I16(values) => extract!(values, 16),
        Samples::U32(values) => extract!(values, 32),
        Samples::I32(values) => extract!(values, 32),
        Samples::F32(_) | Samples::F64(_) => {}
    }
}

/// Applies slope and intercept, which are the same for all slices, or different for each.
fn to_modality_values(samples: Samples, slices: &[Slice]) -> Samples {
    let scale =
        |slice: &Slice| (slice.plane.slope.unwrap_or(1.0), slice.plane.intercept.unwrap_or(0.0));
    let (slope, intercept) = slices.first().map_or((1.0, 0.0), scale);
    if slices.iter().all(|slice| scale(slice) == (slope, intercept)) {
        return rescaled(samples, slope, intercept);
    }
    let each = samples.len() / slices.len();
    let value = |i: usize| {
        let (slope, intercept) = scale(&slices[i / each]);
        samples.get(i) * slope + intercept
    };
    let values = (0..samples.len()).map(value);
    if samples.is_wide() {
        Samples::F64(values.collect())
    } else {
        Samples::F32(values.map(|v| v as f32).collect())
    }
}

/// A reader of the bytes of all slices, one after the other.
struct FrameReader<'a> {
    images: &'a [DicomImage],
    slices: &'a [Slice],
    /// The plane of the channel, if channels are stored as planes.
    plane: Option<usize>,
    next: usize,
    open: Option<OpenImage>,
}

/// The open file of an image.
struct OpenImage {
    image: usize,
    reader: Box<dyn Read>,
    /// Byte of the body.
    at: u64,
    /// Remaining bytes of the slice.
    left: u64,
}

impl FrameReader<'_> {
    /// The file of the current slice.
    fn path(&self) -> PathBuf {
        let i = self.next.saturating_sub(1).min(self.slices.len() - 1);
        self.images[self.slices[i].image].path.clone()
    }

    /// Goes to the next slice; false after the last. A file with contiguous slices stays open.
    fn advance(&mut self) -> io::Result<bool> {
        let Some(slice) = self.slices.get(self.next) else { return Ok(false) };
        self.next += 1;
        let image = &self.images[slice.image];
        if let Some(codec) = image.codec {
            let reader = Box::new(io::Cursor::new(image.decompress_frame(codec, slice.frame)?));
            let left = image.frame_bytes();
            self.open = Some(OpenImage { image: slice.image, reader, at: 0, left });
            return Ok(true);
        }
        let mut from = image.pixels.offset + image.frame_bytes() * slice.frame as u64;
        from += self.plane.map_or(0, |plane| image.plane_bytes() * plane as u64);
        let left = if self.plane.is_some() { image.plane_bytes() } else { image.frame_bytes() };
        let open = self.open.take().filter(|open| (open.image, open.at) == (slice.image, from));
        self.open = Some(match open {
            Some(open) => OpenImage { left, ..open },
            None => {
                let (file, length): (File, u64) =
                    input::open(&image.path).map_err(|e| io::Error::other(e.to_string()))?;
                let reader: Box<dyn Read> = if image.has_swapped_bytes() {
                    // Words start at the first sample.
                    let is_odd = (from - image.pixels.offset) % 2;
                    let words = image.body.open(file, length, from - is_odd)?;
                    Box::new(SwappedBytes::new(words, is_odd == 1)?)
                } else {
                    Box::new(image.body.open(file, length, from)?)
                };
                OpenImage { image: slice.image, reader, at: from, left }
            }
        });
        Ok(true)
    }
}

impl Read for FrameReader<'_> {
    fn read(&mut self, wanted: &mut [u8]) -> io::Result<usize> {
        loop {
            if let Some(open) = self.open.as_mut().filter(|open| open.left > 0) {
                let n = usize::try_from(open.left).unwrap_or(usize::MAX).min(wanted.len());
                let n = open.reader.read(&mut wanted[..n])?;
                open.left -= n as u64;
                open.at += n as u64;
                return Ok(n);
            }
            if wanted.is_empty() || !self.advance()? {
                return Ok(0);
            }
        }
    }
}

/// A reader of 8-bit samples in big-endian words: the second byte of each word comes first.
struct SwappedBytes<R> {
    words: R,
    /// The byte that follows, if its word has been read.
    next: Option<u8>,
}

impl<R: Read> SwappedBytes<R> {
    /// A reader from the start of a word on, or from its second sample.
    fn new(words: R, starts_in_word: bool) -> io::Result<Self> {
        let mut reader = SwappedBytes { words, next: None };
        if starts_in_word {
            reader.read_exact(&mut [0])?;
        }
        Ok(reader)
    }
}

impl<R: Read> Read for SwappedBytes<R> {
    fn read(&mut self, wanted: &mut [u8]) -> io::Result<usize> {
        let Some((first, rest)) = wanted.split_first_mut() else { return Ok(0) };
        if let Some(byte) = self.next.take() {
            *first = byte;
            return Ok(1);
        }
        if rest.is_empty() {
            let mut word = [0; 2];
            self.words.read_exact(&mut word)?;
            (*first, self.next) = (word[1], Some(word[0]));
            return Ok(1);
        }
        let n = wanted.len() / 2 * 2;
        self.words.read_exact(&mut wanted[..n])?;
        wanted[..n].as_chunks_mut().0.iter_mut().for_each(|[a, b]| std::mem::swap(a, b));
        Ok(n)
    }
}

/// The name of the compression of a transfer syntax.
fn compression_name(syntax: &str) -> String {
    let name = match syntax.strip_prefix("1.2.840.10008.1.2.").unwrap_or_default() {
        "4.50" | "4.51" => "JPEG",
        "4.57" | "4.70" => "lossless JPEG",
        "4.80" | "4.81" => "JPEG-LS",
        "4.90" | "4.91" | "4.92" | "4.93" => "JPEG 2000",
        "4.201" | "4.202" | "4.203" => "high-throughput JPEG 2000",
        "4.110" | "4.111" | "4.112" => "JPEG XL",
        other if other.starts_with("4.10") => "video",
        _ => return format!("transfer syntax '{}'", shortened(syntax)),
    };
    name.to_owned()
}
