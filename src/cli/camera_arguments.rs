//! `--camera`, `--up` and `--orthographic`: from where a surface is seen.

use clap::Args;
use isospectrum::render::{Axis, Camera};

#[derive(Args, Clone, Copy, Debug)]
pub(super) struct CameraArguments {
    /// Where it is seen from, at first where one can move: azimuth and elevation in degrees, and the distance (1 just shows
    /// what is to fit)
    #[arg(long, value_name = "AZ,EL[,DIST]", allow_hyphen_values = true)]
    camera: Option<Camera>,
    /// The axis of the volume that points up: x, y, z, -x, -y or -z; the azimuth turns about it, from the next axis (of x
    /// that is y, of z it is x). Without it the z axis of the world points up
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<Axis>,
    /// Parallel projection: sizes do not depend on depth, and the scale bar holds all over the picture
    #[arg(long)]
    orthographic: bool,
}

impl CameraArguments {
    /// The camera that they tell.
    pub(super) fn camera(self) -> Camera {
        Camera { up: self.up, orthographic: self.orthographic, ..self.camera.unwrap_or_default() }
    }
}
