//! The plan of a computation in bricks: the volume, the parameters and the bricks.
//!
//! # Invariants
//!
//! The hash covers the recipe: everything a part depends on, except the location of the volume, which may differ between machines,
//! and the backend.

use serde::{Deserialize, Serialize};

use super::blocks::{check_side, checksum, cut};
use super::source::{OpenVolume, VolumeSource};
use super::survey::Survey;
use crate::error::{Error, Result};
use crate::prepared::{Noise, Prepared};
use crate::spectrum::VolumeInfo;
use crate::sweep::Parameters;
use crate::topology::blocks::{BlockTopology, Owned, block_topology, with_halo};
use crate::volume::{Preparation, Volume};

/// Cells along the side of a brick by default.
pub const SIDE: usize = 128;

/// Version of the formats of plans and parts.
const VERSION: u32 = 1;

/// Most bricks of a plan: its file then takes about a hundred megabytes.
const MAX_BRICKS: usize = 1 << 20;

/// A block of samples that is swept on its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brick {
    /// Its first sample along x, y, z.
    pub first: [usize; 3],
    /// The sample after its last one; neighbouring bricks share a plane of samples.
    pub end: [usize; 3],
    /// CRC-32 of its samples, little endian, x fastest.
    pub crc32: u32,
}

impl Brick {
    /// Number of samples along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.end[a] - self.first[a])
    }
}

/// Everything that parts depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Version of the program: another version may compute different parts.
    pub program: String,
    /// The volume after its preparation.
    pub volume: VolumeInfo,
    /// Entries for the spectrum's metadata that describe the volume, its statistics included.
    pub(crate) metadata: serde_json::Map<String, serde_json::Value>,
    /// Preparation of the volume.
    pub preparation: Preparation,
    /// Removal of noise from the prepared volume.
    pub noise: Noise,
    /// Parameters of the sweep; the range is always set.
    pub parameters: Parameters,
    /// Requested number of cells along the side of a brick.
    pub side: usize,
    /// The bricks, x fastest.
    pub bricks: Vec<Brick>,
}

/// The plan of a computation in bricks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    version: u32,
    /// How to read the volume.
    pub source: VolumeSource,
    /// Everything that parts depend on.
    pub recipe: Recipe,
    hash: String,
}

impl Plan {
    /// Plans a computation in bricks of about `side` cells. `source` and `noise` are how the volume of `survey` was read and
    /// prepared.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for bricks smaller than 4 cells, too many bricks, parameters that contradict the volume, and an initial
    /// mesh; [`Error::Range`] for a start outside the range; those of reading the volume.
    pub fn new(
        source: VolumeSource,
        survey: &Survey,
        noise: Noise,
        parameters: &Parameters,
        side: usize,
    ) -> Result<Plan> {
        check_side(side)?;
        parameters.check_for_blocks()?;
        let info = survey.info();
        let parameters = parameters.within(info.range)?;
        let covered = parameters.range.unwrap_or(info.range);
        parameters.check_sampling(covered)?;
        let range = Some(covered);
        let blocks = cut(info.dims, side);
        if blocks.len() > MAX_BRICKS {
            let n = blocks.len();
            return Err(Error::Usage(format!("{n} bricks, expected at most {MAX_BRICKS}")));
        }
        let bricks = blocks.iter().zip(survey.checksums(&blocks)?);
        let recipe = Recipe {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            volume: info.clone(),
            metadata: survey.metadata(),
            preparation: survey.preparation(),
            noise,
            parameters: Parameters { range, ..parameters },
            side,
            bricks: bricks.map(|(&(first, end), crc32)| Brick { first, end, crc32 }).collect(),
        };
        Ok(Plan { version: VERSION, source, hash: recipe.hash()?, recipe })
    }

    /// Parses the file of a plan.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if it is no plan, has another version, or was changed.
    pub fn from_bytes(bytes: &[u8]) -> Result<Plan> {
        let unsupported = |what: String| Error::input(format!("unsupported plan version: {what}"));
        let plan: Plan = serde_json::from_slice(bytes).map_err(|e| unsupported(e.to_string()))?;
        let (found, own) = (plan.version, &plan.recipe.program);
        if found != VERSION || own != env!("CARGO_PKG_VERSION") {
            return Err(unsupported(format!(
                "version {found} of program {own}, expected {VERSION} of {}",
                env!("CARGO_PKG_VERSION")
            )));
        }
        if plan.hash != plan.recipe.hash()? {
            return Err(Error::input("the plan was changed since `plan` wrote it"));
        }
        let blocks = cut(plan.recipe.volume.dims, plan.recipe.side);
        if !blocks.into_iter().eq(plan.recipe.bricks.iter().map(|b| (b.first, b.end))) {
            return Err(Error::input("the plan's bricks do not match its volume"));
        }
        Ok(plan)
    }

    /// The bytes of its file.
    ///
    /// # Errors
    ///
    /// [`Error::Internal`] if it cannot be encoded as JSON.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let json = serde_json::to_vec_pretty(self).map_err(|e| Error::internal(e.to_string()));
        json.map(|mut bytes| {
            bytes.push(b'\n');
            bytes
        })
    }

    /// Hash of the recipe, 16 hexadecimal digits.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Opens the volume: by blocks of its file if that has plain samples and the volume needs no preparation, else it is read and
    /// prepared as a whole.
    ///
    /// # Errors
    ///
    /// Those of [`VolumeSource::read`] and [`Prepared::new`]; [`Error::Input`] if it is not the volume of the plan.
    pub fn open(&self) -> Result<OpenVolume> {
        let Recipe { preparation, noise, volume, .. } = &self.recipe;
        if preparation.is_none()
            && *noise == Noise::default()
            && let Some(opened) = OpenVolume::slabs(&self.source, volume)?
        {
            return Ok(opened);
        }
        let prepared = Prepared::new(self.source.read()?, preparation.clone(), *noise)?;
        if prepared.volume().info() != *volume {
            return Err(self.other_volume());
        }
        Ok(OpenVolume::Whole(prepared))
    }

    /// The samples of a brick, as a block of the volume.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if its samples are not those that the plan was made from.
    pub fn block(&self, volume: &OpenVolume, number: usize) -> Result<Volume> {
        let Brick { first, end, crc32 } = self.recipe.bricks[number];
        let block = volume.block(first, end)?;
        if checksum(&block) == crc32 { Ok(block) } else { Err(self.other_volume()) }
    }

    /// The box of samples that a part is computed from, first and one after the last: those of its brick, and one layer below it.
    pub fn required_samples(&self, number: usize) -> ([usize; 3], [usize; 3]) {
        let (brick, (first, end)) =
            (self.recipe.bricks[number], with_halo(self.owned(number), self.recipe.volume.dims));
        let start = [0, 1, 2].map(|a| first[a].min(brick.first[a]));
        (start, [0, 1, 2].map(|a| end[a].max(brick.end[a])))
    }

    /// A brick's contribution to the topology of the whole.
    ///
    /// # Errors
    ///
    /// Those of `block_topology`.
    pub fn topology(&self, volume: &OpenVolume, number: usize) -> Result<BlockTopology> {
        let owned = self.owned(number);
        let (first, end) = with_halo(owned, self.recipe.volume.dims);
        block_topology(&volume.block(first, end)?, owned)
    }

    /// The samples whose critical points a brick contributes: all of its samples except those on the upper planes that it shares.
    fn owned(&self, number: usize) -> Owned {
        let (Brick { first, end, .. }, dims) =
            (self.recipe.bricks[number], self.recipe.volume.dims);
        std::array::from_fn(|a| [first[a], if end[a] < dims[a] { end[a] - 1 } else { end[a] }])
    }

    fn other_volume(&self) -> Error {
        Error::input(format!(
            "{}: not the volume that the plan was made of, expected the same samples",
            self.recipe.volume.name
        ))
    }
}

impl Recipe {
    /// FNV-1a over the JSON. It detects accidental changes, not malicious ones.
    fn hash(&self) -> Result<String> {
        let json = serde_json::to_vec(self).map_err(|e| Error::internal(e.to_string()))?;
        let hash = json.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Ok(format!("{hash:016x}"))
    }
}
