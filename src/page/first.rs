//! What a page shows first: a spectrum of the isovalues around the first one, or of that one isosurface alone.
//!
//! It is drawn, and can be moved through, while the whole is still being unpacked. Its packing is that of the whole, so the page
//! needs no second reader.

use super::data;
use super::field::Field;
use super::part::part;
use crate::error::Result;
use crate::spectrum::{About, Knot, Patch, Query, Spectrum, Triangle};

/// It takes at most this part of the whole spectrum's bytes, and so many bytes: what a page unpacks in a fraction of a second.
const SMALLEST_PART: usize = 8;
const MOST_BYTES: usize = 2_500_000;

/// One isosurface alone may take this part of the whole spectrum's bytes: nothing smaller can be shown.
const SMALLEST_PART_OF_ONE: usize = 4;

/// The widest range that is tried is this part of the whole one; each further one is narrower by a factor, down to a thousandth.
const WIDEST: f64 = 0.25;
const NARROWER: f64 = 0.7;
const TRIES: i32 = 16;

/// By their knots, narrow ranges are taken for larger than they are, by so much.
const LARGER: f64 = 1.6;

/// What is shown first.
pub(super) struct First {
    /// A raw deflate stream.
    pub(super) bytes: Vec<u8>,
    /// The isovalues that it covers.
    pub(super) range: (f64, f64),
}

/// The isovalues around `isovalue` that go into a page apart; `whole` is how many bytes all of them take. None where nothing is
/// to be seen, or it would make the page much larger.
pub(super) fn first(
    spectrum: &Spectrum,
    isovalue: f64,
    step: f64,
    field: Option<&Field>,
    whole: usize,
) -> Result<Option<First>> {
    let Some(alone) = alone(spectrum, isovalue, step, field)? else { return Ok(None) };
    let (low, high) = spectrum.range();
    let most = (whole / SMALLEST_PART).min(MOST_BYTES);
    // Numbers of another field stand at the knots of the whole, which a part cuts.
    let tries = if field.is_some() { 0..0 } else { 0..TRIES };
    for i in tries {
        let half = 0.5 * WIDEST * (high - low) * NARROWER.powi(i);
        let range = ((isovalue - half).max(low), (isovalue + half).min(high));
        if range.0 >= range.1 {
            break;
        }
        let around = part(spectrum, range)?;
        // Packing what is clearly too much takes time for nothing.
        let about =
            around.knots().len() as f64 / spectrum.knots().len().max(1) as f64 * whole as f64;
        if about > LARGER * most as f64 {
            continue;
        }
        let (about, patch) = around.into_parts();
        let about = About { range: spectrum.range(), events: Vec::new(), ..about };
        let around = Spectrum::unchecked(about, patch);
        let bytes = data::compressed(&around, step, None)?;
        if bytes.len() <= most {
            return Ok(Some(First { bytes, range }));
        }
    }
    let fits = alone.len() <= whole / SMALLEST_PART_OF_ONE;
    Ok(fits.then_some(First { bytes: alone, range: (isovalue, isovalue) }))
}

/// The raw deflate stream of the isosurface of `isovalue`, each vertex with two knots at one place, of which the second takes
/// next to nothing; none where nothing is to be seen.
fn alone(
    spectrum: &Spectrum,
    isovalue: f64,
    step: f64,
    field: Option<&Field>,
) -> Result<Option<Vec<u8>>> {
    let mut query = Query::new(spectrum);
    let mesh = query.mesh_at(isovalue)?;
    let codes = field.map(|field| field.at(spectrum, query.parts().0, isovalue));
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
