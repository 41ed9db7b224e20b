//! Chooses the reader of a volume by the name of its file.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::input;
use crate::volume::{Samples, Volume, npy, nrrd, raw};

/// What the command line may say about a volume beside its file name.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Dimensions of a RAW file whose name does not tell.
    pub dims: Option<[usize; 3]>,
    /// Sample type of a RAW file whose name does not tell: `uint8`, `float32`, ...
    pub sample_type: Option<String>,
    /// Whether a RAW file is big endian.
    pub big_endian: bool,
    /// Replaces the file's spacing.
    pub spacing: Option<[f64; 3]>,
    /// Replaces the file's origin.
    pub origin: Option<[f64; 3]>,
    /// Value in place of NaN and infinities.
    pub nan_as: Option<f64>,
}

/// The files that hold a volume: the one that is named, and the one with its samples where that is
/// another.
pub fn files_of(path: &Path) -> Vec<PathBuf> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let has_header = matches!(extension.as_str(), "nrrd" | "nhdr");
    let data_file = if has_header { nrrd::data_file(path) } else { None };
    std::iter::once(path.to_path_buf()).chain(data_file).collect()
}

/// Reads a volume: `.raw`, `.nrrd`, `.nhdr` or `.npy` by the extension (in any case); a file of
/// any other name is RAW if the options give both dimensions and sample type.
///
/// # Errors
///
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] if its kind is unknown, it is
/// damaged, or [`Volume::new`] refuses its samples, [`Error::Usage`] for options that do not fit
/// the file or are no numbers.
pub fn read_volume(path: &Path, options: &ReadOptions) -> Result<Volume> {
    let shown = path.display();
    // Before anything is said of its name.
    let (file, length) = input::open(path)?;
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let describes_raw = options.dims.is_some() && options.sample_type.is_some();
    let (dims, mut samples, mut placement) = match extension.as_str() {
        "raw" => raw::read(path, (file, length), options)?,
        "nrrd" | "nhdr" | "npy" => {
            if options.dims.is_some() || options.sample_type.is_some() || options.big_endian {
                return Err(Error::Usage(format!(
                    "{shown}: dimensions, sample type and byte order are in the file, expected them as options for raw files only"
                )));
            }
            if extension == "npy" {
                npy::read(path, (file, length))?
            } else {
                nrrd::read(path, file)?
            }
        }
        _ if describes_raw => raw::read(path, (file, length), options)?,
        _ => {
            return Err(Error::input(format!(
                "{shown}: unknown extension '{extension}', expected .raw, .nrrd, .nhdr or .npy (--dims and --type read any file as raw)"
            )));
        }
    };
    placement.spacing = options.spacing.unwrap_or(placement.spacing);
    placement.origin = options.origin.unwrap_or(placement.origin);
    if let Some(value) = options.nan_as {
        replace_not_finite(&mut samples, value)?;
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Volume::new(name, dims, samples, placement)
}

/// Puts `value` in place of NaN and infinities; integers have none.
fn replace_not_finite(samples: &mut Samples, value: f64) -> Result<()> {
    let is_usable = match samples {
        Samples::F32(_) => (value as f32).is_finite(),
        _ => value.is_finite(),
    };
    if !is_usable {
        return Err(Error::Usage(format!(
            "{value} in place of not finite samples, expected a finite {}",
            samples.type_name()
        )));
    }
    match samples {
        Samples::F32(s) => s.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value as f32),
        Samples::F64(s) => s.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = value),
        _ => {}
    }
    Ok(())
}
