//! A mask: the samples of a volume that count. Surfaces end where it ends.
//!
//! # Theory
//!
//! A mask that is laid over a volume by making everything else low puts a wall of that height around what is inside, and
//! the wall is an isosurface like any other. Here the samples beside the mask, those of the cells that it ends in, stay what
//! they are: around its end the isosurface is the volume's own, and goes on for a cell. Only then all samples are the
//! lowest there is (or the highest, as the layer around the volume), which closes the surface. So what lies nearer to a
//! sample outside the mask than to one inside can be told, and left out as caps are ([`Volume::is_masked_out`]).
//!
//! # Invariants
//!
//! The samples inside are not changed, and no other is beyond their range: it is the volume's range.

use std::io::{Read as _, Write as _};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::bufread::ZlibDecoder;
use flate2::write::ZlibEncoder;
use serde::{Deserialize, Serialize};

use super::stream::DEFLATE_RATIO;
use super::{Samples, Space, Unit, Volume};
use crate::error::{Error, Result};
use crate::with_samples;

/// Most letters that a mask may take in a spectrum, whose description has room for a MiB.
const MOST_LETTERS: usize = 768 << 10;

/// Farthest that a corner of a mask may lie from that of its volume, where both say where they are, voxels.
const NEAR: f64 = 0.5;

/// Which samples of a grid are inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    name: String,
    dims: [usize; 3],
    /// x fastest.
    inside: Vec<bool>,
}

/// A mask as a spectrum records it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaskRecord {
    /// The file's name.
    pub name: String,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// How many samples are inside.
    pub inside: usize,
    /// A bit per sample, x fastest, the lowest bit of a byte first, each byte less (exclusive or) the one a plane of whole
    /// bytes before; deflated (zlib), in base64.
    bits: String,
}

impl Mask {
    /// The samples of a volume that are not zero.
    pub fn of(volume: &Volume) -> Mask {
        let n = volume.samples().len();
        let inside = (0..n).map(|i| volume.samples().get(i) != 0.0).collect();
        Mask { name: volume.name().to_owned(), dims: volume.dims(), inside }
    }

    /// What the mask is called: its file's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Samples along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// How many samples are inside.
    pub fn n_inside(&self) -> usize {
        self.inside.iter().filter(|&&inside| inside).count()
    }

    /// Whether a sample, by its place in x-fastest order, is inside.
    #[inline]
    pub fn is_inside(&self, sample: usize) -> bool {
        self.inside[sample]
    }

    /// Checks that a mask is one for a volume: as many samples, in the same place where both tell where they are.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where it is not.
    pub fn check(mask: &Volume, volume: &Volume) -> Result<()> {
        check_dims(mask.name(), mask.dims(), volume)?;
        let (own, other) = (mask.placement(), volume.placement());
        if [own, other].iter().any(|p| p.space == Space::Unknown || p.unit == Unit::Unknown) {
            return Ok(());
        }
        // Both in millimetres.
        let side = if own.space == other.space { 1.0 } else { -1.0 };
        let off = mask.corners().into_iter().zip(volume.corners()).map(|(p, q)| {
            let [x, y, z] = [side * p[0] - q[0], side * p[1] - q[1], p[2] - q[2]];
            (x * x + y * y + z * z).sqrt()
        });
        let off = off.fold(0.0, f64::max) / other.voxel();
        if off > NEAR {
            return Err(Error::input(format!(
                "{}: a mask that lies up to {off:.1} voxels elsewhere, expected one that lies where {} does",
                mask.name(),
                volume.name()
            )));
        }
        Ok(())
    }

    /// As a spectrum records it.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for one that takes more room than a spectrum's description has.
    pub fn record(&self) -> Result<MaskRecord> {
        let mut bytes: Vec<u8> = self.inside.chunks(8).map(byte_of).collect();
        let plane = (self.dims[0] * self.dims[1] / 8).max(1);
        for i in (plane..bytes.len()).rev() {
            bytes[i] ^= bytes[i - plane];
        }
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        let packed = encoder.write_all(&bytes).and_then(|()| encoder.finish());
        let bits = BASE64.encode(packed.map_err(|e| Error::internal(e.to_string()))?);
        if bits.len() > MOST_LETTERS {
            return Err(Error::input(format!(
                "{}: a mask that takes {} bytes to record, expected at most {MOST_LETTERS}: a smoother one, or a part (--crop)",
                self.name,
                bits.len()
            )));
        }
        Ok(MaskRecord { name: self.name.clone(), dims: self.dims, inside: self.n_inside(), bits })
    }

    /// A region of it.
    pub(super) fn cropped(&self, region: [[usize; 2]; 3]) -> Mask {
        let [nx, ny, _] = self.dims;
        let [x, y, z] = region;
        let rows = (z[0]..z[1]).flat_map(|k| (y[0]..y[1]).map(move |j| nx * (j + ny * k)));
        let inside = rows.flat_map(|row| &self.inside[row + x[0]..row + x[1]]).copied().collect();
        Mask { name: self.name.clone(), dims: region.map(|[first, end]| end - first), inside }
    }

    /// Blocks are inside where half of their samples are.
    pub(super) fn downsampled(&self, n: usize) -> Mask {
        let [nx, ny, _] = self.dims;
        let dims = self.dims.map(|d| d / n);
        let block = |i: usize| {
            let [x, y, z] = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let rows = (0..n * n).map(|r| x * n + nx * (y * n + r % n + ny * (z * n + r / n)));
            let n_inside: usize =
                rows.map(|row| self.inside[row..row + n].iter().filter(|&&i| i).count()).sum();
            2 * n_inside >= n * n * n
        };
        let inside = (0..dims.iter().product()).map(block).collect();
        Mask { name: self.name.clone(), dims, inside }
    }

    /// The samples that are inside, and those that share a cell with one.
    fn grown(&self) -> Vec<bool> {
        let mut inside = self.inside.clone();
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        for (stride, n) in strides.into_iter().zip(self.dims) {
            let before = inside.clone();
            for (i, inside) in inside.iter_mut().enumerate() {
                let at = i / stride % n;
                *inside |= at > 0 && before[i - stride] || at + 1 < n && before[i + stride];
            }
        }
        inside
    }

    /// The volume with the mask laid over it: see the module.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where no sample is inside, and those of [`Volume::new`] for what is left.
    pub(super) fn laid_over(self, volume: &Volume) -> Result<Volume> {
        if self.n_inside() == 0 {
            let (mask, volume) = (&self.name, volume.name());
            return Err(Error::input(format!("{mask}: no sample of {volume} is inside the mask")));
        }
        let grown = self.grown();
        let is_low = volume.outside() == super::Outside::Low;
        let samples = with_samples!(volume.samples(), all => {
            let mut inside = all.iter().zip(&self.inside).filter(|(_, inside)| **inside).map(|(&v, _)| v);
            let first = inside.next().unwrap_or(all[0]);
            let (mut low, mut high) = (first, first);
            for v in inside {
                low = if v < low { v } else { low };
                high = if v > high { v } else { high };
            }
            let masked = all.iter().zip(&grown).map(|(&v, &stays)| match stays {
                true if v < low => low,
                true if v > high => high,
                true => v,
                false if is_low => low,
                false => high,
            });
            Samples::from(masked.collect::<Vec<_>>())
        });
        Ok(volume.with_samples(samples)?.with_mask(self))
    }
}

impl MaskRecord {
    /// The mask for a volume.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] where it is damaged, or for other samples.
    pub fn mask(&self, volume: &Volume) -> Result<Mask> {
        check_dims(&self.name, self.dims, volume)?;
        let damaged = || Error::input(format!("the record of mask {} is damaged", self.name));
        let n: usize = self.dims.iter().product();
        let packed = BASE64.decode(&self.bits).map_err(|_| damaged())?;
        let n_bytes = n.div_ceil(8);
        if n_bytes as u64 > packed.len() as u64 * DEFLATE_RATIO {
            return Err(damaged());
        }
        let mut bytes = Vec::new();
        let decoder = ZlibDecoder::new(&packed[..]);
        decoder.take(n_bytes as u64 + 1).read_to_end(&mut bytes).map_err(|_| damaged())?;
        if bytes.len() != n_bytes {
            return Err(damaged());
        }
        let plane = (self.dims[0] * self.dims[1] / 8).max(1);
        for i in plane..bytes.len() {
            bytes[i] ^= bytes[i - plane];
        }
        let inside = (0..n).map(|i| bytes[i / 8] >> (i % 8) & 1 == 1).collect();
        let mask = Mask { name: self.name.clone(), dims: self.dims, inside };
        if mask.n_inside() == self.inside { Ok(mask) } else { Err(damaged()) }
    }
}

fn check_dims(name: &str, dims: [usize; 3], volume: &Volume) -> Result<()> {
    if dims == volume.dims() {
        return Ok(());
    }
    let told = |[x, y, z]: [usize; 3]| format!("{x}x{y}x{z}");
    let (found, expected) = (told(dims), told(volume.dims()));
    let volume = volume.name();
    Err(Error::input(format!(
        "{name}: a mask of {found} samples, expected {expected} as {volume} has"
    )))
}

/// Eight bits, the first the lowest.
fn byte_of(bits: &[bool]) -> u8 {
    bits.iter().rev().fold(0, |byte, &bit| byte << 1 | u8::from(bit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Outside, Placement};

    fn volume(dims: [usize; 3], samples: Vec<u8>) -> Volume {
        Volume::new("v", dims, Samples::U8(samples), Placement::default()).expect("a volume")
    }

    /// A grid with one sample that is not zero.
    fn one_inside(dims: [usize; 3], at: usize) -> Mask {
        let mut samples = vec![0; dims.iter().product()];
        samples[at] = 3;
        Mask::of(&volume(dims, samples))
    }

    #[test]
    fn a_record_is_the_mask() {
        let dims = [7, 5, 6];
        let bits = |i: usize| u8::from(i.wrapping_mul(2_654_435_761) >> 7 & 3 == 0);
        let given = volume(dims, (0..210).map(bits).collect());
        let mask = Mask::of(&given);
        let record = mask.record().expect("small");
        assert_eq!(record.mask(&given).expect("its own"), mask);
        let told = serde_json::to_string(&record).expect("JSON");
        assert_eq!(serde_json::from_str::<MaskRecord>(&told).expect("JSON"), record);
        // Damaged ones are errors, and take no memory that they have not earned.
        for wrong in [
            MaskRecord { inside: record.inside + 1, ..record.clone() },
            MaskRecord { bits: record.bits[4..].to_owned(), ..record.clone() },
            MaskRecord { bits: "?".to_owned(), ..record.clone() },
            MaskRecord { dims: [7, 5, 7], ..record.clone() },
        ] {
            assert!(matches!(wrong.mask(&given), Err(Error::Input(_))), "{wrong:?}");
        }
    }

    #[test]
    fn samples_beside_the_mask_stay_within_the_range_of_those_inside() {
        let dims = [9, 3, 3];
        let given = volume(dims, (0..81).map(|i| (10 * (i % 9)) as u8).collect());
        let mut inside = vec![0; 81];
        (0..81).filter(|i| (3..6).contains(&(i % 9))).for_each(|i| inside[i] = 1);
        let mask = Mask::of(&volume(dims, inside));
        let row = |outside| {
            let given = given.clone().with_outside(outside);
            let laid = mask.clone().laid_over(&given).expect("a volume");
            assert_eq!(laid.range(), (30.0, 50.0));
            (0..9).map(|x| laid.sample(x, 1, 1)).collect::<Vec<_>>()
        };
        assert_eq!(row(Outside::Low), [30.0, 30.0, 30.0, 30.0, 40.0, 50.0, 50.0, 30.0, 30.0]);
        assert_eq!(row(Outside::High), [50.0, 50.0, 30.0, 30.0, 40.0, 50.0, 50.0, 50.0, 50.0]);
    }

    #[test]
    fn regions_and_blocks_of_a_mask() {
        let mask = one_inside([6, 4, 4], 1 + 6 * (2 + 4 * 3));
        let part = mask.cropped([[1, 6], [2, 4], [2, 4]]);
        assert_eq!((part.dims(), part.n_inside()), ([5, 2, 2], 1));
        assert!(part.is_inside(5 * 2));
        assert_eq!(mask.downsampled(2).n_inside(), 0);
        let all = Mask { inside: vec![true; 96], ..mask };
        assert_eq!(all.downsampled(2).n_inside(), 12);
        let none = Mask { inside: vec![false; 12], dims: [3, 2, 2], ..all };
        assert!(none.laid_over(&volume([3, 2, 2], (0..12).collect())).is_err());
    }
}
