//! Frames that are packed: by run lengths, as JPEG, or as JPEG 2000.
//!
//! Source: DICOM PS3.5, 8.2 and A.4. JPEG (8-bit, and lossless up to 16 bits) and JPEG 2000 are decoded by crates of pure
//! Rust. Numbers of a colour are handed on as they are stored.
//!
//! # Invariants
//!
//! The size that a picture tells is held against that of the image before anything is unpacked, and that of the image
//! against the length of its file.

use std::io;

use hayro_jpeg2000::{DecodeSettings, DecoderContext};
use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};

use super::rle;
use crate::volume::decode::invalid;

/// How frames are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Codec {
    /// Run lengths.
    Runs,
    Jpeg,
    Jpeg2000,
}

/// What a frame holds once it is unpacked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// Numbers of each sample.
    pub(super) n_channels: usize,
    /// Bytes of each number.
    pub(super) n_bytes: usize,
}

/// Most bytes of samples that a byte of a file with packed frames may stand for.
pub(super) const RATIO: u64 = 512;

/// How a codestream of JPEG 2000 begins; at which of its bytes it tells how many components there are, and precision and
/// sign of the first one.
const CODESTREAM: [u8; 4] = [0xff, 0x4f, 0xff, 0x51];
const N_COMPONENTS: usize = 40;
const PRECISION: usize = 42;

impl Codec {
    /// That of a transfer syntax; none of others.
    pub(super) fn of(syntax: &str) -> Option<Codec> {
        match syntax.strip_prefix("1.2.840.10008.1.2.")? {
            "5" => Some(Codec::Runs),
            "4.50" | "4.51" | "4.57" | "4.70" => Some(Codec::Jpeg),
            "4.90" | "4.91" => Some(Codec::Jpeg2000),
            _ => None,
        }
    }

    /// The numbers of all samples of a frame, little endian, one sample after the other.
    ///
    /// # Errors
    ///
    /// `InvalidData` where the frame is damaged, or of another shape.
    pub(super) fn unpacked(self, bytes: &[u8], shape: Shape) -> io::Result<Vec<u8>> {
        let Shape { size: [x, y], n_channels, n_bytes } = shape;
        match self {
            Codec::Runs => rle::unpacked(bytes, x * y, n_bytes, n_channels),
            Codec::Jpeg => jpeg(bytes, shape),
            Codec::Jpeg2000 => jpeg_2000(bytes, shape),
        }
    }
}

impl Shape {
    /// Checks what a picture tells of itself.
    fn check(self, x: usize, y: usize, n_channels: usize, n_bits: usize) -> io::Result<()> {
        let [width, height] = self.size;
        if [x, y] == self.size && n_channels == self.n_channels && n_bits <= 8 * self.n_bytes {
            return Ok(());
        }
        Err(invalid(format!(
            "a picture of {x}x{y} with {n_channels} numbers of {n_bits} bits, expected {width}x{height} with {} of {}",
            self.n_channels,
            8 * self.n_bytes
        )))
    }
}

fn jpeg(bytes: &[u8], shape: Shape) -> io::Result<Vec<u8>> {
    let damaged = |e: jpeg_decoder::Error| invalid(format!("damaged JPEG: {e}"));
    let mut decoder = Decoder::new(bytes);
    decoder.set_color_transform(ColorTransform::None);
    decoder.read_info().map_err(damaged)?;
    let info = decoder.info().ok_or_else(|| invalid("a JPEG that tells no size"))?;
    let (n_channels, n_bits) = match info.pixel_format {
        PixelFormat::L8 => (1, 8),
        PixelFormat::L16 => (1, 16),
        PixelFormat::RGB24 => (3, 8),
        PixelFormat::CMYK32 => (4, 8),
    };
    shape.check(usize::from(info.width), usize::from(info.height), n_channels, n_bits)?;
    let numbers = decoder.decode().map_err(damaged)?;
    let found = numbers.len() * 8 / n_bits;
    if found != shape.size[0] * shape.size[1] * n_channels {
        return Err(invalid(format!("a JPEG of {found} numbers, expected others")));
    }
    // 16 bits are in the order of the machine.
    Ok(match n_bits {
        16 => widened(
            numbers.chunks_exact(2).map(|n| u32::from(u16::from_ne_bytes([n[0], n[1]]))),
            shape.n_bytes,
        ),
        _ => widened(numbers.into_iter().map(u32::from), shape.n_bytes),
    })
}

fn jpeg_2000(bytes: &[u8], shape: Shape) -> io::Result<Vec<u8>> {
    let damaged = |e: hayro_jpeg2000::DecodeError| invalid(format!("damaged JPEG 2000: {e}"));
    let settings = DecodeSettings { strict: true, ..DecodeSettings::default() };
    let image = hayro_jpeg2000::Image::new(bytes, &settings).map_err(damaged)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let n_bits = usize::from(image.original_bit_depth());
    let start = bytes.windows(4).position(|w| w == CODESTREAM);
    let Some(head) = start.and_then(|start| bytes.get(start..start + PRECISION + 1)) else {
        return Err(invalid("JPEG 2000 without a codestream"));
    };
    let n_components = u16::from_be_bytes([head[N_COMPONENTS], head[N_COMPONENTS + 1]]);
    shape.check(width, height, usize::from(n_components), n_bits)?;
    // The decoder takes signed numbers for unsigned ones, half of their range higher.
    let is_signed = head[PRECISION] & 0x80 != 0;
    let shift = if is_signed { 1i64 << (n_bits.max(1) - 1) } else { 0 };
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(damaged)?;
    let components = decoded.components();
    let n = shape.size[0] * shape.size[1];
    if components.len() != shape.n_channels || components.iter().any(|c| c.samples().len() != n) {
        let found = components.len();
        return Err(invalid(format!(
            "a picture of {found} components, expected {}",
            shape.n_channels
        )));
    }
    let number = |i: usize| components[i % shape.n_channels].samples()[i / shape.n_channels];
    let whole = (0..n * shape.n_channels).map(|i| (number(i).round() as i64 - shift) as u32);
    Ok(widened(whole, shape.n_bytes))
}

/// The lowest bytes of numbers.
fn widened(numbers: impl Iterator<Item = u32>, n_bytes: usize) -> Vec<u8> {
    numbers.flat_map(|n| n.to_le_bytes().into_iter().take(n_bytes)).collect()
}
