//! The sections that a file and a container of another kind, the page, have in common.

use super::facing::Units;
use super::geometry::write_geometry;
use super::trajectories::{Ranks, write_ranks};
use super::{info, tables, triangles};
use crate::error::Result;
use crate::spectrum::Spectrum;

/// The spectrum in the order of a file, the contents, and of each of its vertices which it was.
type Parts = (Spectrum, [Vec<u8>; 5], Vec<u32>);

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
    let (spectrum, walk, order) = triangles::arranged(spectrum);
    let ranks = Ranks::new(&spectrum, units);
    let triangles = triangles::write_triangles(&walk, spectrum.triangles(), &ranks);
    drop(walk);
    let sections = [
        info,
        tables::write_isovalues(spectrum.isovalues()),
        write_ranks(&ranks),
        triangles,
        write_geometry(&spectrum, &ranks, units)?,
    ];
    Ok((spectrum, sections, order))
}
