//! `--clip` and `--opacity`: which part of a surface is visible.

use clap::Args;

use super::clip_argument::ClipArgument;
use super::heading;
use super::number_argument::fraction;

/// The flags of every command that shows a surface; in a page or a window, the first state.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::SURFACE)]
pub(super) struct CutawayArguments {
    /// Cut the surface along a plane, e.g. x:50%
    ///
    /// [-]AXIS:POSITION. The position is a percentage of the length of the volume, or a length from the first sample (z:12.5).
    /// What is beyond it is left out, with - (-x:50%) what is before it. The cut is closed.
    #[arg(long, value_name = "PLANE", allow_hyphen_values = true)]
    pub(super) clip: Option<ClipArgument>,
    /// Opacity of the surface, 0 to 1
    #[arg(long, value_name = "OPACITY", default_value_t = 1.0, value_parser = fraction, hide_default_value = true)]
    pub(super) opacity: f64,
}
