//! NIfTI-1 and NIfTI-2: a binary header, then the samples in the same file (`.nii`) or in another one (`.hdr` and `.img`),
//! each plain or gzip.
//!
//! Source: nifti1.h and nifti2.h of the NIfTI Data Format Working Group (nifti.nimh.nih.gov). The world is that of the
//! sform where the header has one, else of the qform, both RAS in millimetres; with neither only the spacing is known
//! ("method 1"), and no space. Samples are scaled by slope and intercept, unless the slope is 0.

mod header;

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use super::decode::{invalid, read_error, rescaled};
use super::select::one_of;
use super::stream::{self, Channel, Layout, Packing};
use super::{Grid, ReadOptions, Samples};
use crate::error::Result;
use crate::input;
use header::Header;

/// Reads a NIfTI file, which is open, and, where the samples are in another one, that.
///
/// # Errors
///
/// [`crate::Error::Io`] if a file cannot be read; [`crate::Error::Input`] for other files, damaged ones, those of complex or
/// 128 bit numbers, and where a frame or channel must be chosen.
pub(crate) fn read(
    path: &Path,
    (file, length): (File, u64),
    options: &ReadOptions,
) -> Result<Grid> {
    let (path, (file, length)) = match header_file(path) {
        Some(header) => {
            let opened = input::open(&header)?;
            (header, opened)
        }
        None => (path.to_owned(), (file, length)),
    };
    let header = read_header(&path, file).map_err(|e| read_error(&path, e))?;
    let data = if header.is_pair { image_file(&path) } else { path.clone() };
    let (file, length) = if header.is_pair {
        input::open(&data)?
    } else {
        (File::open(&data).map_err(|e| crate::Error::io(&data, e))?, length)
    };
    let samples = read_data(&data, (file, length), &header, options);
    Ok((header.dims, samples.map_err(|e| read_error(&data, e))?, header.placement))
}

/// The files that hold a volume beside the one that is named.
pub(crate) fn others(path: &Path) -> Vec<PathBuf> {
    match header_file(path) {
        Some(header) => vec![header],
        None if is_header(path) => vec![image_file(path)],
        None => Vec::new(),
    }
}

fn is_gzip(path: &Path) -> bool {
    Packing::of_name(path) == Packing::Gzip
}

fn is_header(path: &Path) -> bool {
    let name = path.to_string_lossy().to_ascii_lowercase();
    name.trim_end_matches(".gz").ends_with(".hdr")
}

/// The header of an `.img` file.
fn header_file(path: &Path) -> Option<PathBuf> {
    let name = path.to_string_lossy();
    let is_image = name.to_ascii_lowercase().trim_end_matches(".gz").ends_with(".img");
    is_image.then(|| beside(path, "hdr"))
}

/// The samples of a `.hdr` file.
fn image_file(path: &Path) -> PathBuf {
    beside(path, "img")
}

/// The file of the same name with another ending, plain or gzip, whichever there is; plain if neither.
fn beside(path: &Path, extension: &str) -> PathBuf {
    let stem = if is_gzip(path) { path.with_extension("") } else { path.to_owned() };
    let plain = stem.with_extension(extension);
    let packed = stem.with_extension(format!("{extension}.gz"));
    if !plain.exists() && packed.exists() { packed } else { plain }
}

fn read_header(path: &Path, file: File) -> io::Result<Header> {
    let reader = BufReader::new(file);
    if is_gzip(path) { header::read(MultiGzDecoder::new(reader)) } else { header::read(reader) }
}

fn read_data(
    path: &Path,
    (file, length): (File, u64),
    header: &Header,
    options: &ReadOptions,
) -> io::Result<Samples> {
    let frame = one_of("frame", options.frame, header.n_frames)?;
    let channel = one_of("channel", options.channel, header.n_channels)?;
    // Vectors are stored one component of the whole volume after the other, colours sample by sample.
    let (volume, channel) = if header.is_interleaved {
        (frame, Channel { index: channel, of: header.n_channels })
    } else {
        (frame + channel * header.n_frames, Channel::ONLY)
    };
    let mut layout = Layout {
        dims: header.dims,
        sample_type: header.sample_type,
        big_endian: header.big_endian,
        channel,
        skip: 0,
    };
    let (_, bytes_each) = layout.size()?;
    let before = bytes_each.checked_mul(volume as u64);
    layout.skip = before.and_then(|n| n.checked_add(header.offset)).ok_or_else(|| {
        invalid(format!("volume {volume} of {bytes_each} bytes, more than a file can hold"))
    })?;
    let mut reader = BufReader::new(file);
    let samples = stream::read(&mut reader.by_ref(), length, Packing::of_name(path), &layout)?;
    Ok(rescaled(samples, header.slope, header.intercept))
}
