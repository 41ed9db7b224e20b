//! The window as people use it: a real one on a virtual X server, driven by its mouse and keys.
//!
//! `scripts/test-viewer` runs it. It needs Xvfb and xdotool and fails, never skips, without them.
//! What the window shows is read from the server's frame buffer and from its title.

mod program;

use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use program::Folder;

/// How long the window may take for anything; a software adapter on a busy machine is slow.
const PATIENCE: Duration = Duration::from_secs(120);

/// How long the window gets to see one event before the next: events of one frame are seen at once.
const BREATH: Duration = Duration::from_millis(400);

/// Where the button that closes one of several spectra is, from the top left of the window.
const CLOSE: (i32, i32) = (591, 566);

/// Channels of a pixel may differ by this much between two ways to the same picture: rounding once.
const SAME: u8 = 1;

/// Share of pixels that may differ more: where two triangles are equally far, the first one drawn is
/// seen, and a window draws in the order in which triangles came to life.
const TIES: f64 = 1e-3;

/// A virtual X server.
struct Server {
    process: Child,
    display: String,
    folder: tempfile::TempDir,
}

impl Server {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let mut process = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x900x24", "-fbdir"])
            .arg(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|e| panic!("no Xvfb ({e}): apt-get install xvfb xdotool"));
        let mut number = String::new();
        let stdout = process.stdout.take().expect("a pipe");
        BufReader::new(stdout).read_line(&mut number).expect("the number of the display");
        let display = format!(":{}", number.trim());
        Server { process, display, folder }
    }

    fn xdotool(&self, arguments: &str) -> String {
        let output = Command::new("xdotool")
            .args(arguments.split_whitespace())
            .env("DISPLAY", &self.display)
            .output()
            .unwrap_or_else(|e| panic!("no xdotool ({e}): apt-get install xvfb xdotool"));
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// What is on the screen: width and red, green, blue of each pixel. The format is that of xwd:
    /// a head of 25 numbers, colours, then rows of four bytes a pixel.
    fn screen(&self) -> (usize, Vec<[u8; 3]>) {
        let bytes = std::fs::read(self.folder.path().join("Xvfb_screen0")).expect("the screen");
        let number = |i: usize| {
            let word = bytes[4 * i..4 * i + 4].try_into().expect("four bytes");
            u32::from_be_bytes(word) as usize
        };
        let (head, width, height, row, n_colors) =
            (number(0), number(4), number(5), number(12), number(19));
        let first = head + 12 * n_colors;
        let pixels = (0..height).flat_map(|y| {
            let row = &bytes[first + y * row..][..4 * width];
            row.chunks_exact(4).map(|p| [p[2], p[1], p[0]]).collect::<Vec<_>>()
        });
        (width, pixels.collect())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A window on the server.
struct Window<'a> {
    server: &'a Server,
    folder: &'a Folder,
    process: Child,
    id: String,
}

impl<'a> Window<'a> {
    fn open(server: &'a Server, folder: &'a Folder, arguments: &[&str]) -> Self {
        Self::open_titled(server, folder, arguments, "isovalue")
    }

    /// Opens a window and waits until its title has a word.
    fn open_titled(server: &'a Server, folder: &'a Folder, arguments: &[&str], word: &str) -> Self {
        let process = Command::new(program::path())
            .args(["-q", "view", "--size", "1000x700"])
            .args(arguments)
            .current_dir(folder.path())
            .env("DISPLAY", &server.display)
            .env_remove("WAYLAND_DISPLAY")
            .spawn()
            .expect("the program");
        let mut window = Window { server, folder, process, id: String::new() };
        window.id = wait_for("a window", || {
            if let Some(status) = window.process.try_wait().expect("a state") {
                panic!("the window ended: {status}");
            }
            // One that is not seen yet takes no focus.
            let found = server.xdotool(&format!("search --onlyvisible --name {word}"));
            found.lines().next().map(str::to_owned)
        });
        // What a window manager does with a new window; there is none.
        window.input(&format!("windowfocus --sync {}", window.id));
        window
    }

    fn title(&self) -> String {
        self.server.xdotool(&format!("getwindowname {}", self.id))
    }

    /// The isovalue and the number of triangles that the title tells.
    fn seen(&self) -> (f64, usize) {
        let title = self.title();
        let part = |name: &str, skip: usize| {
            let words: Vec<&str> = title.split_whitespace().collect();
            let at = words.iter().position(|w| *w == name).unwrap_or_else(|| panic!("{title}"));
            words[(at + skip) - 1].to_owned()
        };
        let isovalue = part("isovalue", 2).parse().unwrap_or_else(|_| panic!("{title}"));
        (isovalue, part("triangles", 0).parse().unwrap_or_else(|_| panic!("{title}")))
    }

    fn wait_for_isovalue(&self, is_it: impl Fn(f64) -> bool) -> f64 {
        wait_for(&format!("an isovalue, not {}", self.title()), || {
            Some(self.seen().0).filter(|&c| is_it(c))
        })
    }

    /// Moves the pointer, from the top left of the window.
    fn point(&self, x: i32, y: i32) {
        self.server.xdotool(&format!("mousemove --window {} {x} {y}", self.id));
        sleep(BREATH);
    }

    fn input(&self, arguments: &str) {
        self.server.xdotool(arguments);
        sleep(BREATH);
    }

    fn drag(&self, button: u32, from: (i32, i32), to: (i32, i32)) {
        self.point(from.0, from.1);
        self.input(&format!("mousedown {button}"));
        self.point((from.0 + to.0) / 2, (from.1 + to.1) / 2);
        self.point(to.0, to.1);
        self.input(&format!("mouseup {button}"));
    }

    /// Clicks on a point, from the top left of the window.
    fn click(&self, x: i32, y: i32) {
        self.point(x, y);
        self.input("click 1");
    }

    /// Types into the field of the isovalue.
    fn type_isovalue(&self, text: &str) {
        self.point(100, 570);
        self.input("click --repeat 2 --delay 80 1");
        self.input("key ctrl+a");
        self.input(&format!("type --delay 40 {text}"));
        self.input("key Return");
    }

    /// The picture that the key S saves.
    fn picture(&self) -> Picture {
        let before = self.folder.names();
        self.input("key s");
        let path = wait_for("a picture", || {
            let new = |name: &String| name.ends_with(".png") && !before.contains(name);
            self.folder.names().into_iter().find(new)
        });
        Picture::read(&self.folder.path().join(path))
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(started.elapsed() < PATIENCE, "waited in vain for {what}");
        sleep(Duration::from_millis(50));
    }
}

#[derive(Clone, PartialEq)]
struct Picture {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    fn read(path: &PathBuf) -> Self {
        let mut reader = png::Decoder::new(BufReader::new(File::open(path).expect("a file")))
            .read_info()
            .expect("a picture");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut bytes).expect("a frame");
        let pixels = bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        Picture { width: info.width as usize, pixels }
    }

    fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// Share of pixels that differ by more than rounding.
    fn difference(&self, other: &Picture) -> f64 {
        assert_eq!((self.width, self.height()), (other.width, other.height()));
        let differ =
            |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > SAME);
        let n = self.pixels.iter().zip(&other.pixels).filter(|&pair| differ(pair)).count();
        n as f64 / self.pixels.len() as f64
    }

    /// Share of pixels that are not the white background.
    fn covered(&self) -> f64 {
        let n = self.pixels.iter().filter(|p| **p != [255; 3]).count();
        n as f64 / self.pixels.len() as f64
    }
}

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
        let place = server.xdotool(&format!("getwindowgeometry --shell {}", window.id));
        let number = |name: &str| -> usize {
            let line = place.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{place}"))
        };
        let (left, top) = (number("X="), number("Y="));
        let (width, screen) = server.screen();
        let shown = (0..saved.height())
            .flat_map(|y| screen[(top + y) * width + left..][..saved.width].to_vec())
            .collect();
        let shown = Picture { width: saved.width, pixels: shown };
        assert_eq!(shown.difference(&saved), 0.0, "the screen shows what S saves at {typed}");
    }
}

#[test]
fn the_hand_moves_the_surface() {
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
    // The sphere is not quite round, so that turning it is seen; its edges show it better.
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
    window.point(400, 250);
    window.input("keydown ctrl");
    window.input("click 4");
    window.input("keyup ctrl");
    let covered = window.picture().covered();
    assert!(covered > 1.02 * first.covered(), "Ctrl and the wheel zoom in: {covered}");
    changes("zooming");
    // A point beside the middle comes to the middle.
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
    window.input("key Right");
    window.wait_for_isovalue(near(0.51));
    window.input("key Left");
    window.input("key Left");
    window.wait_for_isovalue(near(0.49));
    window.input("key shift+Right");
    window.wait_for_isovalue(near(0.491));
    // Where a pointer has no scroll axes, winit reports a notch at the press and at the release.
    window.input("click 4");
    let up = window.wait_for_isovalue(|c| c > 0.4999 - 0.001);
    assert!(near(0.5)(up) || near(0.51)(up), "{up}");
    window.input("click 5");
    let down = window.wait_for_isovalue(|c| c < up);
    assert!((up - down - 0.01).abs() < 1e-6 || (up - down - 0.02).abs() < 1e-6, "{up} {down}");
    window.input("key space");
    let played = window.wait_for_isovalue(|c| (c - down).abs() > 0.01);
    window.input("key space");
    sleep(BREATH);
    let (stopped, _) = window.seen();
    sleep(3 * BREATH);
    assert_eq!(window.seen().0, stopped, "Space stops what it started at {played}");
    // In the middle of the slider lies the middle of the range.
    window.point(500, 650);
    window.input("click 1");
    window.wait_for_isovalue(|c| (c - 0.055).abs() < 0.03);
    // What cannot be understood changes nothing.
    window.type_isovalue("2");
    window.type_isovalue("p5x");
    window.wait_for_isovalue(|c| (c - 0.055).abs() < 0.03);
}

#[test]
fn what_the_panel_offers_is_done() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.2"]);
    window.point(400, 250);
    let whole = window.picture();
    let (_, n_triangles) = window.seen();

    // Half of the ball is gone, and one looks into it: everything stays where it is.
    window.click(746, 136);
    let clipped = window.picture();
    assert!(clipped.difference(&whole) > 0.05, "the plane cuts");
    assert!(clipped.covered() < whole.covered(), "and leaves less");
    window.click(746, 136);
    assert!(window.picture() == whole, "without the plane all is as before");

    // The second surface is that of -0.2, a larger ball around the first.
    window.click(746, 191);
    wait_for("two surfaces", || (window.seen().1 > n_triangles).then_some(()));
    let both = window.picture();
    assert!(both.covered() > 1.1 * whole.covered(), "the larger ball is seen");
    // To the middle of the slider of opacity; one looks through the one at the other.
    window.drag(1, (833, 81), (790, 81));
    assert!(window.picture().difference(&both) > 0.05, "one looks through");
    window.drag(1, (790, 81), (850, 81));
    assert!(window.picture().difference(&both) < TIES, "opaque again");
    window.click(746, 191);
    wait_for("one surface", || (window.seen().1 == n_triangles).then_some(()));

    window.click(746, 104);
    let dark = window.picture();
    assert!(dark.pixels[0].iter().all(|&c| c < 64), "dark: {:?}", dark.pixels[0]);
    window.click(746, 104);

    window.click(850, 104);
    let parallel = window.picture();
    // What is nearer than the middle of the ball is not larger any more.
    let share = parallel.covered() / whole.covered();
    assert!(parallel.difference(&whole) > 0.005 && share < 0.995, "{share} in parallel projection");
    window.click(850, 104);
    assert!(window.picture() == whole, "in perspective all is as before");

    window.click(872, 278);
    wait_for("the mesh", || folder.names().contains(&"s-0.2.ply".to_owned()).then_some(()));
    folder.run(&["extract", "s.isp", "-c", "0.2", "-o", "m.ply"]);
    assert!(folder.read("s-0.2.ply") == folder.read("m.ply"), "the mesh is what extract writes");

    window.click(766, 324);
    let last = folder.path().join("s-sweep").join("s-00100.png");
    wait_for("the last picture of the sweep", || last.exists().then_some(()));
    window.wait_for_isovalue(|c| c == 0.2);
    let frames = std::fs::read_dir(folder.path().join("s-sweep")).expect("a folder").count();
    assert_eq!(frames, 100);
}

#[test]
fn what_render_draws_over_and_darkens_the_window_shows_too() {
    let server = Server::start();
    let folder = Folder::new();
    // A ring, which has a hollow.
    folder.run(&["compute", "--phantom", "torus:14", "--backend", "cpu", "-o", "s.isp"]);
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
        if key == "1" || key == "6" || key == "o" {
            // The others keep what fits; from elsewhere another distance does.
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

#[test]
fn views_are_undone_and_done_again() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    let window = Window::open(&server, &folder, &["s.isp", "-c", "0.2", "--wireframe"]);
    window.point(400, 250);
    let first = window.picture();
    window.drag(1, (300, 200), (420, 260));
    sleep(3 * BREATH);
    let second = window.picture();
    window.drag(1, (300, 200), (340, 300));
    sleep(3 * BREATH);
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

#[test]
fn files_are_opened_and_saved_by_dialogs_and_several_stay_open() {
    let server = Server::start();
    let folder = Folder::with_spectrum();
    folder.run(&["compute", "--phantom", "torus:10", "--backend", "cpu", "-o", "torus.isp"]);
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
    window.input("key ctrl+s");
    window.input("key ctrl+a");
    window.input("type --delay 60 mine.ply");
    window.input("key Return");
    wait_for("the mesh", || folder.names().contains(&"mine.ply".to_owned()).then_some(()));
    folder.run(&["extract", "s.isp", "-c", "0.2", "-o", "m.ply"]);
    assert!(folder.read("mine.ply") == folder.read("m.ply"), "the mesh is what extract writes");
    // What cannot be saved is told, and the dialog stays until Escape.
    window.input("key ctrl+s");
    window.input("key ctrl+a");
    window.input("type --delay 60 mine.doc");
    window.input("key Return");
    window.input("key Escape");
    assert!(!folder.names().contains(&"mine.doc".to_owned()));

    open("torus.isp");
    // The list of what is open is behind the buttons; closing shows the one before, as it was.
    window.click(CLOSE.0, CLOSE.1);
    wait_for("the first one", || window.title().starts_with("s.isp").then_some(()));
    assert_eq!(window.seen().0, 0.2);
}

#[test]
fn a_computation_can_be_cancelled() {
    let server = Server::start();
    let folder = Folder::new();
    let window = Window::open_titled(&server, &folder, &["--phantom", "noise:64"], "working");
    window.click(400, 80);
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
}

#[test]
fn what_cannot_be_shown_is_one_line() {
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
        (Some(&server.display), &["s.isp", "-c", "7"], 4, "isovalue 7 lies outside"),
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
