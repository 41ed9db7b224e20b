//! The box of the volume and the axes of the world: their positions and their visibility.

use isospectrum::render::{BORDER, Background, Image, Surface, View};

use crate::render::drawing::*;

/// The corners of the box of [`growing_sphere`], voxel frame, x fastest.
fn corners() -> [[f64; 3]; 8] {
    let side = |bit: usize| if bit == 0 { -BORDER } else { 20.0 + BORDER };
    std::array::from_fn(|i| [i & 1, i >> 1 & 1, i >> 2].map(side))
}

/// Darkness of the darkest pixel next to a point of the voxel frame, 0 for the white background.
fn ink_at(image: &Image, view: &View, p: [f64; 3]) -> i32 {
    let ([x, y], _) = project(growing_sphere(0).volume(), view, p);
    let near = [-1.0, 0.0, 1.0].map(|d| [-1.0, 0.0, 1.0].map(|e| [x + d, y + e]));
    let inside = |[x, y]: &[f64; 2]| {
        (0.0..f64::from(image.width)).contains(x) && (0.0..f64::from(image.height)).contains(y)
    };
    let pixels = near.into_iter().flatten().filter(inside);
    pixels.map(|[x, y]| 765 - brightness(image.pixel(x as u32, y as u32))).max().unwrap_or(0)
}

/// Points along the twelve edges at shares of their length.
fn along_edges(shares: &[f64]) -> Vec<[f64; 3]> {
    let corners = corners();
    let edges = (0..8usize).flat_map(|i| [1, 2, 4].map(|bit| (i, i | bit)));
    let edges = edges.filter(|(i, j)| i != j);
    edges
        .flat_map(|(i, j)| {
            let at = move |&t: &f64| {
                std::array::from_fn(|a| (1.0 - t) * corners[i][a] + t * corners[j][a])
            };
            shares.iter().map(at).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn the_box_is_where_a_projection_by_hand_puts_it_and_behind_what_hides_it() {
    let spectrum = growing_sphere(4);
    let view = small("35,22").with_axes(true).with_background(Background::White);
    let mut renderer = isospectrum::render::Renderer::new(gpu(), &spectrum).expect("a renderer");
    for view in [view.clone(), parallel(view.clone())] {
        // Only the box and the axes: the surface is invisible.
        let nothing = Surface { opacity: Some(0.0), ..Surface::from(0.0) };
        let image = renderer.draw_all(&[nothing], &view).expect("a picture");
        let points = along_edges(&[0.07, 0.31, 0.5, 0.77, 0.93]);
        assert_eq!(points.len(), 60);
        for p in &points {
            assert!(ink_at(&image, &view, *p) > 60, "no line at {p:?}");
        }
        // Between the edges, on the faces, it is empty.
        for p in [[10.0, 10.0, -BORDER], [20.1, 12.0, 8.0], [7.0, 20.1, 13.0]] {
            assert_eq!(ink_at(&image, &view, p), 0, "a line at {p:?}");
        }

        // A ball of 9 voxels hides the corner behind it, and none of the one before it.
        let with = renderer.draw(1.0, &view).expect("a picture");
        let plain = renderer.draw(1.0, &view.clone().with_axes(false)).expect("a picture");
        let off = |p| ink_at(&with, &view, p).abs_diff(ink_at(&plain, &view, p));
        let [far, .., near] = corners();
        let inwards = |p: [f64; 3], axis: usize| {
            let mut moved = p;
            moved[axis] += 0.15 * (10.0 - p[axis]);
            moved
        };
        for axis in 0..3 {
            assert_eq!(off(inwards(far, axis)), 0, "the far corner is hidden");
            assert!(off(inwards(near, axis)) > 20, "the near corner is seen");
        }
    }
    // Inside the box, only edges in front of the eye are drawn.
    let inside = small("0,0,0.1").with_axes(true).with_background(Background::White);
    let nothing = Surface { opacity: Some(0.0), ..Surface::from(0.0) };
    let image = renderer.draw_all(&[nothing], &inside).expect("a picture");
    let inked = image.pixels.chunks_exact(4).filter(|p| p[..3] != [255; 3]).count();
    assert!((1..20_000).contains(&inked), "{inked} pixels of lines");
}

#[test]
fn the_axes_point_in_the_directions_of_the_camera() {
    let spectrum = growing_sphere(1);
    for camera in ["35,22", "-70,40", "160,-30"] {
        let view =
            small(camera).with_background(Background::White).with_width(640).with_height(480);
        let with = draw(&spectrum, 0.0, &view.clone().with_axes(true));
        let side = view.height / 3;
        // The middle of each colour at the top right.
        let middle = |channel: usize| {
            let (mut n, mut x_sum, mut y_sum) = (0.0, 0.0, 0.0);
            for (x, y) in
                (view.width - side..view.width).flat_map(|x| (0..side).map(move |y| (x, y)))
            {
                let p = with.pixel(x, y).map(i32::from);
                let others = [1, 2].map(|i| p[(channel + i) % 3]);
                if p[channel] > others[0] + 40 && p[channel] > others[1] + 40 {
                    (n, x_sum, y_sum) = (n + 1.0, x_sum + f64::from(x), y_sum + f64::from(y));
                }
            }
            assert!(n > 10.0, "{n} pixels of axis {channel} from {camera}");
            [x_sum / n, y_sum / n]
        };
        let middles = [0, 1, 2].map(middle);
        let (sin_a, cos_a) = view.camera.azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = view.camera.elevation.to_radians().sin_cos();
        // Right and down in the picture.
        let ways = [[-sin_a, sin_e * cos_a], [cos_a, sin_e * sin_a], [0.0, -cos_e]];
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let found = [0, 1].map(|k| middles[j][k] - middles[i][k]);
            let wanted = [0, 1].map(|k| ways[j][k] - ways[i][k]);
            let length = found[0].hypot(found[1]) * wanted[0].hypot(wanted[1]);
            let cosine = (found[0] * wanted[0] + found[1] * wanted[1]) / length;
            // The middle of an axis and its letter lies somewhere along it; letters are as long as a quarter of it.
            assert!(cosine > 0.95, "from {camera} axes {i} and {j}: {found:?}, not {wanted:?}");
        }
    }
}
