//! The choice between a computation of the whole volume and one in bricks.

use isospectrum::Forecast;
use isospectrum::Parameters;
use isospectrum::Prepared;
use isospectrum::Progress as _;
use isospectrum::bricks::{Plan, Strategy, Survey, VolumeSource, is_divisible, side_within};

use crate::cli::bricks::InBricks;
use crate::cli::budget::{BudgetArguments, Limit};
use crate::cli::parameter_arguments::ParameterArguments;
use crate::cli::plan;
use crate::cli::preparation_arguments::PreparationArguments;
use crate::cli::progress::Bar;
use crate::cli::simplify_arguments::SimplifyArguments;
use crate::cli::volume_arguments::VolumeArguments;

/// The flags of `compute` on which the choice depends.
pub(super) struct Request<'a> {
    pub(super) volume: &'a VolumeArguments,
    pub(super) preparation: &'a PreparationArguments,
    pub(super) simplify: &'a SimplifyArguments,
    pub(super) parameters: &'a ParameterArguments,
    pub(super) budget: &'a BudgetArguments,
    /// Cells along the side of a brick, if given.
    pub(super) brick: Option<usize>,
    pub(super) quiet: bool,
}

/// How a spectrum is computed.
pub(super) enum Way {
    Whole(Box<Whole>),
    Bricks(Box<InBricks>),
}

/// A volume to sweep as a whole.
pub(super) struct Whole {
    pub(super) prepared: Prepared,
    pub(super) parameters: Parameters,
    pub(super) forecast: Forecast,
}

impl Request<'_> {
    /// Chooses bricks if they are requested, or if the whole volume is expected to exceed the memory.
    pub(super) fn way(&self) -> anyhow::Result<Way> {
        let limit = self.budget.limit();
        if let Some(side) = self.brick {
            return Ok(Way::Bricks(Box::new(self.in_bricks(limit, None, side)?)));
        }
        let source = self.volume.source()?;
        if self.is_plain()
            && let Some(dims) = source.dims_in_file()?
        {
            let beyond = limit.and_then(|l| l.beyond(Forecast::least_memory(dims)));
            let parameters = self.parameters.settings().parameters;
            if let Some(why) = beyond.filter(|_| is_divisible(dims, &parameters)) {
                let memory = limit.map_or(f64::INFINITY, |limit| limit.bytes);
                let side = side_within(dims, Forecast::least_memory(dims), memory);
                return Ok(Way::Bricks(Box::new(self.in_bricks(limit, Some(why), side)?)));
            }
        }
        self.read_as_a_whole(&source, limit)
    }

    /// Chooses after the whole volume is read and prepared.
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
        let bar = Bar::new(self.quiet);
        bar.report(0.0, "estimating the size");
        let strategy = Strategy::choose(&prepared, &parameters, limit.map(|limit| limit.bytes))?;
        drop(bar);
        let (expected_memory, side) = match strategy {
            Strategy::Whole(forecast) => {
                self.budget.check(volume.name(), &forecast)?;
                return Ok(Way::Whole(Box::new(Whole { prepared, parameters, forecast })));
            }
            Strategy::Bricks { expected_memory, side } => (expected_memory, side),
        };
        let why = limit.and_then(|limit| limit.beyond(expected_memory));
        // Samples that can be read again need not stay in memory.
        let of_file = if self.is_plain() { Survey::of_file(source)? } else { None };
        let survey = of_file.unwrap_or_else(|| Survey::of(prepared));
        let plan = Plan::new(source.clone(), &survey, noise, &parameters, side)?;
        let bricks = self.bounded(plan, survey, limit, why);
        Ok(Way::Bricks(Box::new(bricks)))
    }

    /// True if the volume is not prepared before the sweep.
    fn is_plain(&self) -> bool {
        self.preparation.is_none() && self.simplify.settings().is_none()
    }

    fn in_bricks(
        &self,
        limit: Option<Limit>,
        why: Option<String>,
        side: usize,
    ) -> anyhow::Result<InBricks> {
        let source = self.volume.source()?;
        let (survey, noise) = plan::survey(&source, self.volume, self.preparation, self.simplify)?;
        let parameters =
            self.parameters.settings().resolve(survey.info().range, survey.samples())?;
        let plan = Plan::new(source, &survey, noise, &parameters, side)?;
        Ok(self.bounded(plan, survey, limit, why))
    }

    fn bounded(
        &self,
        plan: Plan,
        survey: Survey,
        limit: Option<Limit>,
        why: Option<String>,
    ) -> InBricks {
        InBricks { plan, survey, limit, triangles: self.budget.max_triangles(), why }
    }
}
