//! `convert`: between our format and the file layout of the thesis (its section 4.4).

use std::path::PathBuf;

use clap::Args;

use super::{heading, report, spectrum_file};
use isospectrum::file::Output;

/// Convert between .isp and the file layout of the thesis
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
        let format = spectrum_file::Format::of_name(&self.to)?;
        let output = Output::open(&self.to, &[&self.from])?;
        spectrum_file::check_memory(&self.from, spectrum_file::CONVERT_BYTES)?;
        let (spectrum, before) = spectrum_file::read(&self.from)?;
        let after =
            spectrum_file::write_as(spectrum, format, output).map_err(|e| e.of_file(&self.from))?;
        log::info!(
            "{}: {} (from {})",
            self.to.display(),
            report::bytes(after),
            report::bytes(before)
        );
        Ok(())
    }
}
