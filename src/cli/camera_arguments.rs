//! `--camera`, `--up` and `--orthographic`: the view point.

use clap::Args;
use isospectrum::render::{Axis, Camera};

use super::heading;

/// The flags of every command that shows a surface.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = heading::CAMERA)]
pub(super) struct CameraArguments {
    /// View point: azimuth,elevation[,distance]
    ///
    /// For example 30,20. Angles in degrees. At distance 1, the default, the surface just fits. In a page or a window this is the first view.
    #[arg(long, value_name = "AZ,EL[,D]", allow_hyphen_values = true)]
    camera: Option<Camera>,
    /// Axis of the volume that points up, e.g. y or -z
    ///
    /// One of x, y, z, -x, -y, -z. The azimuth turns about it, from the next axis: from y for x, from x for z. By default
    /// the z axis of the world points up.
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, hide_short_help = true)]
    up: Option<Axis>,
    /// Use a parallel projection
    ///
    /// Sizes do not depend on depth, and the scale bar holds all over the picture.
    #[arg(long, hide_short_help = true)]
    orthographic: bool,
}

impl CameraArguments {
    /// Returns the camera.
    pub(super) fn camera(self) -> Camera {
        Camera { up: self.up, orthographic: self.orthographic, ..self.camera.unwrap_or_default() }
    }
}
