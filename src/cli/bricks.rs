//! `compute` in bricks: the parts in a folder of their own beside the result, which goes in the end.

use isospectrum::Backend;
use isospectrum::bricks::{Limits, Opened, Parts, Plan, Survey, compute_parts};
use isospectrum::{Error, Result};

use super::budget::Limit;
use super::progress::Bar;
use super::report;
use super::target::{Made, Target, named_for};

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
        let volume = self.survey.opened();
        compute_parts(&parts, volume, backend, limits, &bar)
            .map_err(|error| named_for(error, work.path(), &shown))?;
        let memory = self.limit.map(|_| limits.memory);
        target.merge(&parts, volume, (Some(work), memory), &bar)
    }

    /// What is left for the bricks.
    fn limits(&self, is_folder: bool) -> Result<Limits> {
        let (one_file, triangles) = (!is_folder, self.triangles);
        let Some(limit) = self.limit else {
            return Ok(Limits { memory: f64::INFINITY, one_file, triangles });
        };
        let memory = limit.bytes - PROGRAM - self.samples_in_memory();
        if memory <= 0.0 {
            let name = &self.plan.recipe.volume.name;
            let beyond = limit.beyond(PROGRAM + self.samples_in_memory()).unwrap_or_default();
            return Err(Error::Usage(format!("{name}: {beyond}; bricks do not help")));
        }
        Ok(Limits { memory, one_file, triangles })
    }

    /// Bytes of samples that stay in memory.
    fn samples_in_memory(&self) -> f64 {
        match self.survey.opened() {
            Opened::Slabs(..) | Opened::Blocks(..) => 0.0,
            Opened::Whole(prepared) => prepared.volume().samples().n_bytes() as f64,
        }
    }

    fn announce(&self) {
        let (name, n) = (&self.plan.recipe.volume.name, self.plan.recipe.bricks.len());
        let why = self.why.as_ref().map_or_else(String::new, |why| format!("{why}: "));
        let whole = match self.survey.opened() {
            Opened::Slabs(..) | Opened::Blocks(..) => String::new(),
            Opened::Whole(_) => format!(
                "; it cannot be read or prepared by blocks, so {} of samples stay in memory",
                report::bytes(self.samples_in_memory() as u64)
            ),
        };
        log::info!("{name}: {why}in {n} bricks of about {}^3 cells{whole}", self.plan.recipe.side);
    }
}
