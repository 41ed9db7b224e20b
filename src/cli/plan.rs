//! `plan`: cuts a computation into parts that need nothing of each other.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::bricks::{self, Plan as Bricks, Survey, VolumeSource};
use isospectrum::{Error, Result};
use isospectrum::{Noise, Prepared};

use super::compute::ParameterArguments;
use super::output::Output;
use super::preparation_arguments::PreparationArguments;
use super::simplify_arguments::SimplifyArguments;
use super::terminal;
use super::volume_arguments::VolumeArguments;

/// Plan a computation in bricks: `compute --plan` makes parts, anywhere and in any order, `merge` the spectrum of them
#[derive(Args, Debug)]
pub(super) struct Plan {
    #[command(flatten)]
    volume: VolumeArguments,
    /// Plan to write (.json); - is stdout
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Cells along the side of a brick
    #[arg(long, value_name = "N", default_value_t = bricks::SIDE)]
    brick: usize,
    #[command(flatten)]
    preparation: PreparationArguments,
    #[command(flatten)]
    simplify: SimplifyArguments,
    #[command(flatten)]
    parameters: ParameterArguments,
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
        let plan = Bricks::new(source, &survey, noise, &parameters, self.brick)?;
        let last = plan.recipe.bricks.len() - 1;
        output.write_bytes(&plan.to_bytes()?)?;
        log::info!("{}: parts 0:{last}, plan {}", self.output.display(), plan.hash());
        Ok(())
    }
}

/// What is known of a volume: from slabs of its file where nothing is done to it and its file is of plain samples, else from the
/// whole, after all that is done to it.
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
pub(super) fn read(path: &Path) -> Result<Bricks> {
    Bricks::from_bytes(&isospectrum::unstable::input::read(path)?).map_err(|error| match error {
        // What a parser says of a file may hold what the file holds.
        Error::Input(what) => {
            Error::input(format!("{}: {}", path.display(), terminal::plain(&what)))
        }
        other => other,
    })
}

/// The folder for the parts of a plan, where no other is named: beside the plan.
pub(super) fn folder_of_parts(plan: &Path) -> PathBuf {
    plan.with_extension("parts")
}
