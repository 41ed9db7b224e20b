//! The destination of a spectrum that is computed as a whole or merged from parts.

use std::path::{Path, PathBuf};

use isospectrum::Progress;
use isospectrum::Result;
use isospectrum::bricks::{Merged, OpenVolume, Parts, merge_to_file};
use isospectrum::file::{Output, TemporaryFolder};
use isospectrum::spectrum::{Size, Spectrum};

use super::info::Facts;
use super::interrupt::Signals;
use super::spectrum_file;

/// A destination that was writable when it was opened.
pub(super) struct Target(Output);

/// A written spectrum, without its triangles if it was merged from parts.
pub(super) struct Made {
    pub(super) spectrum: Spectrum,
    size: Size,
    n_bytes: u64,
    n_parts: usize,
}

impl Target {
    /// Checks that `path` can be written and is no input of the command.
    pub(super) fn open(path: &Path, inputs: &[&Path]) -> Result<Target> {
        let output = Output::open(path, inputs)?;
        if matches!(output, Output::File(_)) && is_replaced(path) {
            // Removes the folder that a killed run with bricks has left.
            TemporaryFolder::next_to(path)?;
        }
        Ok(Target(output))
    }

    pub(super) fn is_stdout(&self) -> bool {
        self.0.is_stdout()
    }

    /// Returns the name of the destination for messages.
    pub(super) fn name(&self) -> PathBuf {
        self.0.name().into()
    }

    /// Makes a work folder, on the disk of the destination if that is a regular file.
    pub(super) fn work_folder(&self) -> Result<TemporaryFolder> {
        match &self.0 {
            Output::File(path) if is_replaced(path) => TemporaryFolder::next_to(path),
            _ => TemporaryFolder::next_to(&std::env::temp_dir().join("isospectrum")),
        }
    }

    /// Writes a spectrum.
    pub(super) fn write(self, spectrum: Spectrum) -> Result<Made> {
        let (spectrum, n_bytes) = spectrum_file::write_whole(spectrum, self.0)?;
        Ok(Made { size: Size::of(&spectrum), spectrum, n_bytes, n_parts: 1 })
    }

    /// Merges parts and writes the spectrum. `memory` limits the memory for writing it, bytes.
    pub(super) fn merge(
        self,
        parts: &Parts,
        volume: &OpenVolume,
        memory: Option<f64>,
        progress: &dyn Progress,
    ) -> Result<Made> {
        let mut merged = None;
        let n_bytes = self.0.write(&Signals, |out| {
            merged = Some(merge_to_file(parts, volume, out, memory, progress)?);
            Ok(())
        })?;
        let Merged { whole: spectrum, size, n_trees: n_parts, .. } =
            merged.expect("the content was written");
        Ok(Made { spectrum, size, n_bytes, n_parts })
    }
}

impl Made {
    pub(super) fn facts(&self) -> Facts<'_> {
        Facts::of(&self.spectrum, &self.size, self.n_bytes, self.n_parts)
    }
}

/// True if the destination is replaced by a new file, not opened for writing as a pipe or a device.
fn is_replaced(path: &Path) -> bool {
    std::fs::metadata(path).map_or(true, |found| found.is_file())
}
