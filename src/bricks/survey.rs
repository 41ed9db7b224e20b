//! What a plan is made of: a volume, and what is known of its samples.
//!
//! # Invariants
//!
//! A plan is the same whether its volume was read by slabs or as a whole.

use std::sync::Arc;

use super::plan::{Blocks, checksum};
use super::{Opened, ReadBlocks, Source};
use crate::error::{Error, Result};
use crate::prepared::Prepared;
use crate::spectrum::VolumeInfo;
use crate::volume::{
    Preparation, Samples, Slabs, Statistics, check_grid, check_range, with_samples,
};

/// See the module.
#[derive(Clone, Debug)]
pub struct Survey {
    opened: Opened,
    info: VolumeInfo,
    samples: Statistics,
    /// CRC-32 of the samples of the blocks of a plan, where somebody has looked already.
    checksums: Option<Vec<u32>>,
}

impl Survey {
    /// Of a volume that was read and prepared.
    pub fn of(prepared: Prepared) -> Survey {
        let info = prepared.volume().info();
        Survey {
            samples: prepared.samples().clone(),
            info,
            opened: Opened::Whole(prepared),
            checksums: None,
        }
    }

    /// Of a volume in a file to which nothing is done, slab by slab; none where it must be read as a whole.
    ///
    /// # Errors
    ///
    /// Those of [`Slabs::of`], [`Slabs::range`].
    pub fn of_file(source: &Source) -> Result<Option<Survey>> {
        let Source::File { path, options, outside } = source else { return Ok(None) };
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
        let opened = Opened::Slabs(slabs, info.clone());
        Ok(Some(Survey { opened, info, samples, checksums: None }))
    }

    /// Of a volume whose blocks somebody else has looked at: its range and the statistics of all samples, each counted once, and
    /// CRC-32 of the samples, little endian, x fastest, of every block that a plan will have ([`cut`](super::cut)).
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for what is no volume.
    pub fn of_blocks(
        info: VolumeInfo,
        samples: Statistics,
        checksums: Vec<u32>,
        blocks: Arc<dyn ReadBlocks>,
    ) -> Result<Survey> {
        check_grid(&info.name, info.dims, &info.placement)?;
        check_range(&info.name, info.range)?;
        let opened = Opened::Blocks(blocks, info.clone());
        Ok(Survey { opened, info, samples, checksums: Some(checksums) })
    }

    /// What a spectrum keeps of the volume.
    pub fn info(&self) -> &VolumeInfo {
        &self.info
    }

    /// What is known of its samples: what isovalues are written by.
    pub fn samples(&self) -> &Statistics {
        &self.samples
    }

    /// The volume, of which blocks are asked for.
    pub fn opened(&self) -> &Opened {
        &self.opened
    }

    pub(super) fn preparation(&self) -> Preparation {
        match &self.opened {
            Opened::Whole(prepared) => prepared.preparation().clone(),
            Opened::Slabs(..) | Opened::Blocks(..) => Preparation::default(),
        }
    }

    /// What a spectrum's parameters tell of the volume.
    pub(super) fn told(&self) -> serde_json::Map<String, serde_json::Value> {
        match &self.opened {
            Opened::Whole(prepared) => prepared.told(),
            Opened::Slabs(..) | Opened::Blocks(..) => {
                let told = serde_json::json!(self.samples);
                [(Statistics::NAME.to_owned(), told)].into_iter().collect()
            }
        }
    }

    /// CRC-32 of the samples of blocks.
    ///
    /// # Errors
    ///
    /// As [`Opened::block`], [`Slabs::each`].
    pub(super) fn checksums(&self, blocks: &Blocks) -> Result<Vec<u32>> {
        if let Some(known) = &self.checksums {
            if known.len() != blocks.len() {
                let (n, expected) = (known.len(), blocks.len());
                let what = format!("checksums of {n} blocks, expected {expected}");
                return Err(Error::Usage(what));
            }
            return Ok(known.clone());
        }
        match &self.opened {
            Opened::Blocks(..) => {
                let block = |&(first, end): &_| Ok(checksum(&self.opened.block(first, end)?));
                blocks.iter().map(block).collect()
            }
            Opened::Whole(prepared) => {
                let volume = prepared.volume();
                let block = |&(first, end): &_| Ok(checksum(&volume.block(first, end)?));
                blocks.iter().map(block).collect()
            }
            Opened::Slabs(slabs, _) => {
                let [nx, ny, _] = slabs.dims();
                let mut hashers = vec![crc32fast::Hasher::new(); blocks.len()];
                slabs.each(|z, samples| {
                    hash_planes(samples, ([nx, ny], z), blocks, &mut hashers);
                    Ok(())
                })?;
                Ok(hashers.into_iter().map(crc32fast::Hasher::finalize).collect())
            }
        }
    }
}

/// Gives each block what it has of some planes, which begin at `z`.
fn hash_planes(
    samples: &Samples,
    ([nx, ny], z): ([usize; 2], usize),
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
