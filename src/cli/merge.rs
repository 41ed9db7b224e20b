//! `merge`: the spectrum of a volume from the parts of its plan.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::bricks::{self, Part, Plan};
use isospectrum::{Error, Result, input};

use super::info::Facts;
use super::output::Output;
use super::plan::{self, folder_of_parts, part_in};
use super::spectrum_file::named;
use super::{report, spectrum_file};

/// Parts that a message names.
const NAMED: usize = 8;

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
        let files: Vec<PathBuf> =
            (0..plan.recipe.bricks.len()).map(|number| part_in(&folder, number)).collect();
        let mut inputs: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
        inputs.extend([self.plan.as_path()].into_iter().chain(plan.source.path()));
        let output = Output::open(&self.output, &inputs)?;
        if self.json && output.is_stdout() {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        all_there(&self.plan, &folder, &files)?;
        let parts = files.iter().enumerate().map(|(number, file)| read(&plan, number, file));
        let parts = parts.collect::<Result<Vec<Part>>>()?;
        let spectrum = bricks::merge(&plan, parts, &plan.open()?)?;
        let n_bytes = spectrum_file::write(&spectrum, output)?;
        let facts = Facts::of(&spectrum, n_bytes);
        if self.json {
            report::print_json("merge", &facts)?;
        } else if !quiet {
            report::tell(&report::table(&facts.summary()));
        }
        Ok(())
    }
}

fn read(plan: &Plan, number: usize, file: &Path) -> Result<Part> {
    Part::from_bytes(&input::read(file)?, plan, number).map_err(named(file))
}

/// Says which parts are missing.
fn all_there(plan: &Path, folder: &Path, files: &[PathBuf]) -> Result<()> {
    let is_missing = |i: &usize| !files[*i].exists();
    let missing: Vec<String> = (0..files.len()).filter(is_missing).map(|i| i.to_string()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let more = if missing.len() > NAMED { ", ..." } else { "" };
    Err(Error::input(format!(
        "{}: {} of {} parts are missing: {}{more}, expected them in {}",
        plan.display(),
        missing.len(),
        files.len(),
        missing[..missing.len().min(NAMED)].join(", "),
        folder.display()
    )))
}
