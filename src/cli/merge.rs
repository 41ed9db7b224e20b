//! `merge`: the spectrum of a volume from the parts of its plan.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::bricks::{self, Parts};

use super::info::Facts;
use super::output::Output;
use super::plan::{self, folder_of_parts};
use super::progress::Bar;
use super::spectrum_file::named;
use super::{report, spectrum_file};

/// Merge the parts of a plan to the spectrum of its volume
#[derive(Args, Debug)]
pub(super) struct Merge {
    /// Plan that the parts are of
    plan: PathBuf,
    /// Spectrum to write (.isp); - is stdout
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Folder with the parts [default: beside the plan]
    #[arg(long, value_name = "DIR")]
    parts: Option<PathBuf>,
    /// Print what `info` would tell as JSON
    #[arg(long)]
    json: bool,
}

impl Merge {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        let plan = plan::read(&self.plan)?;
        let folder = self.parts.clone().unwrap_or_else(|| folder_of_parts(&self.plan));
        let parts = Parts::new(&plan, &folder);
        let files = parts.files();
        let mut inputs: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
        inputs.extend([self.plan.as_path()].into_iter().chain(plan.source.path()));
        let output = Output::open(&self.output, &inputs)?;
        if self.json && output.is_stdout() {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        parts.check_all_there().map_err(named(&self.plan))?;
        let spectrum = bricks::merge(&parts, &plan.open()?, &Bar::new(quiet))?;
        let (spectrum, n_bytes) = spectrum_file::write_whole(spectrum, output)?;
        let facts = Facts::of(&spectrum, n_bytes);
        if self.json {
            report::print_json("merge", &facts)?;
        } else if !quiet {
            report::tell(&report::table(&facts.summary()));
        }
        Ok(())
    }
}
