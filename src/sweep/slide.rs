//! The exact extraction itself, sliding: where a remeshed surface cannot be tracked.
//!
//! While no sample's value is passed and no lattice face changes its decision, the exact extraction
//! keeps its triangles and its vertices slide along their lattice edges, linearly in the isovalue:
//! two knots each, exact everywhere, never through itself. Its triangles are those of an exact
//! marching cubes, so it is what is left when good triangles do not fit, above all just beside a
//! plateau, where the isosurface hugs the lattice.

use glam::Vec3;

use super::start::component_at;
use super::{Counts, Piece, Sweep};
use crate::error::Result;
use crate::extract::Extraction;
use crate::mesh::{Mesh, Vertex};
use crate::spectrum::{Knot, Patch, Triangle, normal};

/// A stretch whose extractions at both ends differ is cut in two at most so many times. What then
/// still differs inside is shown by one unmoving extraction: its topology is right all the same.
const MOST_CUTS: u32 = 4;

/// A stretch over which vertices slide no farther than this, in voxels, is not cut: each cut stores
/// all of the component again.
const UNMOVING: f32 = 0.2;

/// Distance from both ends of a stretch at which it is extracted, as a share of it.
const END_SHARE: f64 = 1e-3;

/// Whether one sliding extraction covers the piece.
pub(super) fn slides(sweep: &Sweep, piece: &Piece) -> Result<bool> {
    let [low, high] = ends(sweep, piece)?;
    Ok(is_same(&low, &high))
}

/// Covers a piece by sliding extractions, as many as it takes.
pub(super) fn slide(
    sweep: &Sweep,
    piece: &Piece,
    patches: &mut Vec<Patch>,
    counts: &mut Counts,
) -> Result<()> {
    slide_in(sweep, piece, MOST_CUTS, patches, counts)
}

/// Covers a piece that may be cut in two so many times.
fn slide_in(
    sweep: &Sweep,
    piece: &Piece,
    cuts: u32,
    patches: &mut Vec<Patch>,
    counts: &mut Counts,
) -> Result<()> {
    let [low, high] = ends(sweep, piece)?;
    if is_same(&low, &high) {
        counts.sliding += 1;
        patches.push(patch(piece, &low, &high)?);
    } else if cuts > 0 && motion(&low, &high) > UNMOVING {
        let middle = 0.5 * (piece.low + piece.high);
        slide_in(sweep, &Piece { high: middle, ..*piece }, cuts - 1, patches, counts)?;
        slide_in(sweep, &Piece { low: middle, ..*piece }, cuts - 1, patches, counts)?;
    } else {
        counts.unmoving += 1;
        let middle = component_at(sweep, piece, 0.5 * (piece.low + piece.high))?;
        patches.push(patch(piece, &middle, &middle)?);
    }
    Ok(())
}

/// The extractions just inside both ends of a piece.
fn ends(sweep: &Sweep, piece: &Piece) -> Result<[Extraction; 2]> {
    let margin = END_SHARE * (piece.high - piece.low);
    Ok([
        component_at(sweep, piece, piece.low + margin)?,
        component_at(sweep, piece, piece.high - margin)?,
    ])
}

/// How far most vertices slide between two extractions, voxels: the 95th percentile over the lattice
/// edges crossed in both.
fn motion(a: &Extraction, b: &Extraction) -> f32 {
    let sorted = |e: &Extraction| {
        let mut crossings: Vec<((u32, u32), Vec3)> = e
            .crossings
            .iter()
            .zip(&e.positions)
            .filter_map(|(c, &p)| c.map(|c| (c, Vec3::from(p))))
            .collect();
        crossings.sort_by_key(|c| c.0);
        crossings
    };
    let (a, b) = (sorted(a), sorted(b));
    let mut motions: Vec<f32> = a
        .iter()
        .filter_map(|(c, p)| b.binary_search_by_key(c, |x| x.0).ok().map(|i| p.distance(b[i].1)))
        .collect();
    if motions.is_empty() {
        return f32::INFINITY;
    }
    let i = (motions.len() - 1) * 95 / 100;
    *motions.select_nth_unstable_by(i, f32::total_cmp).1
}

/// Whether two extractions differ only in where their vertices are.
fn is_same(a: &Extraction, b: &Extraction) -> bool {
    a.faces == b.faces && a.crossings == b.crossings
}

/// A patch with one knot at each end of the piece.
fn patch(piece: &Piece, low: &Extraction, high: &Extraction) -> Result<Patch> {
    let mut patch =
        Patch { isovalues: vec![piece.low, piece.high], first_knot: vec![0], ..Patch::default() };
    let ends = [mesh(low)?, mesh(high)?];
    for v in 0..low.positions.len() as u32 {
        for (rank, end) in ends.iter().enumerate() {
            patch.knots.push(Knot {
                rank: rank as u32,
                position: end.position(Vertex(v)).to_array(),
                normal: normal::encode(end.vertex_normal(Vertex(v)).to_array()),
            });
        }
        patch.first_knot.push(patch.knots.len() as u32);
    }
    patch.triangles = low
        .faces
        .iter()
        .zip(&low.caps)
        .map(|(&vertices, &cap)| Triangle { vertices, birth: 0, death: 1, cap })
        .collect();
    Ok(patch)
}

/// The mesh of an extraction.
pub(super) fn mesh(extraction: &Extraction) -> Result<Mesh> {
    Mesh::from_triangles(
        &extraction.positions,
        &extraction.borders,
        &extraction.faces,
        &extraction.caps,
    )
}
