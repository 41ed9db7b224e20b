//! TIFF and BigTIFF: each page a slice, as microscopes and Fiji write them; and folders of numbered slices (`slices`).
//!
//! Source: TIFF 6.0; the OME-TIFF specification (docs.openmicroscopy.org); for ImageJ its `TiffEncoder` and `TiffDecoder`.
//! The crate `tiff` decodes pages; this module adds slice, channel and frame of each page, and the spacing, from the
//! OME-XML or ImageJ's lines in the description of the first page. Without either all pages are slices, and the spacing is
//! unknown: the resolution of other files is meant for printing.
//!
//! Samples are read as stored, also where the smallest is white or a colour table follows (`interpretation`). Only a straight
//! line that ImageJ calibrates integers with is applied: it stores signed samples so. Pages of reduced resolution are left out.
//!
//! ImageJ writes files larger than 4 GiB with one directory for all pages, which are contiguous in the file.

mod decoded;
mod described;
mod description;
mod directories;
mod imagej;
mod interpretation;
mod ome;
mod planes;
pub(crate) mod slices;

use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom};

use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, Limits};
use ::tiff::tags::Tag;

use super::data_error::invalid;
use super::decode::{read_samples, rescaled, select_channel};
use super::decoder_panic::catch_panic;
use super::layout::{Channel, SampleType};
use super::memory::try_filled_vec;
use super::placement::Placement;
use super::read_options::{ReadOptions, SliceAxis};
use super::samples::{SampleGrid, Samples};
use super::select::one_of;
use super::stream::DEFLATE_RATIO;
use super::text::shortened;
use decoded::{explained, samples_of, wrong};
use described::{Described, Planes, Writer};
use interpretation::AsStored;

/// Most bytes of a page per byte of the file. LZW could compress more than deflate, but does not in practice.
const MAX_COMPRESSION_RATIO: u64 = DEFLATE_RATIO;

/// Most pages of a file: ends chains of directories that form a circle.
const MAX_PAGES: usize = 1 << 20;

/// Values of the tag PlanarConfiguration, and of NewSubfileType: reduced resolution, or a transparency mask.
const PLANAR: u16 = 2;
const REDUCED_OR_MASK: u32 = 1 | 4;

/// Reads a TIFF file.
///
/// # Errors
///
/// `InvalidData` for damaged files, pages that differ, compression other than LZW and deflate, and if a frame or channel must
/// be chosen.
pub(super) fn read(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    catch_panic("TIFF", || read_pages(file, length, options))
}

fn read_pages(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    let mut pages = Pages::open(file, length)?;
    let described = description::read(&pages.description()?)?;
    if let Some(other) = &described.metadata_file {
        return Err(invalid(format!(
            "pages of an OME-TIFF whose description is in '{}', expected a file with its own, or a folder of numbered slices",
            shortened(other)
        )));
    }
    let (full, n_pages) = pages.full_resolution()?;
    let planes = described.planes(full, n_pages, pages.first.n_colours)?;
    check_slices(&planes, options)?;
    read_planes(&mut pages, &described, &planes, options)
}

/// Checks that a file of several planes has several slices, or that they are chosen.
fn check_slices(planes: &Planes, options: &ReadOptions) -> io::Result<()> {
    let order = planes.order;
    if options.slices.is_some() || order.n_slices > 1 || order.n_planes() == 1 {
        return Ok(());
    }
    Err(invalid(format!(
        "one slice of {} channels and {} frames, expected several slices (--slices channels or --slices frames reads these as slices)",
        order.n_channels, order.n_frames
    )))
}

/// Reads a file of one page, of which a description of several is ignored.
pub(super) fn read_page(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    let mut pages = Pages::open(file, length)?;
    let described = description::read(&pages.description()?)?;
    let (full, n_pages) = pages.full_resolution()?;
    if full.len() == 1 && described.writer == Writer::Ome || described.metadata_file.is_some() {
        let planes = Described::default().planes(full, n_pages, 1)?;
        return read_planes(&mut pages, &described, &planes, options);
    }
    let planes = described.planes(full, n_pages, pages.first.n_colours)?;
    read_planes(&mut pages, &described, &planes, options)
}

fn read_planes(
    pages: &mut Pages,
    described: &Described,
    planes: &Planes,
    options: &ReadOptions,
) -> io::Result<SampleGrid> {
    let wanted = Wanted::of(planes, pages.first.n_colours, options)?;
    let samples = if planes.is_contiguous() {
        pages.read_contiguous(&wanted.pages)?
    } else {
        pages.read(&wanted.pages, wanted.colour)?
    };
    let samples = match (described.calibration, &samples) {
        (Some((slope, intercept)), Samples::U8(_) | Samples::U16(_)) => {
            rescaled(samples, slope, intercept)
        }
        _ => samples,
    };
    let [width, height] = pages.first.size;
    let placement = placement(&pages.first, described);
    Ok(SampleGrid { dims: [width, height, wanted.pages.len()], samples, placement })
}

/// The pages of the slices that are read, and the number of each pixel.
struct Wanted {
    pages: Vec<usize>,
    colour: Channel,
}

impl Wanted {
    fn of(planes: &Planes, n_colours: usize, options: &ReadOptions) -> io::Result<Wanted> {
        let order = planes.order;
        let (n_channels, n_frames) = match options.slices {
            None => (order.n_channels, order.n_frames),
            Some(SliceAxis::Channels) => (1, order.n_frames),
            Some(SliceAxis::Frames) => (order.n_channels, 1),
        };
        if options.slices.is_some() && order.n_slices > 1 {
            let n = order.n_slices;
            return Err(invalid(format!("--slices, but the file has {n} slices, expected one")));
        }
        let frame = one_of("frame", options.frame, n_frames)?;
        // Channels are separate pages, or colours of a page, or both.
        let n = n_channels.saturating_mul(n_colours);
        let index = one_of("channel", options.channel, n)?;
        let (channel, colour) = (index / n_colours, index % n_colours);
        let pages: io::Result<Vec<usize>> = match options.slices {
            None => (0..order.n_slices).map(|z| planes.page(channel, z, frame)).collect(),
            Some(SliceAxis::Channels) => {
                (0..order.n_channels).map(|z| planes.page(z, 0, frame)).collect()
            }
            Some(SliceAxis::Frames) => {
                (0..order.n_frames).map(|z| planes.page(channel, 0, z)).collect()
            }
        };
        Ok(Wanted { pages: pages?, colour: Channel { index: colour, of: n_colours } })
    }
}

/// The placement of the samples, as far as the file has it.
fn placement(first: &TiffPage, described: &Described) -> Placement {
    let mut placement = Placement { unit: described.unit, ..Placement::IDENTITY };
    for a in 0..3 {
        let spacing = described.spacing[a].or_else(|| {
            // ImageJ stores the pixel spacing as resolution, in its own unit.
            let is_imagej = described.writer == Writer::ImageJ;
            let resolution = if is_imagej && a < 2 { first.resolution[a] } else { None };
            resolution.map(|per_unit| 1.0 / per_unit)
        });
        if let Some(spacing) = spacing.filter(|s| s.is_finite() && *s > 0.0) {
            placement.spacing[a] = spacing;
        }
    }
    let is_unknown = described.spacing.iter().chain(&first.resolution).all(Option::is_none);
    if is_unknown || described.writer == Writer::Other {
        log::info!("no spacing in the file, 1 is assumed (--spacing X,Y,Z)");
    }
    placement
}

/// The properties of a page.
#[derive(Clone, Debug, PartialEq)]
struct TiffPage {
    size: [usize; 2],
    n_colours: usize,
    /// Whether the numbers of all pixels for one colour follow each other.
    is_planar: bool,
    sample_type: SampleType,
    /// Pixels per unit along x and y.
    resolution: [Option<f64>; 2],
}

/// The pages of a file.
struct Pages {
    decoder: Decoder<AsStored<BufReader<File>>>,
    length: u64,
    /// The first of full resolution.
    first: TiffPage,
    /// The page at which the decoder is.
    at: usize,
}

impl Pages {
    fn open(file: File, length: u64) -> io::Result<Self> {
        let mut reader = BufReader::new(file);
        let replaced = directories::check(&mut reader, length)?;
        let decoder = Decoder::new(AsStored::new(reader, replaced)?).map_err(wrong)?;
        let mut limits = Limits::default();
        let max_bytes =
            usize::try_from(length.saturating_mul(MAX_COMPRESSION_RATIO)).unwrap_or(usize::MAX);
        limits.decoding_buffer_size = max_bytes;
        limits.intermediate_buffer_size = max_bytes;
        limits.ifd_value_size = usize::try_from(length).unwrap_or(usize::MAX);
        let mut decoder = decoder.with_limits(limits);
        let first = page(&mut decoder, length)?;
        Ok(Pages { decoder, length, first, at: 0 })
    }

    /// The bytes of the first page's description; empty without one.
    fn description(&mut self) -> io::Result<Vec<u8>> {
        let mut directory = self.decoder.image_ifd();
        let entry = directory.find_entry(Tag::ImageDescription);
        // The check of directories has bounded the number by the length of the file.
        let n = entry.map_or(0, |entry| entry.count().min(self.length));
        let mut bytes = vec![0; usize::try_from(n).unwrap_or(0)];
        directory.find_tag_bytes(Tag::ImageDescription, &mut bytes, 0).map_err(wrong)?;
        Ok(bytes)
    }

    /// The pages of full resolution, or all if none is, and the number of all pages.
    fn full_resolution(&mut self) -> io::Result<(Vec<usize>, usize)> {
        let (mut full, mut n) = (Vec::new(), 0);
        loop {
            let kind: Option<u32> =
                self.decoder.find_tag_unsigned(Tag::NewSubfileType).map_err(wrong)?;
            if kind.unwrap_or(0) & REDUCED_OR_MASK == 0 {
                full.push(n);
            }
            n += 1;
            if n > MAX_PAGES {
                return Err(invalid(format!("more than {MAX_PAGES} pages")));
            }
            if !self.decoder.more_images() {
                break;
            }
            self.decoder.next_image().map_err(wrong)?;
        }
        if full.is_empty() {
            full = (0..n).collect();
        }
        if full.len() < n {
            log::info!("{} pages of reduced resolution or masks are left out", n - full.len());
        }
        self.at = n - 1;
        self.go_to(full[0])?;
        self.first = page(&mut self.decoder, self.length)?;
        Ok((full, n))
    }

    /// Goes to a page that was visited before.
    fn go_to(&mut self, index: usize) -> io::Result<()> {
        if index == self.at + 1 {
            self.decoder.next_image().map_err(wrong)?;
        } else if index != self.at {
            self.decoder.seek_to_image(index).map_err(wrong)?;
        }
        self.at = index;
        Ok(())
    }

    /// Reads the samples of pages.
    fn read(&mut self, wanted: &[usize], colour: Channel) -> io::Result<Samples> {
        joined(wanted.iter().map(|&index| {
            self.go_to(index)?;
            let page = page(&mut self.decoder, self.length)?;
            let first = &self.first;
            let is_same = (page.size, page.n_colours, page.is_planar, page.sample_type)
                == (first.size, first.n_colours, first.is_planar, first.sample_type);
            if !is_same {
                let ([width, height], [first_width, first_height]) = (page.size, first.size);
                return Err(invalid(format!(
                    "page {index} is {width}x{height} {}, expected {first_width}x{first_height} {} as the first",
                    page.sample_type, first.sample_type
                )));
            }
            if page.is_planar {
                return self.read_plane(&page, colour.index);
            }
            let decoded = self.decoder.read_image().map_err(|e| explained(&mut self.decoder, e))?;
            let (samples, n) = (samples_of(decoded)?, page.size[0] * page.size[1]);
            if samples.len() != n * page.n_colours {
                return Err(invalid(format!(
                    "page {index} has {} numbers, expected {} of {} per pixel",
                    samples.len(),
                    n * page.n_colours,
                    page.n_colours
                )));
            }
            Ok(select_channel(samples, colour))
        }))
    }

    /// Reads the numbers of one colour from its own strips or tiles. The decoder takes those at the lower border of all planes but
    /// the first for whole ones.
    fn read_plane(&mut self, page: &TiffPage, colour: usize) -> io::Result<Samples> {
        let ([width, height], size) = (page.size, page.sample_type.n_bytes());
        let (chunk_width, chunk_height) = self.decoder.chunk_dimensions();
        let (chunk_width, chunk_height) = (chunk_width as usize, chunk_height as usize);
        let across = width.div_ceil(chunk_width);
        let n_chunks = across * height.div_ceil(chunk_height);
        let mut plane = try_filled_vec(width * height * size, 0u8)?;
        for i in 0..n_chunks {
            let index = u32::try_from(colour * n_chunks + i);
            let index = index.map_err(|_| invalid(format!("{n_chunks} tiles of a page")))?;
            let layout = self.decoder.image_chunk_buffer_layout(index).map_err(wrong)?;
            if layout.len as u64 > self.length.saturating_mul(MAX_COMPRESSION_RATIO) {
                let (length, n) = (self.length, layout.len);
                return Err(invalid(format!("a tile of {n} bytes, more than {length} can hold")));
            }
            let mut chunk = try_filled_vec(layout.len, 0u8)?;
            let read = self.decoder.read_chunk_bytes(index, &mut chunk);
            read.map_err(|e| explained(&mut self.decoder, e))?;
            let row_bytes = layout.row_stride.map_or(1, |bytes| bytes.get());
            let [x, y] = [i % across * chunk_width, i / across * chunk_height];
            let n = row_bytes.min((width - x) * size);
            for (j, row) in chunk.chunks_exact(row_bytes).take(height - y).enumerate() {
                let at = ((y + j) * width + x) * size;
                plane[at..at + n].copy_from_slice(&row[..n]);
            }
        }
        let (big_endian, n) = (cfg!(target_endian = "big"), width * height);
        read_samples(&mut &plane[..], page.sample_type, big_endian, n, n)
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
fn page(decoder: &mut Decoder<AsStored<BufReader<File>>>, length: u64) -> io::Result<TiffPage> {
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
    let planar: Option<u16> = decoder.find_tag_unsigned(Tag::PlanarConfiguration).map_err(wrong)?;
    let is_planar = n_colours > 1 && planar == Some(PLANAR);
    let mut number = |tag| {
        let value = decoder.find_tag(tag).ok().flatten()?;
        let value = match value {
            ::tiff::decoder::ifd::Value::Rational(a, b) => f64::from(a) / f64::from(b),
            _ => return None,
        };
        Some(value).filter(|v| v.is_finite() && *v > 0.0)
    };
    let resolution = [number(Tag::XResolution), number(Tag::YResolution)];
    Ok(TiffPage { size, n_colours, is_planar, sample_type, resolution })
}
