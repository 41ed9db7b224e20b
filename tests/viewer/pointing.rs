//! Picking with the pointer: components to keep or hide, distances, positions; the orientation cube.

use super::server::{Server, wait_for};
use super::window::Window;
use crate::common::program::Folder;

/// Two separate balls of 5 and 3 samples: `s.isp`. Isovalues are minus the distance from the surface at 0.
fn two_balls() -> Folder {
    let folder = Folder::new();
    let sample = |i: usize| {
        let at = [i % 40, i / 40 % 20, i / 800].map(|x| x as f64);
        let reach = |middle: [f64; 3], radius: f64| {
            radius - [0, 1, 2].map(|a| (at[a] - middle[a]).powi(2)).iter().sum::<f64>().sqrt()
        };
        reach([10.0, 9.5, 9.5], 5.0).max(reach([29.0, 9.5, 9.5], 3.0)) as f32
    };
    let bytes: Vec<u8> = (0..40 * 20 * 20).flat_map(|i| sample(i).to_le_bytes()).collect();
    folder.write("balls_40x20x20_float32.raw", &bytes);
    folder.run(&["compute", "-q", "balls_40x20x20_float32.raw", "-o", "s.isp", "--backend", "cpu"]);
    folder
}

#[test]
fn components_are_selected_hidden_and_followed_by_the_mouse() {
    let server = Server::start();
    let folder = two_balls();
    // From the front the balls are left and right.
    let arguments = ["s.isp", "-c", "0", "--camera", "-90,0", "--mark", "1"];
    let window = Window::open(&server, &folder, &arguments);
    window.point(5, 5);
    let both = window.picture();
    let (_, n) = window.seen();
    let n_of = |isovalue: &str, x: &str| {
        folder.run(&["extract", "s.isp", "-c", isovalue, "--at", x, "-o", "m.stl"]);
        (folder.read("m.stl").len() - 84) / 50
    };
    let [large, small] = ["10,9.5,9.5", "29,9.5,9.5"].map(|at| n_of("0", at));
    assert_eq!(n, large + small);
    let half = both.width / 2;
    let (x, y) = both.middle_between(half, both.width);
    window.point(x, y);
    window.input("key x");
    wait_for("the large one", || (window.seen().1 == large).then_some(()));
    // It stays hidden where it is smaller, and saved meshes have the visible components.
    window.type_isovalue("1.5");
    let left = n_of("1.5", "10,9.5,9.5");
    wait_for("the large one, smaller", || (window.seen() == (1.5, left)).then_some(()));
    window.point(5, 5);
    window.save_mesh("seen.stl");
    assert_eq!((folder.read("seen.stl").len() - 84) / 50, left);
    window.type_isovalue("0");
    wait_for("the large one again", || (window.seen() == (0.0, large)).then_some(()));
    window.input("key a");
    wait_for("both", || (window.seen().1 == n).then_some(()));
    // With the button and a click. Beyond its maximum the component is gone; it is selected again when it comes back.
    window.click_on("Button", "keep one");
    window.click(x, y);
    wait_for("the small one", || (window.seen().1 == small).then_some(()));
    window.type_isovalue("4");
    wait_for("nothing", || (window.seen() == (4.0, 0)).then_some(()));
    window.type_isovalue("0");
    wait_for("the small one again", || (window.seen() == (0.0, small)).then_some(()));
}

#[test]
fn distances_and_positions_are_shown() {
    let server = Server::start();
    let folder = two_balls();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0", "--camera", "-90,0"]);
    window.point(5, 5);
    let picture = window.picture();
    let half = picture.width / 2;
    let [a, b] = [picture.middle_between(0, half), picture.middle_between(half, picture.width)];
    window.input("key m");
    window.click(a.0, a.1);
    window.click(b.0, b.1);
    window.point(5, 5);
    let shown = window.screen(picture.width, picture.height());
    // Half-way there is no surface, so only the line and the cube are drawn.
    let (x, y) = ((a.0 + b.0) / 2, (a.1 + b.1) / 2);
    let at = |x: i32, y: i32| shown.pixels[y as usize * shown.width + x as usize];
    assert!((y - 2..=y + 2).any(|y| at(x, y)[0] < 160), "a line crosses the gap");
    let changed = shown.without_cube().difference(&picture.without_cube());
    assert!(0.0 < changed && changed < 0.02, "{changed}");
    // The same key removes the line.
    window.input("key m");
    let shown = window.screen(picture.width, picture.height());
    assert_eq!(shown.without_cube().difference(&picture.without_cube()), 0.0);
    // The position under a resting pointer is shown in the left corner.
    window.point(a.0, a.1);
    let words = |picture: &super::window::Picture| {
        let rows = (0..30).flat_map(|y| picture.pixels[y * picture.width..][..300].to_vec());
        rows.filter(|p| p[0] < 128).count()
    };
    let shown = wait_for("the place", || {
        let shown = window.screen(picture.width, picture.height());
        (words(&shown) > 100).then_some(shown)
    });
    assert_eq!(words(&picture), 0);
    assert!(shown.without_cube().difference(&picture.without_cube()) < 0.02);
}

#[test]
fn a_click_on_the_cube_turns_the_camera_to_that_side() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.2", "--wireframe"]);
    window.point(400, 250);
    let first = window.picture();
    window.input("key 1");
    let from_x = window.picture();
    assert!(from_x.difference(&first) > 0.01);
    window.input("key ctrl+z");
    wait_for("the view before", || (window.picture().difference(&first) == 0.0).then_some(()));
    // The middle of the side towards +x in the first view.
    let cube = (first.width as i32 - 38, 38);
    window.click(cube.0 - 10, cube.1 + 5);
    window.point(400, 250);
    assert_eq!(window.picture().difference(&from_x), 0.0);
}
