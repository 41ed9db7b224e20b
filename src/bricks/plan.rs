//! The plan of a computation in bricks: what is computed, from what, in which parts.
//!
//! # Invariants
//!
//! The hash is over the recipe, which is all that a part depends on but where the volume lies and which backend computes: the same
//! samples may lie elsewhere on another machine.

use serde::{Deserialize, Serialize};

use super::{Opened, Source, Survey};
use crate::error::{Error, Result};
use crate::prepared::{Noise, Prepared};
use crate::spectrum::VolumeInfo;
use crate::sweep::Parameters;
use crate::topology::blocks::{BlockTopology, Owned, of_block, with_halo};
use crate::volume::{Preparation, Volume};

/// The version of plans and parts.
const VERSION: u32 = 1;

/// Fewest cells along the side of a brick: below it there is more border than inside.
const LEAST_SIDE: usize = 4;

/// Most bricks of a plan; a plan of so many is a hundred megabytes.
const MOST_BRICKS: usize = 1 << 20;

/// A block of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brick {
    /// Its first sample along x, y, z.
    pub first: [usize; 3],
    /// The sample behind its last one: bricks share the planes between them.
    pub end: [usize; 3],
    /// CRC-32 of its samples, little endian, x fastest.
    pub crc32: u32,
}

impl Brick {
    /// Its samples along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| self.end[a] - self.first[a])
    }
}

/// All that parts depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Version of the program: another may compute otherwise.
    pub program: String,
    /// The volume after what is done to it.
    pub volume: VolumeInfo,
    /// What the spectrum's parameters tell of it, what is known of its samples among it.
    pub(crate) told: serde_json::Map<String, serde_json::Value>,
    /// What is done to the volume that is read.
    pub preparation: Preparation,
    /// Which noise is taken out of it.
    pub noise: Noise,
    /// The parameters of the sweep, with a range.
    pub parameters: Parameters,
    /// Cells along the side of a brick that were asked for.
    pub side: usize,
    /// The bricks, x fastest.
    pub bricks: Vec<Brick>,
}

/// See the module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    version: u32,
    /// How to read the volume.
    pub source: Source,
    /// What is computed.
    pub recipe: Recipe,
    hash: String,
}

/// Blocks of samples: the first one of each, and the one behind its last.
pub type Blocks = Vec<([usize; 3], [usize; 3])>;

/// The blocks of a volume of `dims` samples: as many along an axis as come nearest to `side` cells, of sides that differ by
/// two cells at most; first samples and those behind the last, x fastest.
pub fn cut(dims: [usize; 3], side: usize) -> Blocks {
    let [x, y, z] = dims.map(|n| intervals(n.saturating_sub(1), side.max(1)));
    let (x, y) = (&x, &y);
    z.iter()
        .flat_map(|k| y.iter().flat_map(move |j| x.iter().map(move |i| [i, j, k])))
        .map(|axes| (axes.map(|a| a.0), axes.map(|a| a.1 + 1)))
        .collect()
}

/// Where cells are cut, two by two, as the sweep takes them.
fn intervals(n_cells: usize, side: usize) -> Vec<(usize, usize)> {
    let n = ((n_cells + side / 2) / side).clamp(1, n_cells.div_ceil(2).max(1));
    let at = |i: usize| {
        if i == n { n_cells } else { (i * n_cells / n).next_multiple_of(2).min(n_cells) }
    };
    (0..n).map(|i| (at(i), at(i + 1))).filter(|(a, b)| a < b).collect()
}

impl Plan {
    /// The plan for a volume that was read from a source, and prepared where it was read as a whole.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for bricks smaller than 4 cells, more of them than a plan may have, and parameters that contradict
    /// the volume or are none for bricks; those of reading the volume.
    pub fn new(
        source: Source,
        survey: &Survey,
        noise: Noise,
        parameters: &Parameters,
        side: usize,
    ) -> Result<Plan> {
        if side < LEAST_SIDE {
            return Err(Error::Usage(format!(
                "bricks of {side} cells, expected {LEAST_SIDE} or more along a side"
            )));
        }
        parameters.check_for_blocks()?;
        let info = survey.info();
        let parameters = parameters.within(info.range)?;
        let range = Some(parameters.range.unwrap_or(info.range));
        let blocks = cut(info.dims, side);
        if blocks.len() > MOST_BRICKS {
            let n = blocks.len();
            return Err(Error::Usage(format!("{n} bricks, expected at most {MOST_BRICKS}")));
        }
        let bricks = blocks.iter().zip(survey.checksums(&blocks)?);
        let recipe = Recipe {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            volume: info.clone(),
            told: survey.told(),
            preparation: survey.preparation(),
            noise,
            parameters: Parameters { range, ..parameters },
            side,
            bricks: bricks.map(|(&(first, end), crc32)| Brick { first, end, crc32 }).collect(),
        };
        Ok(Plan { version: VERSION, source, hash: recipe.hash()?, recipe })
    }

    /// A plan from its file.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for what is no plan, one of another version, or one that was changed.
    pub fn from_bytes(bytes: &[u8]) -> Result<Plan> {
        let no_plan = |what: String| Error::input(format!("no plan of this version: {what}"));
        let plan: Plan = serde_json::from_slice(bytes).map_err(|e| no_plan(e.to_string()))?;
        let (found, own) = (plan.version, &plan.recipe.program);
        if found != VERSION || own != env!("CARGO_PKG_VERSION") {
            return Err(no_plan(format!(
                "version {found} of program {own}, expected {VERSION} of {}",
                env!("CARGO_PKG_VERSION")
            )));
        }
        if plan.hash != plan.recipe.hash()? {
            return Err(Error::input("the plan was changed, expected one as `plan` wrote it"));
        }
        let blocks = cut(plan.recipe.volume.dims, plan.recipe.side);
        if !blocks.into_iter().eq(plan.recipe.bricks.iter().map(|b| (b.first, b.end))) {
            return Err(Error::input("the plan's bricks are not those of its volume"));
        }
        Ok(plan)
    }

    /// The plan as its file has it.
    ///
    /// # Errors
    ///
    /// [`Error::Internal`] if it cannot be written as JSON.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let json = serde_json::to_vec_pretty(self).map_err(|e| Error::internal(e.to_string()));
        json.map(|mut bytes| {
            bytes.push(b'\n');
            bytes
        })
    }

    /// The hash of the recipe, 16 hexadecimal digits.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// The volume as the plan wants it: in its file, where that has plain samples and nothing is done to them, else read and
    /// prepared.
    ///
    /// # Errors
    ///
    /// Those of [`Source::read`] and [`Prepared::new`]; [`Error::Input`] if it is another one than the plan was made of.
    pub fn open(&self) -> Result<Opened> {
        let Recipe { preparation, noise, volume, .. } = &self.recipe;
        if preparation.is_none()
            && *noise == Noise::default()
            && let Some(opened) = Opened::slabs(&self.source, volume)?
        {
            return Ok(opened);
        }
        let prepared = Prepared::new(self.source.read()?, preparation.clone(), *noise)?;
        if prepared.volume().info() != *volume {
            return Err(self.other_volume());
        }
        Ok(Opened::Whole(prepared))
    }

    /// The volume of a brick, cut from the whole.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if its samples are others than those of which the plan was made.
    pub fn block(&self, volume: &Opened, number: usize) -> Result<Volume> {
        let Brick { first, end, crc32 } = self.recipe.bricks[number];
        let block = volume.block(first, end)?;
        if checksum(&block) == crc32 { Ok(block) } else { Err(self.other_volume()) }
    }

    /// All samples that a part is made of, the first one and the one behind the last: a brick's own, and one more below it.
    pub fn needed(&self, number: usize) -> ([usize; 3], [usize; 3]) {
        let (brick, (first, end)) =
            (self.recipe.bricks[number], with_halo(self.owned(number), self.recipe.volume.dims));
        let least = [0, 1, 2].map(|a| first[a].min(brick.first[a]));
        (least, [0, 1, 2].map(|a| end[a].max(brick.end[a])))
    }

    /// What a brick tells of the topology of the whole.
    ///
    /// # Errors
    ///
    /// Those of [`of_block`].
    pub fn topology(&self, volume: &Opened, number: usize) -> Result<BlockTopology> {
        let owned = self.owned(number);
        let (first, end) = with_halo(owned, self.recipe.volume.dims);
        of_block(&volume.block(first, end)?, owned)
    }

    /// The samples that a brick owns in the sense of the topology: its own but the upper planes that it shares.
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
    /// FNV-1a over the JSON: it tells apart what was changed by mistake, not by design.
    fn hash(&self) -> Result<String> {
        let json = serde_json::to_vec(self).map_err(|e| Error::internal(e.to_string()))?;
        let hash = json.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Ok(format!("{hash:016x}"))
    }
}

pub(super) fn checksum(volume: &Volume) -> u32 {
    crc32fast::hash(&volume.samples().to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_cover_all_cells_once_and_share_their_planes() {
        for (dims, side) in
            [([41, 41, 41], 20), ([7, 200, 2], 8), ([129, 513, 1000], 128), ([2, 2, 2], 4)]
        {
            let blocks = cut(dims, side);
            let cells = |(first, end): &([usize; 3], [usize; 3])| -> usize {
                (0..3).map(|a| end[a] - 1 - first[a]).product()
            };
            let all: usize = dims.iter().map(|n| n - 1).product();
            assert_eq!(blocks.iter().map(cells).sum::<usize>(), all, "{dims:?}");
            for (first, end) in &blocks {
                for a in 0..3 {
                    assert!(first[a] == 0 || blocks.iter().any(|b| b.1[a] == first[a] + 1));
                    assert!(end[a] == dims[a] || blocks.iter().any(|b| b.0[a] + 1 == end[a]));
                }
            }
        }
        assert_eq!(cut([41; 3], 20).len(), 8);
        assert_eq!(cut([257; 3], super::super::SIDE).len(), 8);
    }
}
