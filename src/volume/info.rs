//! What is kept of a volume where its samples are not: spectra, their files and pages tell it.

use serde::{Deserialize, Serialize};

use super::{Outside, Placement, Volume};

/// What is known of the volume a spectrum was computed from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeInfo {
    /// Name of the volume.
    pub name: String,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Sample type as flags spell it.
    pub sample_type: String,
    /// Smallest and largest sample.
    pub range: (f64, f64),
    /// Where the samples lie in the world.
    pub placement: Placement,
    /// Side of the layer around the volume.
    pub outside: Outside,
}

impl Volume {
    /// What is kept of it where its samples are not.
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
