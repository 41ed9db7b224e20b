//! A scalar field on a regular grid, trilinear between samples.
//!
//! # Frames
//!
//! | frame | unit | sample (i, j, k) lies at |
//! |---|---|---|
//! | index | cells | (i, j, k) |
//! | voxel | the smallest spacing | (i, j, k) * [`Volume::voxel_size`] |
//! | world | the file's | origin + direction * (spacing * (i, j, k)) |
//!
//! All geometry inside the library is in the voxel frame, so lengths are metric also where the
//! spacing is anisotropic; exports are in the world frame. There the axes need not be perpendicular ([`Placement`]).

mod block;
mod cube;
mod decode;
#[cfg(feature = "dicom")]
mod dicom;
mod elsewhere;
mod histogram;
mod info;
mod isovalue;
#[cfg(not(feature = "formats"))]
mod left_out;
mod mask;
mod metaimage;
mod mrc;
mod nifti;
mod npy;
#[cfg(feature = "zip")]
mod npz;
mod nrrd;
pub mod phantom;
mod placement;
mod prepare;
mod raw;
mod read;
mod select;
mod slabs;
mod statistics;
mod stream;
mod text;
#[cfg(feature = "tiff")]
mod tiff;
#[cfg(feature = "xml")]
mod vti;
mod vtk;

pub(crate) use block::part_of_samples;
pub use block::{Whole, Within};
pub use histogram::Histogram;
pub use info::VolumeInfo;
pub use isovalue::Isovalue;
#[cfg(not(feature = "dicom"))]
use left_out::dicom;
#[cfg(not(feature = "zip"))]
use left_out::npz;
#[cfg(not(feature = "tiff"))]
use left_out::tiff;
#[cfg(not(feature = "xml"))]
use left_out::vti;
pub use mask::{Mask, MaskRecord};
pub use phantom::{phantom, phantom_names};
pub use placement::{Placement, Space, Unit};
pub use prepare::Preparation;
pub use raw::told_by_name;
use read::Kind;
pub use read::{ReadOptions, files_of, is_volume_name, read_volume, replace_not_finite};
pub use slabs::Slabs;
pub use statistics::{Statistics, Tally};
pub(crate) use stream::DEFLATE_RATIO;

use std::sync::Arc;

use num_traits::AsPrimitive;

use crate::error::{Error, Result};

/// Longest extent along an axis, in voxels: beyond it f32 positions are more than a sixteenth of a voxel apart.
const LARGEST_EXTENT: f64 = 1_048_576.0;

/// Smallest range of the samples: levels, shares of isovalues and differences are normal numbers from here on.
const LEAST_RANGE: f64 = 1e-290;

/// What a reader gives: samples along x, y, z; the samples; where they lie.
type Grid = ([usize; 3], Samples, Placement);

/// The samples in the type of their file, x fastest, then y, then z.
///
/// ```
/// use isospectrum::Samples;
///
/// let samples = Samples::from(vec![-1i16, 7]);
/// assert_eq!((samples.type_name(), samples.get(1)), ("int16", 7.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Samples {
    /// 8 bit unsigned.
    U8(Vec<u8>),
    /// 8 bit signed.
    I8(Vec<i8>),
    /// 16 bit unsigned.
    U16(Vec<u16>),
    /// 16 bit signed.
    I16(Vec<i16>),
    /// 32 bit unsigned.
    U32(Vec<u32>),
    /// 32 bit signed.
    I32(Vec<i32>),
    /// 32 bit floating point.
    F32(Vec<f32>),
    /// 64 bit floating point.
    F64(Vec<f64>),
}

/// Applies one expression to the samples of whatever type.
macro_rules! with_samples {
    ($samples:expr, $name:ident => $body:expr) => {
        match $samples {
            $crate::volume::Samples::U8($name) => $body,
            $crate::volume::Samples::I8($name) => $body,
            $crate::volume::Samples::U16($name) => $body,
            $crate::volume::Samples::I16($name) => $body,
            $crate::volume::Samples::U32($name) => $body,
            $crate::volume::Samples::I32($name) => $body,
            $crate::volume::Samples::F32($name) => $body,
            $crate::volume::Samples::F64($name) => $body,
        }
    };
}

pub(crate) use with_samples;

/// Samples from the numbers of their type.
macro_rules! from_numbers {
    ($($number:ty => $variant:ident),*) => {
        $(impl From<Vec<$number>> for Samples {
            fn from(numbers: Vec<$number>) -> Self {
                Samples::$variant(numbers)
            }
        })*
    };
}

from_numbers!(u8 => U8, i8 => I8, u16 => U16, i16 => I16, u32 => U32, i32 => I32, f32 => F32, f64 => F64);

impl Samples {
    /// How many samples there are.
    pub fn len(&self) -> usize {
        with_samples!(self, s => s.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sample at flat index `i` as f64 (exact for every type).
    #[inline]
    pub fn get(&self, i: usize) -> f64 {
        #[allow(clippy::unnecessary_cast, reason = "the macro serves every type, f64 among them")]
        {
            with_samples!(self, s => s[i] as f64)
        }
    }

    /// Bytes that they take.
    pub fn n_bytes(&self) -> usize {
        with_samples!(self, s => std::mem::size_of_val(&s[..]))
    }

    /// Whether float32 does not hold all samples of the type.
    fn is_wide(&self) -> bool {
        matches!(self, Samples::U32(_) | Samples::I32(_) | Samples::F64(_))
    }

    /// Takes more samples of the same type behind these.
    fn append(&mut self, more: Samples) -> std::io::Result<()> {
        match (self, more) {
            (Samples::U8(all), Samples::U8(more)) => all.extend(more),
            (Samples::I8(all), Samples::I8(more)) => all.extend(more),
            (Samples::U16(all), Samples::U16(more)) => all.extend(more),
            (Samples::I16(all), Samples::I16(more)) => all.extend(more),
            (Samples::U32(all), Samples::U32(more)) => all.extend(more),
            (Samples::I32(all), Samples::I32(more)) => all.extend(more),
            (Samples::F32(all), Samples::F32(more)) => all.extend(more),
            (Samples::F64(all), Samples::F64(more)) => all.extend(more),
            (all, more) => {
                let (a, b) = (all.type_name(), more.type_name());
                return Err(decode::invalid(format!("samples of {b} behind {a}")));
            }
        }
        Ok(())
    }

    /// Whether the type holds integers only.
    pub fn is_integer(&self) -> bool {
        !matches!(self, Samples::F32(_) | Samples::F64(_))
    }

    /// The samples as bytes, little endian, as a RAW file holds them.
    pub fn to_le_bytes(&self) -> Vec<u8> {
        with_samples!(self, s => s.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    /// The name of the type as flags and file names spell it: `uint8`, `float32`, ...
    pub fn type_name(&self) -> &'static str {
        match self {
            Samples::U8(_) => "uint8",
            Samples::I8(_) => "int8",
            Samples::U16(_) => "uint16",
            Samples::I16(_) => "int16",
            Samples::U32(_) => "uint32",
            Samples::I32(_) => "int32",
            Samples::F32(_) => "float32",
            Samples::F64(_) => "float64",
        }
    }
}

/// Which side of the isosurface the layer around the volume lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Outside {
    /// One layer of samples below the minimum: surfaces close around high values.
    #[default]
    Low,
    /// One layer of samples above the maximum.
    High,
}

/// A scalar field on a regular grid.
#[derive(Clone, Debug)]
pub struct Volume {
    name: String,
    dims: [usize; 3],
    samples: Samples,
    placement: Placement,
    outside: Outside,
    range: (f64, f64),
    mask: Option<Arc<Mask>>,
    /// Where it lies in the volume that it is a block of.
    within: Option<Within>,
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
    /// below 2, [`Placement::check`] fails, a sample is not finite (named with its position),
    /// all samples are equal, or their range or the extent of the volume are beyond what the arithmetic holds.
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

    /// The same volume with the layer around it on the given side.
    pub fn with_outside(mut self, outside: Outside) -> Self {
        self.outside = outside;
        self
    }

    /// The same volume with other samples, in the same places.
    ///
    /// # Errors
    ///
    /// As [`Volume::new`].
    pub(crate) fn with_samples(&self, samples: Samples) -> Result<Self> {
        let (outside, mask) = (self.outside, self.mask.clone());
        let volume = Volume::new(self.name(), self.dims, samples, self.placement)?;
        Ok(Volume { outside, mask, ..volume })
    }

    /// The same volume, of which only what is inside a mask of as many samples counts.
    fn with_mask(mut self, mask: Mask) -> Self {
        self.mask = Some(Arc::new(mask));
        self
    }

    /// The mask that was laid over the volume, where one was.
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

    /// The values of the samples, of those inside the mask where there is one.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let counts = |i: &usize| self.mask.as_ref().is_none_or(|mask| mask.is_inside(*i));
        (0..self.samples.len()).filter(counts).map(|i| self.samples.get(i))
    }

    /// What the volume is called: the file's name without folders, or the phantom's.
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

    /// Where the samples lie in the world.
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// Which side of the isosurface the layer around the volume lies on.
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

    /// Sample (i, j, k) of the volume with the layer around it: -1 and `dims` are the layer.
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

    /// Size of a cell in the voxel frame: spacing over the smallest spacing.
    pub fn voxel_size(&self) -> [f64; 3] {
        let unit = self.placement.voxel();
        self.placement.spacing.map(|s| s / unit)
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
    let (spacing, unit) = (placement.spacing, placement.voxel());
    if let Some(a) = (0..3).find(|&a| dims[a] as f64 * spacing[a] > LARGEST_EXTENT * unit) {
        return Err(Error::input(format!(
            "{name}: {} samples {:e} apart, expected at most {LARGEST_EXTENT} times the smallest spacing {unit:e} in all",
            dims[a], spacing[a]
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
    // The layer around the volume lies ten ranges beyond the samples and must be finite too; and small parts of
    // the range must be numbers.
    let length = range.1 - range.0;
    if !(11.0 * length).is_finite() || length < LEAST_RANGE {
        return Err(Error::input(format!(
            "{name}: samples from {:?} to {:?}, expected a range from {LEAST_RANGE:e} to below 1e306",
            range.0, range.1
        )));
    }
    Ok(())
}

/// Says that the sample `v` at index `i` is no number.
fn not_finite(name: &str, dims: [usize; 3], i: usize, v: f64) -> Error {
    let (x, y, z) = (i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1]));
    Error::input(format!(
        "{name}: sample ({x}, {y}, {z}) is {v}, expected finite values (--nan-as VALUE replaces them)"
    ))
}

/// Smallest and largest sample, or the index of the first that is not finite.
///
/// The comparisons stay in the samples' own type and without early exit inside a chunk, so the
/// compiler can use vector instructions: a volume of 1024^3 samples is scanned at memory speed.
fn range_of<T: Copy + PartialOrd + AsPrimitive<f64>>(
    samples: &[T],
) -> std::result::Result<(f64, f64), usize> {
    const CHUNK: usize = 4096;
    let Some(&first) = samples.first() else { return Err(0) };
    let (mut low, mut high) = (first, first);
    for (n, chunk) in samples.chunks(CHUNK).enumerate() {
        let mut all_finite = true;
        for &v in chunk {
            low = if v < low { v } else { low };
            high = if v > high { v } else { high };
            all_finite &= v.as_().is_finite();
        }
        if !all_finite {
            let within = chunk.iter().position(|v| !v.as_().is_finite());
            return Err(n * CHUNK + within.unwrap_or(0));
        }
    }
    Ok((low.as_(), high.as_()))
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
