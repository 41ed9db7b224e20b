//! Where a spectrum goes: a file, or a folder of parts.

use std::path::{Path, PathBuf};

use isospectrum::Progress;
use isospectrum::Result;
use isospectrum::bricks::{OpenVolume, Parts, merge, merge_to_path};
use isospectrum::file::{SpectrumFolder, TemporaryFolder, is_folder};
use isospectrum::spectrum::Spectrum;

use super::info::Facts;
use super::output::Output;
use super::spectrum_file;

/// A destination that could be written to when it was opened.
pub(super) enum Target {
    File(Output),
    Folder(PathBuf),
}

/// A spectrum that was written.
pub(super) enum Made {
    /// To a file of so many bytes.
    File(Box<Spectrum>, u64),
    Folder(Box<SpectrumFolder>),
}

impl Target {
    /// Checks that `path` can be written to and is none of the command's inputs: a folder by its name, `.ispt`, else a file.
    pub(super) fn open(path: &Path, inputs: &[&Path]) -> Result<Target> {
        if !is_folder_name(path) {
            return Output::open(path, inputs).map(Target::File);
        }
        Output::check_apart(path, inputs)?;
        // As in the end; gone again at once.
        TemporaryFolder::next_to_folder(path, is_folder)?;
        Ok(Target::Folder(path.to_owned()))
    }

    pub(super) fn is_stdout(&self) -> bool {
        matches!(self, Target::File(output) if output.is_stdout())
    }

    /// What was asked for, to show.
    pub(super) fn name(&self) -> PathBuf {
        match self {
            Target::File(output) => output.name().into(),
            Target::Folder(path) => path.clone(),
        }
    }

    pub(super) fn is_folder(&self) -> bool {
        matches!(self, Target::Folder(_))
    }

    /// A folder to work in, on the disk that the result goes to where that is a regular file or a folder.
    pub(super) fn work_folder(&self) -> Result<TemporaryFolder> {
        match self {
            Target::Folder(path) => TemporaryFolder::next_to_folder(path, is_folder),
            Target::File(Output::File(path)) if is_replaced(path) => TemporaryFolder::next_to(path),
            Target::File(_) => TemporaryFolder::next_to(&std::env::temp_dir().join("isospectrum")),
        }
    }

    /// Joins parts and writes what they become; the folder to work in goes, where there was one. A folder of
    /// parts is written within `memory`, bytes, where that is limited.
    pub(super) fn merge(
        self,
        parts: &Parts,
        volume: &OpenVolume,
        (work, memory): (Option<TemporaryFolder>, Option<f64>),
        progress: &dyn Progress,
    ) -> Result<Made> {
        match self {
            Target::File(output) => {
                let spectrum = merge(parts, volume, progress)?;
                // Nothing is written beside a file while it is there.
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

/// Whether a name is that of a folder of the parts of a spectrum.
pub(super) fn is_folder_name(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "ispt")
}

/// Whether a file is put in the place of what is there, not written to.
fn is_replaced(path: &Path) -> bool {
    std::fs::metadata(path).map_or(true, |found| found.is_file())
}
