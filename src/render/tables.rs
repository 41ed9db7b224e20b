//! The trajectories as tables for the shader: of the whole spectrum, or of the vertices that one isovalue needs.

use serde::Serialize;

use super::shader_types::{ActiveTriangle, Knot, split_f64};
use crate::spectrum::{Size, Spectrum};

/// The tables that do not depend on the view.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tables {
    /// The isovalue of each rank, scaled.
    pub(super) isovalues: Vec<[f32; 2]>,
    /// Start of each vertex's knots, and the end.
    pub(super) first_knot: Vec<u32>,
    /// Knots by vertex.
    pub(super) knots: Vec<Knot>,
}

/// Bytes of the largest of the tables of the whole spectrum.
pub(super) fn largest_table(spectrum: &Spectrum) -> u64 {
    let bytes = |n: usize, size: usize| n as u64 * size as u64;
    bytes(spectrum.knots().len(), size_of::<Knot>())
        .max(bytes(spectrum.first_knot().len(), size_of::<u32>()))
        .max(bytes(spectrum.isovalues().len(), size_of::<[f32; 2]>()))
}

/// The device memory for drawing a spectrum, without the picture itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Memory {
    /// Bytes of the trajectories: isovalues, knots, and the index of each vertex's first knot.
    pub trajectories: u64,
    /// Bytes of the longest list of active triangles.
    pub triangles: u64,
    /// Triangles of that list.
    pub most_triangles: u64,
}

impl Memory {
    /// The memory for a spectrum.
    pub fn of(spectrum: &Spectrum) -> Self {
        Memory::of_size(&Size::of(spectrum))
    }

    /// The memory for a spectrum of a given size.
    pub fn of_size(size: &Size) -> Self {
        let bytes = |n: u64, each: usize| n.saturating_mul(each as u64);
        Memory {
            trajectories: bytes(size.knots, size_of::<Knot>())
                .saturating_add(bytes(size.trajectories.saturating_add(1), size_of::<u32>()))
                .saturating_add(bytes(size.isovalues, size_of::<[f32; 2]>())),
            triangles: bytes(size.most_triangles, size_of::<ActiveTriangle>()),
            most_triangles: size.most_triangles,
        }
    }
}

/// Largest number of bytes of knots for one active triangle: two knots per vertex.
pub(super) const KNOT_BYTES_PER_TRIANGLE: u64 = 6 * size_of::<Knot>() as u64;

/// An isovalue scaled such that those of the spectrum cover [0, 1]: the interpolation is the same, and no value overflows or
/// underflows the shader's floats.
pub(super) fn scaled(spectrum: &Spectrum, isovalue: f64) -> [f32; 2] {
    let first = spectrum.isovalues().first().copied().unwrap_or(0.0);
    let last = spectrum.isovalues().last().copied().unwrap_or(1.0);
    let scaled = (0.5 * isovalue - 0.5 * first) / (0.5 * last - 0.5 * first);
    // Not finite for a single isovalue.
    split_f64(if scaled.is_finite() { scaled } else { 0.0 })
}

/// The tables of the whole spectrum.
pub(super) fn of_spectrum(spectrum: &Spectrum) -> Tables {
    Tables {
        isovalues: spectrum.isovalues().iter().map(|&c| scaled(spectrum, c)).collect(),
        first_knot: spectrum.first_knot().to_vec(),
        knots: spectrum.knots().iter().map(Knot::from).collect(),
    }
}

/// The tables of the vertices of `triangles` only, with the knots on both sides of the isovalue with rank `rank`. Vertices and
/// ranks are renumbered, in `triangles` too. Returns the tables and the new rank.
pub(super) fn of_triangles(
    spectrum: &Spectrum,
    triangles: &mut [ActiveTriangle],
    rank: u32,
) -> (Tables, u32) {
    let mut vertices: Vec<u32> = triangles.iter().flat_map(|t| t.vertices).collect();
    vertices.sort_unstable();
    vertices.dedup();
    for triangle in triangles.iter_mut() {
        triangle.vertices = triangle.vertices.map(|v| vertices.partition_point(|&w| w < v) as u32);
    }

    let mut first_knot = Vec::with_capacity(vertices.len() + 1);
    let mut knots: Vec<Knot> = Vec::with_capacity(2 * vertices.len());
    for &vertex in &vertices {
        first_knot.push(knots.len() as u32);
        let trajectory = spectrum.trajectory(vertex);
        let next = trajectory.partition_point(|knot| knot.rank <= rank);
        let bracket = next.saturating_sub(1)..(next + 1).min(trajectory.len());
        knots.extend(bracket.map(|i| Knot::from(&trajectory[i])));
    }
    first_knot.push(knots.len() as u32);

    let mut ranks: Vec<u32> = knots.iter().map(|knot| knot.rank).collect();
    ranks.sort_unstable();
    ranks.dedup();
    for knot in &mut knots {
        knot.rank = ranks.partition_point(|&r| r < knot.rank) as u32;
    }
    let isovalues =
        ranks.iter().map(|&r| scaled(spectrum, spectrum.isovalues()[r as usize])).collect();
    let rank = ranks.partition_point(|&r| r <= rank).saturating_sub(1) as u32;
    (Tables { isovalues, first_knot, knots }, rank)
}
