//! Translucent surfaces: their triangles blend from the farthest to the nearest, over all surfaces.

use isospectrum::render::{Background, Clip, Renderer, Surface, View};
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Outside;

use super::drawing::*;

/// Each of four blends rounds to eight bits, in linear light and back.
const BLENDING_TOLERANCE: u8 = 4;

fn to_linear(byte: u8) -> f32 {
    let s = f32::from(byte) / 255.0;
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

fn to_srgb(linear: f32) -> u8 {
    let s =
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * s).round() as u8
}

/// A layer of this colour over another, at opacity 0.5, in linear light.
fn over(front: [u8; 4], behind: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| 0.5 * to_linear(front[i]) + 0.5 * behind[i])
}

fn assert_near(found: [u8; 4], wanted: [f32; 3], what: &str) {
    let wanted = wanted.map(to_srgb);
    let is_near = (0..3).all(|i| found[i].abs_diff(wanted[i]) <= BLENDING_TOLERANCE);
    assert!(is_near, "{what}: {found:?}, not {wanted:?}");
}

/// Two shells around the middle of the volume, red outside, green inside.
fn shells(opacity: f32) -> [Surface; 2] {
    let surface =
        |isovalue, color| Surface { isovalue, color: Some(color), opacity: Some(opacity) };
    [surface(0.2, [0.0, 0.6, 0.0]), surface(0.9, [0.6, 0.0, 0.0])]
}

/// Spheres that grow with the isovalue: those of higher isovalues are the outer ones.
fn shells_of_low_values() -> Spectrum {
    let changed = growing_sphere(4).changed(|about, _| about.volume.outside = Outside::High);
    changed.expect("valid")
}

fn views() -> [View; 3] {
    let view = small("35,22").with_background(Background::White);
    [view.clone(), small("-120,-50,0.7").with_background(Background::White), parallel(view)]
}

#[test]
fn shells_blend_in_the_order_of_their_depth() {
    let spectrum = shells_of_low_values();
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    for view in views() {
        let mut middle = |surfaces: &[Surface]| {
            renderer.draw_all(surfaces, &view).expect("a picture").pixel(160, 120)
        };
        // The ray through the middle meets each shell at a right angle, where both of its sides look the same.
        let [inner, outer] = shells(1.0).map(|shell| middle(&[shell]));
        let wanted =
            [outer, inner, inner, outer].iter().fold([1.0; 3], |behind, &c| over(c, behind));
        assert_near(middle(&shells(0.5)), wanted, "both shells");
        let wanted = [outer, outer].iter().fold([1.0; 3], |behind, &c| over(c, behind));
        assert_near(middle(&shells(0.5)[1..]), wanted, "the outer one");
        // An opaque one hides what is behind it.
        let [_, clear] = shells(0.5);
        let [solid, _] = shells(1.0);
        let wanted = over(outer, [0, 1, 2].map(|i| to_linear(inner[i])));
        assert_near(middle(&[solid, clear]), wanted, "an opaque one inside");
    }
}

#[test]
fn a_section_is_in_front_of_what_remains_or_behind_it() {
    let spectrum = shells_of_low_values();
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    let [from_eye, from_behind] =
        [1.0, -1.0].map(|x| Clip { normal: [x, 0.0, 0.0], offset: x * MIDDLE[0] });
    let mut middle = |surfaces: &[Surface], clip: Clip, open: bool| {
        let view = small("0,0").with_background(Background::White).with_clip(Some(clip));
        renderer.draw_all(surfaces, &view.with_open(open)).expect("a picture").pixel(160, 120)
    };
    // Over the walls, which are alone without the section.
    let section = middle(&shells(1.0)[..1], from_eye, false);
    let walls = middle(&shells(0.5), from_eye, true);
    let wanted = over(section, [0, 1, 2].map(|i| to_linear(walls[i])));
    assert_near(middle(&shells(0.5), from_eye, false), wanted, "in front");
    // Behind the walls: they hide three quarters of whatever its colour is.
    let [found, walls] = [false, true].map(|open| middle(&shells(0.5), from_behind, open));
    assert!(found != walls, "the section is seen");
    for i in 0..3 {
        let behind = 4.0 * (to_linear(walls[i]) - to_linear(found[i]));
        assert!((0.0..=0.55).contains(&behind), "half of the white background at most: {behind}");
    }
}
