//! Pictures of synthetic spectra against analytic geometry.
//!
//! These tests need a Vulkan, Metal or DirectX 12 adapter and fail where there is none; a software
//! adapter will do.

mod axes;
mod drawing;
mod normals;
mod occlusion;
mod parallel;
mod silhouette;
mod translucent;
mod turntable;

use std::f64::consts::PI;

use drawing::*;
use isospectrum::Error;
use isospectrum::color::{Scale, ScaleEnds};
use isospectrum::render::{Background, Clip, Color, Renderer, Surface, View};
use isospectrum::spectrum::{Keep, Spectrum};
use isospectrum::volume::Placement;

#[test]
fn the_silhouette_of_a_growing_sphere_has_the_radius_of_its_isovalue() {
    let spectrum = growing_sphere(5);
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    let view = small("35,22");
    let ([x, y], depth) = project(spectrum.volume(), &view, MIDDLE);
    for isovalue in [0.0, 0.1, 1.0 / 3.0, 0.5, 0.77, 1.0] {
        let image = renderer.draw(isovalue, &view).expect("a picture");
        let (area, middle) = coverage(&image);
        let found = (area / PI).sqrt();
        let wanted = outline_radius(&view, radius_at(isovalue), depth);
        // The mesh lies inside the ball: five splits leave edges below 0.064 radii, chords that
        // cut off at most an eighth of their square.
        let tolerance = OUTLINE_TOLERANCE + wanted * 0.064 * 0.064 / 8.0;
        assert!((found - wanted).abs() < tolerance, "{isovalue}: {found} pixels, not {wanted}");
        assert!((middle[0] - x).abs() < MIDDLE_TOLERANCE, "{isovalue}: {middle:?}");
        assert!((middle[1] - y).abs() < MIDDLE_TOLERANCE, "{isovalue}: {middle:?}");
    }
}

#[test]
fn points_appear_where_a_projection_by_hand_puts_them() {
    let oblique = Placement {
        origin: [1e7, -300.0, 12.0],
        spacing: [0.5, 0.5, 0.75],
        direction: [[0.0, 1.0, 0.0], [-0.8, 0.0, 0.6], [0.6, 0.0, 0.8]],
        ..Placement::default()
    };
    // Index frame.
    let paths = [
        ([3.0, 4.0, 2.0], [15.0, 4.0, 2.0]),
        ([17.0, 12.0, 12.0], [17.0, 2.0, 3.0]),
        ([2.0, 13.0, 8.0], [12.0, 9.0, 14.0]),
        ([16.0, 1.0, 1.0], [18.0, 12.0, 13.5]),
    ];
    for placement in [Placement::default(), oblique] {
        // Each marker lives through one step of the isovalue.
        let isovalues = (0..=paths.len()).map(|i| i as f64).collect();
        let mut spectrum = empty(placement, [20, 15, 16], isovalues, (0.0, 3.9));
        let z_size = placement.spacing[2] / placement.spacing[0];
        let voxel = |[x, y, z]: [f64; 3]| [x, y, z_size * z];
        let paths = paths.map(|(start, end)| (voxel(start), voxel(end)));
        for (rank, &(start, end)) in (0..).zip(&paths) {
            add(&mut spectrum, &octahedron(), &[(rank, 0.5, start), (rank + 1, 0.5, end)]);
        }
        spectrum.check().expect("a valid spectrum");
        let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
        let views = [
            (small("35,22"), 0.3),
            (small("-100,-40,1.4"), 0.85),
            (small("200,90"), 0.0),
            (parallel(small("60,-15")), 0.6),
            (parallel(small("-130,48,1.2")), 0.1),
        ];
        for (view, t) in views {
            let camera = view.camera;
            for (step, (start, end)) in paths.iter().enumerate() {
                let p = std::array::from_fn(|i| (1.0 - t) * start[i] + t * end[i]);
                let (wanted, _) = project(spectrum.volume(), &view, p);
                let image = renderer.draw(step as f64 + t, &view).expect("a picture");
                assert_eq!(renderer.n_triangles(), 8);
                let (area, found) = coverage(&image);
                assert!(area > 4.0, "marker {step} from {camera:?} covers {area} pixels");
                for axis in 0..2 {
                    assert!(
                        (found[axis] - wanted[axis]).abs() < MIDDLE_TOLERANCE,
                        "marker {step} from {camera:?}: {found:?}, not {wanted:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn nearly_equal_knots_are_distinguished() {
    let hair = 1e-12;
    let isovalues = vec![0.0, 0.5, 0.5 + hair, 1.0];
    let mut spectrum = empty(Placement::default(), [21; 3], isovalues, (0.0, 0.9));
    let at = [(0, 3.0, MIDDLE), (1, 3.0, MIDDLE), (2, 8.0, MIDDLE), (3, 8.0, MIDDLE)];
    add(&mut spectrum, &sphere(4), &at);
    spectrum.check().expect("a valid spectrum");
    let view = small("35,22");
    let (_, depth) = project(spectrum.volume(), &view, MIDDLE);
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    for (isovalue, r) in [(0.5, 3.0), (0.5 + 0.5 * hair, 5.5), (0.5 + hair, 8.0)] {
        let (area, _) = coverage(&renderer.draw(isovalue, &view).expect("a picture"));
        let (found, wanted) = ((area / PI).sqrt(), outline_radius(&view, r, depth));
        // As for the growing sphere, with edges twice as long.
        let tolerance = OUTLINE_TOLERANCE + wanted * 0.128 * 0.128 / 8.0;
        assert!((found - wanted).abs() < tolerance, "{isovalue}: {found} pixels, not {wanted}");
    }
}

#[test]
fn wireframe_darkens_edges_and_leaves_the_middle_of_faces() {
    let spectrum = growing_sphere(1);
    let plain = small("20,30").with_background(Background::White);
    let lined = plain.clone().with_wireframe(Some(2.0));
    let (without, with) = (draw(&spectrum, 1.0, &plain), draw(&spectrum, 1.0, &lined));
    let at = |weights: [f64; 3], corners: [[f64; 3]; 3]| {
        let p: [f64; 3] = std::array::from_fn(|i| {
            MIDDLE[i] + radius_at(1.0) * (0..3).map(|c| weights[c] * corners[c][i]).sum::<f64>()
        });
        let ([x, y], _) = project(spectrum.volume(), &plain, p);
        (x as u32, y as u32)
    };
    let (positions, faces) = sphere(1);
    let mut n_seen = 0;
    for face in faces {
        let corners = face.map(|v| positions[v as usize]);
        // Faces turned well towards the eye, whose edges are tens of pixels long.
        let middle = [0, 1, 2].map(|i| corners.iter().map(|c| c[i]).sum::<f64>());
        if dot(unit(middle), unit([0.81, 0.30, 0.50])) < 0.8 {
            continue;
        }
        n_seen += 1;
        let (x, y) = at([1.0 / 3.0; 3], corners);
        assert_eq!(with.pixel(x, y), without.pixel(x, y), "middle of a face");
        let (x, y) = at([0.5, 0.5, 0.0], corners);
        let (dark, bright) = (brightness(with.pixel(x, y)), brightness(without.pixel(x, y)));
        assert!(4 * dark < 3 * bright, "edge: {dark} of {bright}");
    }
    assert!(n_seen > 0, "no face is turned towards the eye");
}

#[test]
fn colors_follow_quality() {
    // Faces of an octahedron are equilateral; drawn out along z they are slivers.
    let (mut positions, faces) = octahedron();
    let view = small("40,10").with_color(Color::Quality);
    let middle_of = |mesh: &Mesh| {
        let mut spectrum = empty(Placement::default(), [21; 3], vec![0.0, 2.0], (0.0, 1.0));
        add(&mut spectrum, mesh, &[(0, 8.0, MIDDLE), (1, 8.0, MIDDLE)]);
        draw(&spectrum, 0.0, &view).pixel(160, 110)
    };
    let [r, g, b, _] = middle_of(&(positions.clone(), faces.clone())).map(i32::from);
    assert!(r > 2 * b && g > 2 * b, "equilateral faces are yellow, not {r} {g} {b}");
    for p in &mut positions {
        p[0] *= 0.08;
        p[1] *= 0.08;
    }
    let [r, g, b, _] = middle_of(&(positions, faces)).map(i32::from);
    assert!(b > g && g > r, "slivers are blue, not {r} {g} {b}");
}

/// The scale of the colours of the last picture.
fn scale(renderer: &Renderer<'_>) -> Scale {
    renderer.attribute().and_then(|shown| shown.scale).expect("a scale")
}

#[test]
fn colors_of_lifetime_curvature_and_components_have_the_ends_they_state() {
    let view = small("35,22").with_color(Color::Curvature);
    let spectrum = growing_sphere(4);
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    renderer.draw(0.5, &view).expect("a picture");
    let Scale { low, high } = scale(&renderer);
    let curvature = 1.0 / radius_at(0.5);
    // Area-weighted normals lean towards the larger triangles: by a sixth of the curvature here, where the
    // sphere's triangles differ in size, however fine it is.
    assert!((high - curvature).abs() < curvature / 6.0, "{high}, not {curvature}");
    assert_eq!(low, -high);
    let fixed = view.clone().with_ends(ScaleEnds::between(-0.5, 0.5));
    renderer.draw(0.5, &fixed).expect("a picture");
    assert_eq!(scale(&renderer), Scale { low: -0.5, high: 0.5 });
    let lifetime = view.clone().with_color(Color::Lifetime);
    renderer.draw(0.5, &lifetime).expect("a picture");
    assert_eq!(scale(&renderer), Scale { low: 0.0, high: 1.0 });

    let mut two = empty(Placement::default(), [21; 3], vec![0.0, 2.0], (0.0, 1.0));
    for (y, n) in [(4.0, 3), (16.0, 2)] {
        let middle = [10.0, y, 10.0];
        add(&mut two, &sphere(n), &[(0, 4.0, middle), (1, 4.0, middle)]);
    }
    let view = small("0,0").with_color(Color::Component);
    let image = draw(&two, 0.0, &view);
    let pixel = |y| {
        let ([x, y], _) = project(two.volume(), &view, [14.0, y, 10.0]);
        image.pixel(x as u32, y as u32).map(i32::from)
    };
    let (larger, smaller) = (pixel(4.0), pixel(16.0));
    assert!(larger[2] > larger[0], "the larger component is blue, not {larger:?}");
    assert!(smaller[0] > smaller[2], "the smaller component is orange, not {smaller:?}");
}

#[test]
fn caps_are_left_out_of_an_open_picture_and_show_the_back() {
    let spectrum = growing_sphere(4).changed(|_, patch| {
        for triangle in &mut patch.triangles {
            let tops = triangle.vertices.map(|v| patch.knots[2 * v as usize].position[2]);
            triangle.cap = tops.iter().all(|&z| z >= 10.0);
        }
    });
    let spectrum = spectrum.expect("valid");
    let n_caps = spectrum.triangles().iter().filter(|triangle| triangle.cap).count();
    assert_eq!(2 * n_caps, spectrum.triangles().len());
    let closed = small("0,90");
    let open = closed.clone().with_open(true);
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    let [r, _, b, a] = renderer.draw(0.5, &closed).expect("a picture").pixel(160, 120);
    assert!(b > r && a == 255, "the front is blue");
    assert_eq!(renderer.n_triangles(), spectrum.triangles().len());
    let [r, _, b, a] = renderer.draw(0.5, &open).expect("a picture").pixel(160, 120);
    assert!(r > b && a == 255, "the back is orange");
    assert_eq!(renderer.n_triangles(), spectrum.triangles().len() - n_caps);
}

#[test]
fn several_surfaces_have_their_own_color_and_opacity() {
    let spectrum = growing_sphere(4);
    let view = small("35,22").with_background(Background::White);
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    let surface =
        |isovalue, color, opacity| Surface { isovalue, color: Some(color), opacity: Some(opacity) };
    // The sphere grows with the isovalue.
    let inner = surface(0.1, [0.0, 0.6, 0.0], 1.0);
    let outer = surface(0.9, [0.6, 0.0, 0.0], 0.5);
    let mut draw = |surfaces: &[Surface]| renderer.draw_all(surfaces, &view).expect("a picture");
    let both = draw(&[inner, outer]);
    let [r, g, b, _] = both.pixel(160, 120);
    assert!(r > b + 40 && g > b + 40, "one is seen through the other: {r} {g} {b}");
    assert!(both == draw(&[outer, inner]), "the order of surfaces does not matter");
    let [r, g, b, _] = draw(&[inner, Surface { opacity: Some(1.0), ..outer }]).pixel(160, 120);
    assert!(r > b + 40 && g < b + 40, "the outer one hides it: {r} {g} {b}");
    let [r, g, b, _] = draw(&[Surface { opacity: Some(0.0), ..outer }]).pixel(160, 120);
    assert_eq!([r, g, b], [255; 3], "nothing is left of it");
    let wrong = renderer.draw_all(&[Surface { opacity: Some(1.5), ..outer }], &view);
    assert!(matches!(wrong, Err(Error::Usage(_))));
}

#[test]
fn components_that_are_not_kept_are_not_drawn() {
    let mut two = empty(Placement::default(), [21; 3], vec![0.0, 2.0], (0.0, 1.0));
    for (y, radius) in [(4.0, 3.0), (15.0, 5.0)] {
        let middle = [10.0, y, 10.0];
        add(&mut two, &sphere(3), &[(0, radius, middle), (1, radius, middle)]);
    }
    let mut renderer = Renderer::new(gpu(), &two).expect("a renderer");
    let keep = Keep { largest: Some(1), ..Keep::default() };
    let background = Background::White;
    let view =
        small("0,0").with_keep(keep).with_background(background).with_color(Color::Component);
    let image = renderer.draw(0.0, &view).expect("a picture");
    let seen = |y: f64| {
        let ([x, y], _) = project(two.volume(), &view, [13.0, y, 10.0]);
        image.pixel(x as u32, y as u32)[..3] != [255; 3]
    };
    assert_eq!([seen(4.0), seen(15.0)], [false, true]);
    assert_eq!(2 * renderer.n_triangles(), two.triangles().len());
    let bounds = renderer.bounds(&[0.0], &keep).expect("in the range").expect("a sphere");
    assert!(bounds[0][1] > 9.9, "{bounds:?}");
    let small = view.clone().with_keep(Keep { at: Some([10.0, 0.0, 10.0]), ..Keep::default() });
    renderer.draw(0.0, &small).expect("a picture");
    let bounds = renderer.bounds(&[0.0], &small.keep).expect("in the range").expect("a sphere");
    assert!(bounds[1][1] < 7.1, "{bounds:?}");
}

#[test]
fn a_left_handed_grid_shows_its_front_too() {
    let spectrum = growing_sphere(2).changed(|about, _| {
        about.volume.placement.direction = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    });
    let spectrum = spectrum.expect("valid");
    let [r, _, b, a] = draw(&spectrum, 0.5, &small("35,22")).pixel(160, 120);
    assert!(b > r && a == 255, "the front is blue");
}

#[test]
fn two_runs_and_the_large_spectrum_path_give_equal_bytes() {
    let spectrum = growing_sphere(4);
    for view in [
        small("35,22").with_wireframe(Some(1.0)).with_color(Color::Quality),
        small("-60,-20,0.8").with_color(Color::Component).with_background(Background::White),
        small("35,22").with_opacity(0.4),
    ] {
        let first = draw(&spectrum, 0.4, &view);
        assert!(first == draw(&spectrum, 0.4, &view), "a second renderer draws the same");

        let budget = 16 << 10;
        let mut large = Renderer::with_budget(gpu(), &spectrum, budget).expect("a renderer");
        // Other pictures in between have no effect.
        for isovalue in [0.4, 0.9, 0.4, 0.4] {
            let image = large.draw(isovalue, &view).expect("a picture");
            assert_eq!(image == first, isovalue == 0.4, "isovalue {isovalue}");
        }
    }
}

#[test]
fn an_empty_isosurface_is_a_picture_of_the_background() {
    let spectrum = empty(Placement::default(), [8; 3], Vec::new(), (0.0, 1.0));
    let image = draw(&spectrum, 0.5, &small("0,0").with_background(Background::White));
    assert!(image.pixels.iter().all(|&c| c == 255));
}

#[test]
fn invalid_isovalues_and_views_are_errors() {
    let spectrum = growing_sphere(0);
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    let view = small("0,0");
    for isovalue in [-0.1, 1.1, f64::NAN] {
        let error = renderer.draw(isovalue, &view).expect_err("outside the range");
        assert!(matches!(error, isospectrum::Error::Range { .. }), "{error}");
    }
    let mut far = view.camera;
    far.distance = f64::NAN;
    for wrong in [
        view.clone().with_width(0),
        view.clone().with_height(1 << 20),
        view.clone().with_wireframe(Some(-1.0)),
        view.clone().with_ends(ScaleEnds { center: Some(f64::NAN), ..ScaleEnds::default() }),
        view.clone().with_camera(far),
    ] {
        let error = renderer.draw(0.5, &wrong).expect_err("no such view");
        assert!(matches!(error, isospectrum::Error::Usage(_)), "{error}");
    }
}

#[test]
fn a_lost_device_is_an_error_of_one_line() {
    let lost = open();
    let spectrum = growing_sphere(1);
    let mut renderer = Renderer::new(&lost, &spectrum).expect("a renderer");
    renderer.draw(0.5, &small("0,0")).expect("a picture");
    lost.lose();
    for error in [
        renderer.draw(0.6, &small("0,0")).expect_err("a lost device"),
        renderer.draw(0.6, &small("0,0").with_width(99)).expect_err("a lost device"),
        Renderer::new(&lost, &spectrum).map(|_| ()).expect_err("a lost device"),
    ] {
        assert!(matches!(error, Error::Gpu(_)), "{error}");
        assert!(!error.to_string().contains('\n'), "{error}");
    }
}

#[test]
fn a_picture_fits_the_surface_and_keeps_its_shape() {
    let spectrum = growing_sphere(4);
    let mut renderer = Renderer::new(gpu(), &spectrum).expect("a renderer");
    for camera in ["35,22", "-80,-60"] {
        for isovalue in [0.1, 1.0] {
            let mut view = small(camera);
            let bounds = renderer
                .bounds(&[isovalue], &Keep::default())
                .expect("in the range")
                .expect("a sphere");
            view.fit(spectrum.volume(), bounds);
            let (area, middle) = coverage(&renderer.draw(isovalue, &view).expect("a picture"));
            // Seen obliquely, the box around a ball is wider than the ball by up to the square root of three.
            let share = 2.0 * (area / PI).sqrt() / f64::from(view.height);
            assert!((0.5..=0.95).contains(&share), "{camera} at {isovalue}: {share} of the height");
            for (found, size) in middle.into_iter().zip([view.width, view.height]) {
                assert!((found - 0.5 * f64::from(size)).abs() < MIDDLE_TOLERANCE, "{middle:?}");
            }
        }
    }
    // A view that fits two isosurfaces fits the larger one.
    let [one, both] = [&[1.0][..], &[0.1, 1.0]]
        .map(|c| renderer.bounds(c, &Keep::default()).expect("in the range"));
    assert_eq!(one, both);
    let mut twice = small("35,22").with_camera("35,22,2".parse().expect("a camera"));
    let mut once = small("35,22");
    let bounds = one.expect("a sphere");
    twice.fit(spectrum.volume(), bounds);
    once.fit(spectrum.volume(), bounds);
    assert!((twice.camera.distance / once.camera.distance - 2.0).abs() < 1e-12);
}

#[test]
fn a_tiny_surface_is_shown_with_its_surroundings() {
    let spectrum = growing_sphere(2);
    let mut view = small("35,22");
    view.fit(spectrum.volume(), [MIDDLE; 2]);
    let mut wider = small("35,22");
    wider.fit(spectrum.volume(), [MIDDLE.map(|x| x - 0.5), MIDDLE.map(|x| x + 0.5)]);
    assert_eq!(view, wider);
    assert!(view.camera.distance > 0.0);
}

#[test]
fn a_clip_plane_caps_the_inside_of_a_surface() {
    // Seen along x, from the side that is cut off: a ball of 8 voxels around (10, 10, 10), cut in its middle, with a cavity of
    // 3 voxels.
    let mut spectrum = empty(Placement::default(), [21; 3], vec![0.0, 2.0], (0.0, 1.0));
    add(&mut spectrum, &sphere(4), &[(0, 8.0, MIDDLE), (1, 8.0, MIDDLE)]);
    let (positions, mut faces) = sphere(4);
    faces.iter_mut().for_each(|face| face.swap(1, 2));
    add(&mut spectrum, &(positions, faces), &[(0, 3.0, MIDDLE), (1, 3.0, MIDDLE)]);
    let clip = Some(Clip { normal: [1.0, 0.0, 0.0], offset: 10.0 });
    for view in [small("0,0"), parallel(small("0,0"))] {
        a_cut_ball_is_covered(&spectrum, &view.with_clip(clip));
    }
}

fn a_cut_ball_is_covered(spectrum: &Spectrum, view: &View) {
    let image = draw(spectrum, 0.5, view);
    let pixel = |y: f64, z: f64| {
        let ([x, y], _) = project(spectrum.volume(), view, [10.0, y, z]);
        image.pixel(x as u32, y as u32)
    };
    // The cap is flat, so it has one colour, unlike a curved side.
    let cap = pixel(15.5, 10.0);
    for (y, z) in [(4.5, 10.0), (10.0, 15.5), (10.0, 4.5), (14.0, 14.0)] {
        let other = pixel(y, z);
        // Light comes a little from the side.
        let off = (0..3).map(|i| cap[i].abs_diff(other[i])).max();
        assert!(off < Some(12), "({y}, {z}): {other:?}, not {cap:?}");
    }
    assert!(pixel(10.0, 10.0)[0].abs_diff(cap[0]) > 20, "the cavity is visible");
    let outside = pixel(10.0, 19.0);
    assert_eq!(outside, image.pixel(2, 2), "background outside the ball");
    // Without caps the inside is visible.
    let open = draw(spectrum, 0.5, &view.clone().with_open(true));
    let ([x, y], _) = project(spectrum.volume(), view, [10.0, 15.5, 10.0]);
    assert!(open.pixel(x as u32, y as u32)[2].abs_diff(cap[2]) > 10);
}
