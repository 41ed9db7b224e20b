//! `convert`: between our file and the layout of the thesis (its section 4.4).

use std::path::PathBuf;

use clap::Args;

use super::output::Output;
use super::{report, spectrum_file};

/// Convert between our file (.isp) and the layout of the thesis (.thesis)
#[derive(Args, Debug)]
pub(super) struct Convert {
    /// Spectrum to read; its content tells the format
    from: PathBuf,
    /// Spectrum to write; its extension tells the format: .isp or .thesis
    to: PathBuf,
}

impl Convert {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let format = spectrum_file::Format::of_name(&self.to)?;
        let output = Output::open(&self.to, &[&self.from])?;
        let (spectrum, before) = spectrum_file::read(&self.from)?;
        let after = spectrum_file::write_as(&spectrum, format, output)
            .map_err(|e| e.of_file(&self.from))?;
        log::info!(
            "{}: {} (from {})",
            self.to.display(),
            report::bytes(after),
            report::bytes(before)
        );
        Ok(())
    }
}
