//! Chooses the reader of a volume by the name of its file.

use std::path::Path;

use crate::error::{Error, Result};
use crate::volume::{Volume, raw};

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

/// Reads a volume.
///
/// # Errors
///
/// [`Error::Io`] and [`Error::Input`].
pub fn read_volume(path: &Path, options: &ReadOptions) -> Result<Volume> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let (dims, samples, mut placement) = match extension.as_str() {
        "raw" => raw::read(path, options)?,
        _ => {
            return Err(Error::input(format!(
                "{}: unknown extension '{extension}', expected .raw",
                path.display()
            )));
        }
    };
    placement.spacing = options.spacing.unwrap_or(placement.spacing);
    placement.origin = options.origin.unwrap_or(placement.origin);
    Volume::new(name, dims, samples, placement)
}
