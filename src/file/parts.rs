//! The sections that a spectrum file and a web page have in common.

use super::column::Content;
use super::geometry::write_geometry;
use super::header::write_info;
use super::tables;
use super::trajectories::{Ranks, write_ranks};
use super::triangles::{self, Arranged};
use super::units::Units;
use crate::error::Result;
use crate::spectrum::Spectrum;

/// Sections of a spectrum, as FORMAT.md describes them, but with positions in any units.
pub(crate) struct Parts {
    /// The spectrum in the order of a file.
    pub(crate) spectrum: Spectrum,
    /// The number that each of its vertices had in the original spectrum.
    pub(crate) order: Vec<u32>,
    /// The contents of `INFO`, `ISOV`, `VERT`, `TRIA` and `POSN`.
    pub(crate) sections: [Content<'static>; 5],
}

impl Parts {
    /// The sections of a spectrum whose positions are rounded as by [`Units::rounded`]. It is consumed to save memory.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Input`] if the spectrum does not pass [`Spectrum::check`], or if vertices with many knots have more
    /// neighbours than a reader accepts, which no mesh has.
    pub(crate) fn new(spectrum: Spectrum, units: Units) -> Result<Parts> {
        spectrum.check()?;
        let info = write_info(&spectrum)?;
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
        Ok(Parts { spectrum, order, sections })
    }
}
