//! NIfTI-1 and NIfTI-2: a binary header, then the samples in the same file (`.nii`) or in another one (`.hdr` and `.img`),
//! each plain or gzip.
//!
//! Source: nifti1.h and nifti2.h of the NIfTI Data Format Working Group (nifti.nimh.nih.gov). The world is that of the
//! sform if the header has one, else of the qform, both RAS in millimetres; without either only the spacing is known
//! ("method 1"), and no space. Samples are scaled by slope and intercept, unless the slope is 0.

mod header;

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use super::data_error::read_error;
use super::decode::rescaled;
use super::layout::{Channel, Compression, SampleLayout};
use super::read_options::ReadOptions;
use super::samples::{SampleGrid, Samples};
use super::select::one_of;
use super::stream;
use crate::error::Result;
use crate::input;
use header::NiftiHeader;

/// Reads a NIfTI file, which is open, or a pair of header and image file.
///
/// # Errors
///
/// [`crate::Error::Io`] if a file cannot be read; [`crate::Error::Input`] for other files, damaged ones, those of complex or
/// 128 bit numbers, and if a frame or channel must be chosen.
pub(crate) fn read(
    path: &Path,
    file: File,
    length: u64,
    options: &ReadOptions,
) -> Result<SampleGrid> {
    let (path, (file, length)) = match header_file(path) {
        Some(header) => (header.clone(), input::open(&header)?),
        None => (path.to_owned(), (file, length)),
    };
    let header = read_header(&path, file).map_err(|e| read_error(&path, e))?;
    let data = if header.is_pair { image_file(&path) } else { path.clone() };
    let (file, length) = if header.is_pair {
        input::open(&data)?
    } else {
        (File::open(&data).map_err(|e| crate::Error::io(&data, e))?, length)
    };
    let samples = read_data(&data, file, length, &header, options);
    let samples = samples.map_err(|e| read_error(&data, e))?;
    Ok(SampleGrid { dims: header.dims, samples, placement: header.placement })
}

/// The other file of a pair.
pub(crate) fn companion_files(path: &Path) -> Vec<PathBuf> {
    match header_file(path) {
        Some(header) => vec![header],
        None if is_header(path) => vec![image_file(path)],
        None => Vec::new(),
    }
}

fn is_gzip(path: &Path) -> bool {
    Compression::of_name(path) == Compression::Gzip
}

fn is_header(path: &Path) -> bool {
    let name = path.to_string_lossy().to_ascii_lowercase();
    name.trim_end_matches(".gz").ends_with(".hdr")
}

/// The header of an `.img` file.
fn header_file(path: &Path) -> Option<PathBuf> {
    let name = path.to_string_lossy();
    let is_image = name.to_ascii_lowercase().trim_end_matches(".gz").ends_with(".img");
    is_image.then(|| companion_file(path, "hdr"))
}

/// The samples of a `.hdr` file.
fn image_file(path: &Path) -> PathBuf {
    companion_file(path, "img")
}

/// The file of the same name with another extension, plain or gzip, whichever exists; plain if neither does.
fn companion_file(path: &Path, extension: &str) -> PathBuf {
    let stem = if is_gzip(path) { path.with_extension("") } else { path.to_owned() };
    let plain = stem.with_extension(extension);
    let gzip = stem.with_extension(format!("{extension}.gz"));
    if !plain.exists() && gzip.exists() { gzip } else { plain }
}

fn read_header(path: &Path, file: File) -> io::Result<NiftiHeader> {
    let reader = BufReader::new(file);
    if is_gzip(path) { header::read(MultiGzDecoder::new(reader)) } else { header::read(reader) }
}

fn read_data(
    path: &Path,
    file: File,
    length: u64,
    header: &NiftiHeader,
    options: &ReadOptions,
) -> io::Result<Samples> {
    let frame = one_of("frame", options.frame, header.n_frames)?;
    let channel = one_of("channel", options.channel, header.n_channels)?;
    // Vectors are stored component by component, colours sample by sample.
    let (volume, channel) = if header.is_interleaved {
        (frame, Channel { index: channel, of: header.n_channels })
    } else {
        (frame + channel * header.n_frames, Channel::ONLY)
    };
    let mut layout = SampleLayout {
        dims: header.dims,
        sample_type: header.sample_type,
        big_endian: header.big_endian,
        channel,
        skip: 0,
    };
    layout.skip_volumes(volume, header.offset)?;
    let mut reader = BufReader::new(file);
    let samples = stream::read(&mut reader.by_ref(), length, Compression::of_name(path), &layout)?;
    Ok(rescaled(samples, header.slope, header.intercept))
}
