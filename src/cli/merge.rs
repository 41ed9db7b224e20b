//! `merge`: the spectrum of a volume from the parts of its plan.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::bricks::Parts;

use super::plan::{self, folder_of_parts};
use super::progress::Bar;
use super::report;
use super::target::Target;

/// Merge the parts of a plan to the spectrum of its volume
#[derive(Args, Debug)]
pub(super) struct Merge {
    /// Plan that the parts are of
    plan: PathBuf,
    /// Spectrum to write (.isp), or a folder of its parts (.ispt), of which no more is read than is asked for; - is stdout
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
        let target = Target::open(&self.output, &inputs)?;
        if self.json && target.is_stdout() {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        parts.check_complete().map_err(|e| e.of_file(&self.plan))?;
        let made = target.merge(&parts, &plan.open()?, (None, None), &Bar::new(quiet))?;
        let facts = made.facts();
        if self.json {
            report::print_json("merge", &facts)?;
        } else if !quiet {
            report::tell(&report::table(&facts.summary()));
        }
        Ok(())
    }
}
