//! Spectrum files of both formats: ours and the layout of the thesis.

use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

use isospectrum::file::{self, MAGIC, Output, SpectrumFile, Summary, Written, thesis};
use isospectrum::spectrum::Spectrum;
use isospectrum::unstable::input;
use isospectrum::{Error, Result};

use super::interrupt::Signals;
use super::kind::{self, Kind};
use super::{machine, report};

/// Memory of a spectrum that is read, bytes per triangle (measured: 110 to 165 with two threads).
const READ_BYTES: f64 = 170.0;

/// Memory of a spectrum that is read and packed into a page, bytes per triangle (measured: 336 to 417 with two threads).
pub(super) const PACK_BYTES: f64 = 420.0;

/// Memory of a spectrum that is read and written in another format, bytes per triangle (measured: 116 to 231 with two threads).
pub(super) const CONVERT_BYTES: f64 = 235.0;

/// A format of spectrum files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// Ours: `.isp`.
    Isp,
    /// The file layout of the thesis, section 4.4: `.thesis`.
    Thesis,
}

impl Format {
    /// Returns the format for the extension of a file.
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

/// A spectrum that is read as far as needed: only the requested chunks of a file, a file in the layout of the thesis as a whole.
pub(super) enum Opened {
    /// With the bytes of the file.
    Whole(Box<Spectrum>, u64),
    File(Box<SpectrumFile>),
}

impl Opened {
    /// Opens a spectrum file of either format.
    pub(super) fn open(path: &Path) -> Result<Opened> {
        kind::check(path, Kind::Spectrum)?;
        if is_named_thesis(path) && !has_magic(path)? {
            let bytes = input::read(path)?;
            let spectrum = thesis::from_bytes(&bytes).map_err(|e| e.of_file(path))?;
            return Ok(Opened::Whole(Box::new(spectrum), bytes.len() as u64));
        }
        Ok(Opened::File(Box::new(SpectrumFile::open(path)?)))
    }

    /// Returns the spectrum with its range, events and parameters; without triangles if it is a file of chunks.
    pub(super) fn header(&self) -> &Spectrum {
        match self {
            Opened::Whole(spectrum, _) => spectrum,
            Opened::File(file) => file.description(),
        }
    }

    /// Returns the size of the file in bytes.
    pub(super) fn n_bytes(&self) -> u64 {
        match self {
            Opened::Whole(_, n_bytes) => *n_bytes,
            Opened::File(file) => file.n_bytes(),
        }
    }

    /// Refuses a file of which the chunks at one isovalue exceed a limit of memory.
    pub(super) fn check_memory_of_part(&self) -> Result<()> {
        match self {
            Opened::Whole(..) => Ok(()),
            Opened::File(file) => check_triangles(file.path(), file.most_at_once(), READ_BYTES),
        }
    }

    /// Returns the whole spectrum; reads all chunks of a file.
    pub(super) fn whole(self) -> Result<Spectrum> {
        match self {
            Opened::Whole(spectrum, _) => Ok(*spectrum),
            Opened::File(file) => {
                check_triangles(file.path(), file.size().triangles, READ_BYTES)?;
                file.read()
            }
        }
    }

    /// Returns the spectrum with all triangles that are alive at the isovalues or between them.
    pub(super) fn around(self, isovalues: &[f64]) -> Result<Spectrum> {
        match self {
            Opened::Whole(spectrum, _) => Ok(*spectrum),
            Opened::File(file) => {
                let (n_triangles, n_bytes) = file.needed_around(isovalues);
                check_triangles(file.path(), n_triangles, READ_BYTES)?;
                let [n, of] = [n_bytes, file.n_bytes()].map(report::bytes);
                log::debug!("{}: {n} of {of} are read", file.path().display());
                file.read_around(isovalues)
            }
        }
    }
}

/// Returns whether a file begins as a spectrum file does, whatever its name.
fn has_magic(path: &Path) -> Result<bool> {
    let mut start = Vec::new();
    let (file, _) = input::open(path)?;
    file.take(MAGIC.len() as u64).read_to_end(&mut start).map_err(|e| Error::io(path, e))?;
    Ok(start == MAGIC)
}

/// Reads a spectrum of either format. Returns its size in bytes as well.
pub(super) fn read(path: &Path) -> Result<(Spectrum, u64)> {
    let opened = Opened::open(path)?;
    let n_bytes = opened.n_bytes();
    Ok((opened.whole()?, n_bytes))
}

/// Refuses a file whose triangles, at `bytes_per_triangle`, exceed a limit of memory beyond which allocations fail.
///
/// # Errors
///
/// [`Error::Input`]; those of [`Summary::read`].
pub(super) fn check_memory(path: &Path, bytes_per_triangle: f64) -> Result<()> {
    if machine::allowed_by_process().is_none() || !path.is_file() || is_named_thesis(path) {
        return Ok(());
    }
    check_triangles(path, Summary::read(path)?.size.triangles, bytes_per_triangle)
}

/// As [`check_memory`], for a known number of triangles to be read.
fn check_triangles(path: &Path, n_triangles: u64, bytes_per_triangle: f64) -> Result<()> {
    let Some(allowed) = machine::allowed_by_process() else { return Ok(()) };
    let expected = bytes_per_triangle * n_triangles as f64;
    if expected <= allowed.bytes {
        return Ok(());
    }
    let [expected, left] = [expected, allowed.bytes].map(|x| report::bytes(x as u64));
    let (name, by) = (path.display(), allowed.by);
    Err(Error::input(format!(
        "{name}: about {expected} of memory expected for {n_triangles} triangles, {by} leaves {left}"
    )))
}

/// True if the extension is that of the layout of the thesis.
fn is_named_thesis(path: &Path) -> bool {
    matches!(Format::of_name(path), Ok(Format::Thesis))
}

/// Reads the summary of a file of either format, without its triangles if the format allows it.
pub(super) fn read_summary(path: &Path) -> Result<Summary> {
    kind::check(path, Kind::Spectrum)?;
    if is_named_thesis(path) {
        return read(path).map(|(spectrum, bytes)| Summary::of(spectrum, bytes));
    }
    Summary::read(path)
}

/// Writes a spectrum in our format. Returns it in the order of the file, and the size of the file in bytes.
pub(super) fn write_whole(spectrum: Spectrum, output: Output) -> Result<(Spectrum, u64)> {
    let Written { bytes, spectrum, .. } = file::into_bytes(spectrum)?;
    Ok((spectrum, output.write_bytes(&Signals, &bytes)?))
}

/// Copies a file, of which all chunks are checked. Returns the size in bytes.
pub(super) fn copy(file: Box<SpectrumFile>, output: Output) -> Result<u64> {
    check_triangles(file.path(), file.most_at_once(), READ_BYTES)?;
    let file = Arc::from(file);
    output.write(&Signals, |target| file::copy(&file, target))
}

/// Writes a spectrum in a format. Returns the size in bytes.
pub(super) fn write_as(spectrum: Spectrum, format: Format, output: Output) -> Result<u64> {
    output.write_bytes(
        &Signals,
        &match format {
            Format::Isp => file::into_bytes(spectrum)?.bytes,
            Format::Thesis => thesis::to_bytes(&spectrum)?,
        },
    )
}
