//! `compute --plan`: computes the missing parts of a plan.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use isospectrum::Backend;
use isospectrum::bricks::{Parts, compute_part};
use isospectrum::{Error, Result};
use serde::Serialize;

use super::interrupt::Signals;
use super::plan::{self, folder_of_parts};
use super::progress::Bar;
use super::{heading, report};
use isospectrum::file::Output;

/// Flags that select parts of a plan.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT)]
pub(super) struct PartArguments {
    /// Compute parts of this plan, see `plan --help`
    ///
    /// Replaces the volume and the parameters. -o is the folder of the parts, by default next to the plan.
    #[arg(long, value_name = "PLAN.json", conflicts_with_all = ["VolumeArguments", "PreparationArguments", "noise", "ParameterArguments", "BudgetArguments"])]
    pub(super) plan: Option<PathBuf>,
    /// Compute these parts of the plan, the last included, e.g. 0:63, or one part [default: all]
    ///
    /// Parts that exist already are not computed again.
    #[arg(long, value_name = "FIRST:LAST", requires = "plan", hide_short_help = true)]
    parts: Option<Numbers>,
}

/// The `compute` report of parts.
#[derive(Serialize)]
struct PartsReport {
    made: Vec<usize>,
    were_there: Vec<usize>,
}

impl PartArguments {
    /// Computes the parts of a plan.
    pub(super) fn run(
        &self,
        path: &Path,
        folder: Option<&Path>,
        backend: &Backend,
        quiet: bool,
        json: bool,
    ) -> anyhow::Result<()> {
        let plan = plan::read(path)?;
        let n = plan.recipe.bricks.len();
        let Numbers { first, last } = self.parts.unwrap_or(Numbers { first: 0, last: n - 1 });
        if last >= n {
            return Err(Error::Usage(format!(
                "{}: has no part {last}, expected 0 to {}",
                path.display(),
                n - 1
            ))
            .into());
        }
        let folder = folder.map_or_else(|| folder_of_parts(path), Path::to_owned);
        std::fs::create_dir_all(&folder).map_err(|source| Error::io(&folder, source))?;
        let parts = Parts::new(&plan, &folder);
        let mut report = PartsReport { made: Vec::new(), were_there: Vec::new() };
        let mut opened = None;
        for number in first..=last {
            let file = parts.file(number);
            if is_there(&parts, number) {
                log::info!("{}: exists already", file.display());
                report.were_there.push(number);
                continue;
            }
            let output = Output::open(&file, &[path])?;
            // The volume is opened only if a part is missing.
            let volume = match opened.take() {
                Some(volume) => volume,
                None => plan.open()?,
            };
            let bytes = compute_part(&plan, &volume, number, backend, &Bar::new(quiet))?;
            let n_bytes = output.write_bytes(&Signals, &bytes)?;
            log::info!("{}: {}", file.display(), report::bytes(n_bytes));
            opened = Some(volume);
            report.made.push(number);
        }
        if json {
            report::print_json("parts", &report)?;
        }
        Ok(())
    }
}

/// True if a part exists and is complete; warns if its file is something else.
fn is_there(parts: &Parts, number: usize) -> bool {
    parts.is_complete(number).unwrap_or_else(|error| {
        log::warn!("{}: {error}; computed again", parts.file(number).display());
        false
    })
}

/// `0:63`, or `7`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Numbers {
    first: usize,
    last: usize,
}

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once(':').unwrap_or((text, text));
        let numbers = first.parse().ok().zip(last.parse().ok());
        let parts = numbers.map(|(first, last)| Numbers { first, last });
        parts
            .filter(|p| p.first <= p.last)
            .ok_or_else(|| "expected the first and the last part such as 0:63".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_of_parts_includes_the_last() {
        assert_eq!("0:63".parse(), Ok(Numbers { first: 0, last: 63 }));
        assert_eq!("7".parse(), Ok(Numbers { first: 7, last: 7 }));
        for wrong in ["", ":", "3:2", "-1:2", "0:1:2", "a"] {
            assert!(wrong.parse::<Numbers>().is_err(), "{wrong}");
        }
    }
}
