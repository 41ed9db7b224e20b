//! Where the samples of a plan's volume come from.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::prepared::Prepared;
use crate::spectrum::VolumeInfo;
use crate::volume::{
    Outside, ReadOptions, Samples, Slabs, Volume, WholeVolume, crop_samples, phantom, read_volume,
};

/// How to read a volume again, on this machine or another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum VolumeSource {
    /// A file, or a folder of slices.
    File {
        /// Its path.
        path: PathBuf,
        /// Options for reading it.
        options: Box<ReadOptions>,
        /// Side of the layer around it.
        outside: Outside,
    },
    /// A built-in volume.
    Phantom {
        /// Its name, as [`phantom()`] takes it.
        name: String,
        /// Side of the layer around it.
        outside: Outside,
    },
    /// An array in memory, which cannot be read again: its plan is of use to one process only.
    Given {
        /// Name of the volume.
        name: String,
    },
}

impl VolumeSource {
    /// Reads the volume.
    ///
    /// # Errors
    ///
    /// Those of [`read_volume`] and [`phantom()`]; [`Error::Usage`] for an array in memory.
    pub fn read(&self) -> Result<Volume> {
        match self {
            VolumeSource::File { path, options, outside } => {
                Ok(read_volume(path, options)?.with_outside(*outside))
            }
            VolumeSource::Phantom { name, outside } => Ok(phantom(name)?.with_outside(*outside)),
            VolumeSource::Given { name } => {
                Err(Error::Usage(format!("{name}: bricks need a file, not an array in memory")))
            }
        }
    }

    /// Samples along x, y, z of a file that can be read by blocks; `None` for any other source. No sample is read.
    ///
    /// # Errors
    ///
    /// Those of [`Slabs::of`].
    pub fn dims_in_file(&self) -> Result<Option<[usize; 3]>> {
        let VolumeSource::File { path, options, .. } = self else { return Ok(None) };
        Ok(Slabs::of(path, options)?.map(|slabs| slabs.dims()))
    }

    /// Path of the file, if the source is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            VolumeSource::File { path, .. } => Some(path),
            VolumeSource::Phantom { .. } | VolumeSource::Given { .. } => None,
        }
    }
}

/// Reads blocks of a volume's samples, for example from a chunked array.
pub trait ReadBlocks: Send + Sync + std::fmt::Debug {
    /// The samples from `first` up to, not including, `end` along x, y, z, x fastest. All of them are inside the volume.
    ///
    /// # Errors
    ///
    /// Whatever prevents reading them.
    fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples>;
}

/// A box of a volume's samples in memory, which serves blocks inside it.
#[derive(Clone, Debug)]
pub struct SampleBox {
    first: [usize; 3],
    end: [usize; 3],
    samples: Samples,
}

impl SampleBox {
    /// The samples from `first` up to, not including, `end`, x fastest.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the number of samples does not match.
    pub fn new(first: [usize; 3], end: [usize; 3], samples: Samples) -> Result<SampleBox> {
        let dims: [usize; 3] = std::array::from_fn(|a| end[a].saturating_sub(first[a]));
        let (n, expected) = (samples.len(), dims.iter().product::<usize>());
        if n != expected {
            return Err(Error::input(format!("{n} samples, expected {expected}")));
        }
        Ok(SampleBox { first, end, samples })
    }
}

impl ReadBlocks for SampleBox {
    fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples> {
        let is_inside =
            |a: usize| self.first[a] <= first[a] && first[a] <= end[a] && end[a] <= self.end[a];
        if !(0..3).all(is_inside) {
            return Err(Error::internal(format!("samples {first:?} to {end:?} are missing")));
        }
        let own = |p: [usize; 3]| [0, 1, 2].map(|a| p[a] - self.first[a]);
        crop_samples(&self.samples, own(self.end), own(first), own(end))
    }
}

/// An open volume that serves blocks of its samples.
#[derive(Clone, Debug)]
pub enum OpenVolume {
    /// In memory, prepared.
    Whole(Prepared),
    /// In its file, unprepared; blocks are read from the file.
    Slabs(Slabs, VolumeInfo),
    /// Anywhere, unprepared; blocks are read by the caller.
    Blocks(Arc<dyn ReadBlocks>, VolumeInfo),
}

impl OpenVolume {
    /// Opens a file for reading by blocks; `None` if its format requires reading it as a whole, or its dimensions are not those of
    /// `info`.
    pub(super) fn slabs(source: &VolumeSource, info: &VolumeInfo) -> Result<Option<OpenVolume>> {
        let VolumeSource::File { path, options, .. } = source else { return Ok(None) };
        let slabs = Slabs::of(path, options)?.filter(|slabs| slabs.dims() == info.dims);
        Ok(slabs.map(|slabs| OpenVolume::Slabs(slabs, info.clone())))
    }

    /// The samples from `first` up to, not including, `end`, as a block of the volume.
    ///
    /// # Errors
    ///
    /// Those of [`Volume::block`] and [`Slabs::read`]; [`Error::Input`] if the type of the samples is not that of the volume.
    pub fn block(&self, first: [usize; 3], end: [usize; 3]) -> Result<Volume> {
        match self {
            OpenVolume::Whole(prepared) => prepared.volume().block(first, end),
            OpenVolume::Slabs(slabs, info) => block_of(info, first, end, slabs.read(first, end)?),
            OpenVolume::Blocks(blocks, info) => {
                block_of(info, first, end, blocks.read(first, end)?)
            }
        }
    }

    /// Bytes of samples that stay in memory as long as the volume is open.
    pub fn bytes_in_memory(&self) -> f64 {
        match self {
            OpenVolume::Slabs(..) | OpenVolume::Blocks(..) => 0.0,
            OpenVolume::Whole(prepared) => prepared.volume().samples().n_bytes() as f64,
        }
    }
}

/// A block of a volume from its samples.
fn block_of(
    info: &VolumeInfo,
    first: [usize; 3],
    end: [usize; 3],
    samples: Samples,
) -> Result<Volume> {
    let (name, found) = (&info.name, samples.type_name());
    if found != info.sample_type {
        let expected = &info.sample_type;
        return Err(Error::input(format!("{name}: {found}, expected {expected}")));
    }
    let VolumeInfo { dims, placement, range, outside, .. } = *info;
    let whole = WholeVolume { name, dims, placement, range, outside };
    Volume::block_of(&whole, first, end, samples)
}
