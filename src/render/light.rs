//! Where the main light of a picture is.

use crate::parse_name::from_name;

/// Where the main light is, as seen by who looks; a fainter one fills in from the other side. The numbers are those of `LAMPS`
/// in `shaders/surface.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u32)]
pub enum Light {
    /// Above, on the left, in front.
    #[default]
    UpperLeft,
    /// Where the eye is: no shadow, as in a photograph with a flash.
    Eye,
    /// On the left: raking light, which shows relief across.
    Left,
    /// On the right.
    Right,
    /// Above.
    Above,
    /// Below.
    Below,
}

impl Light {
    /// Every place, in the order of the documentation.
    pub const ALL: [Light; 6] =
        [Light::UpperLeft, Light::Eye, Light::Left, Light::Right, Light::Above, Light::Below];

    /// The name as flags spell it.
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
