//! What of a surface is seen: the same flags wherever one looks at it.

use clap::Args;

use super::clip_argument::ClipArgument;
use super::compute::share;

/// What of a surface is seen; in a page and a window at first.
#[derive(Args, Debug)]
pub(super) struct SightArguments {
    /// Cut along a plane across an axis of the volume, at a share of its length or a length from the first sample, and cover
    /// the cut: x:50%, z:12.5, or -x:50% for the other side
    #[arg(long, value_name = "[-]AXIS:PLACE", allow_hyphen_values = true)]
    pub(super) clip: Option<ClipArgument>,
    /// How much of what lies behind the surface hides, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 1.0, value_parser = share)]
    pub(super) opacity: f64,
}
