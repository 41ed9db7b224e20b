//! Ambient occlusion darkens hollows, and nothing else.

use isospectrum::render::{Background, Surface, View, linear};
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Placement;

use crate::render::drawing::*;

/// Two balls of 5 voxels that touch in the middle, side by side for an eye on the x axis; a third one lies around them at
/// isovalues from 1 on.
fn touching() -> Spectrum {
    let mut spectrum = empty(Placement::default(), [21; 3], vec![0.0, 1.0, 2.0], (0.0, 1.9));
    for y in [5.0, 15.0] {
        let middle = [10.0, y, 10.0];
        add(&mut spectrum, &sphere(5), &[(0, 5.0, middle), (1, 5.0, middle)]);
    }
    add(&mut spectrum, &sphere(4), &[(1, 10.0, MIDDLE), (2, 10.0, MIDDLE)]);
    spectrum.check().expect("a valid spectrum");
    spectrum
}

fn occluded(view: &View) -> View {
    view.clone().with_occlusion(true)
}

/// The brightness of a pixel with occlusion over that without, at a point of the first ball so many voxels from the point where
/// the balls touch.
fn light_left(spectrum: &Spectrum, view: &View, from_touch: f64) -> f64 {
    let y = 10.0 - from_touch;
    let x = 10.0 + (25.0 - (y - 5.0).powi(2)).sqrt();
    let ([column, row], _) = project(spectrum.volume(), view, [x, y, 10.0]);
    let light = |view: &View| {
        let pixel = draw(spectrum, 0.5, view).pixel(column as u32, row as u32);
        pixel[..3].iter().map(|&c| f64::from(linear(u32::from(c))[2])).sum::<f64>()
    };
    light(&occluded(view)) / light(view)
}

#[test]
fn deeper_hollows_are_darker_in_pictures_of_any_size() {
    let spectrum = touching();
    let small = small("0,0");
    for small in [small.clone(), parallel(small)] {
        let large = small.clone().with_width(2 * small.width).with_height(2 * small.height);
        let [small, large] = [small, large].map(|view| {
            let [deep, slope, top] = [0.4, 0.7, 5.0].map(|y| light_left(&spectrum, &view, y));
            assert!(deep < 0.75, "{deep} of the light is left where the balls touch");
            assert!(deep + 0.1 < slope && slope < 0.97, "{deep} deep, {slope} on the slope");
            // Nothing is around the nearest point of a ball; the picture has 8 bits.
            assert!((top - 1.0).abs() < 0.03, "{top} on top");
            [deep, slope]
        });
        // The radius of occlusion is a share of the picture's height. A pixel of the small picture is 0.1 voxels, over which the
        // brightness changes by a third.
        for (a, b) in small.into_iter().zip(large) {
            assert!((a - b).abs() < 0.1, "{a} in the small picture, {b} in the large one");
        }
    }
}

#[test]
fn background_and_outlines_are_not_darkened() {
    let spectrum = touching();
    let view = small("30,20");
    let (plain, dark) = (draw(&spectrum, 0.5, &view), draw(&spectrum, 0.5, &occluded(&view)));
    let alpha = |image: &isospectrum::render::Image| -> Vec<u8> {
        image.pixels.iter().skip(3).step_by(4).copied().collect()
    };
    assert!(alpha(&plain) == alpha(&dark), "the same pixels are covered");
    let white = view.clone().with_background(Background::White);
    let image = draw(&spectrum, 0.5, &occluded(&white));
    let n_wrong = (image.pixels.chunks_exact(4).zip(alpha(&plain)))
        .filter(|(pixel, alpha)| *alpha == 0 && pixel[..3] != [255; 3])
        .count();
    assert_eq!(n_wrong, 0, "the background is white");
    let is_lighter = |(p, q): (&[u8], &[u8])| p[3] == 255 && (0..3).any(|i| q[i] > p[i]);
    let pixels = plain.pixels.chunks_exact(4).zip(dark.pixels.chunks_exact(4));
    assert_eq!(pixels.filter(|&pair| is_lighter(pair)).count(), 0, "nothing is lighter");
    assert!(draw(&spectrum, 0.5, &occluded(&view)) == dark, "two runs draw the same");
}

#[test]
fn transparent_surfaces_neither_receive_nor_hide_occlusion() {
    let spectrum = touching();
    let view = small("0,0").with_background(Background::White);
    let clear = view.clone().with_opacity(0.5);
    assert!(draw(&spectrum, 0.5, &clear) == draw(&spectrum, 0.5, &occluded(&clear)));

    // The balls inside of a shell: where they are dark, they are so through the shell.
    let mut renderer = isospectrum::render::Renderer::new(gpu(), &spectrum).expect("a renderer");
    let shell = Surface { opacity: Some(0.5), ..Surface::from(1.5) };
    let mut both = |view: &View| renderer.draw_all(&[0.5.into(), shell], view).expect("a picture");
    let (plain, dark) = (both(&view), both(&occluded(&view)));
    let at = |point| {
        let ([x, y], _) = project(spectrum.volume(), &view, point);
        [&plain, &dark].map(|image| brightness(image.pixel(x as u32, y as u32)))
    };
    let [before, after] = at([12.0, 9.4, 10.0]);
    assert!(after + 15 < before, "{before} became {after} in the hollow");
    let [before, after] = at([10.0, 10.0, 18.5]);
    assert_eq!(before, after, "the shell alone");
}
