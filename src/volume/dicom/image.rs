//! A DICOM file with an image, and its slices.

use std::io::{self, Read, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use super::codec::{self, Codec, FrameShape};
use super::elements::{DataSet, PixelData};
use super::fragments::Fragments;
use super::header::{DicomHeader, Slice};
use super::order;
use crate::error::{Error, Result};
use crate::input;
use crate::volume::data_error::{invalid, read_error};
use crate::volume::layout::{SampleType, size_of_grid};
use crate::volume::stream::DEFLATE_RATIO;

/// The image of a file.
pub(super) struct DicomImage {
    pub(super) path: PathBuf,
    pub(super) length: u64,
    pub(super) body: DataSet,
    pub(super) header: DicomHeader,
    pub(super) pixels: PixelData,
    /// The compression of frames, if any.
    pub(super) codec: Option<Codec>,
    /// The fragments of compressed frames.
    pub(super) fragments: Fragments,
}

impl DicomImage {
    /// Reads the header of a file; none if it has no image.
    pub(super) fn of(path: &Path) -> Result<Option<DicomImage>> {
        let (file, length) = input::open(path)?;
        let wrong = |e: io::Error| match e.kind() {
            io::ErrorKind::UnexpectedEof => {
                Error::input(format!("{}: the file ends inside an element", path.display()))
            }
            _ => read_error(path, e),
        };
        let body = DataSet::of(&file, length).map_err(wrong)?;
        let mut header = DicomHeader { n_channels: 1, ..DicomHeader::default() };
        let pixels = body.walk(file, length, &mut header).map_err(wrong)?;
        let Some(pixels) = pixels else { return Ok(None) };
        let codec = Codec::of(&body.syntax);
        let mut fragments = Fragments::default();
        if codec.is_some() && pixels.length.is_none() {
            let at = body.start + pixels.offset;
            let (file, n) = (input::open(path)?.0, header.n_frames.unwrap_or(1));
            fragments = Fragments::find(file, at, n, &header.frame_offsets).map_err(wrong)?;
        }
        Ok(Some(DicomImage {
            path: path.to_owned(),
            length,
            body,
            header,
            pixels,
            codec,
            fragments,
        }))
    }

    /// The slices of the image, whose index in its series is `image`.
    pub(super) fn slices(&self, image: usize) -> io::Result<Vec<Slice>> {
        let DicomHeader { frames, offsets, image: whole, shared, .. } = &self.header;
        let n = self.header.n_frames.unwrap_or(1).max(1);
        for (what, found) in [("groups of frames", frames.len()), ("offsets", offsets.len())] {
            if n > 1 && found != n && found > 0 {
                return Err(invalid(format!("{found} {what}, expected {n}, the number of frames")));
            }
        }
        let time = (self.header.time, self.header.instance);
        // Frames without positions of their own follow the first in even steps.
        let distance = self.header.frame_distance;
        let distance = distance.filter(|_| frames.is_empty() && offsets.is_empty());
        let slice = |frame: usize| {
            let own = frames.get(frame).copied().unwrap_or_default();
            let mut plane = own.or(*shared).or(*whole);
            let along = offsets.get(frame).map(|offset| offset - offsets[0]);
            let along = along.or(distance.map(|distance| distance * frame as f64));
            if let (Some(along), Some(position)) = (along, plane.position) {
                let normal = order::normal(&plane.orientation.unwrap_or_default());
                plane.position = Some([0, 1, 2].map(|i| position[i] + along * normal[i]));
            }
            Slice { image, frame, plane, time }
        };
        Ok((0..n).map(slice).collect())
    }

    /// Directions of rows and columns of an image without frames of its own directions.
    pub(super) fn orientation(&self) -> Option<[f64; 6]> {
        let is_single = self.header.n_frames.unwrap_or(1) <= 1 && self.header.frames.is_empty();
        self.header.image.orientation.filter(|_| is_single)
    }

    /// The name of a slice in messages.
    pub(super) fn name_of(&self, slice: &Slice) -> String {
        match self.header.n_frames {
            Some(n) if n > 1 => format!("frame {}", slice.frame),
            _ => self.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }

    pub(super) fn sample_type(&self) -> SampleType {
        if self.pixels.is_float {
            let is_double = self.header.bits_allocated == 64;
            return if is_double { SampleType::F64 } else { SampleType::F32 };
        }
        match (self.header.bits_allocated, self.header.is_signed) {
            (8, false) => SampleType::U8,
            (8, true) => SampleType::I8,
            (16, false) => SampleType::U16,
            (16, true) => SampleType::I16,
            (_, false) => SampleType::U32,
            (_, true) => SampleType::I32,
        }
    }

    /// Whether samples of 8 bits are in words of the other byte order.
    pub(super) fn has_swapped_bytes(&self) -> bool {
        self.body.encoding.big_endian && self.header.bits_allocated == 8 && self.pixels.is_words
    }

    /// Bytes of one channel of a frame. No overflow: columns and rows have 16 bits.
    pub(super) fn plane_bytes(&self) -> u64 {
        let [x, y] = self.header.size;
        x as u64 * y as u64 * self.sample_type().n_bytes() as u64
    }

    pub(super) fn frame_bytes(&self) -> u64 {
        self.plane_bytes() * self.header.n_channels as u64
    }

    /// Decompresses a frame.
    pub(super) fn decompress_frame(&self, codec: Codec, frame: usize) -> io::Result<Vec<u8>> {
        let mut file = input::open(&self.path).map_err(|e| io::Error::other(e.to_string()))?.0;
        let mut bytes = Vec::new();
        for &(at, length) in self.fragments.of_frame(frame) {
            file.seek(SeekFrom::Start(at))?;
            (&file).take(u64::from(length)).read_to_end(&mut bytes)?;
        }
        let n_bytes = self.sample_type().n_bytes();
        let (size, n_channels) = (self.header.size, self.header.n_channels);
        let is_rgb = self.header.photometric == "RGB";
        codec.decompress(&bytes, FrameShape { size, n_channels, n_bytes, is_rgb })
    }

    /// Checks that the file has the bytes of all frames.
    pub(super) fn check_length(&self) -> io::Result<()> {
        let [x, y] = self.header.size;
        let n = self.header.n_frames.unwrap_or(1).max(1);
        let size = size_of_grid([x, y, n], self.sample_type()).filter(|&(n, _)| n > 0);
        let Some((n_samples, _)) = size else {
            return Err(invalid(format!("{n} slices of {x}x{y}, expected at least one sample")));
        };
        let expected = self.frame_bytes().saturating_mul(n as u64);
        if self.codec.is_some() {
            let found = self.fragments.len();
            if self.fragments.n_frames() != n {
                let message =
                    format!("{found} compressed fragments, expected {n}, the number of frames");
                return Err(invalid(message));
            }
            if expected > self.length.saturating_mul(codec::MAX_COMPRESSION_RATIO) {
                let message =
                    format!("{} bytes, too few for {expected} bytes of samples", self.length);
                return Err(invalid(message));
            }
            return Ok(());
        }
        let left = if self.body.encoding.deflated {
            self.length.saturating_mul(DEFLATE_RATIO)
        } else {
            self.length.saturating_sub(self.body.start + self.pixels.offset)
        };
        let declared = self
            .pixels
            .length
            .ok_or_else(|| invalid("samples in fragments, expected uncompressed ones without"))?;
        let found = left.min(u64::from(declared));
        if found < expected {
            return Err(invalid(format!(
                "{found} bytes of samples, expected {expected} for {n_samples}"
            )));
        }
        Ok(())
    }
}
