//! Colouring of surfaces: values of vertices or triangles ([`Attribute`]), their [`Scale`], and the colour [`Map`].
//!
//! Pictures, exported meshes, the page and the window share this module. It has no access to samples: values that need a
//! volume are passed in as [`ColorSources`].

mod attribute;
mod knot_values;
mod map;
mod scale;
mod srgb;

pub use attribute::{Attribute, Color, ColorSources, DistanceTo, Per, SpectrumMesh};
pub use knot_values::KnotValues;
pub use map::Map;
pub(crate) use map::N_STOPS;
pub use scale::{Scale, ScaleEnd, ScaleEnds};
pub(crate) use srgb::to_linear;
pub use srgb::{linear, to_srgb};
