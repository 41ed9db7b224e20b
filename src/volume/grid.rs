//! A scalar field on a regular grid.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::mask::Mask;
use super::placement::Placement;
use super::samples::{Samples, range_of, with_samples};
use crate::error::{Error, Result};

/// Longest extent along an axis of the voxel frame: beyond, f32 positions are more than a sixteenth of a voxel apart.
const MAX_EXTENT: f64 = 1_048_576.0;

/// Smallest range of the samples: from here on levels and differences of isovalues are normal f64 numbers.
const MIN_RANGE: f64 = 1e-290;

/// The side of the isosurface on which the layer around the volume is, the *outer side*: normals of meshes point to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Outside {
    /// One layer of samples below the minimum: surfaces close around high values, and normals point to lower ones.
    #[default]
    Low,
    /// One layer of samples above the maximum: surfaces close around low values, as those of a distance do, and normals point to
    /// higher ones.
    High,
}

/// A scalar field on a regular grid.
#[derive(Clone, Debug)]
pub struct Volume {
    pub(super) name: String,
    pub(super) dims: [usize; 3],
    pub(super) samples: Samples,
    pub(super) placement: Placement,
    pub(super) outside: Outside,
    pub(super) range: (f64, f64),
    pub(super) mask: Option<Arc<Mask>>,
    /// The position in the volume of which this is a block.
    pub(super) within: Option<BlockPosition>,
}

/// The position of a block of samples in a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockPosition {
    /// Index of the block's first sample in the whole, along x, y, z.
    pub first: [usize; 3],
    /// Samples of the whole along x, y, z.
    pub whole: [usize; 3],
}

impl Volume {
    /// A volume of `dims` samples (x, y, z), x fastest.
    ///
    /// ```
    /// use isospectrum::{Placement, Samples, Volume};
    ///
    /// let samples: Vec<u16> = (0..4 * 3 * 2).collect();
    /// let placement = Placement { spacing: [0.5, 0.5, 2.0], ..Placement::default() };
    /// let volume = Volume::new("ramp", [4, 3, 2], Samples::from(samples), placement)?;
    /// assert_eq!(volume.range(), (0.0, 23.0));
    /// # Ok::<(), isospectrum::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the number of samples is not the product of `dims`, a dimension is
    /// below 2, [`Placement::check`] fails, a sample is not finite (with its position),
    /// all samples are equal, or their range or the extent of the volume exceed the arithmetic.
    pub fn new(
        name: impl Into<String>,
        dims: [usize; 3],
        samples: Samples,
        placement: Placement,
    ) -> Result<Self> {
        let name = name.into();
        check_grid(&name, dims, &placement)?;
        let wanted = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d));
        if wanted != Some(samples.len()) {
            return Err(Error::input(format!(
                "{name}: {} samples, expected {}x{}x{}",
                samples.len(),
                dims[0],
                dims[1],
                dims[2]
            )));
        }
        let range = with_samples!(&samples, s => range_of(s));
        let range = range.map_err(|i| not_finite(&name, dims, i, samples.get(i)))?;
        check_range(&name, range)?;
        Ok(Volume {
            name,
            dims,
            samples,
            placement,
            outside: Outside::default(),
            range,
            mask: None,
            within: None,
        })
    }

    /// The same volume under another name.
    pub fn with_name(mut self, name: impl Into<String>) -> Volume {
        self.name = name.into();
        self
    }

    /// The same volume with the layer around it on the given side.
    pub fn with_outside(mut self, outside: Outside) -> Self {
        self.outside = outside;
        self
    }

    /// The same volume with other samples, in the same places.
    pub(crate) fn with_samples(&self, samples: Samples) -> Result<Self> {
        let (outside, mask) = (self.outside, self.mask.clone());
        let volume = Volume::new(self.name(), self.dims, samples, self.placement)?;
        Ok(Volume { outside, mask, ..volume })
    }

    /// The same volume with a mask of the same dimensions.
    pub(super) fn with_mask(mut self, mask: Mask) -> Self {
        self.mask = Some(Arc::new(mask));
        self
    }

    /// The mask that was applied to the volume, if any.
    pub fn mask(&self) -> Option<&Mask> {
        self.mask.as_deref()
    }

    /// Whether a point of the voxel frame is nearer to a sample outside the mask than to one inside.
    pub fn is_masked_out(&self, p: [f64; 3]) -> bool {
        let Some(mask) = &self.mask else { return false };
        let size = self.voxel_size();
        let nearest = |a: usize| (p[a] / size[a]).round().clamp(0.0, self.dims[a] as f64 - 1.0);
        let [x, y, z] = [0, 1, 2].map(|a| nearest(a) as usize);
        !mask.is_inside(x + self.dims[0] * (y + self.dims[1] * z))
    }

    /// The values of the samples; with a mask, of those inside it.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let counts = |i: &usize| self.mask.as_ref().is_none_or(|mask| mask.is_inside(*i));
        (0..self.samples.len()).filter(counts).map(|i| self.samples.get(i))
    }

    /// The name: that of the file without folders, or of the phantom.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Samples along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The samples, x fastest.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// The placement of the samples in the world.
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// The side of the isosurface on which the layer around the volume is.
    pub fn outside(&self) -> Outside {
        self.outside
    }

    /// Smallest and largest sample.
    pub fn range(&self) -> (f64, f64) {
        self.range
    }

    /// The value of the layer around the volume: ten ranges below the minimum (or above the
    /// maximum), so that caps stay within a tenth of a cell of the border.
    pub fn outside_value(&self) -> f64 {
        let (low, high) = self.range;
        match self.outside {
            Outside::Low => low - 10.0 * (high - low),
            Outside::High => high + 10.0 * (high - low),
        }
    }

    /// Sample (i, j, k).
    #[inline]
    pub fn sample(&self, i: usize, j: usize, k: usize) -> f64 {
        self.samples.get(i + self.dims[0] * (j + self.dims[1] * k))
    }

    /// Sample (i, j, k) of the volume with the layer around it, which has the indices -1 and `dims`.
    #[inline]
    pub fn padded(&self, i: i64, j: i64, k: i64) -> f64 {
        let [nx, ny, nz] = self.dims;
        if i < 0 || j < 0 || k < 0 || i >= nx as i64 || j >= ny as i64 || k >= nz as i64 {
            self.outside_value()
        } else {
            self.sample(i as usize, j as usize, k as usize)
        }
    }

    /// World positions of the first and last samples along x, y, z: the eight corners, x fastest.
    pub fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|corner| {
            let index =
                std::array::from_fn(|a| (corner >> a & 1) as f64 * (self.dims[a] - 1) as f64);
            self.placement.world(index)
        })
    }

    /// Size of a cell in the voxel frame: [`Placement::cell_size`].
    pub fn voxel_size(&self) -> [f64; 3] {
        self.placement.cell_size()
    }

    /// The trilinear field at a point of the voxel frame; outside, that of the layer around the
    /// volume, clamped to it.
    pub fn value_at(&self, p: [f64; 3]) -> f64 {
        let size = self.voxel_size();
        let mut cell = [0i64; 3];
        let mut t = [0f64; 3];
        for a in 0..3 {
            let x = (p[a] / size[a]).clamp(-1.0, self.dims[a] as f64);
            cell[a] = (x.floor() as i64).min(self.dims[a] as i64 - 1);
            t[a] = x - cell[a] as f64;
        }
        let mut value = 0.0;
        for corner in 0..8i64 {
            let d = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let mut weight = 1.0;
            for a in 0..3 {
                weight *= if d[a] == 1 { t[a] } else { 1.0 - t[a] };
            }
            if weight != 0.0 {
                value += weight * self.padded(cell[0] + d[0], cell[1] + d[1], cell[2] + d[2]);
            }
        }
        value
    }
}

/// Checks dimensions and placement of a volume.
///
/// # Errors
///
/// [`Error::Input`] as [`Volume::new`].
pub(crate) fn check_grid(name: &str, dims: [usize; 3], placement: &Placement) -> Result<()> {
    if dims.iter().any(|&d| d < 2) {
        return Err(Error::input(format!(
            "{name}: dimensions {}x{}x{}, expected at least 2 samples along each axis",
            dims[0], dims[1], dims[2]
        )));
    }
    placement.check().map_err(|message| Error::input(format!("{name}: {message}")))?;
    let size = placement.cell_size();
    if let Some(a) = (0..3).find(|&a| dims[a] as f64 * size[a] > MAX_EXTENT) {
        return Err(Error::input(format!(
            "{name}: {} samples with a spacing of {:e}, expected an extent of at most {MAX_EXTENT} times the smallest spacing {:e}",
            dims[a],
            placement.spacing[a],
            placement.voxel()
        )));
    }
    Ok(())
}

/// Checks smallest and largest sample of a volume.
///
/// # Errors
///
/// [`Error::Input`] as [`Volume::new`].
pub(crate) fn check_range(name: &str, range: (f64, f64)) -> Result<()> {
    if range.0 == range.1 {
        return Err(Error::input(format!(
            "{name}: every sample is {:?}, expected at least two different values",
            range.0
        )));
    }
    // The layer, ten ranges outside, must be finite too, and small fractions of the range must be normal numbers.
    let length = range.1 - range.0;
    if !(11.0 * length).is_finite() || length < MIN_RANGE {
        return Err(Error::input(format!(
            "{name}: samples from {:?} to {:?}, expected a range from {MIN_RANGE:e} to below 1e306",
            range.0, range.1
        )));
    }
    Ok(())
}

/// The error for the sample `v` at index `i`, which is not finite.
pub(super) fn not_finite(name: &str, dims: [usize; 3], i: usize, v: f64) -> Error {
    let (x, y, z) = (i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1]));
    Error::input(format!(
        "{name}: sample ({x}, {y}, {z}) is {v}, expected finite values (--nan-as VALUE replaces them)"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_at_is_trilinear_and_falls_to_the_layer_outside() {
        let v = Volume::new(
            "v",
            [2, 2, 2],
            Samples::F32((0..8).map(|i| i as f32).collect()),
            Placement::default(),
        )
        .expect("a valid volume");
        assert_eq!(v.value_at([0.5, 0.5, 0.5]), 3.5);
        assert_eq!(v.value_at([1.0, 0.0, 0.0]), 1.0);
        assert_eq!(v.value_at([-1.0, 0.0, 0.0]), v.outside_value());
        assert_eq!(v.value_at([-0.5, 0.0, 0.0]), 0.5 * v.outside_value());
    }
}
