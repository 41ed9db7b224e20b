//! `convert`: between our format and the file layout of the thesis (its section 4.4).

use std::path::PathBuf;

use clap::Args;

use super::spectrum_file::{Format, Opened};
use super::{heading, report, spectrum_file};
use isospectrum::file::Output;

/// Convert between .isp and the file layout of the thesis
///
/// From .isp to .isp, the trees of a spectrum that was computed in bricks become one; any other file is checked and copied.
#[derive(Args, Debug)]
#[command(after_long_help = "Examples:\n  isospectrum convert scan.isp scan.thesis")]
pub(super) struct Convert {
    /// Spectrum to read (.isp, .thesis)
    #[arg(help_heading = heading::INPUT)]
    from: PathBuf,
    /// Spectrum to write (.isp, .thesis)
    ///
    /// The extension selects the format.
    #[arg(help_heading = heading::OUTPUT)]
    to: PathBuf,
}

impl Convert {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let format = Format::of_name(&self.to)?;
        let output = Output::open(&self.to, &[&self.from])?;
        let from = Opened::open(&self.from)?;
        let before = from.n_bytes();
        let after = match from {
            // A file in our format stays as it is, unless it has a tree for each of several bricks.
            Opened::File(file) if format == Format::Isp && file.n_trees() == 1 => {
                spectrum_file::copy(file, output)
            }
            other => {
                spectrum_file::check_memory(&self.from, spectrum_file::CONVERT_BYTES)?;
                let written = spectrum_file::write_as(other.whole()?, format, output);
                written.map_err(|e| e.of_file(&self.from))
            }
        }?;
        log::info!(
            "{}: {} (from {})",
            self.to.display(),
            report::bytes(after),
            report::bytes(before)
        );
        Ok(())
    }
}
