//! The sections of a web page: those of a spectrum file with a single chunk.

use super::column::Content;
use super::encode::{Encoded, encode};
use super::header::write_info;
use super::tables;
use super::tree::Tree;
use super::units::Units;
use crate::error::Result;
use crate::spectrum::{Size, Spectrum};

/// Sections of a spectrum in a single chunk, as FORMAT.md describes them, but with positions in any units.
pub(crate) struct Parts {
    /// The spectrum in the order of the sections.
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
        let tree = Tree::single(spectrum.isovalues().len() as u32);
        let Encoded { spectrum, order, mut chunks } = encode(spectrum, &tree, 1, units)?;
        let [vertices, triangles, positions] = chunks.remove(0).sections;
        let info = Content::Plain(write_info(&spectrum, Size::of(&spectrum))?.into());
        let mut isovalues = Vec::new();
        tables::write_isovalues(&mut isovalues, spectrum.isovalues());
        let isovalues = Content::Plain(isovalues.into());
        Ok(Parts { spectrum, order, sections: [info, isovalues, vertices, triangles, positions] })
    }
}
