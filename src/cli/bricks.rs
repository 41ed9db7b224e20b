//! `compute` in bricks: the parts in a folder of their own beside the result, which goes in the end.

use isospectrum::Backend;
use isospectrum::bricks::{BrickLimits, OpenVolume, Parts, Plan, Survey, compute_parts};
use isospectrum::{Error, Result};

use super::budget::Limit;
use super::progress::Bar;
use super::report;
use super::target::{Made, Target};

/// What the program itself takes, bytes: 20 MB, and as much again for what the allocator keeps.
const PROGRAM: f64 = 48e6;

/// A volume that is swept in bricks.
pub(super) struct InBricks {
    pub(super) plan: Plan,
    pub(super) survey: Survey,
    /// The memory that may be used, where it is known.
    pub(super) limit: Option<Limit>,
    /// Most triangles, where it was said.
    pub(super) triangles: Option<f64>,
    /// Why it is in bricks, where that was not asked for.
    pub(super) why: Option<String>,
}

impl InBricks {
    /// Computes and writes the spectrum.
    pub(super) fn compute(self, target: Target, backend: &Backend, quiet: bool) -> Result<Made> {
        let limits = self.limits(target.is_folder())?;
        let shown = target.name();
        let work = target.work_folder()?;
        self.announce();
        let parts = Parts::new(&self.plan, work.path());
        let bar = Bar::new(quiet);
        let volume = self.survey.volume();
        compute_parts(&parts, volume, backend, limits, &bar)
            .map_err(|error| work.hide_in(error, &shown))?;
        let memory = self.limit.map(|_| limits.memory);
        target.merge(&parts, volume, (Some(work), memory), &bar)
    }

    /// What is left for the bricks.
    fn limits(&self, is_folder: bool) -> Result<BrickLimits> {
        let (one_file, triangles) = (!is_folder, self.triangles);
        let Some(limit) = self.limit else {
            return Ok(BrickLimits { memory: f64::INFINITY, one_file, triangles });
        };
        let memory = limit.bytes - PROGRAM - self.survey.volume().bytes_in_memory();
        if memory <= 0.0 {
            let name = &self.plan.recipe.volume.name;
            let beyond =
                limit.beyond(PROGRAM + self.survey.volume().bytes_in_memory()).unwrap_or_default();
            return Err(Error::Usage(format!("{name}: {beyond}; bricks do not help")));
        }
        Ok(BrickLimits { memory, one_file, triangles })
    }

    fn announce(&self) {
        let (name, n) = (&self.plan.recipe.volume.name, self.plan.recipe.bricks.len());
        let why = self.why.as_ref().map_or_else(String::new, |why| format!("{why}: "));
        let whole = match self.survey.volume() {
            OpenVolume::Slabs(..) | OpenVolume::Blocks(..) => String::new(),
            OpenVolume::Whole(_) => format!(
                "; it cannot be read or prepared by blocks, so {} of samples stay in memory",
                report::bytes(self.survey.volume().bytes_in_memory() as u64)
            ),
        };
        log::info!("{name}: {why}in {n} bricks of about {}^3 cells{whole}", self.plan.recipe.side);
    }
}
