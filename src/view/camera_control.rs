//! Mouse control of the camera (orbit, pan, zoom), and ray casting.

use glam::{DVec2, DVec3};

use crate::render::{Camera, FIELD_OF_VIEW, View};
use crate::spectrum::VolumeInfo;

/// Degrees per pixel of dragging: the width of a typical window is one turn.
const DEGREES_PER_PIXEL: f64 = 0.4;

/// Minimum and maximum distance, relative to the one at which the volume fits: the minimum shows one voxel of a volume of a
/// thousand voxels per axis.
const DISTANCE_RANGE: (f64, f64) = (0.001, 20.0);

/// Rotates the camera around the target for a drag in pixels, right and down.
pub(super) fn orbit(view: &mut View, drag: DVec2) {
    let camera = &mut view.camera;
    camera.azimuth = (camera.azimuth - DEGREES_PER_PIXEL * drag.x).rem_euclid(360.0);
    camera.elevation = (camera.elevation + DEGREES_PER_PIXEL * drag.y).clamp(-90.0, 90.0);
}

/// Magnifies the picture by a factor.
pub(super) fn zoom(view: &mut View, factor: f64) {
    let distance = view.camera.distance / factor;
    if distance.is_finite() {
        view.camera.distance = distance.clamp(DISTANCE_RANGE.0, DISTANCE_RANGE.1);
    }
}

/// Moves the surface for a drag in pixels, right and down, in the plane through the target.
pub(super) fn pan(view: &mut View, volume: &VolumeInfo, drag: DVec2) {
    let projection = view.camera.projection(volume, view.look_at, view.width, view.height);
    let voxel_from_eye = projection.eye_from_voxel.inverse();
    let pixel = 2.0 * projection.distance * half_height() / f64::from(view.height);
    let target = DVec3::new(-drag.x * pixel, drag.y * pixel, -projection.distance);
    view.look_at = Some(voxel_from_eye.transform_point3(target).to_array());
}

/// Returns to the first camera; parallel or perspective projection stays.
pub(super) fn reset(view: &mut View, first: &Camera) {
    view.camera = Camera { orthographic: view.camera.orthographic, ..*first };
    view.look_at = None;
}

/// A ray in the voxel frame.
#[derive(Clone, Copy)]
pub(super) struct Ray {
    origin: DVec3,
    /// Unit vector.
    direction: DVec3,
}

/// The ray through a pixel (from the top left).
pub(super) fn pixel_ray(view: &View, volume: &VolumeInfo, pixel: DVec2) -> Ray {
    let projection = view.camera.projection(volume, view.look_at, view.width, view.height);
    let voxel_from_clip = projection.clip_from_voxel.inverse();
    let right = 2.0 * pixel.x / f64::from(view.width) - 1.0;
    let up = 1.0 - 2.0 * pixel.y / f64::from(view.height);
    // From the near plane, which works for parallel projection, too.
    let [near, far] =
        [0.0, 1.0].map(|depth| voxel_from_clip.project_point3(DVec3::new(right, up, depth)));
    Ray { origin: near, direction: (far - near).normalize() }
}

/// The nearest kept intersection of a ray with triangles of either orientation.
pub(super) fn first_hit(
    Ray { origin, direction }: Ray,
    triangles: impl Iterator<Item = [DVec3; 3]>,
    is_kept: impl Fn(DVec3) -> bool,
) -> Option<DVec3> {
    // Möller and Trumbore 1997, "Fast, minimum storage ray-triangle intersection".
    let intersect = |[a, b, c]: [DVec3; 3]| {
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        let from = origin - a;
        let q = from.cross(ab);
        let (u, v) = (from.dot(p) / determinant, direction.dot(q) / determinant);
        let t = ac.dot(q) / determinant;
        // The determinant of a triangle parallel to the ray is zero; the comparisons are then false.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    };
    let hits = triangles.filter_map(intersect).filter(|&t| is_kept(origin + t * direction));
    hits.min_by(f64::total_cmp).map(|t| origin + t * direction)
}

/// Half the height of the picture at distance 1.
fn half_height() -> f64 {
    (0.5 * FIELD_OF_VIEW).to_radians().tan()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Outside, Placement};

    fn volume() -> VolumeInfo {
        VolumeInfo {
            name: "box".into(),
            dims: [20, 30, 40],
            sample_type: "uint8".into(),
            range: (0.0, 1.0),
            placement: Placement { spacing: [1.0, 1.0, 1.5], ..Placement::default() },
            outside: Outside::Low,
        }
    }

    #[test]
    fn the_target_moves_with_a_pan() {
        for orthographic in [false, true] {
            let camera = Camera { orthographic, ..Camera::default() };
            check_pan(View { width: 640, height: 480, camera, ..View::default() });
        }
    }

    fn check_pan(mut view: View) {
        let volume = volume();
        let at = |view: &View, p: DVec3| {
            let projection = view.camera.projection(&volume, view.look_at, 640, 480);
            let clip = projection.clip_from_voxel.project_point3(p);
            DVec2::new((0.5 + 0.5 * clip.x) * 640.0, (0.5 - 0.5 * clip.y) * 480.0)
        };
        let Ray { origin, direction } = pixel_ray(&view, &volume, DVec2::new(320.0, 240.0));
        let middle = DVec3::new(9.5, 14.5, 29.25);
        assert!(
            direction.cross(middle - origin).length() < 1e-9,
            "the middle ray meets the middle"
        );
        pan(&mut view, &volume, DVec2::new(30.0, -12.0));
        // The arithmetic is f64 on numbers below 1e3.
        assert!(at(&view, middle).distance(DVec2::new(350.0, 228.0)) < 1e-6);
        let pixel = DVec2::new(100.0, 50.0);
        let Ray { origin, direction } = pixel_ray(&view, &volume, pixel);
        assert!(at(&view, origin + 70.0 * direction).distance(pixel) < 1e-6);
    }

    #[test]
    fn orbiting_and_zooming_stay_within_the_limits_of_the_camera() {
        let mut view = View::default();
        orbit(&mut view, DVec2::new(100.0, 1000.0));
        assert_eq!((view.camera.azimuth, view.camera.elevation), (355.0, 90.0));
        zoom(&mut view, 1e9);
        assert_eq!(view.camera.distance, 0.001);
        zoom(&mut view, f64::NAN);
        assert_eq!(view.camera.distance, 0.001);
        let first = Camera::default();
        reset(&mut view, &first);
        assert_eq!(view.camera, first);
    }

    #[test]
    fn a_ray_hits_the_nearest_kept_triangle() {
        let sheet = |z: f64| {
            [DVec3::new(-1.0, -1.0, z), DVec3::new(3.0, -1.0, z), DVec3::new(-1.0, 3.0, z)]
        };
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::Z };
        let sheets = || [sheet(5.0), sheet(2.0), sheet(-1.0)].into_iter();
        assert_eq!(first_hit(ray, sheets(), |_| true), Some(DVec3::new(0.0, 0.0, 2.0)));
        assert_eq!(first_hit(ray, sheets(), |p| p.z > 3.0), Some(DVec3::new(0.0, 0.0, 5.0)));
        assert_eq!(first_hit(Ray { direction: DVec3::X, ..ray }, sheets(), |_| true), None);
    }
}
