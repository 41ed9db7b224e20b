//! Preprocessing of a volume: crop, filter, downsample, mask.
//!
//! The steps have the order of the fields of [`Preparation`]. A spectrum stores them, so that it can be verified against the
//! original volume.

mod filter;

use serde::{Deserialize, Serialize};

use super::grid::Volume;
use super::mask::record::MaskRecord;
use super::placement::Placement;
use super::samples::Samples;
use crate::error::{Error, Result};

/// Steps before the sweep; each is optional.
///
/// ```
/// use isospectrum::{Preparation, volume::phantom};
///
/// let preparation = Preparation { crop: Some([[0, 8], [2, 8], [0, 8]]), downsample: Some(2), ..Preparation::default() };
/// assert_eq!(preparation.apply(phantom("sphere:8")?)?.dims(), [4, 3, 4]);
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Preparation {
    /// Index of the first sample, and one past the last, along x, y, z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crop: Option<[[usize; 2]; 3]>,
    /// Each sample becomes the median of those up to this many samples away along every axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median: Option<usize>,
    /// Standard deviations of a Gaussian along x, y, z, in samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smooth: Option<[f64; 3]>,
    /// Blocks of this many samples along every axis become one, their mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub downsample: Option<usize>,
    /// A mask of the samples before all steps, at which surfaces end. Filters use all samples; the mask is applied to their
    /// result.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<MaskRecord>,
}

/// Largest radius of a median, and standard deviation of a Gaussian, in samples.
const MAX_RADIUS: f64 = 64.0;

impl Preparation {
    /// Whether there are no steps.
    pub fn is_none(&self) -> bool {
        *self == Preparation::default()
    }

    /// The preparation in the metadata of a spectrum.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for steps that this version does not support.
    pub(crate) fn of_json(json: &serde_json::Value) -> Result<Self> {
        Preparation::deserialize(json)
            .map_err(|_| Error::input("unsupported preparation of the volume in the spectrum"))
    }

    /// The volume after all steps.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a region outside the volume, and for invalid radii; [`Error::Input`] if [`Volume::new`] rejects
    /// the result, the mask does not fit or memory does not suffice.
    pub fn apply(&self, volume: Volume) -> Result<Volume> {
        self.check(&volume)?;
        let mut mask = self.mask.as_ref().map(|mask| mask.mask(&volume)).transpose()?;
        let mut volume = volume;
        if let Some(region) = self.crop {
            mask = mask.map(|mask| mask.cropped(region));
            volume = cropped(&volume, region)?;
        }
        if let Some(radius) = self.median {
            let samples = filter::median(volume.samples(), volume.dims(), radius);
            volume = volume.with_samples(samples)?;
        }
        if let Some(sigma) = self.smooth {
            let samples = filter::gaussian(volume.samples(), volume.dims(), sigma);
            volume = volume.with_samples(samples)?;
        }
        if let Some(n) = self.downsample {
            volume = downsampled(&volume, n)?;
            mask = mask.map(|mask| mask.downsampled(n));
        }
        match mask {
            Some(mask) => mask.apply_to(&volume),
            None => Ok(volume),
        }
    }

    fn check(&self, volume: &Volume) -> Result<()> {
        let dims = volume.dims();
        if let Some(region) = self.crop
            && let Some(a) = (0..3)
                .find(|&a| region[a][1] > dims[a] || region[a][1].saturating_sub(region[a][0]) < 2)
        {
            let ([first, end], axis) = (region[a], ["x", "y", "z"][a]);
            return Err(Error::Usage(format!(
                "region {first}:{end} along {axis}, expected at least 2 of the samples 0:{}",
                dims[a]
            )));
        }
        let is_radius = |r: f64| (0.0..=MAX_RADIUS).contains(&r);
        let radii = self.smooth.iter().flatten().copied();
        if let Some(r) = radii.chain(self.median.map(|r| r as f64)).find(|&r| !is_radius(r)) {
            return Err(Error::Usage(format!(
                "filter radius of {r} samples, expected 0 to {MAX_RADIUS}"
            )));
        }
        if self.downsample.is_some_and(|n| n < 1) {
            return Err(Error::Usage("blocks of 0 samples, expected 1 or more".to_owned()));
        }
        Ok(())
    }
}

/// A volume with the name and the layer's side of another.
fn with_grid(
    volume: &Volume,
    samples: Samples,
    dims: [usize; 3],
    placement: Placement,
) -> Result<Volume> {
    Ok(Volume::new(volume.name(), dims, samples, placement)?.with_outside(volume.outside()))
}

fn cropped(volume: &Volume, region: [[usize; 2]; 3]) -> Result<Volume> {
    let dims = region.map(|[first, end]| end - first);
    let samples = volume.samples_of(region.map(|r| r[0]), region.map(|r| r[1]))?;
    let first = region.map(|[first, _]| first as f64);
    let placement = Placement { origin: volume.placement().world(first), ..*volume.placement() };
    with_grid(volume, samples, dims, placement)
}

/// Means of blocks; an incomplete block at an upper end is dropped.
fn downsampled(volume: &Volume, n: usize) -> Result<Volume> {
    let dims = volume.dims().map(|d| d / n);
    if n == 1 {
        return Ok(volume.clone());
    }
    if dims.iter().any(|&d| d < 2) {
        let message = format!("blocks of {n} samples, expected at least 2 blocks along each axis");
        return Err(Error::Usage(message));
    }
    let samples = filter::block_means(volume.samples(), volume.dims(), n);
    // A block is at the centre of its samples.
    let middle = [0.5 * (n as f64 - 1.0); 3];
    let mut placement = *volume.placement();
    placement.origin = placement.world(middle);
    placement.spacing = placement.spacing.map(|s| s * n as f64);
    with_grid(volume, samples, dims, placement)
}
