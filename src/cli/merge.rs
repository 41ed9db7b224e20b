//! `merge`: joins the parts of a plan to the spectrum of its volume.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::bricks::Parts;

use super::plan::{self, folder_of_parts};
use super::progress::Bar;
use super::target::Target;
use super::{heading, report};

/// Merge the parts of a plan to the spectrum of its volume
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT, after_long_help = "Examples:\n  isospectrum merge large.json -o large.isp")]
pub(super) struct Merge {
    /// Plan of the parts (.json)
    plan: PathBuf,
    /// Folder of the parts [default: next to the plan]
    #[arg(long, value_name = "DIR")]
    parts: Option<PathBuf>,
    /// Spectrum to write (.isp), or - for stdout
    #[arg(short, long, value_name = "FILE", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Print the report of `info` as JSON
    #[arg(long, help_heading = heading::OUTPUT)]
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
        let target = Target::open(&self.output, &inputs)?;
        if self.json && target.is_stdout() {
            return Err(Error::Usage(
                "--json and -o - both write to stdout, expected one of them".to_owned(),
            )
            .into());
        }
        parts.check_complete().map_err(|e| e.of_file(&self.plan))?;
        let made = target.merge(&parts, &plan.open()?, None, &Bar::new(quiet))?;
        let facts = made.facts();
        if self.json {
            report::print_json("merge", &facts)?;
        } else if !quiet {
            report::log_lines(&report::table(&facts.summary()));
        }
        Ok(())
    }
}
