//! The samples of slices: which bits of which bytes, and what they stand for.
//!
//! Source: DICOM PS3.3, C.7.6.3 (pixels) and C.11.1 (modality); PS3.5, 8 (how they are stored).

use std::fs::File;
use std::io::{self, Read, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use super::packed::{self, Codec, Shape};
use super::{Image, Slice};
use crate::error::Result;
use crate::input;
use crate::volume::decode::{SampleType, invalid, read_error, rescaled, size_of_grid};
use crate::volume::select::one_of;
use crate::volume::stream::{self, Channel, DEFLATE_RATIO, Layout};
use crate::volume::text::shortened;
use crate::volume::{ReadOptions, Samples};

/// Transfer syntaxes whose samples are not packed, beside those of no name.
const PLAIN: [&str; 4] =
    ["1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.1.99", "1.2.840.10008.1.2.2"];

/// Checks that an image is one that is read, and of the kind of the first of its series.
///
/// # Errors
///
/// `InvalidData` that says what is not.
pub(super) fn check(image: &Image, first: &Image) -> io::Result<()> {
    let header = &image.header;
    let syntax = image.body.syntax.as_str();
    if !syntax.is_empty() && image.codec.is_none() && !PLAIN.contains(&syntax) {
        return Err(invalid(format!(
            "samples packed as {}, expected plain ones: gdcmconv --raw unpacks them, and dcm2niix makes NIfTI of a series",
            name_of(syntax)
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
    let (allocated, stored, high) = (header.bits_allocated, header.bits_stored, header.high_bit);
    if !matches!(allocated, 8 | 16 | 32) || stored == 0 || stored > high + 1 || high >= allocated {
        return Err(invalid(format!(
            "samples of {stored} bits up to bit {high} of {allocated}, expected some of 8, 16 or 32"
        )));
    }
    if image.body.encoding.big_endian && allocated == 8 && image.pixels.is_words {
        return Err(invalid("8-bit samples in big-endian words, expected bytes"));
    }
    let kind = |image: &Image| {
        let h = &image.header;
        let bits = (h.bits_allocated, h.bits_stored, h.high_bit, h.is_signed);
        (h.size, h.n_channels, bits, image.body.encoding.big_endian, image.codec)
    };
    if kind(image) != kind(first) {
        let [x, y] = header.size;
        let [first_x, first_y] = first.header.size;
        return Err(invalid(format!(
            "a slice of {x}x{y} samples of {stored} bits, expected {first_x}x{first_y} of {} as {}",
            first.header.bits_stored,
            first.path.file_name().unwrap_or_default().to_string_lossy()
        )));
    }
    image.check_length()
}

impl Image {
    fn sample_type(&self) -> SampleType {
        match (self.header.bits_allocated, self.header.is_signed) {
            (8, false) => SampleType::U8,
            (8, true) => SampleType::I8,
            (16, false) => SampleType::U16,
            (16, true) => SampleType::I16,
            (_, false) => SampleType::U32,
            (_, true) => SampleType::I32,
        }
    }

    /// Bytes of one of the numbers of all samples of a frame. They fit: sides are of 16 bits.
    fn plane_bytes(&self) -> u64 {
        let [x, y] = self.header.size;
        x as u64 * y as u64 * self.sample_type().n_bytes() as u64
    }

    fn frame_bytes(&self) -> u64 {
        self.plane_bytes() * self.header.n_channels as u64
    }

    /// The bytes of a frame that is packed: a fragment, or of a single one all of them.
    fn unpacked(&self, codec: Codec, frame: usize) -> io::Result<Vec<u8>> {
        let mut file = input::open(&self.path).map_err(|e| io::Error::other(e.to_string()))?.0;
        let is_single = self.header.n_frames.unwrap_or(1) <= 1;
        let parts = if is_single { &self.fragments[..] } else { &self.fragments[frame..=frame] };
        let mut bytes = Vec::new();
        for &(at, length) in parts {
            file.seek(SeekFrom::Start(at))?;
            (&file).take(u64::from(length)).read_to_end(&mut bytes)?;
        }
        let n_bytes = self.sample_type().n_bytes();
        let (size, n_channels) = (self.header.size, self.header.n_channels);
        codec.unpacked(&bytes, Shape { size, n_channels, n_bytes })
    }

    /// Checks that the file can hold all frames.
    fn check_length(&self) -> io::Result<()> {
        let [x, y] = self.header.size;
        let n = self.header.n_frames.unwrap_or(1).max(1);
        let size = size_of_grid([x, y, n], self.sample_type()).filter(|&(n, _)| n > 0);
        let Some((n_samples, _)) = size else {
            return Err(invalid(format!("{n} slices of {x}x{y}, expected some samples")));
        };
        let expected = self.frame_bytes().saturating_mul(n as u64);
        if self.codec.is_some() {
            let found = self.fragments.len();
            if found == 0 || n > 1 && found != n {
                let of = format!("{found} packed fragments, expected {n} as there are frames");
                return Err(invalid(of));
            }
            if expected > self.length.saturating_mul(packed::RATIO) {
                let of = format!("{} bytes, too few for {expected} bytes of samples", self.length);
                return Err(invalid(of));
            }
            return Ok(());
        }
        let left = if self.body.encoding.deflated {
            self.length.saturating_mul(DEFLATE_RATIO)
        } else {
            self.length.saturating_sub(self.body.start + self.pixels.offset)
        };
        let told = self.pixels.length.ok_or_else(|| {
            invalid("samples in fragments, as packed ones are, expected plain ones")
        })?;
        let found = left.min(u64::from(told));
        if found < expected {
            return Err(invalid(format!(
                "{found} bytes of samples, expected {expected} for {n_samples}"
            )));
        }
        Ok(())
    }
}

/// Reads the samples of slices in their order.
///
/// # Errors
///
/// [`crate::Error::Io`] if a file cannot be read; [`crate::Error::Input`] where one ends early, and where a channel must be
/// chosen.
pub(super) fn read(
    path: &Path,
    images: &[Image],
    slices: &[Slice],
    options: &ReadOptions,
) -> Result<Samples> {
    let first = &images[0];
    let of = first.header.n_channels;
    let wrong = |e| read_error(path, e);
    let index = one_of("channel", options.channel, of).map_err(wrong)?;
    let is_planar = first.header.is_planar && of > 1 && first.codec.is_none();
    let [x, y] = first.header.size;
    let layout = Layout {
        dims: [x, y, slices.len()],
        sample_type: first.sample_type(),
        big_endian: first.body.encoding.big_endian,
        channel: if is_planar { Channel::ONLY } else { Channel { index, of } },
        skip: 0,
    };
    layout.size().map_err(wrong)?;
    let n_earned = images.iter().map(|image| image.length).fold(0, u64::saturating_add);
    let plane = if is_planar { Some(index) } else { None };
    let mut frames = Frames { images, slices, plane, next: 0, open: None };
    let samples = stream::unpacked(&mut frames, n_earned, &layout);
    let at = frames.path();
    let mut samples = samples.map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => read_error(&at, invalid("the file ends inside samples")),
        _ => read_error(&at, e),
    })?;
    mask(&mut samples, first.header.bits_stored, first.header.high_bit);
    if first.header.photometric == "MONOCHROME1" {
        log::info!("MONOCHROME1: the lowest samples are the brightest; they are read as stored");
    }
    Ok(of_modality(samples, slices))
}

/// Keeps the bits that are stored, of which the highest is the sign where there is one.
fn mask(samples: &mut Samples, stored: u16, high: u16) {
    macro_rules! mask {
        ($values:expr, $bits:expr) => {
            if stored < $bits {
                let (up, down) = ($bits - 1 - high, $bits - stored);
                $values.iter_mut().for_each(|v| *v = (*v << up) >> down);
            }
        };
    }
    match samples {
        Samples::U8(values) => mask!(values, 8),
        Samples::I8(values) => mask!(values, 8),
        Samples::U16(values) => mask!(values, 16),
        Samples::I16(values) => mask!(values, 16),
        Samples::U32(values) => mask!(values, 32),
        Samples::I32(values) => mask!(values, 32),
        Samples::F32(_) | Samples::F64(_) => {}
    }
}

/// What samples stand for: slope and intercept are the same for all slices, or each has its own.
fn of_modality(samples: Samples, slices: &[Slice]) -> Samples {
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

/// The bytes of slices in a row.
struct Frames<'a> {
    images: &'a [Image],
    slices: &'a [Slice],
    /// Which plane of each, where numbers are planes.
    plane: Option<usize>,
    next: usize,
    open: Option<Open>,
}

/// A file at some byte of its body.
struct Open {
    image: usize,
    reader: Box<dyn Read>,
    at: u64,
    /// Bytes of the present slice.
    left: u64,
}

impl Frames<'_> {
    /// The file that is being read.
    fn path(&self) -> PathBuf {
        let i = self.next.saturating_sub(1).min(self.slices.len() - 1);
        self.images[self.slices[i].image].path.clone()
    }

    /// Goes to the next slice; a file whose slices follow each other stays open.
    fn advance(&mut self) -> io::Result<bool> {
        let Some(slice) = self.slices.get(self.next) else { return Ok(false) };
        self.next += 1;
        let image = &self.images[slice.image];
        if let Some(codec) = image.codec {
            let reader = Box::new(io::Cursor::new(image.unpacked(codec, slice.frame)?));
            let left = image.frame_bytes();
            self.open = Some(Open { image: slice.image, reader, at: 0, left });
            return Ok(true);
        }
        let mut from = image.pixels.offset + image.frame_bytes() * slice.frame as u64;
        from += self.plane.map_or(0, |plane| image.plane_bytes() * plane as u64);
        let left = if self.plane.is_some() { image.plane_bytes() } else { image.frame_bytes() };
        let open = self.open.take().filter(|open| (open.image, open.at) == (slice.image, from));
        self.open = Some(match open {
            Some(open) => Open { left, ..open },
            None => {
                let (file, length): (File, u64) =
                    input::open(&image.path).map_err(|e| io::Error::other(e.to_string()))?;
                let reader = Box::new(image.body.open(file, length, from)?);
                Open { image: slice.image, reader, at: from, left }
            }
        });
        Ok(true)
    }
}

impl Read for Frames<'_> {
    fn read(&mut self, wanted: &mut [u8]) -> io::Result<usize> {
        loop {
            if let Some(open) = self.open.as_mut().filter(|open| open.left > 0) {
                let most = usize::try_from(open.left).unwrap_or(usize::MAX).min(wanted.len());
                let n = open.reader.read(&mut wanted[..most])?;
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

/// The name of a transfer syntax that packs samples.
fn name_of(syntax: &str) -> String {
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
