//! A survey of a volume: its description, its statistics and the checksums of its blocks. A plan is made from it.
//!
//! # Invariants
//!
//! A plan is the same whether its volume was read by slabs or as a whole.

use std::sync::Arc;

use super::blocks::{Blocks, checksum};
use super::source::{OpenVolume, ReadBlocks, VolumeSource};
use crate::error::{Error, Result};
use crate::prepared::Prepared;
use crate::spectrum::VolumeInfo;
use crate::volume::{
    Preparation, Samples, Slabs, Statistics, check_grid, check_range, with_samples,
};

/// A volume, its description and its statistics, from which a plan is made.
#[derive(Clone, Debug)]
pub struct Survey {
    volume: OpenVolume,
    info: VolumeInfo,
    samples: Statistics,
    /// CRC-32 of the samples of each block of the plan, if the caller has computed them.
    checksums: Option<Vec<u32>>,
}

impl Survey {
    /// Surveys a volume in memory.
    pub fn of(prepared: Prepared) -> Survey {
        let info = prepared.volume().info();
        Survey {
            samples: prepared.samples().clone(),
            info,
            volume: OpenVolume::Whole(prepared),
            checksums: None,
        }
    }

    /// Surveys a file slab by slab, for a volume that needs no preparation; `None` if its format requires reading it as a whole.
    ///
    /// # Errors
    ///
    /// Those of [`Slabs::of`], [`Slabs::range`].
    pub fn of_file(source: &VolumeSource) -> Result<Option<Survey>> {
        let VolumeSource::File { path, options, outside } = source else { return Ok(None) };
        let Some(slabs) = Slabs::of(path, options)? else { return Ok(None) };
        let range = slabs.range()?;
        let samples = slabs.statistics(range)?;
        let info = VolumeInfo {
            name: slabs.name().to_owned(),
            dims: slabs.dims(),
            sample_type: slabs.type_name(),
            range,
            placement: *slabs.placement(),
            outside: *outside,
        };
        let volume = OpenVolume::Slabs(slabs, info.clone());
        Ok(Some(Survey { volume, info, samples, checksums: None }))
    }

    /// A survey by the caller of a volume that is read by `blocks`: `samples` counts each sample once, and `checksums` holds the CRC-32
    /// of the samples, little endian, x fastest, of every block of the plan ([`cut`](super::cut)).
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for invalid dimensions, placement or range.
    pub fn of_blocks(
        info: VolumeInfo,
        samples: Statistics,
        checksums: Vec<u32>,
        blocks: Arc<dyn ReadBlocks>,
    ) -> Result<Survey> {
        check_grid(&info.name, info.dims, &info.placement)?;
        check_range(&info.name, info.range)?;
        let volume = OpenVolume::Blocks(blocks, info.clone());
        Ok(Survey { volume, info, samples, checksums: Some(checksums) })
    }

    /// Description of the volume, as a spectrum keeps it.
    pub fn info(&self) -> &VolumeInfo {
        &self.info
    }

    /// Statistics of the samples, to which percentiles and sigmas refer.
    pub fn samples(&self) -> &Statistics {
        &self.samples
    }

    /// The volume.
    pub fn volume(&self) -> &OpenVolume {
        &self.volume
    }

    pub(super) fn preparation(&self) -> Preparation {
        match &self.volume {
            OpenVolume::Whole(prepared) => prepared.preparation().clone(),
            OpenVolume::Slabs(..) | OpenVolume::Blocks(..) => Preparation::default(),
        }
    }

    /// Entries for the spectrum's metadata that describe the volume.
    pub(super) fn metadata(&self) -> serde_json::Map<String, serde_json::Value> {
        match &self.volume {
            OpenVolume::Whole(prepared) => prepared.metadata(),
            OpenVolume::Slabs(..) | OpenVolume::Blocks(..) => {
                let samples = serde_json::json!(self.samples);
                [(Statistics::NAME.to_owned(), samples)].into_iter().collect()
            }
        }
    }

    /// CRC-32 of the samples of each block.
    ///
    /// # Errors
    ///
    /// As [`OpenVolume::block`], [`Slabs::each`].
    pub(super) fn checksums(&self, blocks: &Blocks) -> Result<Vec<u32>> {
        if let Some(known) = &self.checksums {
            if known.len() != blocks.len() {
                let (n, expected) = (known.len(), blocks.len());
                let what = format!("checksums of {n} blocks, expected {expected}");
                return Err(Error::Usage(what));
            }
            return Ok(known.clone());
        }
        match &self.volume {
            OpenVolume::Whole(_) | OpenVolume::Blocks(..) => {
                let block = |&(first, end): &_| Ok(checksum(&self.volume.block(first, end)?));
                blocks.iter().map(block).collect()
            }
            OpenVolume::Slabs(slabs, _) => {
                let [nx, ny, _] = slabs.dims();
                let mut hashers = vec![crc32fast::Hasher::new(); blocks.len()];
                slabs.for_each(|z, samples| {
                    hash_planes(samples, [nx, ny], z, blocks, &mut hashers);
                    Ok(())
                })?;
                Ok(hashers.into_iter().map(crc32fast::Hasher::finalize).collect())
            }
        }
    }
}

/// Adds the samples of planes of `nx` by `ny` samples, the first of which is `z`, to the checksums of the blocks that contain them.
fn hash_planes(
    samples: &Samples,
    [nx, ny]: [usize; 2],
    z: usize,
    blocks: &Blocks,
    hashers: &mut [crc32fast::Hasher],
) {
    let end_z = z + samples.len() / (nx * ny);
    for ((first, end), hasher) in blocks.iter().zip(hashers) {
        for k in first[2].max(z)..end[2].min(end_z) {
            for j in first[1]..end[1] {
                let row = nx * (j + ny * (k - z));
                with_samples!(samples, s => {
                    let row = &s[row + first[0]..row + end[0]];
                    let bytes: Vec<u8> = row.iter().flat_map(|v| v.to_le_bytes()).collect();
                    hasher.update(&bytes);
                });
            }
        }
    }
}
