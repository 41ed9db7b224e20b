//! Runs the program in a temporary folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The program.
pub(crate) fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_BIN_EXE_isospectrum"))
}

/// A temporary folder to run the program in.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Folder(tempfile::tempdir().expect("a temporary folder"))
    }

    /// A folder with the spectrum of a small sphere, `s.isp`.
    pub(crate) fn with_spectrum() -> Self {
        Folder::with_phantom("sphere:12")
    }

    /// A folder with the spectrum of a phantom, `s.isp`, computed once for all tests of a binary.
    pub(crate) fn with_phantom(name: &'static str) -> Self {
        static SPECTRA: Mutex<BTreeMap<&str, Arc<OnceLock<Vec<u8>>>>> = Mutex::new(BTreeMap::new());
        let spectrum = {
            let mut spectra = SPECTRA.lock().unwrap_or_else(PoisonError::into_inner);
            spectra.entry(name).or_default().clone()
        };
        let bytes = spectrum.get_or_init(|| {
            let folder = Folder::new();
            folder.run(&["compute", "-q", "--phantom", name, "--backend", "cpu", "-o", "s.isp"]);
            folder.read("s.isp")
        });
        let folder = Folder::new();
        folder.write("s.isp", bytes);
        folder
    }

    /// A folder with the same files, in folders one deep.
    pub(crate) fn copy(&self) -> Self {
        let copy = Folder::new();
        let copy_files = |from: &Path, to: &Path| {
            for entry in std::fs::read_dir(from).expect("readable").map(|e| e.expect("readable")) {
                if entry.path().is_file() {
                    std::fs::copy(entry.path(), to.join(entry.file_name())).expect("copied");
                }
            }
        };
        copy_files(self.path(), copy.path());
        for name in self.names().iter().filter(|name| self.path().join(name).is_dir()) {
            std::fs::create_dir(copy.path().join(name)).expect("a folder");
            copy_files(&self.path().join(name), &copy.path().join(name));
        }
        copy
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path().join(name), bytes).expect("written");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The names of everything in the folder, hidden files too, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path()).expect("readable");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// Runs the program and expects success.
    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        self.run_for(arguments, 0)
    }

    /// Runs the program and expects an exit code.
    pub(crate) fn run_for(&self, arguments: &[&str], code: i32) -> Output {
        let output = std::process::Command::new(path())
            .args(arguments)
            .current_dir(self.path())
            .output()
            .expect("the program runs");
        let printed = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {printed}");
        assert!(!printed.contains("panicked") && !printed.contains("internal error"), "{printed}");
        output
    }

    /// Runs a script of `sh` in the folder; `"$0"` is the program.
    pub(crate) fn shell(&self, script: &str) -> Output {
        std::process::Command::new("sh")
            .args(["-c", script])
            .arg(path())
            .current_dir(self.path())
            .output()
            .expect("sh runs")
    }

    /// Runs the program and expects an exit code, no output, one line on stderr and no new file. Returns the line without the
    /// name of the program.
    pub(crate) fn fails(&self, arguments: &[&str], code: i32) -> String {
        let before = self.names();
        let output = self.run_for(arguments, code);
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert_eq!(self.names(), before, "{arguments:?}");
        one_line(&stderr(&output))
    }
}

/// The text on stderr.
pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The one line of an error.
pub(crate) fn one_line(printed: &str) -> String {
    let lines: Vec<&str> = printed.lines().collect();
    assert_eq!(lines.len(), 1, "{printed}");
    let line = lines[0].strip_prefix("isospectrum: ");
    line.unwrap_or_else(|| panic!("no name in front: {printed}")).to_owned()
}

/// The JSON on stdout.
pub(crate) fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).expect("stdout is JSON")
}
