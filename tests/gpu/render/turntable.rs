//! Pictures around the upward direction: each equals the first one of an object that is turned the other way.

use isospectrum::render::{Axis, Background, Camera, Image, Renderer, View};
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Placement;

use crate::render::drawing::*;

/// Least difference of a channel that counts as another colour; drivers round to a step or two.
const MIN_DIFFERENCE: u8 = 8;

/// The largest share of pixels of another colour between a picture and one of the turned object: outlines, which single
/// precision may shift across one of the four samples of a pixel.
const MAX_DIFFERENT_SHARE: f64 = 0.002;

/// Balls in a volume that is longer than wide, rotated by degrees about an axis (0 to 2) through its middle, counter-clockwise
/// when the axis points towards the eye.
fn balls(axis: usize, degrees: f64) -> Spectrum {
    let dims = [31, 21, 13];
    let middle = dims.map(|n| 0.5 * (f64::from(n) - 1.0));
    let mut spectrum =
        empty(Placement::default(), dims.map(|n| n as usize), vec![0.0, 2.0], (0.0, 1.0));
    let (sin, cos) = degrees.to_radians().sin_cos();
    let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
    for (offset, radius) in
        [([6.0, 2.0, 1.0], 4.0), ([-5.0, 5.0, -2.0], 2.5), ([0.0, -4.0, 3.0], 1.5)]
    {
        let mut at = offset;
        at[b] = cos * offset[b] - sin * offset[c];
        at[c] = sin * offset[b] + cos * offset[c];
        let at = std::array::from_fn(|i| middle[i] + at[i]);
        add(&mut spectrum, &sphere(5), &[(0, radius, at), (1, radius, at)]);
    }
    spectrum.check().expect("a valid spectrum");
    spectrum
}

fn different_share(a: &Image, b: &Image) -> f64 {
    let pixels = a.pixels.chunks_exact(4).zip(b.pixels.chunks_exact(4));
    let is_different =
        |(p, q): &(&[u8], &[u8])| p.iter().zip(*q).any(|(x, y)| x.abs_diff(*y) > MIN_DIFFERENCE);
    pixels.filter(is_different).count() as f64 / f64::from(a.width * a.height)
}

#[test]
fn each_picture_of_a_turntable_is_the_first_one_of_the_turned_object() {
    const N: u32 = 6;
    // A box in the middle, so that the turned object is looked at from the same distance.
    let bounds = [[6.0, 2.0, 1.0], [24.0, 18.0, 11.0]];
    for (up, axis, sign) in [(None, 2, 1.0), (Some(Axis::Y), 1, 1.0), (Some(Axis::MinusX), 0, -1.0)]
    {
        let spectrum = balls(axis, 0.0);
        let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
        let turntables = [false, true].map(|orthographic| {
            let view = small("20,25");
            let camera = Camera { up, orthographic, ..view.camera };
            let view = view.with_camera(camera).with_background(Background::White);
            let views = view.turntable(spectrum.volume(), Some(bounds), N);
            assert_eq!(views.len(), N as usize);
            assert_eq!(views[0].camera.azimuth, view.camera.azimuth);
            let pictures = views.iter().map(|view| renderer.draw(0.5, view).expect("a picture"));
            let pictures = pictures.collect::<Vec<_>>();
            (views[0].clone(), pictures)
        });
        for k in 1..N {
            // The eye goes counter-clockwise, so the object seems to turn clockwise.
            let degrees = -sign * 360.0 * f64::from(k) / f64::from(N);
            let turned = balls(axis, degrees);
            let mut renderer = Renderer::new(gpu(), &turned).expect("a renderer");
            for (view, pictures) in &turntables {
                let what =
                    format!("{up:?}, orthographic {}, picture {k}", view.camera.orthographic);
                let picture = &pictures[k as usize];
                let turned = renderer.draw(0.5, view).expect("a picture");
                let off = different_share(picture, &turned);
                assert!(off < MAX_DIFFERENT_SHARE, "{what}: {off} of its pixels differ");
                let off = different_share(picture, &pictures[0]);
                assert!(off > 20.0 * MAX_DIFFERENT_SHARE, "{what} is the first one: {off}");
            }
        }
    }
}

#[test]
fn a_turntable_fits_its_box_in_all_pictures_and_touches_the_margin_in_one() {
    // A rod of 26 voxels: long from the side, a disc from its end.
    let mut spectrum = empty(Placement::default(), [31, 21, 13], vec![0.0, 2.0], (0.0, 1.0));
    for x in 2..=28 {
        let at = [f64::from(x), 10.0, 6.0];
        add(&mut spectrum, &sphere(2), &[(0, 1.0, at), (1, 1.0, at)]);
    }
    let bounds = Some([[1.0, 9.0, 5.0], [29.0, 11.0, 7.0]]);
    for view in [small("0,0"), parallel(small("0,0"))] {
        // Columns covered, as shares of the half width from the middle.
        let reach = |view: &View| {
            let image = draw(&spectrum, 0.5, view);
            let is_covered = |x: u32| (0..image.height).any(|y| image.pixel(x, y)[3] > 0);
            let columns = (0..image.width).filter(|&x| is_covered(x));
            let half = 0.5 * f64::from(image.width);
            columns.map(|x| ((f64::from(x) + 0.5 - half) / half).abs()).fold(0.0, f64::max)
        };
        let all: Vec<f64> =
            view.turntable(spectrum.volume(), bounds, 4).iter().map(reach).collect();
        // A pixel is 1/160; the rod's ends are round, so they do not reach the corners of its box.
        let most = all.iter().copied().fold(0.0, f64::max);
        assert!((0.85..=0.95).contains(&most), "{all:?}");
        assert!(all[0] < 0.3, "its end is seen first: {all:?}");
    }
}
