//! The description of a volume without its samples, for spectra, their files and pages.

use serde::{Deserialize, Serialize};

use super::grid::{Outside, Volume};
use super::placement::Placement;

/// The description of the volume a spectrum was computed from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeInfo {
    /// Name of the volume.
    pub name: String,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Sample type: `uint8`, `float32`, ...
    pub sample_type: String,
    /// Smallest and largest sample.
    pub range: (f64, f64),
    /// The placement of the samples in the world.
    pub placement: Placement,
    /// Side of the layer around the volume.
    pub outside: Outside,
}

impl Volume {
    /// The description of the volume without its samples.
    pub fn info(&self) -> VolumeInfo {
        VolumeInfo {
            name: self.name().to_string(),
            dims: self.dims(),
            sample_type: self.samples().type_name().to_string(),
            range: self.range(),
            placement: *self.placement(),
            outside: self.outside(),
        }
    }
}
