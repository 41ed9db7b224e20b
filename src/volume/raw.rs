//! RAW: samples without a header, x fastest, then y, then z.
//!
//! Dimensions and sample type are part of the file name (`name_128x128x128_uint8.raw`, as in the Open SciVis Datasets) or
//! come from [`ReadOptions`], which take precedence. The byte order is little endian unless the options set it.
//! Without either, a companion header of the same name is read (`name.nhdr`, `name.mhd`). A file that ends in `.gz` is
//! decompressed.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use super::data_error::read_error;
use super::decode::read_samples;
use super::layout::{Channel, Compression, SampleLayout, SampleType, size_of_grid};
use super::placement::Placement;
use super::plain::PlainSamples;
use super::read_options::ReadOptions;
use super::samples::SampleGrid;
use super::stream;
use super::{metaimage, nrrd};
use crate::error::{Error, Result};

/// Reads a RAW file, which is open and has `length` bytes.
///
/// # Errors
///
/// [`Error::Io`] if the file cannot be read; [`Error::Input`] if neither name nor options give
/// dimensions and type, or the file does not have exactly the bytes that these need;
/// [`Error::Usage`] for an unknown sample type among the options.
pub(crate) fn read(
    path: &Path,
    mut file: File,
    length: u64,
    options: &ReadOptions,
) -> Result<SampleGrid> {
    if let Some(header) = described_by_header(path, options) {
        return read_by_header(path, &header, options);
    }
    let plain = layout(path, options)?;
    let PlainSamples { dims, sample_type, big_endian, placement, .. } = plain;
    let samples = if Compression::of_name(path) == Compression::Gzip {
        let layout =
            SampleLayout { dims, sample_type, big_endian, channel: Channel::ONLY, skip: 0 };
        stream::read_gzip_to_end(&mut BufReader::new(file), length, &layout)
    } else {
        let n = size_of_grid(dims, sample_type).filter(|&(_, bytes)| bytes as u64 == length);
        let (n, _) = n.ok_or_else(|| plain.wrong_length(length))?;
        read_samples(&mut file, sample_type, big_endian, n, n)
    };
    Ok(SampleGrid { dims, samples: samples.map_err(|e| read_error(path, e))?, placement })
}

/// The layout of the samples by name and options.
fn layout(path: &Path, options: &ReadOptions) -> Result<PlainSamples> {
    let is_gzip = Compression::of_name(path) == Compression::Gzip;
    let stem = if is_gzip { path.with_extension("") } else { path.to_owned() };
    let name = stem.file_stem().unwrap_or_default().to_string_lossy();
    let shown = path.display();
    let dims = options.dims.or_else(|| dims_in_name(&name)).ok_or_else(|| {
        Error::input(format!(
            "{shown}: no dimensions in the file name, expected e.g. name_128x128x128_uint8.raw or --dims 128x128x128"
        ))
    })?;
    let sample_type = match &options.sample_type {
        Some(given) => SampleType::from_name(given).ok_or_else(|| {
            Error::Usage(format!("sample type '{given}', expected one of {}", SampleType::list()))
        })?,
        None => type_in_name(&name).ok_or_else(|| {
            Error::input(format!(
                "{shown}: no sample type in the file name, expected e.g. name_128x128x128_uint8.raw or --type uint8"
            ))
        })?,
    };
    Ok(PlainSamples {
        path: path.to_owned(),
        start: 0,
        dims,
        sample_type,
        big_endian: options.big_endian,
        placement: Placement::default(),
    })
}

/// Where the samples of a RAW file are; none if it is compressed or its header describes other than plain samples.
pub(super) fn plain(path: &Path, options: &ReadOptions) -> Result<Option<PlainSamples>> {
    if Compression::of_name(path) == Compression::Gzip {
        return Ok(None);
    }
    if let Some(header) = described_by_header(path, options) {
        let is_plain = is_mhd(&header) && !options.describes_layout();
        return if is_plain { metaimage::plain(&header) } else { Ok(None) };
    }
    let plain = layout(path, options)?;
    let length = crate::input::open(path)?.1;
    if plain.end() != Some(length) {
        return Err(plain.wrong_length(length));
    }
    Ok(Some(plain))
}

/// The companion header of a file whose name and options do not give dimensions and type.
fn described_by_header(path: &Path, options: &ReadOptions) -> Option<PathBuf> {
    let (dims, sample_type) = parse_raw_name(path);
    let is_known = (options.dims.is_some() || dims.is_some())
        && (options.sample_type.is_some() || sample_type.is_some());
    if is_known { None } else { companion_header(path) }
}

/// The header (`.nhdr` or `.mhd`) that has the name of a RAW file and refers to it.
pub(crate) fn companion_header(path: &Path) -> Option<PathBuf> {
    let refers_to_file = |header: &PathBuf| {
        let files =
            if is_mhd(header) { metaimage::data_files(header) } else { nrrd::data_files(header) };
        files.iter().any(|file| file.file_name() == path.file_name())
    };
    ["nhdr", "mhd"].map(|e| path.with_extension(e)).into_iter().find(refers_to_file)
}

fn is_mhd(header: &Path) -> bool {
    header.extension().is_some_and(|e| e == "mhd")
}

/// Reads a RAW file as its companion header describes it.
fn read_by_header(path: &Path, header: &Path, options: &ReadOptions) -> Result<SampleGrid> {
    if options.describes_layout() {
        return Err(Error::Usage(format!(
            "{}: {} describes its samples, expected both --dims and --type or neither",
            path.display(),
            header.display()
        )));
    }
    let (file, _) = crate::input::open(header)?;
    if is_mhd(header) {
        metaimage::read(header, file, options)
    } else {
        nrrd::read(header, file, options)
    }
}

/// The words of a file name, last first: the description of the samples is at the end.
fn words(name: &str) -> impl Iterator<Item = &str> {
    name.rsplit(['_', '-', '.', ' '])
}

/// The last `AxBxC` of a file name.
fn dims_in_name(name: &str) -> Option<[usize; 3]> {
    words(name).find_map(|word| {
        let numbers: Option<Vec<usize>> =
            word.split(['x', 'X']).map(|digits| digits.parse().ok()).collect();
        numbers?.try_into().ok()
    })
}

/// The last sample type of a file name.
fn type_in_name(name: &str) -> Option<SampleType> {
    words(name).find_map(SampleType::from_name)
}

/// Dimensions and sample type in the name of a RAW file, each if it has one.
pub fn parse_raw_name(path: &Path) -> (Option<[usize; 3]>, Option<String>) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    (dims_in_name(&name), type_in_name(&name).map(|t| t.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_name_tells_dimensions_and_type() {
        assert_eq!(dims_in_name("hydrogen_atom_128x64x32_uint8"), Some([128, 64, 32]));
        assert_eq!(dims_in_name("a_1x2x3_b_4x5x6_f32"), Some([4, 5, 6]));
        assert_eq!(dims_in_name("flat_128x128"), None);
        assert_eq!(dims_in_name("wide_1x2x99999999999999999999999"), None);
        assert_eq!(type_in_name("hydrogen_atom_128x64x32_uint8"), Some(SampleType::U8));
        assert_eq!(type_in_name("a-2x2x2-float64"), Some(SampleType::F64));
        assert_eq!(type_in_name("float_2x2x2"), None);
    }
}
