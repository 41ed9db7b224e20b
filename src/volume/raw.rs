//! RAW: samples without a header, x fastest, then y, then z.
//!
//! What the file does not say, its name may (`name_128x128x128_uint8.raw`, the habit of the
//! open scientific visualisation data sets) or [`ReadOptions`]; options win over the name. The
//! byte order is little endian unless the options say otherwise. Where neither tells, a header of the same name beside it
//! may (`name.nhdr`, `name.mhd`). A file that ends in `.gz` is inflated.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::volume::decode::{SampleType, read_error, read_samples, size_of_grid};
use crate::volume::slabs::{Plain, wrong_length};
use crate::volume::stream::{self, Channel, Layout, Packing};
use crate::volume::{Grid, Placement, ReadOptions, metaimage, nrrd};

/// Reads a RAW file, which is open and has so many bytes.
///
/// # Errors
///
/// [`Error::Io`] if the file cannot be read; [`Error::Input`] if neither name nor options tell
/// dimensions and type, or the file does not have exactly the bytes they ask for;
/// [`Error::Usage`] for an unknown sample type among the options.
pub(crate) fn read(
    path: &Path,
    (mut file, found): (File, u64),
    options: &ReadOptions,
) -> Result<Grid> {
    if let Some(header) = header_beside(path).filter(|_| !is_told(path, options)) {
        return read_by_header(path, &header, options);
    }
    let is_gzip = Packing::of_name(path) == Packing::Gzip;
    let (dims, sample_type) = told(path, options)?;
    if is_gzip {
        let channel = Channel::ONLY;
        let layout = Layout { dims, sample_type, big_endian: options.big_endian, channel, skip: 0 };
        let samples = stream::read_all(&mut BufReader::new(file), found, Packing::Gzip, &layout)
            .map_err(|e| read_error(path, e))?;
        return Ok((dims, samples, Placement::default()));
    }
    let size = size_of_grid(dims, sample_type);
    let n = size.filter(|&(_, bytes)| bytes as u64 == found).map(|(n, _)| n);
    let n = n.ok_or_else(|| {
        let expected = size.map(|(_, bytes)| bytes as u64);
        wrong_length(path, (found, expected), (dims, sample_type))
    })?;
    let samples = read_samples(&mut file, sample_type, options.big_endian, n, n)
        .map_err(|e| read_error(path, e))?;
    Ok((dims, samples, Placement::default()))
}

/// What name and options tell.
fn told(path: &Path, options: &ReadOptions) -> Result<([usize; 3], SampleType)> {
    let is_gzip = Packing::of_name(path) == Packing::Gzip;
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
    Ok((dims, sample_type))
}

/// Where the samples of a RAW file are, if they are not packed.
///
/// # Errors
///
/// As [`read`].
pub(super) fn plain(path: &Path, options: &ReadOptions) -> Result<Option<Plain>> {
    if Packing::of_name(path) == Packing::Gzip {
        return Ok(None);
    }
    if let Some(header) = header_beside(path).filter(|_| !is_told(path, options)) {
        let is_meta = header.extension().is_some_and(|e| e == "mhd");
        let is_told_too =
            options.dims.is_some() || options.sample_type.is_some() || options.big_endian;
        return if is_meta && !is_told_too { metaimage::plain(&header) } else { Ok(None) };
    }
    let (dims, sample_type) = told(path, options)?;
    let plain = Plain {
        path: path.to_owned(),
        start: 0,
        dims,
        sample_type,
        big_endian: options.big_endian,
        placement: Placement::default(),
    };
    let found = crate::input::open(path)?.1;
    if plain.end() != Some(found) {
        return Err(wrong_length(path, (found, plain.end()), (dims, sample_type)));
    }
    Ok(Some(plain))
}

/// Whether name and options tell what is in a file.
fn is_told(path: &Path, options: &ReadOptions) -> bool {
    let (dims, sample_type) = told_by_name(path);
    (options.dims.is_some() || dims.is_some())
        && (options.sample_type.is_some() || sample_type.is_some())
}

/// The header of the same name beside a RAW file, if there is one and it is of this file.
pub(crate) fn header_beside(path: &Path) -> Option<PathBuf> {
    let is_ours = |header: &PathBuf| {
        let told = if header.extension().is_some_and(|e| e == "mhd") {
            metaimage::others(header)
        } else {
            nrrd::data_files(header)
        };
        told.iter().any(|file| file.file_name() == path.file_name())
    };
    ["nhdr", "mhd"].map(|e| path.with_extension(e)).into_iter().find(is_ours)
}

/// Reads a RAW file as a header beside it tells.
fn read_by_header(path: &Path, header: &Path, options: &ReadOptions) -> Result<Grid> {
    if options.dims.is_some() || options.sample_type.is_some() || options.big_endian {
        return Err(Error::Usage(format!(
            "{}: {} tells what is in it, expected both --dims and --type or neither",
            path.display(),
            header.display()
        )));
    }
    let opened = crate::input::open(header)?;
    if header.extension().is_some_and(|e| e == "mhd") {
        metaimage::read(header, opened, options)
    } else {
        nrrd::read(header, opened.0)
    }
}

/// The words of a file name, last first: what describes the samples stands at the end.
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

/// What the name of a RAW file says: dimensions and sample type, each if it does.
pub fn told_by_name(path: &Path) -> (Option<[usize; 3]>, Option<String>) {
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
