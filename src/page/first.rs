//! The mesh that a page shows first, as a spectrum of that one isosurface.
//!
//! It is drawn while the whole is still being unpacked. Its packing is that of the whole, so the page
//! needs no second reader; each vertex has two knots at one place, and the second takes next to nothing.

use super::data;
use super::field::Field;
use crate::error::Result;
use crate::spectrum::{Knot, Query, Spectrum, Triangle};

/// The raw deflate stream of the isosurface of `isovalue`; none where nothing is to be seen.
pub(super) fn compressed(
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
    let first = Spectrum {
        volume: spectrum.volume.clone(),
        range: spectrum.range,
        tolerance: spectrum.tolerance,
        parameters: serde_json::Value::Null,
        events: Vec::new(),
        isovalues: vec![isovalue, after],
        first_knot: (0..=mesh.positions.len() as u32).map(|v| 2 * v).collect(),
        knots: knots.collect(),
        triangles: triangles
            .map(|(&vertices, &cap)| Triangle { vertices, birth: 0, death: 1, cap })
            .collect(),
        collapses: Vec::new(),
    };
    data::compressed(&first, step, codes.as_deref()).map(Some)
}
