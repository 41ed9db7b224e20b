//! The controls of the panel next to the picture.

use super::server::{Server, wait_for};
use super::window::{Picture, TIES, Window};
use crate::common::program::Folder;

#[test]
fn every_control_of_the_panel_works() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.2", "--mark", "0.4"]);
    window.point(400, 250);
    let whole = window.picture();

    // The plane cuts off half of the ball; the camera does not move.
    window.click_on("CheckBox", "clip across");
    let clipped = window.picture();
    assert!(clipped.difference(&whole) > 0.05, "the plane cuts");
    assert!(clipped.covered() < whole.covered(), "and leaves less");
    window.click_on("CheckBox", "clip across");
    assert!(window.picture() == whole, "without the plane all is as before");

    // From the right end of the slider to its middle, and beyond the end.
    let slider = window.control("Slider", "opacity");
    let (middle, y) = slider.middle();
    let right = slider.left + slider.width;
    window.drag(1, (right - 7, y), (middle, y));
    assert!(window.picture().difference(&whole) > 0.05, "the surface is transparent");
    window.drag(1, (middle, y), (right + 10, y));
    assert!(window.picture().difference(&whole) < TIES, "opaque again");

    window.click_on("CheckBox", "parallel projection");
    let parallel = window.picture();
    // Parts nearer than the middle of the ball are no longer larger.
    let share = parallel.covered() / whole.covered();
    assert!(parallel.difference(&whole) > 0.005 && share < 0.995, "{share} in parallel projection");
    window.click_on("CheckBox", "parallel projection");
    assert!(window.picture() == whole, "in perspective all is as before");

    window.choose("background", "dark");
    let dark = window.picture();
    assert!(dark.pixels[0].iter().all(|&c| c < 64), "dark: {:?}", dark.pixels[0]);
    window.choose("background", "white");
    assert!(window.picture() == whole, "white again");

    window.click_on("Button", "ply");
    wait_for("the mesh", || folder.names().contains(&"s-0.2.ply".to_owned()).then_some(()));
    folder.run(&["extract", "s.isp", "-c", "0.2", "-o", "m.ply"]);
    assert!(folder.read("s-0.2.ply") == folder.read("m.ply"), "the mesh is what extract writes");

    window.click_on("Button", "sweep");
    let last = folder.path().join("s-sweep").join("s-00100.png");
    wait_for("the last picture of the sweep", || last.exists().then_some(()));
    window.wait_for_isovalue(|c| c == 0.2);
    let frames = std::fs::read_dir(folder.path().join("s-sweep")).expect("a folder").count();
    assert_eq!(frames, 100);
}

#[test]
fn isovalues_are_suggested_and_kept_next_to_each_other() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window =
        Window::open(&server, &folder, &["s.isp", "-c", "0.2", "--mark", "-0.2=outer,0.4"]);
    window.point(400, 250);
    let (_, n_inner) = window.seen();
    let inner = window.picture();
    window.click_on("Button", "outer");
    window.wait_for_isovalue(|c| c == -0.2);
    let (_, n_outer) = window.seen();
    let outer = window.picture();
    assert!(
        outer.covered() > 1.1 * inner.covered(),
        "the marked isovalue is that of a larger ball"
    );
    // It stays, in another colour, while the slider moves.
    window.click_on("Button", "keep this isovalue");
    window.type_isovalue("0.2");
    wait_for("two surfaces", || (window.seen().1 == n_inner + n_outer).then_some(()));
    window.point(400, 250);
    let both = window.picture();
    assert!(both.difference(&inner) > 0.05 && both.difference(&outer) > 0.05);
    // It can be removed.
    window.click_on("Button", "remove");
    wait_for("one surface", || (window.seen().1 == n_inner).then_some(()));
    window.point(400, 250);
    assert_eq!(window.picture().difference(&inner), 0.0);
}

#[test]
fn surfaces_colours_and_a_plane_are_set_by_flags() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let arguments =
        ["-c", "0.2=bone", "-c", "-0.2=skin@0.3", "--clip", "y:60%", "--background", "dark"];
    let window = Window::open(&server, &folder, &[&["s.isp"][..], &arguments].concat());
    window.point(400, 250);
    let seen = window.picture();
    let size = format!("{}x{}", seen.width, seen.height());
    let rest = ["--size", &size, "-o", "r.png"];
    folder.run(&[&["render", "s.isp"][..], &arguments, &rest].concat());
    let rendered = Picture::read(&folder.path().join("r.png"));
    // The window fits the isosurface of the slider, `render` all of them, so the cameras differ.
    assert!(seen.covered() > 0.9 && rendered.covered() > 0.9, "both are dark");
    let colors = |picture: &Picture| {
        let is_bone = |p: &&[u8; 3]| p[0] > 150 && p[0] > p[2] && p[0] - p[2] < 60;
        picture.pixels.iter().filter(is_bone).count()
    };
    assert!(colors(&seen) > 1000 && colors(&rendered) > 1000, "both show bone");
}
