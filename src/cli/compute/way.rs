//! Whether `compute` takes a volume as a whole or in bricks.

use isospectrum::Forecast;
use isospectrum::Parameters;
use isospectrum::bricks::{Plan, SIDE, Strategy, Survey, VolumeSource, is_divisible};
use isospectrum::{Noise, Prepared};

use super::Compute;
use crate::cli::bricks::InBricks;
use crate::cli::budget::Limit;
use crate::cli::plan;
use crate::cli::target::is_folder_name;

/// How a spectrum is computed.
pub(super) enum Way {
    Whole(Box<Whole>),
    Bricks(Box<InBricks>),
}

/// A volume that is swept as a whole.
pub(super) struct Whole {
    pub(super) prepared: Prepared,
    pub(super) parameters: Parameters,
    pub(super) forecast: Forecast,
}

impl Compute {
    /// As a whole, or in bricks: where that is asked for, or more memory is expected than there may be used.
    pub(super) fn way(&self) -> anyhow::Result<Way> {
        let limit = self.budget.limit();
        let is_folder = self.output.as_deref().is_some_and(is_folder_name);
        if self.brick.is_some() || is_folder {
            return Ok(Way::Bricks(Box::new(self.in_bricks(limit, None)?)));
        }
        let source = self.volume.source()?;
        if self.is_plain()
            && let Some(dims) = source.dims_in_file()?
        {
            let beyond = limit.and_then(|l| l.beyond(Forecast::least_memory(dims)));
            let parameters = self.parameters.settings().parameters;
            if let Some(why) = beyond.filter(|_| is_divisible(dims, &parameters)) {
                return Ok(Way::Bricks(Box::new(self.in_bricks(limit, Some(why))?)));
            }
        }
        self.read_as_a_whole(&source, limit)
    }

    /// After all is known of the whole.
    fn read_as_a_whole(&self, source: &VolumeSource, limit: Option<Limit>) -> anyhow::Result<Way> {
        let volume = self.volume.read()?;
        let (volume, preparation) = self.preparation.apply(volume)?;
        let noise = self.simplify.settings().resolve(&volume);
        let (volume, cleaned) = self.simplify.apply(volume)?;
        let prepared = Prepared::of(volume, preparation, cleaned);
        let volume = prepared.volume();
        let parameters = self.parameters.settings().resolve(volume.range(), prepared.samples())?;
        if !is_divisible(volume.dims(), &parameters) {
            self.budget.check_least(volume)?;
        }
        let strategy = Strategy::choose(&prepared, &parameters, limit.map(|limit| limit.bytes))?;
        let expected_memory = match strategy {
            Strategy::Whole(forecast) => {
                self.budget.check(volume.name(), &forecast)?;
                return Ok(Way::Whole(Box::new(Whole { prepared, parameters, forecast })));
            }
            Strategy::Bricks { expected_memory } => expected_memory,
        };
        let why = limit.and_then(|limit| limit.beyond(expected_memory));
        // Samples that can be read again need not stay in memory.
        let of_file = if self.is_plain() { Survey::of_file(source)? } else { None };
        let survey = of_file.unwrap_or_else(|| Survey::of(prepared));
        let bricks = self.planned((source.clone(), survey, noise), &parameters, limit, why)?;
        Ok(Way::Bricks(Box::new(bricks)))
    }

    /// Whether nothing is done to the volume before the sweep.
    fn is_plain(&self) -> bool {
        self.preparation.is_none() && self.simplify.settings().is_none()
    }

    fn in_bricks(&self, limit: Option<Limit>, why: Option<String>) -> anyhow::Result<InBricks> {
        let source = self.volume.source()?;
        let (survey, noise) =
            plan::survey(&source, &self.volume, &self.preparation, &self.simplify)?;
        let parameters =
            self.parameters.settings().resolve(survey.info().range, survey.samples())?;
        self.planned((source, survey, noise), &parameters, limit, why)
    }

    fn planned(
        &self,
        (source, survey, noise): (VolumeSource, Survey, Noise),
        parameters: &Parameters,
        limit: Option<Limit>,
        why: Option<String>,
    ) -> anyhow::Result<InBricks> {
        let side = self.brick.unwrap_or(SIDE);
        let plan = Plan::new(source, &survey, noise, parameters, side)?;
        let triangles = self.budget.max_triangles();
        Ok(InBricks { plan, survey, limit, triangles, why })
    }
}
