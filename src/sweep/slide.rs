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

/// Stretches shorter than this share of the range are not cut in two any more.
const SHORTEST_SHARE: f64 = 2e-4;

/// Distance from both ends of a stretch at which it is extracted, as a share of it.
const END_SHARE: f64 = 1e-3;

/// Covers a piece by sliding extractions, as many as it takes.
pub(super) fn slide(sweep: &Sweep, piece: &Piece, patches: &mut Vec<Patch>, counts: &mut Counts) -> Result<()> {
    sweep.cancelled()?;
    let length = piece.high - piece.low;
    let margin = END_SHARE * length;
    let low = component_at(sweep, piece, piece.low + margin)?;
    let high = component_at(sweep, piece, piece.high - margin)?;
    let same = low.faces == high.faces && low.crossings == high.crossings;
    if same {
        counts.sliding += 1;
        patches.push(patch(piece, &low, &high)?);
    } else if length > SHORTEST_SHARE * (sweep.range.1 - sweep.range.0) {
        let middle = 0.5 * (piece.low + piece.high);
        slide(sweep, &Piece { high: middle, ..*piece }, patches, counts)?;
        slide(sweep, &Piece { low: middle, ..*piece }, patches, counts)?;
    } else {
        counts.unmoving += 1;
        let middle = component_at(sweep, piece, 0.5 * (piece.low + piece.high))?;
        patches.push(patch(piece, &middle, &middle)?);
    }
    Ok(())
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
