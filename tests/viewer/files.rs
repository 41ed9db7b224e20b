//! Opening, computing and saving.

use std::io::Read as _;
use std::path::Path;
use std::process::{Command, Stdio};

use super::server::{Server, wait_for};
use super::window::Window;
use crate::common::program::{self, Folder};

#[test]
fn files_are_opened_and_saved_by_dialogs_and_several_stay_open() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    folder.run(&["compute", "-q", "--phantom", "torus:10", "--backend", "cpu", "-o", "torus.isp"]);
    let window = Window::open_titled(&server, &folder, &[], "isospectrum");
    let (width, screen) = server.screen();
    // Letters are dark on light: the empty window can be read.
    let row = |y: usize| &screen[y * width + 300..y * width + 900];
    let light = (150..600).flat_map(row).filter(|p| p[0] > 200).count();
    assert!(light > 450 * 600 * 8 / 10, "{light} pixels are light");

    let open = |name: &str| {
        window.input("key ctrl+o");
        window.input(&format!("type --delay 60 {name}"));
        window.input("key Return");
        wait_for(name, || window.title().starts_with(name).then_some(()));
    };
    open("s.isp");
    window.type_isovalue("0.2");
    window.wait_for_isovalue(|c| c == 0.2);
    window.point(400, 250);
    window.save_mesh("mine.ply");
    folder.run(&["extract", "s.isp", "-c", "0.2", "-o", "m.ply"]);
    assert!(folder.read("mine.ply") == folder.read("m.ply"), "the mesh is that of extract");
    // An error of saving is shown, and the dialog stays until Escape.
    window.input("key ctrl+s");
    window.input("key ctrl+a");
    window.input("type --delay 60 mine.doc");
    window.input("key Return");
    window.input("key Escape");
    assert!(!folder.names().contains(&"mine.doc".to_owned()));

    open("torus.isp");
    // The list of open spectra is behind the buttons; closing one shows the one before in its previous state.
    window.click_on("Button", "close");
    wait_for("the first one", || window.title().starts_with("s.isp").then_some(()));
    assert_eq!(window.seen().0, 0.2);
}

#[test]
fn a_computation_can_be_cancelled() {
    let server = Server::start();
    let folder = Folder::new();
    let window = Window::open_titled(&server, &folder, &["--phantom", "noise:64"], "working");
    window.click_on("Button", "cancel");
    wait_for("nothing", || (window.title() == "isospectrum").then_some(()));
    window.input("key h");
    assert_eq!(window.title(), "isospectrum");
}

#[test]
fn a_volume_is_computed_and_shown() {
    let server = Server::start();
    let folder = Folder::new();
    let window = Window::open(&server, &folder, &["--phantom", "sphere:12"]);
    window.wait_for_isovalue(|c| (0.0..0.2).contains(&c));
    assert!(window.seen().1 > 100, "{}", window.title());
    // Its samples are known.
    window.type_isovalue("p50");
    let median = window.wait_for_isovalue(|c| !(0.05..0.06).contains(&c));
    assert!((-0.5..0.5).contains(&median), "{median}");
    // Its spectrum is saved, and is that of the program.
    window.save_mesh("saved.isp");
    let output = folder.run(&["info", "saved.isp", "--json"]);
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(facts["volume"]["dims"], serde_json::json!([12, 12, 12]));
    assert!(facts["n_triangles"].as_u64() > Some(100));
}

#[test]
fn the_settings_of_a_computation_are_asked_for_with_their_cost() {
    let server = Server::start();
    let folder = Folder::new();
    // A ball with noise: many events of little persistence.
    let sample = |i: usize| {
        let square = |x: usize| (x as f64 - 7.5).powi(2);
        let radius = (square(i % 16) + square(i / 16 % 16) + square(i / 256)).sqrt();
        (200.0 - 20.0 * radius + (i * 7919 % 13) as f64).max(0.0) as u8
    };
    let samples: Vec<u8> = (0..16 * 16 * 16).map(sample).collect();
    folder.write("ball_16x16x16_uint8.raw", &samples);
    let window = Window::open_titled(&server, &folder, &["ball_16x16x16_uint8.raw"], "ball");
    let whole = window.control("Label", "roughly");
    // One isosurface is there already.
    let (width, screen) = server.screen();
    let teal = |p: &&[u8; 3]| p[1] / 2 > p[0] / 2 + 15 && p[2] / 2 > p[0] / 2 + 15;
    assert!(screen.iter().filter(teal).count() > 5000, "a surface on a screen {width} pixels wide");

    // A wrong range is a message; a narrower one costs less.
    let range = window.control("TextInput", "range").middle();
    let fill = |text: &str| {
        window.click(range.0, range.1);
        window.input("key ctrl+a");
        window.input(&format!("type --delay 40 {text}"));
    };
    fill("5");
    window.control("Label", "'5', expected LOW:HIGH");
    fill("60:120");
    let part = wait_for("another cost", || {
        let part = window.control("Label", "roughly");
        (part != whole).then_some(part)
    });
    window.click_on("TextInput", "persistence");
    window.input("type --delay 40 20");
    wait_for("another cost", || (window.control("Label", "roughly") != part).then_some(()));
    window.click_on("Button", "compute");
    window.control("TextInput", "isovalue");
    window.save_mesh("saved.isp");
    let output = folder.run(&["info", "saved.isp", "--json"]);
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(facts["range"], serde_json::json!([60.0, 120.0]));
    assert_eq!(facts["parameters"]["simplification"]["persistence"], 20.0);
}

#[test]
fn files_that_cannot_be_shown_are_errors_of_one_line() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let mut damaged = folder.read("s.isp");
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    folder.write("damaged.isp", &damaged);
    folder.write("volume_2x2x2_uint8.raw", &[1, 2, 3]);
    let run = |display: Option<&str>, arguments: &[&str]| {
        let mut command = Command::new(program::path());
        command.arg("view").args(arguments).current_dir(folder.path());
        command.env_remove("WAYLAND_DISPLAY").env_remove("DISPLAY").stderr(Stdio::piped());
        display.map(|display| command.env("DISPLAY", display));
        let mut process = command.spawn().expect("the program");
        let mut text = String::new();
        process.stderr.take().expect("a pipe").read_to_string(&mut text).expect("text");
        (process.wait().expect("a state").code(), text)
    };
    let cases: [(Option<&str>, &[&str], i32, &str); 5] = [
        (Some(&server.display), &["damaged.isp"], 3, "damaged.isp: "),
        (Some(&server.display), &["nothing.isp"], 3, "nothing.isp: "),
        (Some(&server.display), &["volume_2x2x2_uint8.raw"], 3, "volume_2x2x2_uint8.raw: "),
        (Some(&server.display), &["s.isp", "-c", "7"], 4, "isovalue 7 is outside"),
        (None, &["s.isp"], 1, "no window: "),
    ];
    for (display, arguments, code, words) in cases {
        let (found, text) = run(display, arguments);
        assert_eq!(found, Some(code), "{arguments:?}: {text}");
        assert_eq!(text.lines().count(), 1, "{arguments:?}: {text}");
        assert!(text.contains(words), "{arguments:?}: {text}");
    }
    assert!(Path::new(folder.path()).join("s.isp").exists());
}
