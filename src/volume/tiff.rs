//! TIFF and BigTIFF: each page a slice, as microscopes and Fiji write them; and folders of numbered slices (`slices`).
//!
//! Source: TIFF 6.0; the OME-TIFF specification (docs.openmicroscopy.org); for ImageJ its `TiffEncoder` and `TiffDecoder`.
//! The crate `tiff` decodes pages; what this module adds is which page is which slice, channel and frame, and how far
//! apart they are: by the OME-XML or ImageJ's lines in the description of the first page. Without either all pages are
//! slices, and the spacing is not known: resolutions of plain files are those of printers.
//!
//! ImageJ writes what is larger than 4 GiB with one directory: its pages follow each other in the file.

mod description;
mod directories;
pub(crate) mod slices;

use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom};
use std::path::Path;

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};

use super::decode::{SampleType, exact_f64, invalid, picked, read_error, read_samples};
use super::select::one_of;
use super::stream::{Channel, DEFLATE_RATIO};
use super::text::shortened;
use super::{Grid, Placement, ReadOptions, Samples};
use crate::error::Result;
use description::Described;

/// Most bytes of a page that a byte of the file may stand for: LZW, which can tell of more than deflate, does not in practice.
const PACKING_RATIO: u64 = DEFLATE_RATIO;

/// Most pages of a file.
const MOST_PAGES: usize = 1 << 20;

/// Reads a TIFF file, which is open.
///
/// # Errors
///
/// [`crate::Error::Io`] if it cannot be read; [`crate::Error::Input`] for damaged files, pages of different kinds, packings
/// other than LZW and deflate, and where a frame or channel must be chosen.
pub(crate) fn read(
    path: &Path,
    (file, length): (File, u64),
    options: &ReadOptions,
) -> Result<Grid> {
    read_grid(file, length, options).map_err(|e| read_error(path, e))
}

fn read_grid(file: File, length: u64, options: &ReadOptions) -> io::Result<Grid> {
    let mut pages = Pages::open(file, length)?;
    let n_pages = pages.count()?;
    let described = description::read(&pages.first.description)?;
    let is_run_on = n_pages == 1 && described.n_pages.is_some_and(|n| n > 1);
    let n_pages = if is_run_on { described.n_pages.unwrap_or(1) } else { n_pages };
    let order = described.order(n_pages)?;
    let frame = one_of("frame", options.frame, order.n_frames)?;
    // Colours of a page, or channels of pages of their own.
    let n_colours = pages.first.n_colours;
    if n_colours > 1 && order.n_channels > 1 {
        return Err(invalid("pages of colours in several channels, expected one or the other"));
    }
    let index = one_of("channel", options.channel, n_colours.max(order.n_channels))?;
    let (page_channel, colour) = if n_colours > 1 { (0, index) } else { (index, 0) };
    let wanted: Vec<usize> =
        (0..order.n_slices).map(|z| order.page(page_channel, z, frame)).collect();
    let colour = Channel { index: colour, of: n_colours };
    let samples = if is_run_on { pages.run_on(&wanted)? } else { pages.read(&wanted, colour)? };
    let [width, height] = pages.first.size;
    Ok(([width, height, wanted.len()], samples, placement(&pages.first, &described)))
}

/// Where the samples lie, as far as the file tells.
fn placement(first: &Page, described: &Described) -> Placement {
    let mut placement = Placement { unit: described.unit, ..Placement::IDENTITY };
    for a in 0..3 {
        let told = described.spacing[a].or_else(|| {
            // ImageJ keeps the spacing of pixels as the resolution, in its own unit.
            let resolution = if described.is_imagej && a < 2 { first.resolution[a] } else { None };
            resolution.map(|per_unit| 1.0 / per_unit)
        });
        if let Some(spacing) = told.filter(|s| s.is_finite() && *s > 0.0) {
            placement.spacing[a] = spacing;
        }
    }
    if described.spacing.iter().chain(&first.resolution).all(Option::is_none) || !described.is_any {
        log::info!("no spacing in the file: samples are taken as 1 apart (--spacing X,Y,Z)");
    }
    placement
}

/// What there is to know of a page.
#[derive(Clone, Debug, PartialEq)]
struct Page {
    size: [usize; 2],
    n_colours: usize,
    sample_type: SampleType,
    description: String,
    /// Pixels per unit along x and y.
    resolution: [Option<f64>; 2],
}

/// The pages of a file, one after the other.
struct Pages {
    decoder: Decoder<BufReader<File>>,
    length: u64,
    first: Page,
}

impl Pages {
    fn open(file: File, length: u64) -> io::Result<Self> {
        let mut reader = BufReader::new(file);
        directories::check(&mut reader, length)?;
        let decoder = Decoder::new(reader).map_err(wrong)?;
        let mut limits = Limits::default();
        let most = usize::try_from(length.saturating_mul(PACKING_RATIO)).unwrap_or(usize::MAX);
        limits.decoding_buffer_size = most;
        limits.intermediate_buffer_size = most;
        limits.ifd_value_size = usize::try_from(length).unwrap_or(usize::MAX);
        let mut decoder = decoder.with_limits(limits);
        let first = page(&mut decoder, length)?;
        Ok(Pages { decoder, length, first })
    }

    /// How many pages there are; goes back to the first.
    fn count(&mut self) -> io::Result<usize> {
        let mut n = 1;
        while self.decoder.more_images() {
            self.decoder.next_image().map_err(wrong)?;
            n += 1;
            if n > MOST_PAGES {
                return Err(invalid(format!("more than {MOST_PAGES} pages")));
            }
        }
        self.decoder.seek_to_image(0).map_err(wrong)?;
        Ok(n)
    }

    /// The samples of pages in ascending order.
    fn read(&mut self, wanted: &[usize], colour: Channel) -> io::Result<Samples> {
        let mut at = 0;
        joined(wanted.iter().map(|&index| {
            while at < index {
                self.decoder.next_image().map_err(wrong)?;
                at += 1;
            }
            let page = page(&mut self.decoder, self.length)?;
            let Page { size, n_colours, sample_type, .. } = self.first;
            if (page.size, page.n_colours, page.sample_type) != (size, n_colours, sample_type) {
                let [width, height] = page.size;
                return Err(invalid(format!(
                    "page {index} is {width}x{height} {}, expected {}x{} {sample_type} as the first",
                    page.sample_type, size[0], size[1]
                )));
            }
            let decoded = self.decoder.read_image().map_err(wrong)?;
            let samples = picked(samples_of(decoded)?, colour);
            if samples.len() != size[0] * size[1] {
                return Err(invalid(format!("page {index} has {} samples", samples.len())));
            }
            Ok(samples)
        }))
    }

    /// The samples of pages that follow each other in the file, with one directory.
    fn run_on(&mut self, wanted: &[usize]) -> io::Result<Samples> {
        let offset: Option<Vec<u64>> =
            self.decoder.find_tag_unsigned_vec(Tag::StripOffsets).map_err(wrong)?;
        let packing: Option<u16> =
            self.decoder.find_tag_unsigned(Tag::Compression).map_err(wrong)?;
        let (Some(&[start, ..]), None | Some(1)) = (offset.as_deref(), packing) else {
            return Err(invalid("one packed page where ImageJ tells of several"));
        };
        let Page { size: [width, height], sample_type, .. } = self.first;
        let n = width * height;
        let n_bytes = (n * sample_type.n_bytes()) as u64;
        let big_endian = self.decoder.byte_order() == ::tiff::tags::ByteOrder::BigEndian;
        joined(wanted.iter().map(|&index| {
            let at = n_bytes.checked_mul(index as u64).and_then(|at| at.checked_add(start));
            let Some(at) = at.filter(|at| at.saturating_add(n_bytes) <= self.length) else {
                return Err(invalid(format!("the file ends before page {index}")));
            };
            let reader = self.decoder.inner();
            reader.seek(SeekFrom::Start(at))?;
            read_samples(reader, sample_type, big_endian, n, n)
        }))
    }
}

/// The samples of pages, one behind the other.
fn joined(pages: impl Iterator<Item = io::Result<Samples>>) -> io::Result<Samples> {
    let mut all: Option<Samples> = None;
    for page in pages {
        match &mut all {
            Some(all) => all.append(page?)?,
            None => all = Some(page?),
        }
    }
    all.ok_or_else(|| invalid("no pages"))
}

/// What the directory of the present page tells.
fn page(decoder: &mut Decoder<BufReader<File>>, length: u64) -> io::Result<Page> {
    let (width, height) = decoder.dimensions().map_err(wrong)?;
    let (n_colours, bits) = match decoder.colortype().map_err(wrong)? {
        ColorType::Gray(bits) => (1, bits),
        ColorType::GrayA(bits) => (2, bits),
        ColorType::RGB(bits) | ColorType::YCbCr(bits) | ColorType::Lab(bits) => (3, bits),
        ColorType::RGBA(bits) | ColorType::CMYK(bits) => (4, bits),
        ColorType::Multiband { bit_depth, num_samples } => (usize::from(num_samples), bit_depth),
        other => return Err(invalid(format!("pixels of {other:?}, expected numbers"))),
    };
    let formats: Option<Vec<u16>> =
        decoder.find_tag_unsigned_vec(Tag::SampleFormat).map_err(wrong)?;
    let format = formats.and_then(|formats| formats.first().copied()).unwrap_or(1);
    let sample_type = match (format, bits) {
        (1 | 4, 8) => SampleType::U8,
        (1 | 4, 16) => SampleType::U16,
        (1 | 4, 32) => SampleType::U32,
        (1 | 4, 64) => SampleType::U64,
        (2, 8) => SampleType::I8,
        (2, 16) => SampleType::I16,
        (2, 32) => SampleType::I32,
        (2, 64) => SampleType::I64,
        (3, 16) => SampleType::F16,
        (3, 32) => SampleType::F32,
        (3, 64) => SampleType::F64,
        _ => return Err(invalid(format!("pixels of {bits} bits, expected 8, 16, 32 or 64"))),
    };
    let size = [width as usize, height as usize];
    let bytes = size[0] as u64 * size[1] as u64 * (n_colours * sample_type.n_bytes()) as u64;
    if bytes > length.saturating_mul(PACKING_RATIO) {
        return Err(invalid(format!(
            "a page of {width}x{height} {sample_type}, more than {length} bytes can hold"
        )));
    }
    let description = decoder.find_tag(Tag::ImageDescription).ok().flatten();
    let description = description.and_then(|d| d.into_string().ok()).unwrap_or_default();
    let mut number = |tag| {
        let value = decoder.find_tag(tag).ok().flatten()?;
        let value = match value {
            ::tiff::decoder::ifd::Value::Rational(a, b) => f64::from(a) / f64::from(b),
            _ => return None,
        };
        Some(value).filter(|v| v.is_finite() && *v > 0.0)
    };
    let resolution = [number(Tag::XResolution), number(Tag::YResolution)];
    Ok(Page { size, n_colours, sample_type, description, resolution })
}

/// What was decoded, widened as every reader does.
fn samples_of(decoded: DecodingResult) -> io::Result<Samples> {
    Ok(match decoded {
        DecodingResult::U8(v) => Samples::U8(v),
        DecodingResult::I8(v) => Samples::I8(v),
        DecodingResult::U16(v) => Samples::U16(v),
        DecodingResult::I16(v) => Samples::I16(v),
        DecodingResult::U32(v) => Samples::U32(v),
        DecodingResult::I32(v) => Samples::I32(v),
        DecodingResult::F16(v) => Samples::F32(v.into_iter().map(|v| v.to_f32()).collect()),
        DecodingResult::F32(v) => Samples::F32(v),
        DecodingResult::F64(v) => Samples::F64(v),
        DecodingResult::U64(v) => {
            Samples::F64(v.into_iter().map(|v| exact_f64(v.into())).collect::<io::Result<_>>()?)
        }
        DecodingResult::I64(v) => {
            Samples::F64(v.into_iter().map(|v| exact_f64(v.into())).collect::<io::Result<_>>()?)
        }
    })
}

/// What the decoder says, in a line.
fn wrong(e: TiffError) -> io::Error {
    match e {
        TiffError::IoError(e) if e.kind() != io::ErrorKind::UnexpectedEof => e,
        TiffError::IoError(_) => invalid("the file ends inside a page"),
        other => {
            let said: String = other.to_string().chars().filter(|c| !c.is_control()).collect();
            invalid(format!("no TIFF that is read: {}", shortened(&said)))
        }
    }
}
