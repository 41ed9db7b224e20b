//! `compute` in bricks: the parts are in a temporary folder next to the result.

use isospectrum::Backend;
use isospectrum::bricks::{BrickLimits, OpenVolume, Parts, Plan, Survey, compute_parts};
use isospectrum::{Error, Result};

use super::budget::Limit;
use super::progress::Bar;
use super::report;
use super::target::{Made, Target};

/// Memory of the program itself, bytes: 20 MB, and as much again that the allocator keeps.
const PROGRAM_MEMORY: f64 = 48e6;

/// A volume that is swept in bricks.
pub(super) struct InBricks {
    pub(super) plan: Plan,
    pub(super) survey: Survey,
    /// The limit of memory, if known.
    pub(super) limit: Option<Limit>,
    /// The limit of triangles, if given.
    pub(super) triangles: Option<f64>,
    /// The reason for bricks, unless they were requested.
    pub(super) why: Option<String>,
}

impl InBricks {
    /// Computes and writes the spectrum.
    pub(super) fn compute(self, target: Target, backend: &Backend, quiet: bool) -> Result<Made> {
        let limits = self.limits()?;
        let shown = target.name();
        let work = target.work_folder()?;
        self.announce();
        let parts = Parts::new(&self.plan, work.path());
        let bar = Bar::new(quiet);
        let volume = self.survey.volume();
        compute_parts(&parts, volume, backend, limits, &bar)
            .map_err(|error| work.hide_in(error, &shown))?;
        let memory = self.limit.map(|_| limits.memory);
        target.merge(&parts, volume, memory, &bar).map_err(|error| work.hide_in(error, &shown))
    }

    /// Returns the limits of the bricks: the memory without the program and samples that stay in memory.
    fn limits(&self) -> Result<BrickLimits> {
        let (in_memory, triangles) = (false, self.triangles);
        let Some(limit) = self.limit else {
            return Ok(BrickLimits { memory: f64::INFINITY, in_memory, triangles });
        };
        let memory = limit.bytes - PROGRAM_MEMORY - self.survey.volume().bytes_in_memory();
        if memory <= 0.0 {
            let name = &self.plan.recipe.volume.name;
            let beyond = limit
                .beyond(PROGRAM_MEMORY + self.survey.volume().bytes_in_memory())
                .unwrap_or_default();
            return Err(Error::Usage(format!("{name}: {beyond}; too large even in bricks")));
        }
        Ok(BrickLimits { memory, in_memory, triangles })
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
