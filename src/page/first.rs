//! The isovalues that a page shows first: a range around the isovalue it opens with, or that one isosurface.
//!
//! They are a spectrum of their own, compressed as the whole one. The page draws it, and its slider moves within it, while a
//! worker still decodes the whole spectrum.

use super::data;
use super::field::PageField;
use super::range::with_range;
use crate::error::Result;
use crate::spectrum::{About, Knot, Patch, Query, Spectrum, Triangle};

/// The first range takes at most this fraction (1 / n) of the bytes of the whole spectrum.
const RANGE_FRACTION: usize = 8;

/// The first range takes at most this many bytes, which a page decodes in a fraction of a second.
const MAX_BYTES: usize = 2_500_000;

/// The first range may always take this many bytes, a tenth of the page's script, so that the slider of a small page moves, too.
const MIN_BYTES: usize = 16_000;

/// A single isosurface may take this fraction (1 / n) of the bytes of the whole spectrum: there is nothing smaller to show.
const SINGLE_FRACTION: usize = 4;

/// The widest range that is tried, as a share of the whole range.
const WIDEST_SHARE: f64 = 0.25;

/// Each range is this share of the one tried before it.
const NARROWING: f64 = 0.7;

/// The number of ranges that are tried; the narrowest is a thousandth of the whole range.
const N_TRIES: i32 = 16;

/// The number of knots overestimates the bytes of narrow ranges, by at most this factor.
const MAX_OVERESTIMATE: f64 = 1.6;

/// The isovalues that a page shows first.
pub(super) struct FirstRange {
    /// A raw deflate stream.
    pub(super) bytes: Vec<u8>,
    /// Its lowest and its highest isovalue.
    pub(super) range: (f64, f64),
}

/// The widest range around `isovalue` that is small compared to the `n_bytes` of the whole spectrum. `None` if there is no surface
/// at the isovalue, or even the one isosurface is too large.
pub(super) fn first_range(
    spectrum: &Spectrum,
    isovalue: f64,
    step: f64,
    field: Option<&PageField>,
    n_bytes: usize,
) -> Result<Option<FirstRange>> {
    let Some(single) = single_isosurface(spectrum, isovalue, step, field)? else { return Ok(None) };
    let (low, high) = spectrum.range();
    let max_bytes = (n_bytes / RANGE_FRACTION).clamp(MIN_BYTES, MAX_BYTES);
    // The codes of a second field belong to the knots of the whole spectrum, which a range replaces at its ends.
    let tries = if field.is_some() { 0..0 } else { 0..N_TRIES };
    for i in tries {
        let half = 0.5 * WIDEST_SHARE * (high - low) * NARROWING.powi(i);
        let range = ((isovalue - half).max(low), (isovalue + half).min(high));
        if range.0 >= range.1 {
            break;
        }
        let part = with_range(spectrum, range)?;
        let share = part.knots().len() as f64 / spectrum.knots().len().max(1) as f64;
        if share * n_bytes as f64 > MAX_OVERESTIMATE * max_bytes as f64 {
            continue;
        }
        let (about, patch) = part.into_parts();
        let about = About { range: spectrum.range(), events: Vec::new(), ..about };
        let bytes = data::compressed(&Spectrum::unchecked(about, patch), step, None)?;
        if bytes.len() <= max_bytes {
            return Ok(Some(FirstRange { bytes, range }));
        }
    }
    let fits = single.len() <= n_bytes / SINGLE_FRACTION;
    Ok(fits.then_some(FirstRange { bytes: single, range: (isovalue, isovalue) }))
}

/// Compresses the isosurface of `isovalue` as a spectrum whose vertices have two equal knots; the second one compresses to almost
/// nothing. `None` if there is no surface.
fn single_isosurface(
    spectrum: &Spectrum,
    isovalue: f64,
    step: f64,
    field: Option<&PageField>,
) -> Result<Option<Vec<u8>>> {
    let mut query = Query::new(spectrum);
    let mesh = query.mesh_at(isovalue)?;
    let codes = field.map(|field| field.codes_at(spectrum, query.parts().0, isovalue));
    let after = isovalue.next_up();
    if mesh.triangles.is_empty() || !after.is_finite() {
        return Ok(None);
    }
    let knots =
        mesh.positions.iter().flat_map(|&position| [0, 1].map(|rank| Knot { rank, position }));
    let triangles = mesh.triangles.iter().zip(&mesh.caps);
    let about = About::new(spectrum.volume().clone(), spectrum.range(), spectrum.tolerance());
    let patch = Patch {
        isovalues: vec![isovalue, after],
        first_knot: (0..=mesh.positions.len() as u32).map(|v| 2 * v).collect(),
        knots: knots.collect(),
        triangles: triangles
            .map(|(&vertices, &cap)| Triangle { vertices, birth: 0, death: 1, cap })
            .collect(),
        collapses: Vec::new(),
    };
    let first = Spectrum::unchecked(about, patch);
    data::compressed(&first, step, codes.as_deref()).map(Some)
}
