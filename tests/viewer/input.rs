//! Mouse and keys on the surface, and undo.

use std::thread::sleep;

use super::server::{EVENT_INTERVAL, Server};
use super::window::Window;
use crate::common::program::Folder;

#[test]
fn mouse_and_keys_move_the_surface() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.5"]);
    window.point(400, 250);
    let first = window.picture();
    let changes = |what: &str| {
        let picture = window.picture();
        assert!(picture.difference(&first) > 0.01, "{what} changes the picture");
        window.input("key r");
        let back = window.picture().difference(&first);
        assert_eq!(back, 0.0, "R brings the first view back after {what}");
    };
    // The wireframe makes rotation of the sphere visible.
    window.input("key w");
    let edges = window.picture();
    assert!(edges.difference(&first) > 0.01, "W draws edges");
    window.drag(1, (300, 200), (420, 260));
    assert!(window.picture().difference(&edges) > 0.01, "the left button turns");
    window.input("key w");
    window.input("key r");
    window.drag(3, (300, 200), (420, 260));
    changes("moving by the right button");
    window.drag(2, (300, 200), (250, 300));
    changes("moving by the middle button");
    window.input("key shift+Right");
    changes("moving by keys");
    window.input("key v");
    let all = window.picture().covered();
    assert!(all < 0.98 * first.covered(), "V makes room for larger surfaces: {all}");
    changes("fitting all");
    for modifier in ["", "ctrl"] {
        window.point(400, 250);
        if !modifier.is_empty() {
            window.input(&format!("keydown {modifier}"));
        }
        window.input("click 4");
        if !modifier.is_empty() {
            window.input(&format!("keyup {modifier}"));
        }
        let covered = window.picture().covered();
        assert!(covered > 1.02 * first.covered(), "the wheel zooms in: {covered}");
        changes("zooming");
    }
    // A point next to the middle moves to the middle.
    window.point(440, 280);
    window.input("click --repeat 2 --delay 80 1");
    changes("a double click");
}

#[test]
fn wheel_and_keys_step_through_isovalues() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.5"]);
    let near = |wanted: f64| move |c: f64| (c - wanted).abs() < 1e-6;
    window.point(400, 250);
    // The range is -0.77 to 0.88: steps are 0.01, fine ones a tenth of that.
    window.input("key period");
    window.wait_for_isovalue(near(0.51));
    window.input("key comma");
    window.input("key comma");
    window.wait_for_isovalue(near(0.49));
    window.input("key shift+period");
    window.wait_for_isovalue(near(0.491));
    // Where a pointer has no scroll axes, winit reports a notch at the press and at the release.
    let turn_wheel = |button: u32| {
        window.input("keydown shift");
        window.input(&format!("click {button}"));
        window.input("keyup shift");
    };
    turn_wheel(4);
    let up = window.wait_for_isovalue(|c| c > 0.4999 - 0.001);
    assert!(near(0.5)(up) || near(0.51)(up), "{up}");
    turn_wheel(5);
    let down = window.wait_for_isovalue(|c| c < up);
    assert!((up - down - 0.01).abs() < 1e-6 || (up - down - 0.02).abs() < 1e-6, "{up} {down}");
    window.input("key End");
    let high = window.wait_for_isovalue(|c| c > 0.8);
    window.input("key Home");
    window.wait_for_isovalue(|c| c < -0.7 && c < high);
    window.type_isovalue(&down.to_string());
    window.wait_for_isovalue(near(down));
    window.point(400, 250);
    window.input("key space");
    let played = window.wait_for_isovalue(|c| (c - down).abs() > 0.01);
    window.input("key space");
    sleep(EVENT_INTERVAL);
    let (stopped, _) = window.seen();
    sleep(3 * EVENT_INTERVAL);
    assert_eq!(window.seen().0, stopped, "Space stops what it started at {played}");
    // The middle of the slider is the middle of the range.
    window.point(500, 650);
    window.input("click 1");
    window.wait_for_isovalue(|c| (c - 0.055).abs() < 0.03);
    // Invalid input changes nothing.
    window.type_isovalue("2");
    window.type_isovalue("p5x");
    window.wait_for_isovalue(|c| (c - 0.055).abs() < 0.03);
}

#[test]
fn views_are_undone_and_redone() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.2", "--wireframe"]);
    window.point(400, 250);
    let first = window.picture();
    window.drag(1, (300, 200), (420, 260));
    sleep(3 * EVENT_INTERVAL);
    let second = window.picture();
    window.drag(1, (300, 200), (340, 300));
    sleep(3 * EVENT_INTERVAL);
    let third = window.picture();
    assert!(first.difference(&second) > 0.01 && second.difference(&third) > 0.01);
    for (keys, wanted) in [
        ("ctrl+z", &second),
        ("ctrl+z", &first),
        ("ctrl+z", &first),
        ("ctrl+y", &second),
        ("ctrl+shift+z", &third),
    ] {
        window.input(&format!("key {keys}"));
        assert_eq!(window.picture().difference(wanted), 0.0, "{keys}");
    }
}
