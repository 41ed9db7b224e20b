//! The sections that a file and a container of another kind, the page, have in common.

use super::column::Content;
use super::facing::Units;
use super::geometry::write_geometry;
use super::trajectories::{Ranks, write_ranks};
use super::triangles::{self, Arranged};
use super::{info, tables};
use crate::error::Result;
use crate::spectrum::Spectrum;

/// The spectrum in the order of a file, the contents, and of each of its vertices which it was.
type Parts = (Spectrum, [Content<'static>; 5], Vec<u32>);

/// The spectrum in the order of a file, and the contents of `INFO`, `ISOV`, `VERT`, `TRIA` and `POSN` as
/// FORMAT.md describes them, but with positions in other units, as [`Units::rounded`] leaves them.
/// And of each vertex there, which it was in `spectrum`.
///
/// # Errors
///
/// [`crate::Error::Input`] if the spectrum does not pass [`Spectrum::check`], or its triangles are no meshes: so many
/// meet at vertices of so many knots that a reader would not look at all of them.
pub(crate) fn parts(spectrum: &Spectrum, units: Units) -> Result<Parts> {
    parts_of(spectrum.clone(), units)
}

/// As [`parts`], of a spectrum that is not needed any more as it was.
pub(super) fn parts_of(spectrum: Spectrum, units: Units) -> Result<Parts> {
    spectrum.check()?;
    let info = info(&spectrum)?;
    let mut arranged = triangles::arranged(spectrum, units);
    let ranks = Ranks::new(&arranged.spectrum, std::mem::take(&mut arranged.is_lattice));
    let (triangles, (vertices, positions)) = rayon::join(
        || triangles::write_triangles(&arranged),
        || (write_ranks(&ranks), write_geometry(&arranged.spectrum, &ranks, units)),
    );
    let Arranged { spectrum, order, .. } = arranged;
    let isovalues = tables::write_isovalues(spectrum.isovalues());
    let sections = [
        Content::Plain(info.into()),
        Content::Plain(isovalues.into()),
        vertices,
        triangles,
        positions?,
    ];
    Ok((spectrum, sections, order))
}
