//! Spectrum files of both formats: ours, and the layout of the thesis.

use std::path::Path;

use isospectrum::file::{self, MAGIC, Written, thesis};
use isospectrum::spectrum::Spectrum;
use isospectrum::{Error, Result, input};

use super::kind::{self, Kind};
use super::output::Output;

/// A format of spectrum files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// Ours: `.isp`.
    Isp,
    /// The layout of the thesis, section 4.4: `.thesis`.
    Thesis,
}

impl Format {
    /// The format that a file's extension means.
    pub(super) fn of_name(path: &Path) -> Result<Self> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("isp") => Ok(Format::Isp),
            Some("thesis") => Ok(Format::Thesis),
            _ => Err(Error::Usage(format!(
                "{}: expected a name that ends in .isp or .thesis",
                path.display()
            ))),
        }
    }
}

/// Reads a spectrum of either format; also how many bytes its file has.
pub(super) fn read(path: &Path) -> Result<(Spectrum, u64)> {
    kind::check(path, Kind::Spectrum)?;
    let bytes = input::read(path)?;
    let is_thesis =
        matches!(Format::of_name(path), Ok(Format::Thesis)) && !bytes.starts_with(&MAGIC);
    let spectrum = if is_thesis { thesis::from_bytes(&bytes) } else { file::from_bytes(&bytes) };
    let spectrum = spectrum.map_err(named(path))?;
    Ok((spectrum, bytes.len() as u64))
}

/// Says of which spectrum something is wrong.
pub(super) fn named(path: &Path) -> impl Fn(Error) -> Error + '_ {
    move |error| match error {
        Error::Input(what) => Error::input(format!("{}: {what}", path.display())),
        other => other,
    }
}

/// Writes a spectrum in our format; how many bytes that took.
pub(super) fn write(spectrum: &Spectrum, output: Output) -> Result<u64> {
    write_as(spectrum, Format::Isp, output)
}

/// As [`write`], of a spectrum that is not needed any more as it was; gives it back in the order of the file.
pub(super) fn write_whole(spectrum: Spectrum, output: Output) -> Result<(Spectrum, u64)> {
    let Written { bytes, spectrum, .. } = file::into_bytes(spectrum)?;
    Ok((spectrum, output.write_bytes(&bytes)?))
}

/// Whether a name is that of a folder of the parts of a spectrum.
pub(super) fn is_folder_name(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "ispt")
}

/// Writes a spectrum in a format; how many bytes that took.
pub(super) fn write_as(spectrum: &Spectrum, format: Format, output: Output) -> Result<u64> {
    output.write_bytes(&match format {
        Format::Isp => file::to_bytes(spectrum)?,
        Format::Thesis => thesis::to_bytes(spectrum)?,
    })
}
