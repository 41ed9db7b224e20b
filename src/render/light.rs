//! The position of the main light of a picture.

use crate::parse_name::from_name;

/// The position of the main light as seen by the viewer; a fainter fill light comes from the other side. The order is that of
/// `LAMPS` in `shaders/surface.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u32)]
pub enum Light {
    /// Above left, in front.
    #[default]
    UpperLeft,
    /// At the eye: no shadows, as in a photograph with a flash.
    Eye,
    /// On the left: raking light, which emphasizes relief.
    Left,
    /// On the right.
    Right,
    /// Above.
    Above,
    /// Below.
    Below,
}

impl Light {
    /// Every position, in the order of the documentation.
    pub const ALL: [Light; 6] =
        [Light::UpperLeft, Light::Eye, Light::Left, Light::Right, Light::Above, Light::Below];

    /// The name, as in command-line flags.
    pub fn name(self) -> &'static str {
        match self {
            Light::UpperLeft => "upper-left",
            Light::Eye => "eye",
            Light::Left => "left",
            Light::Right => "right",
            Light::Above => "above",
            Light::Below => "below",
        }
    }
}

from_name!(Light, "light");
