//! A virtual X server, and time limits.

use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time limit of any reaction of the window; a software adapter on a busy machine is slow.
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// Time between two events: events of one frame are seen at once.
pub(crate) const EVENT_INTERVAL: Duration = Duration::from_millis(400);

/// A virtual X server.
pub(crate) struct Server {
    process: Child,
    pub(crate) display: String,
    folder: tempfile::TempDir,
}

impl Server {
    pub(crate) fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        // By default the server starts again when its last client leaves, and refuses others meanwhile.
        let mut process = Command::new("Xvfb")
            .args(["-noreset", "-displayfd", "1", "-screen", "0", "1280x900x24", "-fbdir"])
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

    /// The file with the controls of the window.
    pub(crate) fn controls(&self) -> PathBuf {
        self.folder.path().join("controls.tsv")
    }

    pub(crate) fn xdotool(&self, arguments: &str) -> String {
        let output = Command::new("xdotool")
            .args(arguments.split_whitespace())
            .env("DISPLAY", &self.display)
            .output()
            .unwrap_or_else(|e| panic!("no xdotool ({e}): apt-get install xvfb xdotool"));
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// The screen: width and red, green, blue of each pixel. The format is that of xwd:
    /// a head of 25 numbers, colours, then rows of four bytes a pixel.
    pub(crate) fn screen(&self) -> (usize, Vec<[u8; 3]>) {
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

pub(crate) fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(started.elapsed() < TIME_LIMIT, "no {what} within the time limit");
        sleep(Duration::from_millis(50));
    }
}
