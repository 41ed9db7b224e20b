//! A mask: the samples of a volume that count. Surfaces end where it ends.
//!
//! # Theory
//!
//! A mask that is laid over a volume by making everything else low puts a wall of that height around what is inside, and
//! the wall is an isosurface like any other. Here the samples beside the mask, those of the cells that it ends in, stay what
//! they are: around its end the isosurface is the volume's own, and goes on for a cell. Only then samples fall, with the
//! distance, to the lowest there is (or the highest, as the layer around the volume), which closes the surface. So what lies
//! nearer to a sample outside the mask than to one inside can be told, and left out as caps are ([`Volume::is_masked_out`]).
//!
//! They fall over some voxels because a wall of stairs cannot be tracked: of nucleon, cut by a slanting plane, 22 % of the
//! area was tracked with a wall of one cell.
//!
//! # Invariants
//!
//! The samples inside are not changed, and no other is beyond their range: it is the volume's range. Memory: 2 bytes per
//! sample.

use std::io::{Read as _, Write as _};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::bufread::ZlibDecoder;
use flate2::write::ZlibEncoder;
use num_traits::AsPrimitive;
use serde::{Deserialize, Serialize};

use super::stream::DEFLATE_RATIO;
use super::{Outside, Samples, Space, Unit, Volume};
use crate::error::{Error, Result};
use crate::volume::with_samples;

/// Most letters that a mask may take in a spectrum, whose description has room for a MiB.
const MOST_LETTERS: usize = 768 << 10;

/// Samples of cells that a mask ends in lie so near to one inside: the diagonal of a cell.
const BESIDE: f64 = 1.7321;

/// So far from the mask all samples are those of the layer's side, in samples.
const FAR: usize = 6;

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

    /// Of each sample the square of the distance to the nearest one inside, in samples; [`FAR`]^2 where it is farther away.
    fn squared_distances(&self) -> Vec<u8> {
        let far = (FAR * FAR) as u8;
        let mut squares: Vec<u8> = self.inside.iter().map(|&i| if i { 0 } else { far }).collect();
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        // The square of a distance is the sum of those along the axes.
        for (stride, n) in strides.into_iter().zip(self.dims) {
            let before = squares.clone();
            for (i, square) in squares.iter_mut().enumerate().filter(|(_, square)| **square > 0) {
                let at = i / stride % n;
                for d in 1..FAR {
                    let along = (d * d) as u8;
                    if along >= *square {
                        break;
                    }
                    let down = (at >= d).then(|| before[i - d * stride]);
                    let up = (at + d < n).then(|| before[i + d * stride]);
                    let nearest = down.into_iter().chain(up).min().unwrap_or(far);
                    *square = (*square).min(along.saturating_add(nearest));
                }
            }
        }
        squares
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
        let squares = self.squared_distances();
        let is_low = volume.outside() == Outside::Low;
        let share = |square: u8| match f64::from(square).sqrt() {
            d if d <= BESIDE => 1.0,
            d => ((FAR as f64 - d) / (FAR as f64 - BESIDE)).max(0.0),
        };
        let shares: Vec<f64> = (0..=(FAR * FAR) as u8).map(share).collect();
        let samples = with_samples!(volume.samples(), all => {
            let inside = all.iter().zip(&self.inside).filter(|(_, inside)| **inside);
            let (low, high) = range_of(inside.map(|(&v, _)| v)).unwrap_or((all[0], all[0]));
            let masked = all.iter().zip(&squares).map(|(&v, &square)| {
                let v = if v < low { low } else if v > high { high } else { v };
                fallen(v, if is_low { low } else { high }, shares[usize::from(square)])
            });
            Samples::from(masked.collect::<Vec<_>>())
        });
        Ok(volume.with_samples(samples)?.with_mask(self))
    }
}

/// Smallest and largest of some numbers.
fn range_of<T: Copy + PartialOrd>(mut values: impl Iterator<Item = T>) -> Option<(T, T)> {
    let first = values.next()?;
    Some(values.fold((first, first), |(low, high), v| {
        (if v < low { v } else { low }, if v > high { v } else { high })
    }))
}

/// The sample that has a share of the way from an end of the range.
fn fallen<T: Copy + AsPrimitive<f64>>(sample: T, end: T, share: f64) -> T
where
    f64: AsPrimitive<T>,
{
    if share == 1.0 {
        return sample;
    }
    let (from, to): (f64, f64) = (end.as_(), sample.as_());
    (from + share * (to - from)).as_()
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
    fn samples_beside_the_mask_stay_within_the_range_of_those_inside_and_fall_off_farther_out() {
        let dims = [16, 3, 3];
        let given = volume(dims, (0..144).map(|i| (10 * (i % 16)) as u8).collect());
        let inside = (0..144).map(|i| u8::from((3..6).contains(&(i % 16)))).collect();
        let mask = Mask::of(&volume(dims, inside));
        let row = |outside| {
            let given = given.clone().with_outside(outside);
            let laid = mask.clone().laid_over(&given).expect("a volume");
            assert_eq!(laid.range(), (30.0, 50.0));
            assert!(laid.is_masked_out([2.4, 1.0, 1.0]) && !laid.is_masked_out([2.6, 1.0, 1.0]));
            (0..16).map(|x| laid.sample(x, 1, 1)).collect::<Vec<_>>()
        };
        let low = row(Outside::Low);
        assert_eq!(low[..7], [30.0, 30.0, 30.0, 30.0, 40.0, 50.0, 50.0]);
        assert!(low[6..12].windows(2).all(|w| w[0] > w[1]), "{low:?}");
        assert_eq!(low[11..], [30.0; 5]);
        let high = row(Outside::High);
        assert_eq!((high[2], high[3], high[4], high[15]), (30.0, 30.0, 40.0, 50.0));
        assert!(high[..3].windows(2).all(|w| w[0] > w[1]), "{high:?}");
    }

    #[test]
    fn distances_are_those_to_the_nearest_sample_inside() {
        let dims = [9, 8, 7];
        let mask = one_inside(dims, 2 + 9 * (3 + 8 * 5));
        for (i, square) in mask.squared_distances().into_iter().enumerate() {
            let [x, y, z] = [i % 9, i / 9 % 8, i / 72].map(|x| x as i64);
            let expected = (x - 2).pow(2) + (y - 3).pow(2) + (z - 5).pow(2);
            assert_eq!(i64::from(square), expected.min(36), "{x}, {y}, {z}");
        }
    }

    #[test]
    fn a_mask_that_lies_elsewhere_is_refused_where_both_say_where() {
        let at = |origin, space| {
            let placement = Placement { origin, space, unit: Unit::Mm, ..Placement::default() };
            let samples = Samples::U8((0..8).collect());
            Volume::new("v", [2; 3], samples, placement).expect("a volume")
        };
        let given = at([5.0, 6.0, 7.0], Space::Lps);
        assert!(Mask::check(&at([5.0, 6.3, 7.0], Space::Lps), &given).is_ok());
        assert!(Mask::check(&at([5.0, 6.6, 7.0], Space::Lps), &given).is_err());
        assert!(Mask::check(&at([0.0; 3], Space::Unknown), &given).is_ok());
        // RAS: x and y the other way round, and so are the axes of this one.
        let mut turned = *at([-5.0, -6.0, 7.0], Space::Ras).placement();
        turned.direction[0][0] = -1.0;
        turned.direction[1][1] = -1.0;
        let samples = Samples::U8((0..8).collect());
        let turned = Volume::new("v", [2; 3], samples, turned).expect("a volume");
        assert!(Mask::check(&turned, &given).is_ok());
        assert!(Mask::check(&at([-5.0, -6.0, 7.0], Space::Ras), &given).is_err());
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
