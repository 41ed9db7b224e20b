//! Compressed frames: run length encoding, JPEG, JPEG 2000.
//!
//! Source: DICOM PS3.5, 8.2 and A.4. JPEG (8-bit, and lossless up to 16 bits) and JPEG 2000 are decoded by crates of pure
//! Rust. Colours stay in the space that the photometric interpretation names: only JPEG whose marker contradicts `RGB` is
//! converted. Values that lossy compression moves out of their bits are clipped.
//!
//! # Invariants
//!
//! Before decompression, the size in the frame is checked against that of the image, and that of the image against the
//! length of its file.

use std::io;

use hayro_jpeg2000::{DecodeSettings, DecoderContext};
use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};

use super::rle;
use crate::volume::data_error::invalid;
use crate::volume::decoder_panic::catch_panic;

/// The compression of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Codec {
    /// Run lengths.
    Rle,
    Jpeg,
    Jpeg2000,
}

/// The samples of a decompressed frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameShape {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// Numbers of each sample.
    pub(super) n_channels: usize,
    /// Bytes of each number.
    pub(super) n_bytes: usize,
    /// Whether the photometric interpretation of the image is RGB.
    pub(super) is_rgb: bool,
}

/// Most bytes of samples per byte of a file with compressed frames.
pub(super) const MAX_COMPRESSION_RATIO: u64 = 512;

/// The value of Adobe's marker for luminance and two differences.
const ADOBE_YCBCR: u8 = 1;

/// The start of a JPEG 2000 codestream; its bytes with the number of components, and with precision and sign of the first.
const CODESTREAM: [u8; 4] = [0xff, 0x4f, 0xff, 0x51];
const N_COMPONENTS: usize = 40;
const PRECISION: usize = 42;

impl Codec {
    /// The codec of a transfer syntax, if it is supported.
    pub(super) fn of(syntax: &str) -> Option<Codec> {
        match syntax.strip_prefix("1.2.840.10008.1.2.")? {
            "5" => Some(Codec::Rle),
            "4.50" | "4.51" | "4.57" | "4.70" => Some(Codec::Jpeg),
            "4.90" | "4.91" => Some(Codec::Jpeg2000),
            _ => None,
        }
    }

    /// The numbers of all samples of a frame, little endian, one sample after the other.
    ///
    /// # Errors
    ///
    /// `InvalidData` if the frame is damaged or has another shape.
    pub(super) fn decompress(self, bytes: &[u8], shape: FrameShape) -> io::Result<Vec<u8>> {
        let FrameShape { size: [x, y], n_channels, n_bytes, .. } = shape;
        match self {
            Codec::Rle => rle::decompress(bytes, x * y, n_bytes, n_channels),
            Codec::Jpeg => catch_panic("JPEG", || decode_jpeg(bytes, shape)),
            Codec::Jpeg2000 => catch_panic("JPEG 2000", || decode_jpeg_2000(bytes, shape)),
        }
    }
}

impl FrameShape {
    /// Checks the shape in the header of a compressed frame.
    fn check(self, x: usize, y: usize, n_channels: usize, n_bits: usize) -> io::Result<()> {
        let [width, height] = self.size;
        if [x, y] == self.size && n_channels == self.n_channels && n_bits <= 8 * self.n_bytes {
            return Ok(());
        }
        Err(invalid(format!(
            "a frame of {x}x{y} with {n_channels} numbers of {n_bits} bits, expected {width}x{height} with {} of {}",
            self.n_channels,
            8 * self.n_bytes
        )))
    }
}

fn decode_jpeg(bytes: &[u8], shape: FrameShape) -> io::Result<Vec<u8>> {
    let damaged = |e: jpeg_decoder::Error| invalid(format!("damaged JPEG: {e}"));
    let mut decoder = Decoder::new(bytes);
    decoder.read_info().map_err(damaged)?;
    let info = decoder.info().ok_or_else(|| invalid("a JPEG without a size"))?;
    let (n_channels, n_bits) = match info.pixel_format {
        PixelFormat::L8 => (1, 8),
        PixelFormat::L16 => (1, 16),
        PixelFormat::RGB24 => (3, 8),
        PixelFormat::CMYK32 => (4, 8),
    };
    shape.check(usize::from(info.width), usize::from(info.height), n_channels, n_bits)?;
    if n_channels == 3 {
        // As "RGB" the decoder leaves three numbers as they are.
        let is_converted = shape.is_rgb && adobe_transform(bytes) == Some(ADOBE_YCBCR);
        let transform = if is_converted { ColorTransform::YCbCr } else { ColorTransform::RGB };
        decoder.set_color_transform(transform);
    }
    let numbers = decoder.decode().map_err(damaged)?;
    let found = numbers.len() * 8 / n_bits;
    let expected = shape.size[0] * shape.size[1] * n_channels;
    if found != expected {
        return Err(invalid(format!("a JPEG of {found} numbers, expected {expected}")));
    }
    // 16-bit numbers have the native byte order.
    Ok(match n_bits {
        16 => low_bytes(
            numbers.chunks_exact(2).map(|n| u32::from(u16::from_ne_bytes([n[0], n[1]]))),
            shape.n_bytes,
        ),
        _ => low_bytes(numbers.into_iter().map(u32::from), shape.n_bytes),
    })
}

/// The colours of a JPEG by the marker of Adobe (APP14), if it has one.
fn adobe_transform(bytes: &[u8]) -> Option<u8> {
    // Markers before the first scan: 0xff, kind, length.
    let mut rest = bytes.get(2..)?;
    loop {
        let &[0xff, kind, high, low] = rest.first_chunk()? else { return None };
        let length = usize::from(u16::from_be_bytes([high, low]));
        let segment = rest.get(4..2 + length)?;
        match (kind, segment) {
            (0xda, _) => return None,
            (0xee, [b'A', b'd', b'o', b'b', b'e', _, _, _, _, _, _, transform, ..]) => {
                return Some(*transform);
            }
            _ => rest = &rest[2 + length..],
        }
    }
}

fn decode_jpeg_2000(bytes: &[u8], shape: FrameShape) -> io::Result<Vec<u8>> {
    let damaged = |e: hayro_jpeg2000::DecodeError| invalid(format!("damaged JPEG 2000: {e}"));
    let settings = DecodeSettings { strict: true, ..DecodeSettings::default() };
    // DICOM wants a bare codestream; some writers put it into the boxes of a JP2 file, whose colours are not needed.
    let start = bytes.windows(4).position(|w| w == CODESTREAM);
    let bytes = &bytes[start.ok_or_else(|| invalid("JPEG 2000 without a codestream"))?..];
    let image = hayro_jpeg2000::Image::new(bytes, &settings).map_err(damaged)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let n_bits = usize::from(image.original_bit_depth());
    let head = bytes.get(..PRECISION + 1).ok_or_else(|| invalid("JPEG 2000 without a header"))?;
    let n_components = u16::from_be_bytes([head[N_COMPONENTS], head[N_COMPONENTS + 1]]);
    shape.check(width, height, usize::from(n_components), n_bits)?;
    // The decoder shifts signed numbers by half of their range to unsigned ones.
    let is_signed = head[PRECISION] & 0x80 != 0;
    let shift = if is_signed { 1i64 << (n_bits.max(1) - 1) } else { 0 };
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(damaged)?;
    let components = decoded.components();
    let n = shape.size[0] * shape.size[1];
    if components.len() != shape.n_channels || components.iter().any(|c| c.samples().len() != n) {
        let found = components.len();
        return Err(invalid(format!(
            "a frame of {found} components, expected {}",
            shape.n_channels
        )));
    }
    let number = |i: usize| components[i % shape.n_channels].samples()[i / shape.n_channels];
    let highest = (1i64 << n_bits) - 1;
    let clipped = |value: f32| (value.round() as i64).clamp(0, highest) - shift;
    let whole = (0..n * shape.n_channels).map(|i| clipped(number(i)) as u32);
    Ok(low_bytes(whole, shape.n_bytes))
}

/// The lowest `n_bytes` bytes of each number, little endian.
fn low_bytes(numbers: impl Iterator<Item = u32>, n_bytes: usize) -> Vec<u8> {
    numbers.flat_map(|n| n.to_le_bytes().into_iter().take(n_bytes)).collect()
}
