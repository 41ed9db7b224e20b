//! The exact extraction itself, sliding: where a remeshed surface cannot be tracked.
//!
//! While no sample's value is passed and no lattice face changes its decision, the exact extraction
//! keeps its triangles and its vertices slide along their lattice edges, linearly in the isovalue:
//! two knots each, exact everywhere, never through itself. Its triangles are those of an exact
//! marching cubes, so it is what is left when good triangles do not fit, above all just beside a
//! plateau, where the isosurface hugs the lattice.

use super::start::component_at;
use super::{Counts, Piece, Sweep};
use crate::error::Result;
use crate::extract::Extraction;
use crate::mesh::{Mesh, Vertex};
use crate::spectrum::{Knot, Patch, Triangle, normal};

/// A stretch whose extractions at both ends differ is cut in two so many times. What then still
/// differs inside is shown by one unmoving extraction: its topology is right all the same.
const MOST_CUTS: u32 = 2;

/// Components with more faces are not cut: each cut stores all of the component again.
const LARGE_FACES: usize = 20_000;

/// Distance from both ends of a stretch at which it is extracted, as a share of it.
const END_SHARE: f64 = 1e-3;

/// Whether one sliding extraction covers the piece.
pub(super) fn slides(sweep: &Sweep, piece: &Piece) -> Result<bool> {
    let [low, high] = ends(sweep, piece)?;
    Ok(is_same(&low, &high))
}

/// Covers a piece by sliding extractions, as many as it takes.
pub(super) fn slide(sweep: &Sweep, piece: &Piece, patches: &mut Vec<Patch>, counts: &mut Counts) -> Result<()> {
    let large = ends(sweep, piece)?[0].faces.len() > LARGE_FACES;
    slide_in(sweep, piece, if large { 0 } else { MOST_CUTS }, patches, counts)
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
    } else if cuts > 0 {
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
    Ok([component_at(sweep, piece, piece.low + margin)?, component_at(sweep, piece, piece.high - margin)?])
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
    Mesh::from_triangles(&extraction.positions, &extraction.borders, &extraction.faces, &extraction.caps)
}
