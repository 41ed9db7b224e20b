//! The background of a picture.

use crate::parse_name::named_values;

/// The background of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Background {
    /// White, for print.
    #[default]
    White,
    /// A light grey.
    Light,
    /// Nearly black, for slides.
    Dark,
    /// Transparent: alpha is 0.
    Transparent,
}

impl Background {
    /// Linear red, green, blue and alpha.
    pub(super) fn linear(self) -> [f64; 4] {
        match self {
            Background::White => [1.0, 1.0, 1.0, 1.0],
            Background::Light => [0.82, 0.83, 0.85, 1.0],
            Background::Dark => [0.012, 0.013, 0.016, 1.0],
            Background::Transparent => [0.0; 4],
        }
    }
}

named_values! {
    Background, "background":
    White = "white",
    Light = "light",
    Dark = "dark",
    Transparent = "transparent",
}
