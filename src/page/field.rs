//! The second field of a page: a byte for every knot.
//!
//! 1 to 255 are the ends of the scale and 253 steps between, more than a map has colours; 0 is none. What lies beyond the
//! ends is at them. Of its two columns the first has the first knots of all vertices, the second their further knots, each
//! as what is added to the byte of the knot before (of the vertex before), modulo 256: surfaces are walked over, so that
//! neighbours follow one another.

use crate::color::{Color, ColorSources, Scale, ScaleEnds};
use crate::spectrum::Spectrum;

/// A field as a page holds it.
pub(super) struct Field {
    name: String,
    scale: Scale,
    map: &'static str,
    /// One per knot.
    pub(super) codes: Vec<u8>,
}

impl Field {
    /// The field of some sources by what is told of the ends of its scale; none where there is none.
    pub(super) fn of(sources: &ColorSources, told: ScaleEnds) -> Option<Field> {
        let field = sources.field.as_ref()?;
        let values = field.values.iter().map(|&x| f64::from(x));
        let scale = Scale::of(values, told, sources.field_ends());
        let code = |&x: &f32| code_of(scale, f64::from(x));
        Some(Field {
            name: field.name.clone(),
            scale,
            map: Color::Field.default_map(sources).name(),
            codes: field.values.iter().map(code).collect(),
        })
    }

    /// What the page is told of it.
    pub(super) fn about(&self) -> serde_json::Value {
        let Field { name, scale: Scale { low, high }, map, .. } = self;
        serde_json::json!({ "name": name, "low": low, "high": high, "map": map })
    }

    /// The codes at an isovalue of some vertices, each twice, as the first mesh of a page has its knots.
    pub(super) fn at(&self, spectrum: &Spectrum, vertices: &[u32], isovalue: f64) -> Vec<u8> {
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

/// The section of codes of knots, by vertex.
pub(super) fn section(spectrum: &Spectrum, codes: &[u8]) -> Vec<u8> {
    let (mut first, mut further) = (Vec::new(), Vec::new());
    let mut before = 0u8;
    for ends in spectrum.first_knot().windows(2) {
        let mut at = before;
        for (i, &code) in codes[ends[0] as usize..ends[1] as usize].iter().enumerate() {
            let column = if i == 0 { &mut first } else { &mut further };
            column.push(code.wrapping_sub(at));
            at = code;
            if i == 0 {
                before = code;
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
    fn codes_are_the_ends_and_steps_between() {
        let scale = Scale { low: -1.0, high: 1.0 };
        let codes = [-5.0, -1.0, 0.0, 1.0, 9.0, f64::NAN].map(|x| code_of(scale, x));
        assert_eq!(codes, [1, 1, 128, 255, 255, 0]);
    }
}
