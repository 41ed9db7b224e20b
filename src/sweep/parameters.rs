//! The parameters of a sweep, with the thesis's values where it gives them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::numbers::exact;
use crate::setters::setters;

/// Most sampling isovalues of a sweep: fifteen for each grey level of 16 bits. The sweep adds those that events need.
const MAX_SAMPLES: f64 = 1e6;

/// Most starts of a sweep: as many as grey levels of 8 bits.
const MAX_STARTS: usize = 256;

/// Most relaxations in a sampling step: a thousand times the default, by which the forces have vanished.
const MAX_RELAX_ITERATIONS: u32 = 10_000;

/// Every parameter of a sweep. Lengths are in voxels (the smallest spacing).
///
/// Start from the default and set the others:
///
/// ```
/// use isospectrum::Parameters;
///
/// let parameters = Parameters::default().with_range((10.0, 200.0)).with_error(0.05);
/// assert_eq!(parameters.max_edge, Parameters::default().max_edge);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Parameters {
    /// Isovalues to cover, cut to the range of the volume; the whole range if absent.
    pub range: Option<(f64, f64)>,
    /// Fixed distance between sampling isovalues; adapted to the motion of the surface if absent.
    pub step: Option<f64>,
    /// Fixed number of sampling isovalues over the range, in place of `step`.
    pub samples: Option<usize>,
    /// Tolerance h (thesis: h_min): how far tracked triangles should be from the isosurface at most.
    pub error: f64,
    /// Radius ratio 2r/R below which a triangle is removed (thesis: lambda, as r/R 0.2).
    pub min_quality: f64,
    /// Area below which a triangle is removed, over the smallest dimension d (thesis: 0.002).
    pub min_area: f64,
    /// Area above which a triangle may be refined, over d (thesis: 0.005).
    pub refine_area: f64,
    /// Share of the tangential force applied in one relaxation (thesis: 0.6).
    pub relax_strength: f64,
    /// Relaxation ends when the largest tangential force is smaller, voxels; tested after every eighth iteration (thesis:
    /// 1e-4 for its table 1).
    pub relax_force: f64,
    /// Number of relaxations in one sampling step at most.
    pub relax_iterations: u32,
    /// Longest edge, voxels.
    pub max_edge: f64,
    /// Isovalue of the initial mesh.
    pub start: Option<f64>,
    /// Number of starts, each with a part of the range of its own; by the forecast if absent.
    pub starts: Option<usize>,
    /// File with a mesh for `start`.
    pub initial_mesh: Option<PathBuf>,
}

impl Parameters {
    setters! {
        with_error(error: f64),
        with_min_quality(min_quality: f64),
        with_min_area(min_area: f64),
        with_refine_area(refine_area: f64),
        with_relax_strength(relax_strength: f64),
        with_relax_force(relax_force: f64),
        with_relax_iterations(relax_iterations: u32),
        with_max_edge(max_edge: f64);
        optional:
        with_range(range: (f64, f64)),
        with_step(step: f64),
        with_samples(samples: usize),
        with_start(start: f64),
        with_starts(starts: usize),
        with_initial_mesh(initial_mesh: PathBuf),
    }
}

impl Parameters {
    /// The parameters with [`Parameters::range`] cut to the range of a volume, with a warning if that changes it: the
    /// range may have been chosen for the original volume, and removing noise may have narrowed that of the samples.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if nothing is left.
    pub fn within(&self, (least, most): (f64, f64)) -> Result<Parameters> {
        let Some((low, high)) = self.range else { return Ok(self.clone()) };
        // A range that is not a number has nothing inside either.
        if !(low < high && low < most && least < high) {
            let [low, high, least, most] = [low, high, least, most].map(exact);
            return Err(Error::Usage(format!(
                "range {low} to {high}, expected one of the volume's {least} to {most}"
            )));
        }
        let cut = (low.max(least), high.min(most));
        if cut != (low, high) {
            let [low, high, least, most] = [low, high, least, most].map(exact);
            log::warn!(
                "range {low} to {high}: the volume has {least} to {most}, so {} to {} is covered",
                exact(cut.0),
                exact(cut.1)
            );
        }
        Ok(Parameters { range: Some(cut), ..self.clone() })
    }

    /// Checks that the start is in the covered range, and that the numbers of sampling isovalues and of relaxations are
    /// numbers that a computation can reach.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] for the start, [`Error::Usage`] for a number that is too large.
    pub(crate) fn check_sampling(&self, (low, high): (f64, f64)) -> Result<()> {
        if let Some(isovalue) = self.start
            && !(low <= isovalue && isovalue <= high)
        {
            return Err(Error::Range { isovalue, low, high });
        }
        let n = self.step.map(|step| (high - low) / step).or(self.samples.map(|n| n as f64));
        if let Some(n) = n
            && n > MAX_SAMPLES
        {
            let message = format!("{n:.3e} sampling isovalues, expected at most {MAX_SAMPLES}");
            return Err(Error::Usage(message));
        }
        if let Some(n) = self.starts {
            if !(1..=MAX_STARTS).contains(&n) {
                return Err(Error::Usage(format!("{n} starts, expected 1 to {MAX_STARTS}")));
            }
            if n > 1 && self.start.is_some() {
                return Err(Error::Usage(format!(
                    "a start isovalue and {n} starts, expected one start"
                )));
            }
        }
        if self.relax_iterations > MAX_RELAX_ITERATIONS {
            return Err(Error::Usage(format!(
                "{} relaxations in a step, expected at most {MAX_RELAX_ITERATIONS}",
                self.relax_iterations
            )));
        }
        Ok(())
    }

    /// Checks that the parameters apply to a block of a volume.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] with an initial mesh, which is one of the whole volume.
    pub(crate) fn check_for_blocks(&self) -> Result<()> {
        if self.initial_mesh.is_some() {
            return Err(Error::Usage(
                "an initial mesh is one of the whole volume, expected none with bricks".to_owned(),
            ));
        }
        Ok(())
    }
}

impl Default for Parameters {
    fn default() -> Self {
        Parameters {
            range: None,
            step: None,
            samples: None,
            error: 0.1,
            min_quality: 0.3,
            min_area: 0.0002,
            refine_area: 0.001,
            relax_strength: 0.6,
            relax_force: 1e-4,
            relax_iterations: 6,
            max_edge: 4.0,
            start: None,
            starts: None,
            initial_mesh: None,
        }
    }
}
