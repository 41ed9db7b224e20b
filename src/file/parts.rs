//! What a file is made of, for a container of another kind: the page.

use super::info;
use super::trajectories::{Ranks, residuals, write_ranks};
use super::{tables, triangles};
use crate::error::Result;
use crate::spectrum::Spectrum;

/// The parts of a file. Sections are as FORMAT.md describes them; `positions` and `normals` are the
/// zigzag-coded columns of `POSN` and `NRML`, and `is_first` says which knots are the first of their
/// vertex.
#[derive(Debug)]
pub(crate) struct Parts {
    pub(crate) info: Vec<u8>,
    pub(crate) isovalues: Vec<u8>,
    pub(crate) ranks: Vec<u8>,
    pub(crate) triangles: Vec<u8>,
    pub(crate) positions: [Vec<u64>; 3],
    pub(crate) normals: [Vec<u64>; 2],
    pub(crate) is_first: Vec<bool>,
}

/// The parts of a spectrum, with codes of normals from -`radius` to `radius` (at most 127, as in
/// files) on the octahedron of that radius.
///
/// # Errors
///
/// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub(crate) fn parts(spectrum: &Spectrum, radius: i8) -> Result<Parts> {
    spectrum.check()?;
    let info = info(spectrum)?;
    let (spectrum, walk) = triangles::arranged(spectrum);
    let ranks = Ranks::new(&spectrum);
    let (positions, normals) = residuals(&spectrum, &ranks, radius);
    let mut is_first = vec![false; spectrum.knots.len()];
    for trajectory in spectrum.first_knot.windows(2).filter(|ends| ends[0] < ends[1]) {
        is_first[trajectory[0] as usize] = true;
    }
    Ok(Parts {
        info,
        isovalues: tables::write_isovalues(&spectrum.isovalues),
        ranks: write_ranks(&ranks),
        triangles: triangles::write_triangles(&walk, &spectrum.triangles, &ranks),
        positions,
        normals,
        is_first,
    })
}
