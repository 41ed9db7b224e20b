//! Where the samples of a plan's volume come from.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::prepared::Prepared;
use crate::spectrum::VolumeInfo;
use crate::volume::{
    Outside, ReadOptions, Samples, Slabs, Volume, Whole, part_of_samples, phantom, read_volume,
};

/// How to read a volume again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Source {
    /// A file, or a folder of slices.
    File {
        /// Where it is.
        path: PathBuf,
        /// What is said about it.
        options: Box<ReadOptions>,
        /// Side of the layer around it.
        outside: Outside,
    },
    /// A built-in volume.
    Phantom {
        /// Its name, as `--phantom` has it.
        name: String,
        /// Side of the layer around it.
        outside: Outside,
    },
    /// Samples that were given, as an array in memory is: nobody can read them again, so its plan is for one run.
    Given {
        /// What it is called.
        name: String,
    },
}

impl Source {
    /// The volume.
    ///
    /// # Errors
    ///
    /// Those of [`read_volume`] and [`phantom()`].
    pub fn read(&self) -> Result<Volume> {
        match self {
            Source::File { path, options, outside } => {
                Ok(read_volume(path, options)?.with_outside(*outside))
            }
            Source::Phantom { name, outside } => Ok(phantom(name)?.with_outside(*outside)),
            Source::Given { name } => Err(Error::Usage(format!(
                "{name}: samples that were given, expected a file that can be read again"
            ))),
        }
    }

    /// Samples along x, y, z where the file is one that is read by blocks; no sample is looked at.
    ///
    /// # Errors
    ///
    /// Those of [`Slabs::of`].
    pub fn dims_in_file(&self) -> Result<Option<[usize; 3]>> {
        let Source::File { path, options, .. } = self else { return Ok(None) };
        Ok(Slabs::of(path, options)?.map(|slabs| slabs.dims()))
    }

    /// The file, where it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Source::File { path, .. } => Some(path),
            Source::Phantom { .. } | Source::Given { .. } => None,
        }
    }
}

/// What gives the samples of blocks of a volume: a chunked array, say.
pub trait ReadBlocks: Send + Sync + std::fmt::Debug {
    /// The samples from `first` up to, not including, `end`, along x, y, z, which are some of the volume; x fastest.
    ///
    /// # Errors
    ///
    /// Whatever keeps them from being read.
    fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples>;
}

/// Some of a volume's samples, of which blocks are given.
#[derive(Clone, Debug)]
pub struct Held {
    first: [usize; 3],
    end: [usize; 3],
    samples: Samples,
}

impl Held {
    /// The samples from `first` up to, not including, `end`, x fastest.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where there are more or fewer of them.
    pub fn new(first: [usize; 3], end: [usize; 3], samples: Samples) -> Result<Held> {
        let dims: [usize; 3] = std::array::from_fn(|a| end[a].saturating_sub(first[a]));
        let (n, expected) = (samples.len(), dims.iter().product::<usize>());
        if n != expected {
            return Err(Error::input(format!("{n} samples, expected {expected}")));
        }
        Ok(Held { first, end, samples })
    }
}

impl ReadBlocks for Held {
    fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<Samples> {
        let is_there =
            |a: usize| self.first[a] <= first[a] && first[a] <= end[a] && end[a] <= self.end[a];
        if !(0..3).all(is_there) {
            return Err(Error::internal(format!("samples {first:?} to {end:?} are not there")));
        }
        let own = |p: [usize; 3]| [0, 1, 2].map(|a| p[a] - self.first[a]);
        part_of_samples(&self.samples, own(self.end), own(first), own(end))
    }
}

/// A plan's volume, of which blocks are asked for.
#[derive(Clone, Debug)]
pub enum Opened {
    /// In memory, after all that is done to it.
    Whole(Prepared),
    /// In its file, plain: blocks are read one by one.
    Slabs(Slabs, VolumeInfo),
    /// Anywhere: blocks are asked for one by one.
    Blocks(Arc<dyn ReadBlocks>, VolumeInfo),
}

impl Opened {
    /// A volume in its file, as a plan describes it; none where it must be read as a whole.
    pub(super) fn slabs(source: &Source, info: &VolumeInfo) -> Result<Option<Opened>> {
        let Source::File { path, options, .. } = source else { return Ok(None) };
        let slabs = Slabs::of(path, options)?.filter(|slabs| slabs.dims() == info.dims);
        Ok(slabs.map(|slabs| Opened::Slabs(slabs, info.clone())))
    }

    /// The samples from `first` up to, not including, `end`, as a block of the volume.
    ///
    /// # Errors
    ///
    /// Those of [`Volume::block`] and [`Slabs::read`]; [`Error::Input`] for samples that the plan's volume does not have.
    pub fn block(&self, first: [usize; 3], end: [usize; 3]) -> Result<Volume> {
        match self {
            Opened::Whole(prepared) => prepared.volume().block(first, end),
            Opened::Slabs(slabs, info) => block_of(info, first, end, slabs.read(first, end)?),
            Opened::Blocks(blocks, info) => block_of(info, first, end, blocks.read(first, end)?),
        }
    }
}

/// A block of a volume of which no more is known.
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
    let whole = Whole { name, dims, placement, range, outside };
    Volume::block_of(&whole, first, end, samples)
}
