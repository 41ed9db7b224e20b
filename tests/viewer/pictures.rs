//! The window shows the pictures that `render` draws.

use super::server::Server;
use super::window::{Picture, TIES, Window};
use crate::common::program::Folder;

#[test]
fn the_window_shows_what_render_draws() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "50%"]);
    for (typed, color) in [("20%", "none"), ("0.45", "none"), ("70%", "none")] {
        let before = window.picture();
        window.type_isovalue(typed);
        let kept = window.picture();
        // The view stays while the isovalue moves; R fits the surface that is shown, as `render` does.
        window.input("key r");
        let saved = window.picture();
        assert!(saved.covered() > 0.1, "the surface fills the picture at {typed}");
        if typed == "20%" {
            assert!(kept.difference(&before) > 0.0 && saved.difference(&kept) > 0.0, "R fits");
        }

        let (isovalue, n_triangles) = window.seen();
        let size = format!("{}x{}", saved.width, saved.height());
        let isovalue = isovalue.to_string();
        folder.run(&[
            "render", "s.isp", "-c", &isovalue, "--size", &size, "--color", color, "-o", "r.png",
        ]);
        let rendered = Picture::read(&folder.path().join("r.png"));
        std::fs::remove_file(folder.path().join("r.png")).expect("removed");
        let difference = saved.difference(&rendered);
        assert!(difference < TIES, "{difference} of the pixels differ at {typed}");
        folder.run(&["extract", "s.isp", "-c", &isovalue, "-o", "m.ply"]);
        let head = String::from_utf8_lossy(&folder.read("m.ply")[..400]).into_owned();
        assert!(head.contains(&format!("element face {n_triangles}\n")), "{head}");

        // The pointer's own picture is drawn over the screen.
        window.point(900, 400);
        let shown = window.screen(saved.width, saved.height());
        let difference = shown.without_cube().difference(&saved.without_cube());
        assert_eq!(difference, 0.0, "the screen equals the picture that S saves at {typed}");
        assert!(shown.difference(&saved) > 0.0, "and the cube over it");
    }
}

#[test]
fn the_window_shows_overlays_and_occlusion_as_render_does() {
    let server = Server::start();
    let folder = Folder::new();
    // A ring, which has a hollow.
    folder.run(&["compute", "-q", "--phantom", "torus:14", "--backend", "cpu", "-o", "s.isp"]);
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.65"]);
    window.point(400, 250);
    // The first picture fits the window of the first frame, which may have had another size.
    window.input("key r");
    let plain = window.picture();
    for (key, flags) in [
        ("g", &["--axes"][..]),
        ("d", &["--occlusion"]),
        ("o", &["--orthographic"]),
        ("1", &["--camera", "0,0"]),
        ("6", &["--camera", "90,-90"]),
    ] {
        window.input(&format!("key {key}"));
        if ["1", "6", "o", "g"].contains(&key) {
            // Other keys keep the fitted distance; a new direction or projection, and the volume's box, need another one.
            window.input("key r");
        }
        if key == "1" || key == "6" {
            window.input(&format!("key {key}"));
        }
        let seen = window.picture();
        assert!(seen.difference(&plain) > 0.005, "{key} changes the picture");
        if flags[0] != "--camera" {
            let size = format!("{}x{}", seen.width, seen.height());
            let base = ["render", "s.isp", "-c", "0.65", "--size", &size, "-o", "r.png"];
            folder.run(&[&base[..], flags].concat());
            let rendered = Picture::read(&folder.path().join("r.png"));
            std::fs::remove_file(folder.path().join("r.png")).expect("removed");
            let difference = seen.difference(&rendered);
            assert!(difference < TIES, "{difference} of the pixels differ with {flags:?}");
            window.input(&format!("key {key}"));
        }
        window.input("key r");
        assert_eq!(window.picture().difference(&plain), 0.0, "and back after {key}");
    }
    let (isovalue, _) = window.seen();
    window.input("key n");
    let up = window.wait_for_isovalue(|c| c > isovalue);
    window.input("key p");
    window.wait_for_isovalue(|c| c < up);
}
