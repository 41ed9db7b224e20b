//! Silhouettes: lines of constant width where a surface turns away.

use std::f64::consts::PI;

use isospectrum::render::Background;

use super::drawing::*;

#[test]
fn a_silhouette_is_a_thin_line_along_the_outline() {
    let spectrum = growing_sphere(5);
    let near = small("35,22").with_background(Background::White);
    for view in
        [near.clone(), small("0,-30,0.6").with_background(Background::White), parallel(near)]
    {
        let plain = draw(&spectrum, 0.5, &view);
        let lined = draw(&spectrum, 0.5, &view.clone().with_silhouette(true));
        let ([x, y], depth) = project(spectrum.volume(), &view, MIDDLE);
        let radius = outline_radius(&view, radius_at(0.5), depth);
        let mut darkened = 0.0;
        for (row, column) in (0..view.height).flat_map(|row| (0..view.width).map(move |c| (row, c)))
        {
            let [before, after] =
                [&plain, &lined].map(|image| brightness(image.pixel(column, row)));
            assert!(after <= before, "nothing is lighter");
            let inside = radius - (f64::from(column) + 0.5 - x).hypot(f64::from(row) + 0.5 - y);
            if before != after {
                assert!((-1.5..MAX_WIDTH).contains(&inside), "{inside} pixels inside the outline");
                darkened += 1.0;
            }
            let is_line = (0.8..1.2).contains(&inside);
            assert!(!is_line || after + 20 < before, "{before} became {after} at {inside}");
        }
        // The whole outline: at least a pixel for each unit of its length.
        assert!(darkened > 2.0 * PI * radius, "{darkened} pixels");
    }
}

/// The greatest distance of a line from the outline, pixels. It is 1.5 wide, and half a pixel fades; where normals are interpolated
/// linearly, the line is up to twice as wide.
const MAX_WIDTH: f64 = 4.0;
