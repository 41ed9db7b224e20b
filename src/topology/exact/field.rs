//! The exact field: levels, ramp and keys of the samples.

use super::isovalue::{IsovalueKeys, LevelScale};
use crate::error::{Error, Result};
use crate::volume::{Outside, Samples, Volume, with_samples};

/// Weights of the ramp along x, y, z: no exact zeros in 12,360 adversarial grids. Smaller weights
/// such as (1, 2, 4) have exact zeros in one of a hundred.
pub(super) const RAMP_WEIGHTS: [i64; 3] = [1, 37, 1009];

/// M is at least 2 to this power. The ramp moves body saddles by a few times 1 / M. With 2^40, on noise of 48^3 with few
/// grey levels, saddles moved by 5e-8 of a grey level, and one isovalue in a few hundred was between a saddle and its
/// moved position. 2^52 leaves 1e-11, and on 8-bit data products of keys still fit 128 bits.
const MIN_M_BITS: u32 = 52;

/// Smallest ratio of the distance between two levels to the ramp over the whole volume.
const MIN_LEVEL_TO_RAMP: i128 = 1_000_000;

/// Fractional bits of an order key: V units times 2^20.
pub const ORDER_BITS: u32 = 20;

/// Doublings of the search interval for an isovalue: from rounding to a level of floating point samples.
const MAX_DOUBLINGS: usize = 24;

/// Cells along each side of a brick, for which the smallest and the largest level are stored.
pub(crate) const BRICK: usize = 8;

/// Levels of the padded grid, x fastest.
enum Levels {
    /// Types up to 16 bit; the level ten ranges outside still fits.
    Narrow(Vec<i32>),
    /// 32 bit integers and floating point.
    Wide(Vec<i64>),
}

/// A volume with the layer around it as a generic integer field.
///
/// Vertices are the samples of the padded grid, numbered x fastest; positions are in the index
/// frame, so the layer is at -1 and at the volume's dimension.
pub struct ExactField<'a> {
    volume: &'a Volume,
    pub(super) dims: [usize; 3],
    levels: Levels,
    pub(super) scale: LevelScale,
    /// M = 2^m_bits.
    pub(super) m_bits: u32,
    /// The ramp's largest magnitude.
    ramp_range: i128,
    /// The position of the volume's first sample in the whole, if it is a block.
    first: [usize; 3],
    brick_dims: [usize; 3],
    /// Smallest and largest level of each brick of [`BRICK`]^3 cells, x fastest.
    bricks: Vec<(i64, i64)>,
}

impl<'a> ExactField<'a> {
    /// Builds the exact field of a volume. Reads every sample once.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the volume with its layer has 2^32 - 1 samples or more, the most that
    /// vertex ids can represent.
    pub fn new(volume: &'a Volume) -> Result<Self> {
        let dims = volume.dims().map(|d| d + 2);
        let n_vertices = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d));
        if n_vertices.is_none_or(|n| n >= u32::MAX as usize) {
            let [x, y, z] = volume.dims();
            return Err(Error::input(format!(
                "{}: {x}x{y}x{z} samples, expected fewer than 2^32 with the layer around them",
                volume.name()
            )));
        }
        let (low, high) = volume.range();
        let scale = if volume.samples().is_integer() {
            LevelScale::Identity
        } else {
            LevelScale::steps(low, power_of_two_from(high * 0.25 - low * 0.25))
        };
        let within = volume.block_position();
        let ramp_range = 1
            + (0..3).map(|a| RAMP_WEIGHTS[a] as i128 * (within.whole[a] as i128 + 1)).sum::<i128>();
        let m_bits = (128 - (ramp_range * MIN_LEVEL_TO_RAMP).leading_zeros()).max(MIN_M_BITS);
        let mut field = ExactField {
            volume,
            dims,
            levels: padded_levels(volume, dims, scale),
            scale,
            m_bits,
            ramp_range,
            first: within.first,
            brick_dims: dims.map(|d| (d - 1).div_ceil(BRICK)),
            bricks: Vec::new(),
        };
        field.bricks = field.brick_ranges();
        Ok(field)
    }

    /// The volume.
    pub fn volume(&self) -> &'a Volume {
        self.volume
    }

    /// Samples of the padded grid along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// How many vertices the padded grid has.
    pub fn n_vertices(&self) -> usize {
        self.dims[0] * self.dims[1] * self.dims[2]
    }

    /// Differences of vertex ids along x, y, z.
    #[inline]
    pub fn strides(&self) -> [u32; 3] {
        [1, self.dims[0] as u32, (self.dims[0] * self.dims[1]) as u32]
    }

    /// The vertex at a position of the index frame (-1 to the volume's dimension).
    #[inline]
    pub fn vertex(&self, position: [i64; 3]) -> u32 {
        let [i, j, k] = position.map(|p| (p + 1) as usize);
        (i + self.dims[0] * (j + self.dims[1] * k)) as u32
    }

    /// The position of a vertex in the index frame.
    #[inline]
    pub fn position(&self, vertex: u32) -> [i64; 3] {
        self.padded_position(vertex).map(|p| p as i64 - 1)
    }

    /// The position of a vertex in the index frame of the whole, if the volume is a block.
    pub(crate) fn whole_position(&self, vertex: u32) -> [f64; 3] {
        let p = self.position(vertex);
        std::array::from_fn(|a| (p[a] + self.first[a] as i64) as f64)
    }

    /// The position of a vertex in the padded grid, 0 to `dims() - 1`.
    #[inline]
    pub(super) fn padded_position(&self, vertex: u32) -> [u32; 3] {
        let [nx, ny] = [self.dims[0] as u32, self.dims[1] as u32];
        let row = vertex / nx;
        [vertex - row * nx, row % ny, row / ny]
    }

    /// The position of the volume's first sample in the whole, if it is a block; else 0, 0, 0.
    pub fn first(&self) -> [usize; 3] {
        self.first
    }

    /// Whether there is an isosurface at an isovalue of the range of the whole volume.
    pub fn has_surface(&self, isovalue: f64) -> bool {
        // Surfaces separate the layer from the highest, or from the lowest sample.
        match self.volume.outside() {
            Outside::Low => {
                self.isovalue_level(self.volume.range().1) > self.isovalue_level(isovalue)
            }
            Outside::High => {
                self.isovalue_level(self.volume.range().0) <= self.isovalue_level(isovalue)
            }
        }
    }

    /// Whether a vertex belongs to the layer around the volume.
    pub fn is_in_layer(&self, vertex: u32) -> bool {
        let p = self.padded_position(vertex);
        (0..3).any(|a| p[a] == 0 || p[a] as usize == self.dims[a] - 1)
    }

    /// The level of a vertex: its sample as an integer, without the ramp.
    #[inline]
    pub fn level(&self, vertex: u32) -> i64 {
        match &self.levels {
            Levels::Narrow(levels) => levels[vertex as usize] as i64,
            Levels::Wide(levels) => levels[vertex as usize],
        }
    }

    /// The levels at several offsets from a vertex.
    #[inline]
    pub(crate) fn levels_at<const N: usize>(&self, vertex: u32, offsets: [u32; N]) -> [i64; N] {
        match &self.levels {
            Levels::Narrow(levels) => offsets.map(|o| levels[(vertex + o) as usize] as i64),
            Levels::Wide(levels) => offsets.map(|o| levels[(vertex + o) as usize]),
        }
    }

    /// The key of a vertex: its value in V units, different from those of its neighbours.
    /// Distant vertices of the same level may share a key; ids break such ties.
    #[inline]
    pub fn key(&self, vertex: u32) -> i128 {
        ((self.level(vertex) as i128) << self.m_bits) + self.ramp(vertex) as i128
    }

    /// The level of the vertices whose keys are next to a key.
    pub(crate) fn level_of_key(&self, key: i128) -> i64 {
        (key >> self.m_bits) as i64 + 1
    }

    /// The ramp at a vertex, in V units; negative.
    #[inline]
    pub(super) fn ramp(&self, vertex: u32) -> i64 {
        let p = self.padded_position(vertex);
        -(1 + (0..3).map(|a| RAMP_WEIGHTS[a] * (p[a] as i64 + self.first[a] as i64)).sum::<i64>())
    }

    /// An isovalue in V units, rounded down, and never among the keys of one level: a vertex is
    /// inside (above the isovalue) iff its key is larger, iff its sample is larger. Monotone.
    pub fn isovalue_key(&self, isovalue: f64) -> i128 {
        self.isovalue_keys().key(isovalue)
    }

    /// The map of [`ExactField::isovalue_key`] on its own.
    pub fn isovalue_keys(&self) -> IsovalueKeys {
        IsovalueKeys { scale: self.scale, m_bits: self.m_bits, ramp_range: self.ramp_range }
    }

    /// The highest level that is not above an isovalue: a vertex is inside iff its level exceeds
    /// this one.
    pub fn isovalue_level(&self, isovalue: f64) -> i64 {
        self.scale.level(isovalue).floor() as i64
    }

    /// V units back to volume values without the ramp: exactly the sample for the key of a vertex
    /// of an integer volume, and within the ramp (10^-6 of a level) for any other key.
    pub fn value(&self, key: i128) -> f64 {
        let m = 1i128 << self.m_bits;
        let above = (key >> self.m_bits) + 1;
        if (above << self.m_bits) - key <= self.ramp_range {
            return self.scale.value(above as f64);
        }
        let fraction = (key & (m - 1)) as f64 / m as f64;
        self.scale.value((above - 1) as f64 + fraction)
    }

    /// The unperturbed sample of a vertex in volume values; in the layer
    /// [`Volume::outside_value`].
    #[inline]
    pub fn sample(&self, vertex: u32) -> f64 {
        let [i, j, k] = self.position(vertex);
        self.volume.padded(i, j, k)
    }

    /// The order key of a vertex: its key on the scale that saddles share (V units times
    /// 2^[`ORDER_BITS`]), by which events are sorted.
    #[inline]
    pub fn order_key(&self, vertex: u32) -> i128 {
        self.key(vertex) << ORDER_BITS
    }

    /// The eight vertex offsets of a cell, corner x + 2 y + 4 z.
    #[inline]
    pub fn cell_offsets(&self) -> [u32; 8] {
        let [sx, sy, sz] = self.strides();
        std::array::from_fn(|c| {
            let c = c as u32;
            (c & 1) * sx + (c >> 1 & 1) * sy + (c >> 2 & 1) * sz
        })
    }

    /// The keys of the eight corners (x + 2 y + 4 z) of the cell whose lowest corner is `corner`.
    pub fn cell_keys(&self, corner: u32) -> [i128; 8] {
        let levels = self.levels_at(corner, self.cell_offsets());
        self.add_ramp(corner, levels)
    }

    /// The keys of a cell with the given levels.
    pub(super) fn add_ramp(&self, corner: u32, levels: [i64; 8]) -> [i128; 8] {
        let ramp = self.ramp(corner);
        std::array::from_fn(|c| {
            let slope = (0..3).map(|a| RAMP_WEIGHTS[a] * (c as i64 >> a & 1)).sum::<i64>();
            ((levels[c] as i128) << self.m_bits) + (ramp - slope) as i128
        })
    }

    /// The least volume value, near `value`, whose isovalue key is at least `key`: so isovalues compare with it as their keys
    /// do with `key`.
    pub(super) fn first_isovalue(&self, value: f64, key: i128) -> f64 {
        let has_happened = |value: f64| self.isovalue_key(value) >= key;
        let (low, high) = self.volume.range();
        let unit = (self.scale.value(1.0) - self.scale.value(0.0)) / (1u64 << self.m_bits) as f64;
        let rounding = unit.max(f64::EPSILON * low.abs().max(high.abs()));
        // `value` is off by a few units of V or of the last place of the range. The bound on
        // doublings only matters where no isovalue has the key.
        let is_after = has_happened(value);
        if is_after && !has_happened(value.next_down()) {
            return value;
        }
        let (mut near, mut far) = (value, value);
        let mut step = if is_after { -rounding } else { rounding };
        for _ in 0..MAX_DOUBLINGS {
            near = far;
            far += step;
            if has_happened(far) != is_after {
                break;
            }
            step *= 2.0;
        }
        if has_happened(far) == is_after {
            return far;
        }
        let (mut before, mut after) = if is_after { (far, near) } else { (near, far) };
        loop {
            let middle = before + 0.5 * (after - before);
            if middle <= before || middle >= after {
                return after;
            }
            if has_happened(middle) {
                after = middle;
            } else {
                before = middle;
            }
        }
    }

    /// The isovalue from which on a vertex is below: its sample, or slightly less if samples are not whole levels. All that
    /// changes the isosurface at a sample changes it here.
    pub(crate) fn vertex_value(&self, vertex: u32) -> f64 {
        let sample = self.sample(vertex);
        match self.scale {
            LevelScale::Steps { .. } if !self.is_in_layer(vertex) => {
                self.first_isovalue(sample, self.key(vertex))
            }
            _ => sample,
        }
    }

    /// Bricks along x, y, z; each has [`BRICK`]^3 cells.
    pub(crate) fn brick_dims(&self) -> [usize; 3] {
        self.brick_dims
    }

    /// Whether cells of a brick (flat index, x fastest) can have samples on both sides of an
    /// isovalue's level.
    #[inline]
    pub(crate) fn is_brick_active(&self, brick: usize, isovalue_level: i64) -> bool {
        let (low, high) = self.bricks[brick];
        low <= isovalue_level && isovalue_level < high
    }

    /// Smallest and largest level of every brick, including the samples it shares with the next.
    fn brick_ranges(&self) -> Vec<(i64, i64)> {
        let [bx, by, bz] = self.brick_dims;
        let mut ranges = vec![(i64::MAX, i64::MIN); bx * by * bz];
        for k in 0..self.dims[2] {
            for j in 0..self.dims[1] {
                let row = self.dims[0] * (j + self.dims[1] * k);
                for x in 0..bx {
                    let first = row + x * BRICK;
                    let last = row + ((x + 1) * BRICK).min(self.dims[0] - 1);
                    let range = self.level_range(first, last);
                    for y in bricks_of(j, by) {
                        for z in bricks_of(k, bz) {
                            let r = &mut ranges[x + bx * (y + by * z)];
                            *r = (r.0.min(range.0), r.1.max(range.1));
                        }
                    }
                }
            }
        }
        ranges
    }

    /// Smallest and largest level of the vertices `first..=last`.
    fn level_range(&self, first: usize, last: usize) -> (i64, i64) {
        fn range<T: Copy + Into<i64>>(levels: &[T]) -> (i64, i64) {
            levels.iter().fold((i64::MAX, i64::MIN), |(low, high), &l| {
                let l = l.into();
                (low.min(l), high.max(l))
            })
        }
        match &self.levels {
            Levels::Narrow(levels) => range(&levels[first..=last]),
            Levels::Wide(levels) => range(&levels[first..=last]),
        }
    }
}

/// The least power of two that is not below a positive number. With steps that are powers of two, samples with few
/// digits, such as integers, have levels without rounding. Otherwise the middle between two events could differ from a
/// sample by rounding, where the sample's level and value disagree.
pub(in crate::topology) fn power_of_two_from(x: f64) -> f64 {
    let mut power = f64::from_bits((x.to_bits() >> 52).max(1) << 52);
    while power * 0.5 >= x && power * 0.5 > 0.0 {
        power *= 0.5;
    }
    if power < x { power * 2.0 } else { power }
}

/// The bricks along one axis that contain sample `p`: two if it is between bricks.
fn bricks_of(p: usize, n_bricks: usize) -> std::ops::RangeInclusive<usize> {
    let last = (p / BRICK).min(n_bricks - 1);
    let first = if p.is_multiple_of(BRICK) { last.saturating_sub(1) } else { last };
    first..=last
}

/// Levels of all samples with the layer around them.
fn padded_levels(volume: &Volume, dims: [usize; 3], scale: LevelScale) -> Levels {
    #[allow(clippy::unnecessary_cast, reason = "the macro serves every sample type")]
    match volume.samples() {
        Samples::U8(_) | Samples::I8(_) | Samples::U16(_) | Samples::I16(_) => {
            let outside = volume.outside_value() as i32;
            Levels::Narrow(
                with_samples!(volume.samples(), s => padded(s, dims, outside, |v| v as i32)),
            )
        }
        Samples::U32(_) | Samples::I32(_) => {
            let outside = volume.outside_value() as i64;
            Levels::Wide(
                with_samples!(volume.samples(), s => padded(s, dims, outside, |v| v as i64)),
            )
        }
        Samples::F32(_) | Samples::F64(_) => {
            let level = |v: f64| scale.level(v).floor() as i64;
            let outside = level(volume.outside_value());
            Levels::Wide(
                with_samples!(volume.samples(), s => padded(s, dims, outside, |v| level(v as f64))),
            )
        }
    }
}

/// The levels of `samples`, surrounded by `outside`, as a grid of `dims`.
fn padded<S: Copy, L: Copy>(
    samples: &[S],
    dims: [usize; 3],
    outside: L,
    level: impl Fn(S) -> L,
) -> Vec<L> {
    let [nx, ny, nz] = dims;
    let mut levels = vec![outside; nx * ny * nz];
    for (row, samples) in samples.chunks_exact(nx - 2).enumerate() {
        let (j, k) = (row % (ny - 2), row / (ny - 2));
        let first = 1 + nx * (j + 1 + ny * (k + 1));
        for (to, &from) in levels[first..first + nx - 2].iter_mut().zip(samples) {
            *to = level(from);
        }
    }
    levels
}
