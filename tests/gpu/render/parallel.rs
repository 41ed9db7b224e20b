//! Parallel projection: sizes do not depend on depth, and the scale bar is correct.

use std::f64::consts::PI;

use isospectrum::render::{BORDER, Background, FILL, View};
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Placement;

use crate::render::drawing::*;

/// A ball of 2 voxels that is alone at each isovalue: near the eye at 0, far from it at 1, seen from +x.
fn near_and_far() -> Spectrum {
    let mut spectrum = empty(Placement::default(), [21; 3], vec![0.0, 1.0, 2.0], (0.0, 1.9));
    for (rank, x) in [(0, 18.0), (1, 2.0)] {
        let middle = [x, 10.0, 10.0];
        add(&mut spectrum, &sphere(4), &[(rank, 2.0, middle), (rank + 1, 2.0, middle)]);
    }
    spectrum.check().expect("a valid spectrum");
    spectrum
}

#[test]
fn size_does_not_depend_on_distance() {
    let spectrum = near_and_far();
    let radii = |view: &View| {
        [0.0, 1.0].map(|isovalue| (coverage(&draw(&spectrum, isovalue, view)).0 / PI).sqrt())
    };
    let view = parallel(small("0,0"));
    let [near, far] = radii(&view);
    // The box fills its share of the height at all depths: no depth of it enters the fit.
    let wanted = 2.0 * 0.5 * f64::from(view.height) * FILL / (10.0 + BORDER);
    // Four splits leave edges below 0.128 radii.
    let tolerance = OUTLINE_TOLERANCE + wanted * 0.128 * 0.128 / 8.0;
    for found in [near, far] {
        assert!((found - wanted).abs() < tolerance, "{found} pixels, not {wanted}");
    }
    // The same pixels are covered: both balls have the same position relative to the samples of pixels.
    assert!((near - far).abs() < 0.05, "{near} near and {far} far");
    let [near, far] = radii(&small("0,0"));
    assert!(near > 1.2 * far, "in perspective {near} near and {far} far");
}

/// The difference of two opposite edges, in a picture, of a parallelogram that extends in depth, pixels.
fn spread_of_edges(view: &View) -> f64 {
    let corners = [[2.0, 6.0, 9.0], [18.0, 6.0, 9.0], [2.0, 14.0, 12.0], [18.0, 14.0, 12.0]];
    let places = corners.map(|corner| {
        let mut spectrum = empty(Placement::default(), [21; 3], vec![0.0, 1.0], (0.0, 0.9));
        add(&mut spectrum, &octahedron(), &[(0, 0.8, corner), (1, 0.8, corner)]);
        coverage(&draw(&spectrum, 0.5, view)).1
    });
    let edge = |i: usize, j: usize| [0, 1].map(|axis| places[j][axis] - places[i][axis]);
    let [[x, y], [other_x, other_y]] = [edge(0, 1), edge(2, 3)];
    assert!(x.hypot(y) > 50.0, "the edge is long: {x}, {y}");
    (x - other_x).abs().max((y - other_y).abs())
}

#[test]
fn parallel_edges_stay_parallel() {
    // Each end of an edge is found to within the tolerance of a marker's middle.
    let view = small("25,12");
    let spread = spread_of_edges(&parallel(view.clone()));
    assert!(spread < 2.0 * MIDDLE_TOLERANCE, "{spread} pixels");
    let spread = spread_of_edges(&view);
    assert!(spread > 5.0, "in perspective {spread} pixels");
}

#[test]
fn the_scale_bar_is_as_long_as_an_object_of_its_length() {
    let spectrum = growing_sphere(5);
    // With the bar in its own picture the ball is counted without it.
    let view = parallel(
        small("35,22").with_width(1280).with_height(960).with_background(Background::White),
    );
    let plain = view.clone().with_background(Background::Transparent);
    let radius = (coverage(&draw(&spectrum, 1.0, &plain)).0 / PI).sqrt();
    let pixels_per_voxel = radius / radius_at(1.0);
    let with_bar = draw(&spectrum, 1.0, &view.clone().with_scale_bar(true));
    let without = draw(&spectrum, 1.0, &view);
    // The row with the most ink is the bar.
    let inked =
        |y| (0..view.width).filter(|&x| with_bar.pixel(x, y) != without.pixel(x, y)).count();
    let bar = (0..view.height).map(inked).max().expect("rows") as f64;
    assert!(bar > 100.0, "a bar of {bar} pixels");
    let length = bar / pixels_per_voxel;
    // Its ends are whole pixels, and the ball is smaller than its radius by the chords of its edges.
    let tolerance = 1.0 / bar + OUTLINE_TOLERANCE / radius + 0.064 * 0.064 / 8.0;
    let off = [1.0, 2.0, 5.0, 10.0].map(|n: f64| (length / n - 1.0).abs());
    let off = off.into_iter().fold(f64::INFINITY, f64::min);
    assert!(off < tolerance, "{length} voxels, not a round number");
}

#[test]
fn the_target_keeps_its_size_when_the_projection_changes() {
    let spectrum = growing_sphere(1);
    let mut view = small("35,22,1.3");
    let first = view.clone();
    // A point next to the target, at the same distance.
    let (sin, cos) = view.camera.azimuth.to_radians().sin_cos();
    let point = [MIDDLE[0] - 5.0 * sin, MIDDLE[1] + 5.0 * cos, MIDDLE[2]];
    let place = |view: &View| project(spectrum.volume(), view, point).0;
    let before = place(&view);
    view.set_orthographic(spectrum.volume(), true);
    assert!(view.camera.orthographic && view.camera.distance > first.camera.distance);
    let after = place(&view);
    // The arithmetic is f64 on numbers below 1e3.
    assert!((0..2).all(|i| (before[i] - after[i]).abs() < 1e-9), "{before:?} became {after:?}");
    view.set_orthographic(spectrum.volume(), false);
    assert!((view.camera.distance - first.camera.distance).abs() < 1e-12);
}

#[test]
fn a_parallel_camera_is_never_inside_the_surface() {
    let spectrum = growing_sphere(4);
    // Only the inside of an open surface has a colour of its own.
    let close = small("35,22,0.1").with_open(true);
    let middle = |view: &View| draw(&spectrum, 1.0, view).pixel(160, 120);
    let [r, _, b, _] = middle(&close);
    assert!(r > b, "in perspective the eye is inside and sees the back, not {r} {b}");
    let [r, _, b, _] = middle(&parallel(close));
    assert!(b > r, "the front, not {r} {b}");
}
