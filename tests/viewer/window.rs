//! A window on the server: its input and its contents.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::process::{Child, Command};
use std::thread::sleep;

use super::server::{EVENT_INTERVAL, Server, wait_for};
use crate::common::program::{self, Folder};

/// Maximum difference of a channel between two ways to the same picture: one rounding.
const SAME: u8 = 1;

/// Share of pixels that may differ more: of two triangles at equal depth the first one drawn is visible, and a window draws in
/// the order in which triangles became active.
pub(crate) const TIES: f64 = 1e-3;

/// Side of the corner with the cube, pixels.
const CUBE: usize = 72;

/// A control of the window, in pixels from its top left.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Control {
    role: String,
    name: String,
    pub(crate) left: i32,
    pub(crate) top: i32,
    pub(crate) width: i32,
    pub(crate) height: i32,
}

impl Control {
    /// A line of the list of controls.
    fn parse(line: &str) -> Self {
        let parts: Vec<&str> = line.split('\t').collect();
        let [role, numbers @ .., name] = &parts[..] else { panic!("{line}") };
        let numbers: Vec<i32> = numbers.iter().map(|n| n.parse().expect("a number")).collect();
        let [left, top, width, height] = numbers[..] else { panic!("{line}") };
        let [role, name] = [role, name].map(|text| (*text).to_owned());
        Control { role, name, left, top, width, height }
    }

    /// Whether this is its name, or the words with which it begins: names may end in a key or a value.
    fn is_named(&self, name: &str) -> bool {
        self.name.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
    }

    pub(crate) fn middle(&self) -> (i32, i32) {
        (self.left + self.width / 2, self.top + self.height / 2)
    }
}

/// A window on the server.
pub(crate) struct Window<'a> {
    server: &'a Server,
    folder: &'a Folder,
    process: Child,
    pub(crate) id: String,
}

impl<'a> Window<'a> {
    pub(crate) fn open(server: &'a Server, folder: &'a Folder, arguments: &[&str]) -> Self {
        Self::open_titled(server, folder, arguments, "isovalue")
    }

    /// Opens a window and waits until its title has a word.
    pub(crate) fn open_titled(
        server: &'a Server,
        folder: &'a Folder,
        arguments: &[&str],
        word: &str,
    ) -> Self {
        let controls = server.controls();
        let _ = std::fs::remove_file(&controls);
        let process = Command::new(program::path())
            .args(["-q", "view", "--size", "1000x700", "--controls"])
            .arg(controls)
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
            // A window that is not visible yet takes no focus.
            let found = server.xdotool(&format!("search --onlyvisible --name {word}"));
            found.lines().next().map(str::to_owned)
        });
        // A window manager would do this with a new window; there is none.
        window.input(&format!("windowfocus --sync {}", window.id));
        window
    }

    pub(crate) fn title(&self) -> String {
        self.server.xdotool(&format!("getwindowname {}", self.id))
    }

    /// The isovalue and the number of triangles in the title.
    pub(crate) fn seen(&self) -> (f64, usize) {
        let title = self.title();
        let part = |name: &str, skip: usize| {
            let words: Vec<&str> = title.split_whitespace().collect();
            let at = words.iter().position(|w| *w == name).unwrap_or_else(|| panic!("{title}"));
            words[(at + skip) - 1].to_owned()
        };
        let isovalue = part("isovalue", 2).parse().unwrap_or_else(|_| panic!("{title}"));
        (isovalue, part("triangles", 0).parse().unwrap_or_else(|_| panic!("{title}")))
    }

    pub(crate) fn wait_for_isovalue(&self, is_it: impl Fn(f64) -> bool) -> f64 {
        wait_for(&format!("an isovalue, not {}", self.title()), || {
            Some(self.seen().0).filter(|&c| is_it(c))
        })
    }

    /// Moves the pointer, from the top left of the window.
    pub(crate) fn point(&self, x: i32, y: i32) {
        self.server.xdotool(&format!("mousemove --window {} {x} {y}", self.id));
        sleep(EVENT_INTERVAL);
    }

    pub(crate) fn input(&self, arguments: &str) {
        self.server.xdotool(arguments);
        sleep(EVENT_INTERVAL);
    }

    pub(crate) fn drag(&self, button: u32, from: (i32, i32), to: (i32, i32)) {
        self.point(from.0, from.1);
        self.input(&format!("mousedown {button}"));
        self.point((from.0 + to.0) / 2, (from.1 + to.1) / 2);
        self.point(to.0, to.1);
        self.input(&format!("mouseup {button}"));
    }

    /// The controls that the window shows.
    fn controls(&self) -> Vec<Control> {
        let list = std::fs::read_to_string(self.server.controls()).unwrap_or_default();
        list.lines().map(Control::parse).collect()
    }

    /// Waits for the control of a role with this name, and until it rests; the first one from the top, if there are several.
    pub(crate) fn control(&self, role: &str, name: &str) -> Control {
        let find = || self.controls().into_iter().find(|c| c.role == role && c.is_named(name));
        wait_for(&format!("{role} {name}"), || {
            let found = find()?;
            sleep(EVENT_INTERVAL / 2);
            find().filter(|later| *later == found)
        })
    }

    /// Moves the pointer to a control, again if that has moved meanwhile: curves that are finished change the layout.
    fn point_at(&self, role: &str, name: &str) {
        let mut control = self.control(role, name);
        loop {
            let (x, y) = control.middle();
            self.point(x, y);
            let now = self.control(role, name);
            if now == control {
                return;
            }
            control = now;
        }
    }

    /// Clicks on a control.
    pub(crate) fn click_on(&self, role: &str, name: &str) {
        self.point_at(role, name);
        self.input("click 1");
    }

    /// Clicks on a choice of a list.
    pub(crate) fn choose(&self, list: &str, choice: &str) {
        self.click_on("ComboBox", list);
        self.click_on("Button", choice);
    }

    /// Clicks on a point, from the top left of the window.
    pub(crate) fn click(&self, x: i32, y: i32) {
        self.point(x, y);
        self.input("click 1");
    }

    /// The picture as the server shows it, of that many pixels.
    pub(crate) fn screen(&self, width: usize, height: usize) -> Picture {
        let place = self.server.xdotool(&format!("getwindowgeometry --shell {}", self.id));
        let number = |name: &str| -> usize {
            let line = place.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{place}"))
        };
        let (left, top) = (number("X="), number("Y="));
        let (of_row, screen) = self.server.screen();
        let row = |y: usize| screen[(top + y) * of_row + left..][..width].to_vec();
        Picture { width, pixels: (0..height).flat_map(row).collect() }
    }

    /// Types into the field of the isovalue.
    pub(crate) fn type_isovalue(&self, text: &str) {
        self.point_at("TextInput", "isovalue");
        self.input("click --repeat 2 --delay 80 1");
        self.input("key ctrl+a");
        self.input(&format!("type --delay 40 {text}"));
        self.input("key Return");
    }

    /// Saves the mesh under a name, in the dialog that Ctrl+S opens.
    pub(crate) fn save_mesh(&self, name: &str) {
        self.input("key ctrl+s");
        self.input("key ctrl+a");
        self.input(&format!("type --delay 60 {name}"));
        self.input("key Return");
        wait_for("the mesh", || self.folder.names().contains(&name.to_owned()).then_some(()));
    }

    /// The picture that the key S saves.
    pub(crate) fn picture(&self) -> Picture {
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

#[derive(Clone, PartialEq)]
pub(crate) struct Picture {
    pub(crate) width: usize,
    pub(crate) pixels: Vec<[u8; 3]>,
}

impl Picture {
    pub(crate) fn read(path: &PathBuf) -> Self {
        let mut reader = png::Decoder::new(BufReader::new(File::open(path).expect("a file")))
            .read_info()
            .expect("a picture");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut bytes).expect("a frame");
        let pixels = bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        Picture { width: info.width as usize, pixels }
    }

    pub(crate) fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// Share of pixels that differ by more than rounding.
    pub(crate) fn difference(&self, other: &Picture) -> f64 {
        assert_eq!((self.width, self.height()), (other.width, other.height()));
        let differ =
            |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > SAME);
        let n = self.pixels.iter().zip(&other.pixels).filter(|&pair| differ(pair)).count();
        n as f64 / self.pixels.len() as f64
    }

    /// Without the corner with the cube.
    pub(crate) fn without_cube(&self) -> Self {
        let mut picture = self.clone();
        for y in 0..CUBE {
            let row = &mut picture.pixels[y * self.width..(y + 1) * self.width];
            row[self.width - CUBE..].fill([0; 3]);
        }
        picture
    }

    /// Position of the surface: the middle one of the pixels that are not white between two columns.
    pub(crate) fn middle_between(&self, from: usize, to: usize) -> (i32, i32) {
        let is_surface =
            |&i: &usize| (from..to).contains(&(i % self.width)) && self.pixels[i] != [255; 3];
        let all: Vec<usize> = (0..self.pixels.len()).filter(is_surface).collect();
        let middle = all[all.len() / 2];
        ((middle % self.width) as i32, (middle / self.width) as i32)
    }

    /// Share of pixels that are not the white background.
    pub(crate) fn covered(&self) -> f64 {
        let n = self.pixels.iter().filter(|p| **p != [255; 3]).count();
        n as f64 / self.pixels.len() as f64
    }
}
