//! What a sweep can be told, with the thesis's values where it has them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Every parameter of a sweep. Lengths are in voxels (the smallest spacing).
///
/// More may come, so those that are not meant are best left to the default:
///
/// ```
/// use isospectrum::Parameters;
///
/// let parameters = Parameters { range: Some((10.0, 200.0)), error: 0.05, ..Parameters::default() };
/// assert_eq!(parameters.max_edge, Parameters::default().max_edge);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Isovalues to cover, as far as they are in the range of the volume; all of that if absent.
    pub range: Option<(f64, f64)>,
    /// Fixed distance between sampling isovalues; by how far the surface moves if absent.
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
    /// Largest tangential force at which relaxation ends, looked at after every eighth (thesis: 1e-4 for its table 1).
    pub relax_force: f64,
    /// Most relaxations in one sampling step.
    pub relax_iterations: u32,
    /// Longest edge, voxels.
    pub max_edge: f64,
    /// Isovalue of the initial mesh.
    pub start: Option<f64>,
    /// Mesh from outside for `start`.
    pub initial_mesh: Option<PathBuf>,
}

impl Parameters {
    /// These for a volume of a range: what [`Parameters::range`] has beyond that is cut off, and so told. It may be written for
    /// the volume as it was read, and taking noise out may have held its ends.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where nothing is left.
    pub fn within(&self, (least, most): (f64, f64)) -> Result<Parameters> {
        let Some((low, high)) = self.range else { return Ok(self.clone()) };
        // A range that is not a number has nothing inside either.
        if !(low < high && low < most && least < high) {
            return Err(Error::Usage(format!(
                "range {low} to {high}, expected one of the volume's {least} to {most}"
            )));
        }
        let cut = (low.max(least), high.min(most));
        if cut != (low, high) {
            log::warn!(
                "range {low} to {high}: the volume has {least} to {most}, so {} to {} is covered",
                cut.0,
                cut.1
            );
        }
        Ok(Parameters { range: Some(cut), ..self.clone() })
    }

    /// That what is swept may be a block of a volume.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where there is an initial mesh: it is one of the whole.
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
            initial_mesh: None,
        }
    }
}
