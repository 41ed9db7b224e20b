//! What the colours of a surface show: numbers of its vertices or triangles ([`Attribute`]), the [`Scale`] they lie on,
//! and the colour [`Map`].
//!
//! Pictures, meshes that are written, the page and the window take both from here. Nothing here knows of samples: what
//! needs a volume is handed in as [`Sources`].

mod attribute;
mod knot_values;
mod light;
mod map;
mod scale;

pub use attribute::{Attribute, Color, DistanceTo, Parts, Per, Sources};
pub use knot_values::KnotValues;
pub use light::{linear, to_srgb};
pub use map::Map;
pub(crate) use map::N_STOPS;
pub use scale::{End, Ends, Scale};

pub(crate) use light::to_linear;

/// Linear red, green and blue of what has no number: a field does not reach everywhere.
pub(crate) const NO_VALUE: [f32; 3] = [0.30, 0.30, 0.30];

/// Linear red, green and blue of a component by its number; the twin of `name_color` in `shaders/surface.wgsl`.
pub(crate) fn name_color(number: u32) -> [f32; 3] {
    const HUES: [f32; 8] = [245.0, 60.0, 165.0, 350.0, 95.0, 220.0, 35.0, 310.0];
    const LIGHTNESS: [f32; 8] = [0.58, 0.74, 0.66, 0.64, 0.87, 0.80, 0.58, 0.48];
    let turn = (number % 8) as usize;
    let round = ((number / 8) % 3) as f32;
    light::from_oklch(LIGHTNESS[turn] * (1.0 - 0.13 * round), 0.125, HUES[turn].to_radians())
}
