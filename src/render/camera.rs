//! The camera: direction and distance of the eye.
//!
//! # Frames
//!
//! The shader reads positions in the voxel frame. The *eye* frame has its origin at the eye, x to the right, y upwards, z
//! towards the viewer; its unit is the voxel, and it is rotated from the axes of the world, so that a volume with oblique
//! directions has its orientation in the world, z upwards. The world's origin and unit cancel in a picture that fits the
//! volume, so they are left out: coordinates stay small for any placement.

use std::str::FromStr;

use glam::{DMat3, DVec3};

use super::axis::Axis;
use crate::error::{Error, Result};
use crate::spectrum::VolumeInfo;

/// Vertical field of view, degrees: small enough that shapes are not distorted.
pub const FIELD_OF_VIEW: f64 = 30.0;

/// Fraction of the half width and half height of the picture that the volume's box fills at distance 1.
pub const FILL: f64 = 0.94;

/// Distance of the box from the outermost samples, cells: caps end within a tenth of a cell of the border.
pub const BORDER: f64 = 0.1;

/// The direction and distance of the eye.
///
/// The camera looks at the center of the volume's box, or at [`View::look_at`](super::View#structfield.look_at). Its angles
/// refer to three perpendicular directions: the world's axes, +z upwards, or those given by [`Camera::up`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Degrees counter-clockwise around the up direction: with the world's axes 0 looks from +x, 90 from +y.
    pub azimuth: f64,
    /// Degrees above the horizontal plane, -90 to 90.
    pub elevation: f64,
    /// Distance relative to the one at which the volume's box just fits; positive.
    pub distance: f64,
    /// Whether the projection is parallel; the distance then only scales the picture.
    pub orthographic: bool,
    /// The axis of the volume that points up; an azimuth of 0 then looks from the next axis (x, y, z, x), projected to the
    /// horizontal plane. `None` for the world's z axis.
    pub up: Option<Axis>,
}

impl Default for Camera {
    /// A three-quarter view of the whole volume.
    fn default() -> Self {
        Camera { azimuth: 35.0, elevation: 22.0, distance: 1.0, orthographic: false, up: None }
    }
}

impl FromStr for Camera {
    type Err = Error;

    /// Reads `azimuth,elevation[,distance]`.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if there are not two or three numbers, one is not finite, the elevation is outside of -90 to 90, or the
    /// distance is not positive.
    fn from_str(text: &str) -> Result<Self> {
        let wrong = |what: &str| Error::Usage(format!("camera '{text}': {what}"));
        let numbers = text
            .split(',')
            .map(|part| part.trim().parse::<f64>().ok().filter(|x| x.is_finite()))
            .collect::<Option<Vec<f64>>>()
            .ok_or_else(|| wrong("expected numbers azimuth,elevation[,distance]"))?;
        let (azimuth, elevation, distance) = match numbers[..] {
            [azimuth, elevation] => (azimuth, elevation, Camera::default().distance),
            [azimuth, elevation, distance] => (azimuth, elevation, distance),
            _ => return Err(wrong("expected two or three numbers azimuth,elevation[,distance]")),
        };
        let camera = Camera { azimuth, elevation, distance, ..Camera::default() };
        camera.check()?;
        Ok(camera)
    }
}

impl Camera {
    /// Checks that the numbers are valid.
    pub(crate) fn check(&self) -> Result<()> {
        let Camera { azimuth, elevation, distance, .. } = *self;
        if !azimuth.is_finite() {
            return Err(Error::Usage(format!(
                "camera azimuth {azimuth}, expected a finite number"
            )));
        }
        if !(-90.0..=90.0).contains(&elevation) {
            return Err(Error::Usage(format!("camera elevation {elevation}, expected -90 to 90")));
        }
        if !(distance > 0.0 && distance.is_finite()) {
            return Err(Error::Usage(format!(
                "camera distance {distance}, expected a positive number"
            )));
        }
        Ok(())
    }

    /// The basis of the angles, unit vectors of the world: towards an azimuth of 0, towards one of 90 degrees, and upwards;
    /// perpendicular and right-handed.
    pub(crate) fn basis(&self, volume: &VolumeInfo) -> DMat3 {
        let Some(up) = self.up else { return DMat3::IDENTITY };
        let world = DMat3::from_cols_array_2d(&volume.placement.direction);
        let (axis, sign) = up.index_and_sign();
        let up = sign * world.col(axis).normalize();
        let first = world.col((axis + 1) % 3).reject_from_normalized(up).normalize();
        DMat3::from_cols(first, up.cross(first), up)
    }

    /// The same camera, looking from a side of the world (0 to 5: +x, -x, +y, -y, +z, -z), upright; from above and below with
    /// +y upwards. Twin: `page/cube.js`.
    pub fn from_side(self, side: usize, volume: &VolumeInfo) -> Camera {
        let sign = if side.is_multiple_of(2) { 1.0 } else { -1.0 };
        let mut towards = DVec3::ZERO;
        towards[side / 2 % 3] = sign;
        let DVec3 { x, y, z } = self.basis(volume).transpose() * towards;
        // At the poles the azimuth is arbitrary; these keep the picture upright.
        let azimuth = match z.abs() < 0.999 {
            true => y.atan2(x).to_degrees().rem_euclid(360.0),
            false if z > 0.0 => 270.0,
            false => 90.0,
        };
        Camera { azimuth, elevation: z.clamp(-1.0, 1.0).asin().to_degrees(), ..self }
    }

    /// The direction from the center of the volume to the eye, and the up direction of the picture; unit vectors of the world.
    /// Up is the derivative by the elevation, so it is defined at the poles too.
    pub(crate) fn directions(&self, volume: &VolumeInfo) -> (DVec3, DVec3) {
        let (sin_a, cos_a) = self.azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = self.elevation.to_radians().sin_cos();
        let basis = self.basis(volume);
        (
            basis * DVec3::new(cos_e * cos_a, cos_e * sin_a, sin_e),
            basis * DVec3::new(-sin_e * cos_a, -sin_e * sin_a, cos_e),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Outside, Placement};

    #[test]
    fn from_side_looks_from_that_side_of_the_world() {
        let volume = VolumeInfo {
            name: "box".into(),
            dims: [4, 5, 6],
            sample_type: "float32".into(),
            range: (0.0, 1.0),
            placement: Placement {
                direction: [[0.0, 1.0, 0.0], [-0.6, 0.0, 0.8], [0.8, 0.0, 0.6]],
                ..Placement::default()
            },
            outside: Outside::Low,
        };
        for up in [None, Some(Axis::X), Some(Axis::MinusY)] {
            for side in 0..6 {
                let mut wanted = DVec3::ZERO;
                wanted[side / 2] = if side.is_multiple_of(2) { 1.0 } else { -1.0 };
                let camera = Camera { up, distance: 3.0, ..Camera::default() };
                let from = camera.from_side(side, &volume);
                assert_eq!((from.up, from.distance), (up, 3.0));
                let (towards, _) = from.directions(&volume);
                // The arithmetic is f64 on numbers about 1.
                assert!(towards.distance(wanted) < 1e-12, "{up:?}, {side}: {towards}");
            }
        }
    }

    #[test]
    fn cameras_are_parsed_and_bad_ones_are_usage_errors() {
        assert_eq!(
            " 30, -20,1.5".parse::<Camera>().expect("a camera"),
            Camera { azimuth: 30.0, elevation: -20.0, distance: 1.5, ..Camera::default() }
        );
        for bad in ["", "30", "1,2,3,4", "a,b", "0,91", "nan,0", "0,0,0", "0,0,-1", "0,inf"] {
            let error = bad.parse::<Camera>().expect_err(bad);
            assert!(matches!(error, Error::Usage(_)), "{bad}: {error}");
        }
    }
}
