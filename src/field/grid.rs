//! The trilinear field in f32, including the layer around the volume. Twin: `shaders/grid.wgsl`.
//!
//! # Precision
//!
//! A position is split into its cell and the coordinates inside the cell (0 to 1 along each axis) before
//! interpolation, so the cubic along a ray is as accurate at (1000, 1000, 1000) as at the
//! origin, and only the position itself is rounded to f32. Samples of 8 and 16 bits and f32 samples
//! are used unchanged. 32-bit integers and f64 do not fit f32: they, and f32 samples whose
//! range is so wide or narrow that sums would leave the normal numbers, are mapped linearly to 0..1;
//! [`Field::isovalue`] maps isovalues in the same way.
//!
//! # Corners
//!
//! Corner `c` of a cell is at `cell + (c & 1, c >> 1 & 1, c >> 2 & 1)`.

use crate::volume::{Samples, Volume};
use glam::{IVec3, Vec3};
use std::sync::Arc;

/// How far a value along a step may leave the slab between start and isovalue, as a share of the range of the
/// volume: well above the rounding of one interpolation (about 4e-7), well below the value
/// difference of any step of a mesh.
const SLAB_TOLERANCE: f32 = 1e-5;

/// Values this near to the isovalue, as a share of the range of the volume, count as equal to it: four
/// roundings of a value as large as the range.
const VALUE_NOISE: f32 = 4.0 * f32::EPSILON;

/// Distance from a border plane of the volume at which slopes there are measured, voxels.
const BORDER_MARGIN: f32 = 1e-5;

/// f32 samples with a smaller range or a larger magnitude are mapped to 0..1: else ten times the range (in the layer around
/// the volume) or squares of differences would overflow or underflow.
const MIN_F32_RANGE: f64 = 1e-12;
const MAX_F32_MAGNITUDE: f64 = 1e12;

/// Samples whose range is a smaller share of their magnitude are mapped to 0..1: else an f32 between them would have fewer
/// than 17 significant bits of the range, and isovalues near each other would be equal.
const MIN_RANGE_SHARE: f64 = 1.0 / 128.0;

/// A trilinear field: a volume, the layer around it, and how values become f32. Shared by threads.
#[derive(Clone, Debug)]
pub struct Field {
    volume: Arc<Volume>,
    dims: IVec3,
    cell_size: Vec3,
    inverse_cell_size: Vec3,
    mapped: Option<Vec<f32>>,
    offset: f64,
    scale: f64,
    range: f32,
    outside: f32,
}

/// A point of the field: its cell, and its coordinates inside the cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellPoint {
    /// Index of the cell's lowest corner; -1 is the layer around the volume.
    pub cell: IVec3,
    /// Coordinates inside the cell, 0 to 1 along each axis.
    pub local: Vec3,
}

impl Field {
    /// The field of a volume. Allocates only if the samples must be mapped.
    pub fn new(volume: Arc<Volume>) -> Self {
        let (low, high) = volume.range();
        let magnitude = low.abs().max(high.abs());
        // high - low may overflow f64; halves do not.
        let half_range = high / 2.0 - low / 2.0;
        let is_mapped = match volume.samples() {
            Samples::U32(_) | Samples::I32(_) | Samples::F64(_) => true,
            Samples::F32(_) if high - low < MIN_F32_RANGE || magnitude > MAX_F32_MAGNITUDE => true,
            _ => half_range < 0.5 * MIN_RANGE_SHARE * magnitude,
        };
        let (offset, scale) = if is_mapped { (low, 0.5 / half_range) } else { (0.0, 1.0) };
        let mapped = is_mapped.then(|| {
            let samples = volume.samples();
            (0..samples.len()).map(|i| map(samples.get(i), offset, scale)).collect()
        });
        let outside_sign = if volume.outside_value() < low { -1.0 } else { 1.0 };
        let edge = if outside_sign < 0.0 { low } else { high };
        let range = if is_mapped { 1.0 } else { 2.0 * half_range };
        let outside = (f64::from(map(edge, offset, scale)) + outside_sign * 10.0 * range) as f32;
        let [nx, ny, nz] = volume.dims().map(|d| d as i32);
        let [sx, sy, sz] = volume.voxel_size();
        let cell_size = Vec3::new(sx as f32, sy as f32, sz as f32);
        let inverse_cell_size = Vec3::new((1.0 / sx) as f32, (1.0 / sy) as f32, (1.0 / sz) as f32);
        Field {
            dims: IVec3::new(nx, ny, nz),
            cell_size,
            inverse_cell_size,
            mapped,
            offset,
            scale,
            range: range as f32,
            outside,
            volume,
        }
    }

    /// The volume behind the field.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// Samples along x, y, z.
    pub fn dims(&self) -> IVec3 {
        self.dims
    }

    /// Size of a cell in the voxel frame; the smallest component is 1.
    pub fn cell_size(&self) -> Vec3 {
        self.cell_size
    }

    /// One over [`Field::cell_size`]: cells per voxel.
    pub fn inverse_cell_size(&self) -> Vec3 {
        self.inverse_cell_size
    }

    /// Largest value minus smallest value, without the layer around the volume.
    pub fn range(&self) -> f32 {
        self.range
    }

    /// Smaller differences from the isovalue count as none.
    pub fn value_noise(&self) -> f32 {
        VALUE_NOISE * self.range
    }

    /// How far values along a step may leave the slab between start and isovalue.
    pub fn slab_tolerance(&self) -> f32 {
        SLAB_TOLERANCE * self.range
    }

    /// Value of the layer around the volume.
    pub fn outside(&self) -> f32 {
        self.outside
    }

    /// The samples mapped to 0..1; `None` if the volume's own are used.
    pub fn mapped(&self) -> Option<&[f32]> {
        self.mapped.as_deref()
    }

    /// An isovalue of the volume as a value of this field.
    pub fn isovalue(&self, isovalue: f64) -> f32 {
        map(isovalue, self.offset, self.scale)
    }

    /// Change of the field's value per unit of the volume's value.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The values at the 8 corners of a cell; indices outside the volume give the layer around it.
    #[inline]
    pub fn corners(&self, cell: IVec3) -> [f32; 8] {
        // One match per cell takes 30 ns; 17 ns if the sample type is known at compile time,
        // 47 ns with a match per sample. A projected vertex takes 430 ns, so
        // kernels for each sample type would gain less than a tenth.
        match (self.volume.samples(), &self.mapped) {
            (_, Some(values)) => self.corners_of(values, cell, |v| v),
            (Samples::U8(values), _) => self.corners_of(values, cell, f32::from),
            (Samples::I8(values), _) => self.corners_of(values, cell, f32::from),
            (Samples::U16(values), _) => self.corners_of(values, cell, f32::from),
            (Samples::I16(values), _) => self.corners_of(values, cell, f32::from),
            (Samples::F32(values), _) => self.corners_of(values, cell, |v| v),
            (Samples::U32(_) | Samples::I32(_) | Samples::F64(_), None) => {
                unreachable!("`new` maps the types that do not fit f32")
            }
        }
    }

    #[inline]
    fn corners_of<T: Copy>(&self, values: &[T], cell: IVec3, to: impl Fn(T) -> f32) -> [f32; 8] {
        let (nx, ny) = (self.dims.x as usize, self.dims.y as usize);
        if cell.cmpge(IVec3::ZERO).all() && cell.cmplt(self.dims - 1).all() {
            let i = cell.x as usize + nx * (cell.y as usize + ny * cell.z as usize);
            let pair = |i: usize| (to(values[i]), to(values[i + 1]));
            let slice = nx * ny;
            let (a, b) = pair(i);
            let (c, d) = pair(i + nx);
            let (e, f) = pair(i + slice);
            let (g, h) = pair(i + nx + slice);
            return [a, b, c, d, e, f, g, h];
        }
        std::array::from_fn(|corner| {
            let at = cell + corner_offset(corner);
            if at.cmpge(IVec3::ZERO).all() && at.cmplt(self.dims).all() {
                to(values[at.x as usize + nx * (at.y as usize + ny * at.z as usize)])
            } else {
                self.outside
            }
        })
    }

    /// The cell of a position (voxel frame), and its coordinates there.
    #[inline]
    pub fn locate(&self, p: Vec3) -> CellPoint {
        let last = self.dims - 1;
        let x = (p * self.inverse_cell_size).clamp(Vec3::NEG_ONE, self.dims.as_vec3());
        let cell = floor(x).min(last);
        CellPoint { cell, local: x - cell.as_vec3() }
    }

    /// The field at a position of the voxel frame; beyond the layer around the volume, its value.
    pub fn value(&self, p: Vec3) -> f32 {
        let point = self.locate(p);
        interpolate(&self.corners(point.cell), point.local)
    }

    /// The upper corner of the volume, voxel frame.
    pub fn top(&self) -> Vec3 {
        (self.dims - 1).as_vec3() * self.cell_size
    }

    /// The length of the gradient, per voxel; at the border the one inside the volume, as the layer around it is much steeper.
    pub fn inner_slope(&self, p: Vec3) -> f32 {
        self.gradient(p.clamp(Vec3::splat(BORDER_MARGIN), self.top() - BORDER_MARGIN)).length()
    }

    /// The gradient at a position, per voxel, in the cell of the position: on
    /// a face between cells in the upper one.
    pub fn gradient(&self, p: Vec3) -> Vec3 {
        self.gradient_in(self.locate(p))
    }

    /// The value and the gradient at a position.
    pub(crate) fn value_and_gradient(&self, p: Vec3) -> (f32, Vec3) {
        let point = self.locate(p);
        let corners = self.corners(point.cell);
        let gradient = slope(&corners, point.local) * self.inverse_cell_size;
        (interpolate(&corners, point.local), gradient)
    }

    /// The gradient at a point of a given cell, per voxel. On a face the two neighbouring cells have different ones.
    pub fn gradient_in(&self, point: CellPoint) -> Vec3 {
        slope(&self.corners(point.cell), point.local) * self.inverse_cell_size
    }
}

/// A value of the volume as a value of the field.
#[inline]
fn map(value: f64, offset: f64, scale: f64) -> f32 {
    // Halves keep the difference finite for the widest f64 ranges, and are exact for samples that are not mapped.
    ((value / 2.0 - offset / 2.0) * scale * 2.0) as f32
}

/// The largest integers that are not above these numbers. Without SSE 4.1 `f32::floor` is a call of the C library.
#[inline]
pub(super) fn floor(x: Vec3) -> IVec3 {
    let nearest = x.as_ivec3();
    let is_above = x.cmplt(nearest.as_vec3());
    nearest.saturating_sub(IVec3::select(is_above, IVec3::ONE, IVec3::ZERO))
}

/// Offset of a corner from the cell's lowest corner.
#[inline]
fn corner_offset(corner: usize) -> IVec3 {
    IVec3::new((corner & 1) as i32, (corner >> 1 & 1) as i32, (corner >> 2 & 1) as i32)
}

/// Linear interpolation, exact at both ends.
#[inline]
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// The trilinear value inside a cell.
#[inline]
pub(super) fn interpolate(corners: &[f32; 8], local: Vec3) -> f32 {
    let low =
        mix(mix(corners[0], corners[1], local.x), mix(corners[2], corners[3], local.x), local.y);
    let high =
        mix(mix(corners[4], corners[5], local.x), mix(corners[6], corners[7], local.x), local.y);
    mix(low, high, local.z)
}

/// The trilinear gradient inside a cell, per cell.
#[inline]
pub(super) fn slope(corners: &[f32; 8], local: Vec3) -> Vec3 {
    let v = corners;
    let x = mix(
        mix(v[1] - v[0], v[3] - v[2], local.y),
        mix(v[5] - v[4], v[7] - v[6], local.y),
        local.z,
    );
    let y = mix(
        mix(v[2] - v[0], v[3] - v[1], local.x),
        mix(v[6] - v[4], v[7] - v[5], local.x),
        local.z,
    );
    let z = mix(
        mix(v[4] - v[0], v[5] - v[1], local.x),
        mix(v[6] - v[2], v[7] - v[3], local.x),
        local.y,
    );
    Vec3::new(x, y, z)
}
