//! Settings for the preparation of a volume.

use super::length::Length;
use super::region::Region;
use crate::error::Result;
use crate::volume::{Mask, Preparation, Volume};

/// Settings for the preparation of a volume, in the order in which they are applied.
#[derive(Clone, Debug, Default)]
pub struct PreparationSettings {
    /// Region to keep.
    pub crop: Option<Region>,
    /// Radius of a median filter, samples.
    pub median: Option<usize>,
    /// Standard deviation of a Gaussian filter; in voxels if it has no unit.
    pub smooth: Option<Length>,
    /// Side of the blocks of samples that are replaced by their mean.
    pub downsample: Option<usize>,
    /// Mask with as many samples as the volume; surfaces end where it is 0.
    pub mask: Option<Volume>,
}

impl PreparationSettings {
    /// True if the volume is left as it is.
    pub fn is_none(&self) -> bool {
        let PreparationSettings { crop, median, smooth, downsample, mask } = self;
        let is_filter = median.is_some() || smooth.is_some() || downsample.is_some();
        crop.is_none() && !is_filter && mask.is_none()
    }

    /// The settings in samples of a volume.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`](crate::Error::Usage) for lengths if the unit of the volume is unknown;
    /// [`Error::Input`](crate::Error::Input) for a mask that does not fit the volume.
    pub fn resolve(&self, volume: &Volume) -> Result<Preparation> {
        let placement = volume.placement();
        let sigma = |length: Length| -> Result<[f64; 3]> {
            let voxels = length.in_steps(placement, placement.voxel())?;
            Ok(placement.spacing.map(|s| voxels * placement.voxel() / s))
        };
        let record =
            |mask: &Volume| Mask::check(mask, volume).and_then(|()| Mask::of(mask).record());
        Ok(Preparation {
            crop: self.crop.map(|region| region.resolve(volume)).transpose()?,
            median: self.median,
            smooth: self.smooth.map(sigma).transpose()?,
            downsample: self.downsample,
            mask: self.mask.as_ref().map(record).transpose()?,
        })
    }
}
