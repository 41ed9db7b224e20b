//! The report of a verification.

use serde::Serialize;

use super::findings::{Continuity, Row, Totals};
use super::isovalues::Sampling;
use super::measure::Geometry;
use super::promise::{Limits, Promise, failures, promises};
use crate::spectrum::Spectrum;
use crate::sweep::Counts;
use crate::volume::Volume;

/// The result of [`verify`](crate::verify()).
///
/// ```
/// # fn of(report: &isospectrum::Report) {
/// for promise in &report.promises {
///     println!("{}: {:?}", promise.what, promise.found);
/// }
/// println!("{} of {} isovalues right", report.totals.topology_right, report.totals.isovalues);
/// # }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// Whether no promise is broken.
    pub passed: bool,
    /// One sentence for each broken promise.
    pub failures: Vec<String>,
    /// All promises with their measurements.
    pub promises: Vec<Promise>,
    /// The volume's name.
    pub volume: String,
    /// Tolerance of the spectrum, voxels.
    pub tolerance: f64,
    /// Seed of the random choice.
    pub seed: u64,
    /// The limits that replace the promised ones.
    pub limits: Limits,
    /// Totals over all isovalues.
    pub totals: Totals,
    /// Counts of the sweep's steps, failures and repairs, from the spectrum's parameters.
    pub counts: Option<Counts>,
    /// Jumps and coherence.
    pub continuity: Continuity,
    /// Measurements at each isovalue.
    pub rows: Vec<Row>,
}

/// What helps a spectrum that breaks a promise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Remedy {
    /// Nothing: the topology is wrong, which is a fault of this library.
    None,
    /// Smoothing, because the samples have two values only.
    Smoothing,
    /// Smoothing or a larger tolerance, perhaps.
    SmoothingOrTolerance,
}

impl Report {
    /// What helps if a promise is broken. `volume` is the verified one.
    pub fn remedy(&self, volume: &Volume) -> Remedy {
        let totals = &self.totals;
        if totals.topology_right.min(totals.manifold).min(totals.finite) < totals.isovalues {
            return Remedy::None;
        }
        let ((low, high), samples) = (volume.range(), volume.samples());
        let mut values = (0..samples.len()).map(|i| samples.get(i));
        if values.all(|value| value == low || value == high) {
            Remedy::Smoothing
        } else {
            Remedy::SmoothingOrTolerance
        }
    }

    pub(super) fn new(
        spectrum: &Spectrum,
        sampling: Sampling,
        limits: Limits,
        rows: Vec<Row>,
        pooled: &Geometry,
        continuity: Continuity,
    ) -> Self {
        let totals = Totals::of(&rows, pooled, &continuity);
        let promises =
            promises(&totals, &continuity.beyond_elsewhere, &limits, spectrum.tolerance());
        let failures = failures(&promises);
        Report {
            passed: failures.is_empty(),
            failures,
            promises,
            volume: spectrum.volume().name.clone(),
            tolerance: spectrum.tolerance(),
            seed: sampling.seed,
            limits,
            totals,
            counts: Counts::of(spectrum),
            continuity,
            rows,
        }
    }
}
