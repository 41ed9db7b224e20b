//! The second field of a page: a code of one byte for every knot.
//!
//! Codes 1 to 255 divide the scale into 254 equal steps, more than a map has colours; values outside the scale have the code of its
//! nearest end. 0 means no value. The section has two columns: the first knots of all vertices, then all other knots. Each code is
//! stored as its difference from the code before it modulo 256: of a first knot from that of the vertex before, of another knot
//! from that of the knot before. Vertices are in the order of a walk over the surface, so neighbours are close.

use crate::color::{Color, ColorSources, Scale, ScaleEnds};
use crate::spectrum::Spectrum;

/// The second field of a page.
pub(super) struct PageField {
    name: String,
    scale: Scale,
    map: &'static str,
    /// One per knot.
    pub(super) codes: Vec<u8>,
}

impl PageField {
    /// The field of colour sources, if they have one, with the ends of its scale.
    pub(super) fn new(sources: &ColorSources, ends: ScaleEnds) -> Option<Self> {
        let field = sources.field.as_ref()?;
        let values = field.values.iter().map(|&x| f64::from(x));
        let scale = Scale::of(values, ends, sources.field_ends()).ok()?;
        let code = |&x: &f32| code_of(scale, f64::from(x));
        Some(PageField {
            name: field.name.clone(),
            scale,
            map: Color::Field.default_map(sources).name(),
            codes: field.values.iter().map(code).collect(),
        })
    }

    /// Its name, scale and map as the scripts read them.
    pub(super) fn to_json(&self) -> serde_json::Value {
        let PageField { name, scale: Scale { low, high }, map, .. } = self;
        serde_json::json!({ "name": name, "low": low, "high": high, "map": map })
    }

    /// The codes of vertices at an isovalue, each twice: the isosurface that a page shows first has two equal knots per vertex.
    pub(super) fn codes_at(&self, spectrum: &Spectrum, vertices: &[u32], isovalue: f64) -> Vec<u8> {
        let rank = spectrum.rank_at(isovalue).unwrap_or(0);
        let at = |&v: &u32| {
            let ([a, b], t) = spectrum.bracketing_knots(v, rank, isovalue);
            let [p, q] = [a, b].map(|i| f64::from(self.codes[i]));
            if p == 0.0 || q == 0.0 { 0 } else { ((1.0 - t) * p + t * q).round() as u8 }
        };
        vertices.iter().flat_map(|v| [at(v); 2]).collect()
    }
}

fn code_of(scale: Scale, value: f64) -> u8 {
    scale.fraction(value).map_or(0, |t| 1 + (254.0 * t).round() as u8)
}

/// Encodes the codes of all knots, which are ordered by vertex.
pub(super) fn section(spectrum: &Spectrum, codes: &[u8]) -> Vec<u8> {
    let (mut first, mut further) = (Vec::new(), Vec::new());
    let mut last_first = 0u8;
    for ends in spectrum.first_knot().windows(2) {
        let mut last = last_first;
        for (i, &code) in codes[ends[0] as usize..ends[1] as usize].iter().enumerate() {
            let column = if i == 0 { &mut first } else { &mut further };
            column.push(code.wrapping_sub(last));
            last = code;
            if i == 0 {
                last_first = code;
            }
        }
    }
    first.append(&mut further);
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_divide_the_scale_into_equal_steps() {
        let scale = Scale { low: -1.0, high: 1.0 };
        let codes = [-5.0, -1.0, 0.0, 1.0, 9.0, f64::NAN].map(|x| code_of(scale, x));
        assert_eq!(codes, [1, 1, 128, 255, 255, 0]);
    }
}
