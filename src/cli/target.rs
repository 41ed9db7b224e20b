//! The destination of a spectrum: a file, or a folder of parts.

use std::path::{Path, PathBuf};

use isospectrum::Progress;
use isospectrum::Result;
use isospectrum::bricks::{OpenVolume, Parts, merge, merge_to_path};
use isospectrum::file::{SpectrumFolder, TemporaryFolder, own_files};
use isospectrum::spectrum::Spectrum;

use super::info::Facts;
use super::output::{Output, check_parent};
use super::spectrum_file;

/// A destination that was writable when it was opened.
pub(super) enum Target {
    File(Output),
    Folder(PathBuf),
}

/// A written spectrum.
pub(super) enum Made {
    /// With the size of the file in bytes.
    File(Box<Spectrum>, u64),
    Folder(Box<SpectrumFolder>),
}

impl Target {
    /// Checks that `path` can be written and is no input of the command. The extension `.ispt` selects a folder.
    pub(super) fn open(path: &Path, inputs: &[&Path]) -> Result<Target> {
        if !is_folder_name(path) {
            let output = Output::open(path, inputs)?;
            if matches!(output, Output::File(_)) && is_replaced(path) {
                // Removes the folder that a killed run with bricks has left.
                TemporaryFolder::next_to(path)?;
            }
            return Ok(Target::File(output));
        }
        Output::check_apart(path, inputs)?;
        check_parent(path)?;
        // Checks that the folder can be written, and that all in an old one may be removed; its temporary folder is removed at once.
        TemporaryFolder::next_to_folder(path, own_files)?;
        Ok(Target::Folder(path.to_owned()))
    }

    pub(super) fn is_stdout(&self) -> bool {
        matches!(self, Target::File(output) if output.is_stdout())
    }

    /// Returns the name of the destination for messages.
    pub(super) fn name(&self) -> PathBuf {
        match self {
            Target::File(output) => output.name().into(),
            Target::Folder(path) => path.clone(),
        }
    }

    pub(super) fn is_folder(&self) -> bool {
        matches!(self, Target::Folder(_))
    }

    /// Makes a work folder, on the disk of the destination if that is a regular file or a folder.
    pub(super) fn work_folder(&self) -> Result<TemporaryFolder> {
        match self {
            Target::Folder(path) => TemporaryFolder::next_to_folder(path, own_files),
            Target::File(Output::File(path)) if is_replaced(path) => TemporaryFolder::next_to(path),
            Target::File(_) => TemporaryFolder::next_to(&std::env::temp_dir().join("isospectrum")),
        }
    }

    /// Merges parts and writes the spectrum. Removes the work folder, if given. `memory` limits the memory for writing a folder,
    /// in bytes.
    pub(super) fn merge(
        self,
        parts: &Parts,
        volume: &OpenVolume,
        work: Option<TemporaryFolder>,
        memory: Option<f64>,
        progress: &dyn Progress,
    ) -> Result<Made> {
        match self {
            Target::File(output) => {
                let spectrum = merge(parts, volume, progress)?;
                // Removed before the file is written, so that the disk holds the spectrum once.
                drop(work);
                let (spectrum, n_bytes) = spectrum_file::write_whole(spectrum, output)?;
                Ok(Made::File(Box::new(spectrum), n_bytes))
            }
            Target::Folder(path) => {
                let folder = merge_to_path(parts, volume, &path, work, memory, progress)?;
                Ok(Made::Folder(Box::new(folder)))
            }
        }
    }
}

impl Made {
    pub(super) fn facts(&self) -> Facts<'_> {
        match self {
            Made::File(spectrum, n_bytes) => Facts::of(spectrum, *n_bytes),
            Made::Folder(folder) => Facts::of_folder(folder),
        }
    }
}

/// True if the extension is that of a folder of parts.
pub(super) fn is_folder_name(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "ispt")
}

/// True if the destination is replaced by a new file, not opened for writing as a pipe or a device.
fn is_replaced(path: &Path) -> bool {
    std::fs::metadata(path).map_or(true, |found| found.is_file())
}
