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

impl VolumeInfo {
    /// What is kept of a volume.
    pub(crate) fn of(volume: &Volume) -> VolumeInfo {
        VolumeInfo {
            name: volume.name().to_string(),
            dims: volume.dims(),
            sample_type: volume.samples().type_name().to_string(),
            range: volume.range(),
            placement: *volume.placement(),
            outside: volume.outside(),
        }
    }
}
