//! A folder of numbered slices, each a TIFF or PNG file of one page.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::input;
use crate::volume::data_error::{invalid, read_error};
use crate::volume::decode::select_channel;
use crate::volume::decoder_panic::catch_panic;
use crate::volume::format::is_slice_image;
use crate::volume::layout::Channel;
use crate::volume::placement::Placement;
use crate::volume::read_options::ReadOptions;
use crate::volume::samples::{SampleGrid, Samples};
use crate::volume::select::one_of;

/// The slices of a folder by number: the last digits of the file name.
///
/// # Errors
///
/// [`Error::Io`] if the folder cannot be read; [`Error::Input`] if a slice has no number, two have the same, or one is missing
/// between others.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let shown = folder.display();
    let mut found: BTreeMap<u64, PathBuf> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::io(folder, e))? {
        let path = entry.map_err(|e| Error::io(folder, e))?.path();
        if !is_slice_image(&path) {
            continue;
        }
        let number = number(&path).ok_or_else(|| {
            Error::input(format!("{}: no number in the name of a slice", path.display()))
        })?;
        if let Some(other) = found.insert(number, path.clone()) {
            return Err(Error::input(format!(
                "{}: slice {number}, the same as {}",
                path.display(),
                other.display()
            )));
        }
    }
    let numbers: Vec<u64> = found.keys().copied().collect();
    let step = match numbers[..] {
        [first, second, ..] => second - first,
        _ => 1,
    };
    if let Some(pair) = numbers.windows(2).find(|pair| pair[1] - pair[0] != step) {
        return Err(Error::input(format!(
            "{shown}: slices {} and {} are {} numbers apart, the first two {step}; expected no gaps",
            pair[0],
            pair[1],
            pair[1] - pair[0]
        )));
    }
    Ok(found.into_values().collect())
}

/// The last digits of a name.
fn number(path: &Path) -> Option<u64> {
    let name = path.file_stem()?.to_string_lossy().into_owned();
    let end = name.rfind(|c: char| c.is_ascii_digit())? + 1;
    let digits = name[..end].rsplit(|c: char| !c.is_ascii_digit()).next()?;
    digits.parse().ok()
}

/// Reads the slices of a folder, in the order of their numbers.
///
/// # Errors
///
/// [`Error::Io`] if one cannot be read; [`Error::Input`] for damaged ones, and those that differ in size or type.
pub(crate) fn read(folder: &Path, options: &ReadOptions) -> Result<SampleGrid> {
    let files = files(folder)?;
    let mut all: Option<SampleGrid> = None;
    for path in &files {
        let slice = read_slice(path, options)?;
        let Some(SampleGrid { samples, dims, .. }) = &mut all else {
            all = Some(slice);
            continue;
        };
        let is_same_type =
            std::mem::discriminant(samples) == std::mem::discriminant(&slice.samples);
        if slice.dims != *dims || !is_same_type {
            return Err(Error::input(format!(
                "{}: a slice of {}x{} {}, expected {}x{} {} as the first",
                path.display(),
                slice.dims[0],
                slice.dims[1],
                slice.samples.type_name(),
                dims[0],
                dims[1],
                samples.type_name()
            )));
        }
        let appended = samples.append(slice.samples);
        appended.map_err(|e| Error::input(format!("{}: {e}", folder.display())))?;
    }
    let mut all = all.ok_or_else(|| no_slices(folder))?;
    all.dims[2] = files.len();
    Ok(all)
}

/// The error for a folder without slices.
fn no_slices(folder: &Path) -> Error {
    Error::input(format!(
        "{}: a folder without slices, expected numbered .tif or .png files, or DICOM files of a series",
        folder.display()
    ))
}

fn read_slice(path: &Path, options: &ReadOptions) -> Result<SampleGrid> {
    let (file, length) = input::open(path)?;
    let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    let grid = if is_png {
        catch_panic("PNG", || read_png(file, length, options))
    } else {
        catch_panic("TIFF", || super::read_page(file, length, options))
    };
    let grid = grid.map_err(|e| read_error(path, e))?;
    if grid.dims[2] != 1 {
        let n = grid.dims[2];
        return Err(Error::input(format!("{}: {n} pages, expected one", path.display())));
    }
    Ok(grid)
}

fn read_png(file: File, length: u64, options: &ReadOptions) -> io::Result<SampleGrid> {
    let mut decoder = png::Decoder::new(BufReader::new(file));
    let max_bytes =
        usize::try_from(length.saturating_mul(super::MAX_COMPRESSION_RATIO)).unwrap_or(usize::MAX);
    decoder.set_limits(png::Limits { bytes: max_bytes });
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(wrong)?;
    let n_bytes = reader.output_buffer_size().filter(|&n| n <= max_bytes);
    let n_bytes =
        n_bytes.ok_or_else(|| invalid(format!("more pixels than {length} bytes can hold")))?;
    let mut bytes = vec![0; n_bytes];
    let info = reader.next_frame(&mut bytes).map_err(wrong)?;
    bytes.truncate(info.buffer_size());
    let of = info.color_type.samples();
    let index = one_of("channel", options.channel, of)?;
    let samples = match info.bit_depth {
        png::BitDepth::Eight => Samples::U8(bytes),
        png::BitDepth::Sixteen => {
            let pairs = bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]]));
            Samples::U16(pairs.collect())
        }
        other => return Err(invalid(format!("pixels of {other:?} bits, expected 8 or 16"))),
    };
    let samples = select_channel(samples, Channel { index, of });
    let dims = [info.width as usize, info.height as usize, 1];
    Ok(SampleGrid { dims, samples, placement: Placement::IDENTITY })
}

/// The error of the PNG decoder.
fn wrong(e: png::DecodingError) -> io::Error {
    match e {
        png::DecodingError::IoError(e) if e.kind() != io::ErrorKind::UnexpectedEof => e,
        e => invalid(e.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_digits_of_a_name_are_its_number() {
        for (name, expected) in
            [("a12_007.tif", Some(7)), ("slice-9b.png", Some(9)), ("x.tif", None)]
        {
            assert_eq!(number(Path::new(name)), expected, "{name}");
        }
    }
}
