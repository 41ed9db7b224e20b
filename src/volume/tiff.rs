//! TIFF and BigTIFF: each page a slice, as microscopes and Fiji write them; and folders of numbered slices (`slices`).
//!
//! Source: TIFF 6.0; the OME-TIFF specification (docs.openmicroscopy.org); for ImageJ its `TiffEncoder` and `TiffDecoder`.
//! The crate `tiff` decodes pages; this module adds slice, channel and frame of each page, and the spacing, from the
//! OME-XML or ImageJ's lines in the description of the first page. Without either all pages are slices, and the spacing is
//! unknown: the resolution of other files is meant for printing.
//!
//! ImageJ writes files larger than 4 GiB with one directory for all pages, which are contiguous in the file.

mod description;
mod directories;
pub(crate) mod slices;

use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom};

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};

use super::data_error::invalid;
use super::decode::{exact_f64, read_samples, select_channel};
use super::layout::{Channel, SampleType};
use super::placement::Placement;
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, Samples};
use super::select::one_of;
use super::stream::DEFLATE_RATIO;
use super::text::shortened;
use description::Described;

/// Most bytes of a page per byte of the file. LZW could compress more than deflate, but does not in practice.
const MAX_COMPRESSION_RATIO: u64 = DEFLATE_RATIO;

/// Most pages of a file: ends chains of directories that form a circle.
const MAX_PAGES: usize = 1 << 20;

/// Reads a TIFF file.
///
/// # Errors
///
/// `InvalidData` for damaged files, pages that differ, compression other than LZW and deflate, and if a frame or channel must
/// be chosen.
pub(super) fn read(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    let mut pages = Pages::open(file, length)?;
    let n_pages = pages.count()?;
    let described = description::read(&pages.first.description)?;
    let is_contiguous = n_pages == 1 && described.n_pages.is_some_and(|n| n > 1);
    let n_pages = if is_contiguous { described.n_pages.unwrap_or(1) } else { n_pages };
    let order = described.order(n_pages)?;
    let frame = one_of("frame", options.frame, order.n_frames)?;
    // Channels are colours of a page or separate pages.
    let n_colours = pages.first.n_colours;
    if n_colours > 1 && order.n_channels > 1 {
        return Err(invalid("several channels with several colours, expected one or the other"));
    }
    let index = one_of("channel", options.channel, n_colours.max(order.n_channels))?;
    let (page_channel, colour) = if n_colours > 1 { (0, index) } else { (index, 0) };
    let wanted: Vec<usize> =
        (0..order.n_slices).map(|z| order.page(page_channel, z, frame)).collect();
    let colour = Channel { index: colour, of: n_colours };
    let samples = if is_contiguous {
        pages.read_contiguous(&wanted)?
    } else {
        pages.read(&wanted, colour)?
    };
    let [width, height] = pages.first.size;
    let placement = placement(&pages.first, &described);
    Ok(SampleGrid { dims: [width, height, wanted.len()], samples, placement })
}

/// The placement of the samples, as far as the file has it.
fn placement(first: &TiffPage, described: &Described) -> Placement {
    let mut placement = Placement { unit: described.unit, ..Placement::IDENTITY };
    for a in 0..3 {
        let spacing = described.spacing[a].or_else(|| {
            // ImageJ stores the pixel spacing as resolution, in its own unit.
            let resolution = if described.is_imagej && a < 2 { first.resolution[a] } else { None };
            resolution.map(|per_unit| 1.0 / per_unit)
        });
        if let Some(spacing) = spacing.filter(|s| s.is_finite() && *s > 0.0) {
            placement.spacing[a] = spacing;
        }
    }
    if described.spacing.iter().chain(&first.resolution).all(Option::is_none) || !described.is_any {
        log::info!("no spacing in the file, 1 is assumed (--spacing X,Y,Z)");
    }
    placement
}

/// The properties of a page.
#[derive(Clone, Debug, PartialEq)]
struct TiffPage {
    size: [usize; 2],
    n_colours: usize,
    sample_type: SampleType,
    description: String,
    /// Pixels per unit along x and y.
    resolution: [Option<f64>; 2],
}

/// The pages of a file, read in order.
struct Pages {
    decoder: Decoder<BufReader<File>>,
    length: u64,
    first: TiffPage,
}

impl Pages {
    fn open(file: File, length: u64) -> io::Result<Self> {
        let mut reader = BufReader::new(file);
        directories::check(&mut reader, length)?;
        let decoder = Decoder::new(reader).map_err(wrong)?;
        let mut limits = Limits::default();
        let max_bytes =
            usize::try_from(length.saturating_mul(MAX_COMPRESSION_RATIO)).unwrap_or(usize::MAX);
        limits.decoding_buffer_size = max_bytes;
        limits.intermediate_buffer_size = max_bytes;
        limits.ifd_value_size = usize::try_from(length).unwrap_or(usize::MAX);
        let mut decoder = decoder.with_limits(limits);
        let first = page(&mut decoder, length)?;
        Ok(Pages { decoder, length, first })
    }

    /// Counts the pages and returns to the first.
    fn count(&mut self) -> io::Result<usize> {
        let mut n = 1;
        while self.decoder.more_images() {
            self.decoder.next_image().map_err(wrong)?;
            n += 1;
            if n > MAX_PAGES {
                return Err(invalid(format!("more than {MAX_PAGES} pages")));
            }
        }
        self.decoder.seek_to_image(0).map_err(wrong)?;
        Ok(n)
    }

    /// Reads the samples of pages in ascending order.
    fn read(&mut self, wanted: &[usize], colour: Channel) -> io::Result<Samples> {
        let mut at = 0;
        joined(wanted.iter().map(|&index| {
            while at < index {
                self.decoder.next_image().map_err(wrong)?;
                at += 1;
            }
            let page = page(&mut self.decoder, self.length)?;
            let TiffPage { size, n_colours, sample_type, .. } = self.first;
            if (page.size, page.n_colours, page.sample_type) != (size, n_colours, sample_type) {
                let [width, height] = page.size;
                return Err(invalid(format!(
                    "page {index} is {width}x{height} {}, expected {}x{} {sample_type} as the first",
                    page.sample_type, size[0], size[1]
                )));
            }
            let decoded = self.decoder.read_image().map_err(wrong)?;
            let samples = select_channel(samples_of(decoded)?, colour);
            if samples.len() != size[0] * size[1] {
                return Err(invalid(format!("page {index} has {} samples", samples.len())));
            }
            Ok(samples)
        }))
    }

    /// Reads the samples of contiguous pages with one directory.
    fn read_contiguous(&mut self, wanted: &[usize]) -> io::Result<Samples> {
        let offset: Option<Vec<u64>> =
            self.decoder.find_tag_unsigned_vec(Tag::StripOffsets).map_err(wrong)?;
        let compression: Option<u16> =
            self.decoder.find_tag_unsigned(Tag::Compression).map_err(wrong)?;
        let (Some(&[start, ..]), None | Some(1)) = (offset.as_deref(), compression) else {
            return Err(invalid("one compressed page, expected several according to ImageJ"));
        };
        let TiffPage { size: [width, height], sample_type, .. } = self.first;
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

/// The samples of pages, one after the other.
fn joined(pages: impl Iterator<Item = io::Result<Samples>>) -> io::Result<Samples> {
    let mut all: Option<Samples> = None;
    for page in pages {
        Samples::append_to(&mut all, page)?;
    }
    all.ok_or_else(|| invalid("no pages"))
}

/// The properties of the current page.
fn page(decoder: &mut Decoder<BufReader<File>>, length: u64) -> io::Result<TiffPage> {
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
    if bytes > length.saturating_mul(MAX_COMPRESSION_RATIO) {
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
    Ok(TiffPage { size, n_colours, sample_type, description, resolution })
}

/// The samples of a page, with types that `Samples` does not have widened.
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

/// The error of the decoder in one line.
fn wrong(e: TiffError) -> io::Error {
    match e {
        TiffError::IoError(e) if e.kind() != io::ErrorKind::UnexpectedEof => e,
        TiffError::IoError(_) => invalid("the file ends inside a page"),
        other => {
            let text: String = other.to_string().chars().filter(|c| !c.is_control()).collect();
            invalid(format!("unsupported or damaged TIFF: {}", shortened(&text)))
        }
    }
}
