//! Curves over the isovalue against formulas.

use super::*;

#[test]
fn area_and_volume_of_a_sphere_are_those_of_the_formula() {
    // Between samples a distance field is interpolated too low by the mean of x (1 - x) / 2 = 1/12
    // times its Laplacian 2 / r: the sphere's radius shrinks by 1 / (6 r), its volume by
    // 1 / (2 r^2), its area by 1 / (3 r^2). A fifth of that is left to the tetrahedra.
    const TOLERANCE: f64 = 1.2 / 2.0;
    let volume =
        from_function(26, |p| 12.0 - p.iter().map(|x| (x - 12.4).powi(2)).sum::<f64>().sqrt());
    let placement = Placement { spacing: [0.5, 0.5, 0.5], ..Placement::default() };
    let volume = Volume::new("sphere", volume.dims(), volume.samples().clone(), placement)
        .expect("a valid volume");
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 64);
    let mut n_checked = 0;
    for (i, &c) in spectrum.isovalues.iter().enumerate() {
        let radius = 0.5 * (12.0 - c);
        if !(4.5..6.0).contains(&radius) {
            continue;
        }
        n_checked += 1;
        let area = 4.0 * std::f64::consts::PI * radius * radius;
        let inside = area * radius / 3.0;
        let tolerance = TOLERANCE / (radius / 0.5).powi(2);
        assert!(
            (spectrum.area[i] / area - 1.0).abs() < tolerance,
            "area {} at {c}: {area}",
            spectrum.area[i]
        );
        assert!(
            (spectrum.volume[i] / inside - 1.0).abs() < tolerance,
            "volume {} at {c}: {inside}",
            spectrum.volume[i]
        );
        assert_eq!((spectrum.n_components[i], spectrum.euler[i], spectrum.genus[i]), (1, 2, 0));
        assert_eq!(spectrum.n_cavities[i], 0);
    }
    assert!(n_checked > 3);
}

#[test]
fn area_and_volume_of_a_sheared_volume_are_those_of_the_world() {
    let steps = [[1.0, 0.0, 0.0], [0.5, 0.75f64.sqrt(), 0.0], [0.25, 0.25, 1.0]];
    let placement = Placement::from_steps([0.0; 3], steps);
    let middle = placement.world([14.5; 3]);
    let distance = |p: [f64; 3]| {
        let world = placement.world(p);
        (0..3).map(|i| (world[i] - middle[i]).powi(2)).sum::<f64>().sqrt()
    };
    let volume = from_function(30, |p| 12.0 - distance(p));
    let volume = Volume::new("sphere", volume.dims(), volume.samples().clone(), placement)
        .expect("a valid volume");
    let spectrum = ContourSpectrum::new(&volume, &topology(&volume), 64);
    let i = spectrum.isovalues.iter().position(|&c| c > 4.0).expect("inside");
    let radius = 12.0 - spectrum.isovalues[i];
    let area = 4.0 * std::f64::consts::PI * radius * radius;
    // Cells are at most 1.8 long here, so what is lost is at most three times that of a cube's sphere, 1 / (2 r^2).
    let tolerance = 1.5 / radius.powi(2);
    assert!((spectrum.area[i] / area - 1.0).abs() < tolerance, "{} {area}", spectrum.area[i]);
    let enclosed = area * radius / 3.0;
    assert!((spectrum.volume[i] / enclosed - 1.0).abs() < tolerance, "{}", spectrum.volume[i]);
    // As if the axes were perpendicular, a tenth would be wrong.
    assert!(placement.span() < 0.9 && tolerance < 0.03);
}

#[test]
fn a_linear_field_is_measured_exactly() {
    // Rounding of a few thousand sums of numbers of order one.
    const ROUNDING: f64 = 1e-9;
    let volume = from_function(9, |p| p[0] + 2.0 * p[1] + 2.0 * p[2]);
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 40);
    // By symmetry half of the cube lies above the middle, cut by a plane with normal (1, 2, 2) / 3;
    // the plane x + 2 y + 2 z = 20 in [0, 8]^3 projects along z onto the strip
    // 4 <= x + 2 y <= 20 of the square, of area 64 - 4 * 4, and is 3 / 2 as large.
    let low = spectrum.isovalues.iter().position(|&c| c > 20.0).expect("a middle");
    let mean = |v: &[f64]| 0.5 * (v[low - 1] + v[low]);
    assert!((mean(&spectrum.volume) - 256.0).abs() < ROUNDING);
    // Volume falls by area / |gradient| per isovalue.
    let step = spectrum.isovalues[1] - spectrum.isovalues[0];
    let fallen: f64 = spectrum.area.iter().sum::<f64>() * step / 3.0;
    // The midpoint rule on curves of second order at 40 points.
    assert!((fallen / 512.0 - 1.0).abs() < 1e-3, "{fallen}");
}

#[test]
fn cavities_are_counted_on_the_side_of_the_layer() {
    let volume = ring();
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 9);
    assert_eq!((spectrum.n_components[0], spectrum.n_cavities[0], spectrum.genus[0]), (2, 1, 1));
    let volume = volume.with_outside(Outside::High);
    let topology = self::topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 9);
    assert_eq!((spectrum.n_components[0], spectrum.n_cavities[0], spectrum.genus[0]), (1, 0, 1));
}

#[test]
fn plot_is_well_formed_and_names_what_it_shows() {
    let volume = ring();
    let topology = topology(&volume);
    let spectrum = ContourSpectrum::new(&volume, &topology, 64);
    let svg = contour_spectrum_svg("ring <1 & 2>", &spectrum, &topology.net_events());
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    assert!(svg.contains("ring &lt;1 &amp; 2&gt;"));
    for word in
        ["area", "enclosed volume", "components", "Euler characteristic", "isovalue", "vanish"]
    {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}
