//! Settings for the sweep.

use super::isovalue_range::IsovalueRange;
use crate::error::Result;
use crate::sweep::Parameters;
use crate::volume::{Isovalue, Statistics};

/// Settings for the sweep of a prepared volume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweepSettings {
    /// Isovalues to cover; the range of the volume if absent.
    pub range: Option<IsovalueRange>,
    /// Isovalue to start from; percentages refer to the covered range.
    pub start: Option<Isovalue>,
    /// All other parameters; its own `range` and `start` are ignored.
    pub parameters: Parameters,
}

impl SweepSettings {
    /// The parameters of the sweep, for a prepared volume with values in `range` and these statistics.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`](crate::Error::Usage) for a range that is empty or outside the volume, and for numbers of samples or
    /// relaxations beyond reach; [`Error::Range`](crate::Error::Range) for a start outside the range.
    pub fn resolve(&self, range: (f64, f64), samples: &Statistics) -> Result<Parameters> {
        let covered = self.range.map(|r| r.resolve(range, Some(samples))).transpose()?;
        let parameters = Parameters { range: covered, start: None, ..self.parameters.clone() };
        let parameters = parameters.within(range)?;
        let covered = parameters.range.unwrap_or(range);
        let start = self.start.map(|c| c.resolve(covered, Some(samples))).transpose()?;
        let parameters = Parameters { start, ..parameters };
        parameters.check_sampling(covered)?;
        Ok(parameters)
    }
}
