//! The projection matrices of a picture, and the distance at which a box fits it.

use glam::dcamera::rh::{
    proj::directx::{orthographic, perspective},
    view::look_to_mat4,
};
use glam::{DMat3, DMat4, DVec3};

use super::camera::{BORDER, Camera, FIELD_OF_VIEW, FILL};
use crate::spectrum::VolumeInfo;

impl Camera {
    /// Fits a box (corners in the voxel frame, the first and the last opposite) to a picture of `size` pixels.
    fn fit(&self, volume: &VolumeInfo, corners: [DVec3; 8], size: [u32; 2]) -> BoxFit {
        let world = DMat3::from_cols_array_2d(&volume.placement.axes());
        let center = world * (0.5 * (corners[0] + corners[7]));
        let (towards_eye, up) = self.directions(volume);
        let rotation = look_to_mat4(DVec3::ZERO, -towards_eye, up);

        let [width, height] = size.map(f64::from);
        let tan_y = (0.5 * FIELD_OF_VIEW).to_radians().tan();
        let tan_x = tan_y * width / height;
        let rotated = corners.map(|corner| rotation.transform_vector3(world * corner - center));
        let distance = rotated
            .iter()
            .map(|p| {
                let depth = if self.orthographic { 0.0 } else { p.z };
                depth + (p.x.abs() / (FILL * tan_x)).max(p.y.abs() / (FILL * tan_y))
            })
            .fold(0.0, f64::max);
        BoxFit { center, rotation, corners: rotated, distance }
    }

    /// The distance, voxels, from the eye to the center of a box that just fits a picture of `size` pixels; `bounds` are the
    /// box's minimum and maximum corner in the voxel frame, or `None` for the volume's box.
    pub(super) fn fit_distance(
        &self,
        volume: &VolumeInfo,
        bounds: Option<[[f64; 3]; 2]>,
        size: [u32; 2],
    ) -> f64 {
        let between = |bounds: [[f64; 3]; 2]| {
            let [low, high] = bounds.map(DVec3::from_array);
            corners_between(low, high)
        };
        self.fit(volume, bounds.map_or_else(|| corners(volume), between), size).distance
    }

    /// The matrices of a picture of `width` by `height` pixels centered on `look_at` (voxel frame; `None` for the center of the
    /// volume).
    pub(crate) fn projection(
        &self,
        volume: &VolumeInfo,
        look_at: Option<[f64; 3]>,
        width: u32,
        height: u32,
    ) -> Projection {
        let world = DMat3::from_cols_array_2d(&volume.placement.axes());
        let fit = self.fit(volume, corners(volume), [width, height]);
        let distance = self.distance * fit.distance;

        let target = look_at.map_or(fit.center, |p| world * DVec3::from_array(p));
        let box_radius = fit.corners.iter().map(|p| p.length()).fold(0.0, f64::max);
        let radius = target.distance(fit.center) + box_radius;
        let aspect = f64::from(width) / f64::from(height);
        let eye_from_voxel = DMat4::from_translation(DVec3::new(0.0, 0.0, -distance))
            * fit.rotation
            * DMat4::from_translation(-target)
            * DMat4::from_mat3(world);
        let (near, far) = (distance - radius, distance + radius);
        let clip_from_eye = if self.orthographic {
            let up = distance * (0.5 * FIELD_OF_VIEW).to_radians().tan();
            let right = up * aspect;
            // The near plane may be behind the eye.
            orthographic(-right, right, -up, up, near, far)
        } else {
            // At least a thousandth of the far plane, to keep depth precise if the eye is inside of the box.
            perspective(FIELD_OF_VIEW.to_radians(), aspect, near.max(1e-3 * far), far)
        };
        Projection {
            clip_from_voxel: clip_from_eye * eye_from_voxel,
            eye_from_voxel,
            eye_from_normal: DMat3::from_mat4(eye_from_voxel).inverse().transpose(),
            mirrored: world.determinant() < 0.0,
            parallel: self.orthographic,
            distance,
            depth: [clip_from_eye.z_axis.z, clip_from_eye.w_axis.z],
            half_extent: [clip_from_eye.x_axis.x.recip(), clip_from_eye.y_axis.y.recip()],
        }
    }
}

/// The eight corners of the box around the volume with its caps, voxel frame, x fastest.
pub(super) fn corners(volume: &VolumeInfo) -> [DVec3; 8] {
    let size = DVec3::from_array(volume.placement.cell_size());
    let last = DVec3::from_array(volume.dims.map(|d| d as f64 - 1.0));
    corners_between(size * DVec3::splat(-BORDER), size * (last + BORDER))
}

/// The eight corners of a box, x fastest.
fn corners_between(low: DVec3, high: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|corner| {
        let side = DVec3::new((corner & 1) as f64, (corner >> 1 & 1) as f64, (corner >> 2) as f64);
        low + side * (high - low)
    })
}

/// A box fitted to a picture.
struct BoxFit {
    /// Center of the box, world's axes.
    center: DVec3,
    /// From the world's axes to those of the eye.
    rotation: DMat4,
    /// The corners relative to the center, axes of the eye.
    corners: [DVec3; 8],
    /// Distance from the eye to the center, voxels.
    distance: f64,
}

/// The matrices of one picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// From the voxel frame to clip coordinates, depth 0 to 1.
    pub(crate) clip_from_voxel: DMat4,
    /// From the voxel frame to the eye frame.
    pub(crate) eye_from_voxel: DMat4,
    /// Transforms normals of the voxel frame to the eye frame, up to their length: the inverse transpose, which holds for
    /// directions that are not orthogonal, too.
    pub(crate) eye_from_normal: DMat3,
    /// Whether the grid axes are left-handed in the world, which reverses the winding of triangles.
    pub(crate) mirrored: bool,
    /// Whether the projection is parallel, along the z axis of the eye frame.
    pub(crate) parallel: bool,
    /// Distance from the eye to the center of the picture, voxels.
    pub(crate) distance: f64,
    /// Depth is (depth[0] z + depth[1]) / -z, z of the eye frame; without the division in parallel projection.
    pub(crate) depth: [f64; 2],
    /// Half width and half height of the picture at a distance of 1; at any distance in parallel projection.
    pub(crate) half_extent: [f64; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Axis;
    use crate::volume::{Outside, Placement};

    fn volume(dims: [usize; 3], placement: Placement) -> VolumeInfo {
        VolumeInfo {
            name: "box".into(),
            dims,
            sample_type: "float32".into(),
            range: (0.0, 1.0),
            placement,
            outside: Outside::Low,
        }
    }

    #[test]
    fn the_box_touches_the_margin_and_stays_inside_it() {
        let oblique = Placement {
            origin: [1e9, -5.0, 3.0],
            spacing: [0.5, 1.0, 2.0],
            direction: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.6, 0.8]],
            ..Placement::default()
        };
        for placement in [Placement::default(), oblique] {
            let volume = volume([20, 10, 15], placement);
            for (camera, orthographic) in ["35,22", "0,90", "-120,-90", "250,-10"]
                .into_iter()
                .flat_map(|camera| [(camera, false), (camera, true)])
            {
                for (width, height) in [(640, 480), (100, 400), (4000, 40)] {
                    let camera: Camera = camera.parse().expect("a camera");
                    let camera = Camera { orthographic, ..camera };
                    let projection = camera.projection(&volume, None, width, height);
                    let extent = corners(&volume)
                        .map(|c| projection.clip_from_voxel.project_point3(c))
                        .iter()
                        .inspect(|p| assert!((0.0..=1.0).contains(&p.z), "depth {}", p.z))
                        .map(|p| p.x.abs().max(p.y.abs()))
                        .fold(0.0, f64::max);
                    // The arithmetic is f64 on numbers below 1e3.
                    assert!((extent - FILL).abs() < 1e-9, "extent {extent} from {camera:?}");
                }
            }
        }
    }

    #[test]
    fn the_world_z_axis_points_up_and_azimuth_turns_counter_clockwise() {
        let volume = volume([11, 11, 11], Placement::default());
        let projection = Camera { azimuth: 90.0, elevation: 0.0, ..Camera::default() }
            .projection(&volume, None, 100, 100);
        let at = |p: [f64; 3]| projection.clip_from_voxel.project_point3(DVec3::from_array(p));
        assert!(at([5.0, 5.0, 9.0]).y > 0.1);
        // Seen from +y, +x is on the left.
        assert!(at([9.0, 5.0, 5.0]).x < -0.1);
        assert!(at([5.0, 9.0, 5.0]).z < at([5.0, 1.0, 5.0]).z);
        assert!(!projection.mirrored);
    }

    #[test]
    fn the_up_axis_points_up_and_azimuths_turn_around_it() {
        let sheared = Placement {
            spacing: [0.75, 0.6, 0.5],
            direction: [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.6, -0.8]],
            ..Placement::default()
        };
        for placement in [Placement::default(), sheared] {
            let volume = volume([11, 11, 11], placement);
            let world = DMat3::from_cols_array_2d(&volume.placement.direction);
            for axis in Axis::ALL {
                let (index, sign) = axis.index_and_sign();
                let camera = |azimuth| Camera {
                    azimuth,
                    elevation: 0.0,
                    up: Some(axis),
                    ..Camera::default()
                };
                let seen = |azimuth: f64, along: DVec3| {
                    let projection = camera(azimuth).projection(&volume, None, 100, 100);
                    projection.eye_from_voxel.transform_vector3(along)
                };
                let mut along = DVec3::ZERO;
                along[index] = sign;
                for azimuth in [0.0, 77.0, -140.0] {
                    // The arithmetic is f64 on numbers about 1.
                    assert!(seen(azimuth, along).distance(DVec3::Y) < 1e-12, "{axis:?}");
                }
                // The next axis points towards the eye, and turns to the left as the azimuth grows.
                let mut next = DVec3::ZERO;
                next[(index + 1) % 3] = 1.0;
                let level = (world * next).reject_from(world * along).length();
                let at = |azimuth| seen(azimuth, next) * DVec3::new(1.0, 0.0, 1.0) / level;
                assert!(at(0.0).distance(DVec3::Z) < 1e-12, "{axis:?}: {}", at(0.0));
                assert!(at(90.0).distance(DVec3::NEG_X) < 1e-12, "{axis:?}: {}", at(90.0));
            }
        }
        // If the volume's axes are those of the world, z is the default.
        let plain = volume([11, 12, 13], Placement::default());
        let camera = Camera { up: Some(Axis::Z), ..Camera::default() };
        assert_eq!(camera.basis(&plain), DMat3::IDENTITY);
        assert!(["", "X", "w", "--x", "+x"].iter().all(|text| text.parse::<Axis>().is_err()));
        assert_eq!("-y".parse::<Axis>().expect("an axis"), Axis::MinusY);
    }
}
