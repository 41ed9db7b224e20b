//! `compute` in bricks: the parts in a folder of their own beside the result, which goes in the end.

use std::path::Path;

use isospectrum::bricks::{Limits, Opened, Parts, Plan, Survey, compute_parts, merge};
use isospectrum::file::PartFolder;
use isospectrum::kernels::Backend;
use isospectrum::spectrum::Spectrum;
use isospectrum::{Error, Result};

use super::budget::Limit;
use super::output::Output;
use super::progress::Bar;
use super::{report, spectrum_file};

/// What the program itself takes, and the topology that joins the parts, bytes: some ten megabytes each.
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

/// What was computed: a spectrum, of whose triangles only numbers are known where it is a folder, and the bytes that were written.
pub(super) struct Made {
    pub(super) spectrum: Spectrum,
    pub(super) n_bytes: u64,
}

impl InBricks {
    /// Computes and writes the spectrum.
    pub(super) fn compute(
        self,
        output: Output,
        backend: &Backend,
        quiet: bool,
    ) -> anyhow::Result<Made> {
        let folder = match &output {
            Output::File(path) if is_replaced(path) => PartFolder::beside(path)?,
            _ => PartFolder::beside(&std::env::temp_dir().join("isospectrum"))?,
        };
        self.announce();
        let spectrum = {
            let parts = Parts::new(&self.plan, folder.path());
            let bar = Bar::new(quiet);
            compute_parts(&parts, self.survey.opened(), backend, self.limits()?, &bar)?;
            merge(&parts, self.survey.opened(), &bar)?
        };
        // Nothing is written beside while it is there.
        drop(folder);
        let (spectrum, n_bytes) = spectrum_file::write_whole(spectrum, output)?;
        Ok(Made { spectrum, n_bytes })
    }

    /// What is left for the bricks.
    fn limits(&self) -> Result<Limits> {
        let Some(limit) = self.limit else {
            let (memory, merge) = (f64::INFINITY, None);
            return Ok(Limits { memory, merge, triangles: self.triangles });
        };
        let left = limit.bytes - PROGRAM - self.samples_in_memory();
        if left <= 0.0 {
            let name = &self.plan.recipe.volume.name;
            let beyond = limit.beyond(PROGRAM + self.samples_in_memory()).unwrap_or_default();
            return Err(Error::Usage(format!("{name}: {beyond}; bricks do not help")));
        }
        Ok(Limits { memory: left, merge: Some(left), triangles: self.triangles })
    }

    /// Bytes of samples that stay in memory.
    fn samples_in_memory(&self) -> f64 {
        match self.survey.opened() {
            Opened::Slabs(..) => 0.0,
            Opened::Whole(prepared) => prepared.volume().samples().n_bytes() as f64,
        }
    }

    fn announce(&self) {
        let (name, n) = (&self.plan.recipe.volume.name, self.plan.recipe.bricks.len());
        let why = self.why.as_ref().map_or_else(String::new, |why| format!("{why}: "));
        let whole = match self.survey.opened() {
            Opened::Slabs(..) => String::new(),
            Opened::Whole(_) => format!(
                "; it cannot be read or prepared by blocks, so {} of samples stay in memory",
                report::bytes(self.samples_in_memory() as u64)
            ),
        };
        log::info!("{name}: {why}in {n} bricks of about {}^3 cells{whole}", self.plan.recipe.side);
    }
}

/// Whether a file is put in the place of what is there, not written to.
fn is_replaced(path: &Path) -> bool {
    std::fs::metadata(path).map_or(true, |found| found.is_file())
}
