//! `plan`: divides a computation into independent parts.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::bricks::{self, Plan as BrickPlan, Survey, VolumeSource};
use isospectrum::{Error, Result};
use isospectrum::{Noise, Prepared};

use super::heading;
use super::interrupt::Signals;
use super::parameter_arguments::ParameterArguments;
use super::preparation_arguments::PreparationArguments;
use super::simplify_arguments::SimplifyArguments;
use super::terminal;
use super::volume_arguments::VolumeArguments;
use isospectrum::file::Output;

const EXAMPLES: &str = "\
Examples:
  isospectrum plan large.nrrd -o large.json
  isospectrum compute --plan large.json --parts 0:31    # on one machine
  isospectrum compute --plan large.json --parts 32:63   # on another
  isospectrum merge large.json -o large.isp";

/// Plan a computation in bricks, for several machines
///
/// `compute --plan` computes the parts, on any machine and in any order; `merge` joins them to the spectrum.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub(super) struct Plan {
    #[command(flatten)]
    volume: VolumeArguments,
    #[command(flatten)]
    preparation: PreparationArguments,
    #[command(flatten)]
    simplify: SimplifyArguments,
    #[command(flatten)]
    parameters: ParameterArguments,
    /// Plan to write (.json), or - for stdout
    #[arg(short, long, value_name = "FILE", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Cells along the side of a brick
    #[arg(long, value_name = "N", default_value_t = bricks::SIDE, help_heading = heading::MACHINE)]
    brick: usize,
}

impl Plan {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let inputs: Vec<PathBuf> =
            self.volume.files().into_iter().chain(self.preparation.files()).collect();
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let output = Output::open(&self.output, &inputs)?;
        let source = self.volume.source()?;
        let (survey, noise) = survey(&source, &self.volume, &self.preparation, &self.simplify)?;
        let parameters =
            self.parameters.settings().resolve(survey.info().range, survey.samples())?;
        let plan = BrickPlan::new(source, &survey, noise, &parameters, self.brick)?;
        let last = plan.recipe.bricks.len() - 1;
        output.write_bytes(&Signals, &plan.to_bytes()?)?;
        log::info!("{}: parts 0:{last}, hash {}", self.output.display(), plan.hash());
        Ok(())
    }
}

/// Surveys a volume: slab by slab if its file allows it and no preparation is requested, else the prepared volume as a whole.
pub(super) fn survey(
    source: &VolumeSource,
    volume: &VolumeArguments,
    preparation: &PreparationArguments,
    simplify: &SimplifyArguments,
) -> Result<(Survey, Noise)> {
    if preparation.is_none() && simplify.settings().is_none() {
        volume.check_kind()?;
        if let Some(survey) = Survey::of_file(source)? {
            return Ok((survey, Noise::default()));
        }
    }
    let (volume, preparation) = preparation.apply(volume.read()?)?;
    let noise = simplify.settings().resolve(&volume);
    let (volume, cleaned) = simplify.apply(volume)?;
    Ok((Survey::of(Prepared::of(volume, preparation, cleaned)), noise))
}

/// Reads a plan.
pub(super) fn read(path: &Path) -> Result<BrickPlan> {
    BrickPlan::from_bytes(&isospectrum::unstable::input::read(path)?).map_err(|error| match error {
        // The message of a parser can contain text of the file.
        Error::Input(what) => {
            Error::input(format!("{}: {}", path.display(), terminal::plain(&what)))
        }
        other => other,
    })
}

/// Returns the default folder for the parts of a plan, next to the plan.
pub(super) fn folder_of_parts(plan: &Path) -> PathBuf {
    plan.with_extension("parts")
}
