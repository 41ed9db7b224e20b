//! The position of the main light of a picture.

use crate::parse_name::named_values;

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

named_values! {
    Light, "light":
    UpperLeft = "upper-left",
    Eye = "eye",
    Left = "left",
    Right = "right",
    Above = "above",
    Below = "below",
}
