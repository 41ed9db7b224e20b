//! A folder of numbered slices, each a TIFF or PNG file of one page.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::input;
use crate::volume::decode::picked;
use crate::volume::select::one_of;
use crate::volume::stream::Channel;
use crate::volume::{Grid, Placement, ReadOptions, Samples};

/// The files of slices in a folder, by their numbers: the last digits of their names.
///
/// # Errors
///
/// [`Error::Io`] if the folder cannot be read; [`Error::Input`] where a slice has no number, two have one, or one is missing
/// between others.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let shown = folder.display();
    let mut found: BTreeMap<u64, PathBuf> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::io(folder, e))? {
        let path = entry.map_err(|e| Error::io(folder, e))?.path();
        if !is_picture(&path) {
            continue;
        }
        let number = number(&path).ok_or_else(|| {
            Error::input(format!("{}: no number in the name of a slice", path.display()))
        })?;
        if let Some(other) = found.insert(number, path.clone()) {
            return Err(Error::input(format!(
                "{}: slice {number}, as is {}",
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
            "{shown}: slices {} and {} are {} apart, the first two {step}: expected no gaps",
            pair[0],
            pair[1],
            pair[1] - pair[0]
        )));
    }
    Ok(found.into_values().collect())
}

/// Whether a file is a slice by the extension of its name.
pub(crate) fn is_picture(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    matches!(extension.as_str(), "tif" | "tiff" | "png")
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
pub(crate) fn read(folder: &Path, options: &ReadOptions) -> Result<Grid> {
    let files = files(folder)?;
    let mut all: Option<(Samples, [usize; 3], Placement)> = None;
    for path in &files {
        let (dims, samples, placement) = read_slice(path, options)?;
        let Some((before, first, _)) = &mut all else {
            all = Some((samples, dims, placement));
            continue;
        };
        let is_same = std::mem::discriminant(before) == std::mem::discriminant(&samples);
        if dims != *first || !is_same {
            return Err(Error::input(format!(
                "{}: a slice of {}x{} {}, expected {}x{} {} as the first",
                path.display(),
                dims[0],
                dims[1],
                samples.type_name(),
                first[0],
                first[1],
                before.type_name()
            )));
        }
        before.append(samples).map_err(|e| Error::input(format!("{}: {e}", folder.display())))?;
    }
    let (samples, [x, y, _], placement) = all.ok_or_else(|| none(folder))?;
    Ok(([x, y, files.len()], samples, placement))
}

/// What to say of a folder without slices.
fn none(folder: &Path) -> Error {
    Error::input(format!(
        "{}: a folder without slices, expected numbered .tif or .png files, or DICOM files of a series",
        folder.display()
    ))
}

fn read_slice(path: &Path, options: &ReadOptions) -> Result<Grid> {
    let opened = input::open(path)?;
    let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    let grid =
        if is_png { read_png(path, opened, options)? } else { super::read(path, opened, options)? };
    if grid.0[2] != 1 {
        let n = grid.0[2];
        return Err(Error::input(format!("{}: {n} pages, expected a slice", path.display())));
    }
    Ok(grid)
}

fn read_png(path: &Path, (file, length): (File, u64), options: &ReadOptions) -> Result<Grid> {
    let wrong = |e: String| Error::input(format!("{}: {e}", path.display()));
    let mut decoder = png::Decoder::new(BufReader::new(file));
    // A byte of deflate stands for at most so many.
    let most = usize::try_from(length.saturating_mul(super::PACKING_RATIO)).unwrap_or(usize::MAX);
    decoder.set_limits(png::Limits { bytes: most });
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|e| wrong(e.to_string()))?;
    let n_bytes = reader.output_buffer_size().filter(|&n| n <= most);
    let n_bytes =
        n_bytes.ok_or_else(|| wrong(format!("more pixels than {length} bytes can hold")))?;
    let mut bytes = vec![0; n_bytes];
    let info = reader.next_frame(&mut bytes).map_err(|e| wrong(e.to_string()))?;
    bytes.truncate(info.buffer_size());
    let of = info.color_type.samples();
    let index = one_of("channel", options.channel, of).map_err(|e| wrong(e.to_string()))?;
    let samples = match info.bit_depth {
        png::BitDepth::Eight => Samples::U8(bytes),
        png::BitDepth::Sixteen => {
            let pairs = bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]]));
            Samples::U16(pairs.collect())
        }
        other => return Err(wrong(format!("pixels of {other:?} bits, expected 8 or 16"))),
    };
    let samples = picked(samples, Channel { index, of });
    let dims = [info.width as usize, info.height as usize, 1];
    Ok((dims, samples, Placement::IDENTITY))
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
