//! All critical points of the trilinear field of a volume with the layer around it.
//!
//! # Theory
//!
//! On the generic field of [`exact`](super::exact) a critical point is one of
//! - a sample, typed by which of its 6 lattice neighbours lie below it: those neighbours are the
//!   corners of an octahedron on which the field has exactly the sign pattern of a small sphere
//!   around the sample. None below: minimum; all: maximum; one opposite pair below (or above) and
//!   nothing else: saddle of index 1 (or 2); anything else is regular;
//! - a saddle of the bilinear field on a lattice face, if the field of both cells rises away from
//!   the face there (index 1) or falls (index 2);
//! - a saddle inside a cell, at most one of each index.
//!
//! Each has samples in the regions that meet in it, its *sectors*; the sweeps need no more. In a
//! face they are the corners of the low and the high diagonal. Inside a cell:
//! the field is constant along the three axis-parallel lines through the saddle, so on the plane
//! z = z0 through it the four quadrants have constant signs, those of f_xy (x - x0) (y - y0),
//! with f_xy = e + h z0 = s sqrt(D) / G in the words of `exact::body`. Each quadrant ends on a
//! lattice edge along z. The end of that edge with the larger distance from the saddle value is in
//! the region of the quadrant. Opposite quadrants are in opposite regions.
//!
//! # The layer
//!
//! The layer counts as one point: with its border collapsed the padded volume is a 3-sphere. This
//! is exact. Every sample of the layer is below every sample of the volume ([`Outside::High`]: above;
//! the same for -f), and the field on the layer is affine, so in a cell with corners in it
//! - a side cell (4 layer corners) rises strictly along the line away from the layer;
//! - in a cell at an edge (6) the field on a slice across the edge is L + a y + b z + e yz with
//!   e > 0, whose only critical value is L - ab / e with a, b < 0: below L, in the layer's range;
//! - a corner cell (7): L + ax + by + cz + hxyz has the critical value L + by + cz, also
//!   below L; the same for faces with three layer corners, and other faces have no saddle.
//!
//! So above the highest sample of the layer no critical point touches it, and only samples, faces
//! and cells of the volume itself are visited.
//!
//! [`Outside::High`]: crate::volume::Outside::High

use num_bigint::{BigInt, Sign};
use rayon::prelude::*;

use super::exact::{BodySaddle, ExactField, FaceSaddle, ORDER_BITS};
use crate::error::{Error, Result};
use crate::volume::Outside;

/// The sample that represents the whole layer around the volume.
pub const LAYER: u32 = 0;

/// The grid element that contains a critical point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum GridElement {
    /// A sample of the padded grid.
    Vertex(u32),
    /// The lattice face normal to `axis` whose lowest sample is `corner`.
    Face {
        /// Lowest sample of the face.
        corner: u32,
        /// Axis the face is normal to.
        axis: u8,
    },
    /// The cell whose lowest sample is given.
    Cell(u32),
    /// The layer around the volume.
    Layer,
}

/// A critical point of the trilinear field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CriticalPoint {
    /// GridElement in the order of the generic field: it has happened at an isovalue with key `k` iff
    /// `key <= k << ORDER_BITS`.
    pub key: i128,
    /// Its value in units of the volume, without the ramp.
    pub isovalue: f64,
    /// Its position, voxel frame of the whole volume that this one is a block of.
    pub position: [f64; 3],
    /// Number of falling directions: 0 minimum, 1 and 2 saddles, 3 maximum.
    pub index: u8,
    /// The grid element that contains it.
    pub element: GridElement,
    /// Samples below it, one in each of the regions that meet there; equal if there is one
    /// region; the sample itself at a minimum.
    pub low: [u32; 2],
    /// Samples above it, in the same way; the sample itself at a maximum.
    pub high: [u32; 2],
}

/// The critical points of a volume with its layer, ascending, and a falling and a rising
/// lattice neighbour of every sample.
#[derive(Debug)]
pub(super) struct CriticalPoints {
    pub(super) points: Vec<CriticalPoint>,
    /// Per sample of the padded grid: its lowest neighbour; itself at a minimum.
    pub(super) falling: Vec<u32>,
    /// Per sample of the padded grid: its highest neighbour; itself at a maximum.
    pub(super) rising: Vec<u32>,
}

impl CriticalPoints {
    /// Finds all critical points. Order and content do not depend on the number of threads.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the volume has 2^31 samples or more with its layer.
    pub(super) fn find(field: &ExactField<'_>) -> Result<Self> {
        let (mut points, mut falling, mut rising) = Self::unordered(field)?;
        points.push(layer(field));
        sort_exactly(&mut points, |run| {
            Ok(run.iter().map(|p| precise_value(Some(field), p)).collect())
        })?;
        // A walk that starts in the layer continues in the volume.
        let first = field.vertex([0; 3]);
        match field.volume().outside() {
            Outside::Low => rising[LAYER as usize] = first,
            Outside::High => falling[LAYER as usize] = first,
        }
        Ok(CriticalPoints { points, falling, rising })
    }

    /// The critical points without the layer, in no particular order, with a falling and a rising neighbour of every sample
    /// of the padded grid.
    pub(super) fn unordered(
        field: &ExactField<'_>,
    ) -> Result<(Vec<CriticalPoint>, Vec<u32>, Vec<u32>)> {
        let n = field.n_vertices();
        if n >= 1 << 31 {
            return Err(Error::input(format!(
                "{}: {n} samples with the layer around them, expected fewer than 2^31 for the topology",
                field.volume().name()
            )));
        }
        let plane = field.dims()[0] * field.dims()[1];
        let mut falling = vec![LAYER; n];
        let mut rising = vec![LAYER; n];
        let slabs: Vec<Vec<CriticalPoint>> = falling
            .par_chunks_mut(plane)
            .zip(rising.par_chunks_mut(plane))
            .enumerate()
            .map(|(z, (falling, rising))| {
                let mut slab = PointSlab { field, z, points: Vec::new() };
                if z > 0 && z + 1 < field.dims()[2] {
                    slab.visit_samples(falling, rising);
                    slab.visit_faces();
                    slab.visit_cells();
                }
                slab.points
            })
            .collect();
        let mut points = Vec::with_capacity(1 + slabs.iter().map(Vec::len).sum::<usize>());
        points.extend(slabs.into_iter().flatten());
        Ok((points, falling, rising))
    }
}

/// Sorts all critical points of a volume. `precise` returns the exact values of points with the same key.
///
/// # Errors
///
/// Those of `precise`.
pub(super) fn sort_exactly(
    points: &mut [CriticalPoint],
    precise: impl Fn(&[CriticalPoint]) -> Result<Vec<BigInt>> + Sync,
) -> Result<()> {
    // Grid elements and indices make the order total.
    points.par_sort_unstable_by_key(|p| (p.key, p.element, p.index));
    sort_ties(points, precise)?;
    // Values are rounded, their order is exact: make values ascend with it.
    let mut highest = f64::NEG_INFINITY;
    for p in points {
        highest = highest.max(p.isovalue);
        p.isovalue = highest;
    }
    Ok(())
}

/// The layer as one critical point: the lowest minimum, or the highest maximum. Its key is that of
/// the layer's sample nearest to the range of the volume.
pub(super) fn layer(field: &ExactField<'_>) -> CriticalPoint {
    let inside = field.vertex([0; 3]);
    let last = field.n_vertices() as u32 - 1;
    let (index, low, high, sample) = match field.volume().outside() {
        Outside::Low => (0, LAYER, inside, 0),
        Outside::High => (3, inside, LAYER, last),
    };
    CriticalPoint {
        key: field.order_key(sample),
        isovalue: field.volume().outside_value(),
        position: in_voxels(field, [-1.0; 3]),
        index,
        element: GridElement::Layer,
        low: [low; 2],
        high: [high; 2],
    }
}

/// From the index frame to the voxel frame.
fn in_voxels(field: &ExactField<'_>, position: [f64; 3]) -> [f64; 3] {
    let size = field.volume().voxel_size();
    std::array::from_fn(|a| position[a] * size[a])
}

/// The samples of one z of the padded grid, with the faces and cells whose lowest sample they are.
struct PointSlab<'a> {
    field: &'a ExactField<'a>,
    z: usize,
    points: Vec<CriticalPoint>,
}

impl PointSlab<'_> {
    /// The range of y with samples of the volume.
    fn rows(&self) -> std::ops::Range<usize> {
        1..self.field.dims()[1] - 1
    }

    /// Calls `visit` for every sample of the volume in this slab.
    fn for_each_sample(&self, mut visit: impl FnMut(u32)) {
        let [nx, ny, _] = self.field.dims();
        for y in self.rows() {
            let row = (nx * (y + ny * self.z)) as u32;
            for x in 1..nx as u32 - 1 {
                visit(row + x);
            }
        }
    }

    fn visit_samples(&mut self, falling: &mut [u32], rising: &mut [u32]) {
        let field = self.field;
        let first = (field.dims()[0] * field.dims()[1] * self.z) as u32;
        let mut found = Vec::new();
        self.for_each_sample(|v| {
            let star = Star::around(field, v);
            falling[(v - first) as usize] = star.lowest;
            rising[(v - first) as usize] = star.highest;
            found.extend(star.critical_point(field, v));
        });
        self.points.append(&mut found);
    }

    fn visit_faces(&mut self) {
        let field = self.field;
        let [nx, ny, nz] = field.dims();
        let strides = field.strides();
        let mut found = Vec::new();
        for y in self.rows() {
            let row = (nx * (y + ny * self.z)) as u32;
            for axis in 0..3 {
                // Faces whose four corners are samples of the volume.
                let fits = |a: usize, p: usize, n: usize| a == axis || p + 2 < n;
                if !fits(1, y, ny) || !fits(2, self.z, nz) {
                    continue;
                }
                let end = if axis == 0 { nx - 1 } else { nx - 2 } as u32;
                assert_eq!(strides[0], 1);
                for corner in row + 1..row + end {
                    if let Some(saddle) = field.face_saddle(corner, axis) {
                        found.extend(face_point(field, &saddle));
                    }
                }
            }
        }
        self.points.append(&mut found);
    }

    fn visit_cells(&mut self) {
        let field = self.field;
        let [nx, ny, nz] = field.dims();
        if self.z + 2 >= nz {
            return;
        }
        for y in 1..ny - 2 {
            let row = (nx * (y + ny * self.z)) as u32;
            for corner in row + 1..row + nx as u32 - 2 {
                for saddle in field.body_saddles(corner) {
                    self.points.push(body_point(field, &saddle));
                }
            }
        }
    }
}

/// A sample among its lattice neighbours.
struct Star {
    /// Bit 2 a + s: the neighbour along axis a (s = 0 towards lower, 1 towards higher
    /// coordinates) is below the sample.
    below: u8,
    neighbours: [u32; 6],
    /// The lowest neighbour below the sample, and the highest above; the sample itself if there is none.
    lowest: u32,
    highest: u32,
}

impl Star {
    #[inline]
    fn around(field: &ExactField<'_>, v: u32) -> Self {
        let level = field.level(v);
        let [sx, sy, sz] = field.strides();
        let neighbours = [v - sx, v + sx, v - sy, v + sy, v - sz, v + sz];
        let mut below = 0;
        let (mut lowest, mut highest) = (v, v);
        let (mut low, mut high) = (i64::MAX, i64::MIN);
        for (n, &neighbour) in neighbours.iter().enumerate() {
            let l = field.level(neighbour);
            // The ramp falls along every axis: of equal samples the one with the higher coordinate is below.
            if l < level || (l == level && n & 1 == 1) {
                below |= 1 << n;
                if l < low {
                    (low, lowest) = (l, neighbour);
                }
            } else if l > high {
                (high, highest) = (l, neighbour);
            }
        }
        // The layer counts as one sample.
        if lowest != v && field.is_in_layer(lowest) {
            lowest = LAYER;
        }
        if highest != v && field.is_in_layer(highest) {
            highest = LAYER;
        }
        Star { below, neighbours, lowest, highest }
    }

    fn critical_point(&self, field: &ExactField<'_>, v: u32) -> Option<CriticalPoint> {
        // The two neighbours along an axis; the layer counts as one sample.
        let pair = |axis: usize| {
            [0, 1].map(|s| {
                let n = self.neighbours[2 * axis + s];
                if field.is_in_layer(n) { LAYER } else { n }
            })
        };
        let opposite = |mask: u8| (0..3).find(|&a| mask == 3 << (2 * a));
        let (index, low, high) = if self.below == 0 {
            (0, [v; 2], [self.highest; 2])
        } else if self.below == 0x3f {
            (3, [self.lowest; 2], [v; 2])
        } else if let Some(axis) = opposite(self.below) {
            (1, pair(axis), [self.highest; 2])
        } else if let Some(axis) = opposite(!self.below & 0x3f) {
            (2, [self.lowest; 2], pair(axis))
        } else {
            return None;
        };
        Some(CriticalPoint {
            key: field.order_key(v),
            isovalue: field.vertex_value(v),
            position: in_voxels(field, field.whole_position(v)),
            index,
            element: GridElement::Vertex(v),
            low,
            high,
        })
    }
}

fn face_point(field: &ExactField<'_>, saddle: &FaceSaddle) -> Option<CriticalPoint> {
    let index = field.face_saddle_index(saddle)?;
    Some(CriticalPoint {
        key: decided_key(saddle.order_key(), |key| saddle.is_above(key)),
        isovalue: field.face_saddle_value(saddle),
        position: in_voxels(field, field.face_saddle_position(saddle)),
        index,
        element: GridElement::Face { corner: saddle.corner, axis: saddle.axis as u8 },
        low: if index == 1 { saddle.low } else { [saddle.low[0]; 2] },
        high: if index == 2 { saddle.high } else { [saddle.high[0]; 2] },
    })
}

fn body_point(field: &ExactField<'_>, saddle: &BodySaddle) -> CriticalPoint {
    let (low, high) = body_sectors(field, saddle);
    CriticalPoint {
        key: decided_key(saddle.order_key(), |key| saddle.is_above(key)),
        isovalue: field.body_saddle_value(saddle),
        position: in_voxels(field, field.body_saddle_position(saddle)),
        index: saddle.index,
        element: GridElement::Cell(saddle.corner),
        low: if saddle.index == 1 { low } else { [low[0]; 2] },
        high: if saddle.index == 2 { high } else { [high[0]; 2] },
    }
}

/// The order key of a saddle, plus one if it was rounded down to the key of an isovalue below the
/// saddle. So its comparison with the key of an isovalue is exact.
fn decided_key(order_key: i128, is_above: impl Fn(i128) -> bool) -> i128 {
    let on_whole = order_key & ((1 << ORDER_BITS) - 1) == 0;
    if on_whole && is_above(order_key >> ORDER_BITS) { order_key + 1 } else { order_key }
}

/// Fractional bits with which values of the same key are compared. Around a sample with ties the
/// values of saddles differ by powers of ramp / M, about 2^-25 each: room for ten of them.
const TIE_BITS: u32 = 256;

/// Sorts points with the same key by their exact values. Keys are rounded, and two saddles of one
/// handle in the wrong order would be inconsistent.
fn sort_ties(
    points: &mut [CriticalPoint],
    precise: impl Fn(&[CriticalPoint]) -> Result<Vec<BigInt>> + Sync,
) -> Result<()> {
    let mut ties: Vec<&mut [CriticalPoint]> =
        points.chunk_by_mut(|a, b| a.key == b.key).filter(|run| run.len() > 1).collect();
    ties.par_iter_mut().try_for_each(|run| {
        let mut valued: Vec<(BigInt, CriticalPoint)> =
            precise(run)?.into_iter().zip(run.iter().copied()).collect();
        // Stable: grid elements decide remaining ties.
        valued.sort_by(|a, b| a.0.cmp(&b.0));
        for (point, (_, sorted)) in run.iter_mut().zip(valued) {
            *point = sorted;
        }
        Ok(())
    })
}

/// The value of a critical point in V units times 2^[`TIE_BITS`], rounded down. Samples need no field.
pub(super) fn precise_value(field: Option<&ExactField<'_>>, point: &CriticalPoint) -> BigInt {
    let value = match (field, point.element) {
        (None, _) | (_, GridElement::Vertex(_) | GridElement::Layer) => None,
        (Some(field), GridElement::Face { corner, axis }) => {
            field.face_saddle(corner, axis as usize).map(|s| s.scaled_value(TIE_BITS))
        }
        (Some(field), GridElement::Cell(corner)) => field
            .body_saddles(corner)
            .find(|s| s.index == point.index)
            .map(|s| s.scaled_value(TIE_BITS)),
    };
    value.unwrap_or_else(|| BigInt::from(point.key) << (TIE_BITS - ORDER_BITS))
}

/// Samples in the regions below and above a body saddle: the ends of the four lattice edges along
/// z. See the module for why.
fn body_sectors(field: &ExactField<'_>, saddle: &BodySaddle) -> ([u32; 2], [u32; 2]) {
    let v = field.cell_keys(saddle.corner);
    let offsets = field.cell_offsets();
    let is_diagonal_high = mixed_derivative_is_positive(&v, saddle.index);
    let end = |edge: usize, want_higher: bool| {
        let upper = v[edge + 4] > v[edge];
        saddle.corner + offsets[if upper == want_higher { edge + 4 } else { edge }]
    };
    let (high_edges, low_edges) =
        if is_diagonal_high { ([0, 3], [1, 2]) } else { ([1, 2], [0, 3]) };
    (low_edges.map(|e| end(e, false)), high_edges.map(|e| end(e, true)))
}

/// The sign of f_xy at the body saddle of an index: that of s G, or of e where h = 0.
fn mixed_derivative_is_positive(v: &[i128; 8], index: u8) -> bool {
    let d = v[4] - v[0];
    let e = v[3] - v[1] - v[2] + v[0];
    let f = v[5] - v[1] - v[4] + v[0];
    let g = v[6] - v[2] - v[4] + v[0];
    let h = v[7] - v[6] - v[5] - v[3] + v[1] + v[2] + v[4] - v[0];
    if h == 0 {
        return e > 0;
    }
    let narrow = h.checked_mul(d).zip(f.checked_mul(g)).map(|(hd, fg)| hd > fg);
    let minor_is_positive =
        narrow.unwrap_or_else(|| (BigInt::from(h) * d - BigInt::from(f) * g).sign() == Sign::Plus);
    minor_is_positive == (index == 1)
}
