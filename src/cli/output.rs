//! Where results go: a file that appears only when it is complete, or stdout.
//!
//! A file is written beside its target and renamed at the end ([`write_atomically`]), so an error, a
//! full disk or Ctrl-C leaves what was there before. Whether that can be done is found out before
//! the work begins: a folder that does not exist is no news after an hour of computing. An output is
//! never a file that the command reads: a slip of the hand must not cost the volume.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use isospectrum::file::{final_path, parent_folder, write_atomically};
use isospectrum::{Error, Result};

use super::interrupt;

/// A destination that could be written to when it was opened.
#[derive(Debug)]
pub(super) enum Output {
    Stdout,
    File(PathBuf),
}

impl Output {
    /// Checks that `path` can be written to and is none of the command's inputs; `-` is stdout. What
    /// is there stays as it is.
    pub(super) fn open(path: &Path, inputs: &[&Path]) -> Result<Self> {
        if path == Path::new("-") {
            return Ok(Output::Stdout);
        }
        let fail = |source| Error::io(path, source);
        match std::fs::metadata(path) {
            Ok(kind) if kind.is_dir() => return Err(fail(io::ErrorKind::IsADirectory.into())),
            // A pipe or a device tells when it is written to.
            Ok(kind) if !kind.is_file() => return Ok(Output::File(path.to_owned())),
            _ => {}
        }
        Self::check_apart(path, inputs)?;
        let place = final_path(path).map_err(fail)?;
        tempfile::tempfile_in(parent_folder(&place)).map_err(fail)?;
        Ok(Output::File(path.to_owned()))
    }

    /// Checks that a file is none of the command's inputs.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] that names both.
    pub(super) fn check_apart(path: &Path, inputs: &[&Path]) -> Result<()> {
        let Some(found) = inputs.iter().find(|input| is_same_file(path, input)) else {
            return Ok(());
        };
        let (shown, input) = (path.display(), found.display());
        Err(Error::Usage(if path == *found {
            format!("{shown}: is read and would be replaced, expected another name for the output")
        } else {
            format!(
                "{shown}: is the same file as {input}, which is read, expected another file for the output"
            )
        }))
    }

    /// The name to show.
    pub(super) fn name(&self) -> String {
        match self {
            Output::File(path) => path.display().to_string(),
            Output::Stdout => "-".to_owned(),
        }
    }

    /// Whether this is stdout, so that no report can go there.
    pub(super) fn is_stdout(&self) -> bool {
        matches!(self, Output::Stdout)
    }

    /// Writes everything and puts the file in its place; how many bytes it has.
    pub(super) fn write(self, fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<u64> {
        let mut n_bytes = 0;
        let mut failure = None;
        // The library's errors travel past the writer's, which know no path.
        let content = |target: &mut dyn Write| {
            let mut counted = Counted { target, n_bytes: 0 };
            let result = fill(&mut counted).and_then(|()| counted.flush().map_err(no_path));
            n_bytes = counted.n_bytes;
            result.map_err(|error| match error {
                Error::Io { source, .. } => source,
                other => {
                    let message = other.to_string();
                    failure = Some(other);
                    io::Error::other(message)
                }
            })
        };
        let written = match &self {
            Output::Stdout => {
                let mut stdout = BufWriter::new(io::stdout().lock());
                content(&mut stdout).map_err(|source| Error::io("standard output", source))
            }
            Output::File(path) => write_atomically(path, content),
        };
        match (failure, written) {
            _ if interrupt::requested() => Err(Error::Interrupted),
            (Some(failure), _) => Err(failure),
            (None, written) => written.map(|()| n_bytes),
        }
    }

    /// As [`Output::write`], of bytes that are there already.
    pub(super) fn write_bytes(self, bytes: &[u8]) -> Result<u64> {
        self.write(|target| target.write_all(bytes).map_err(no_path))
    }
}

/// Whether two names lead to one regular file, through links of either kind.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let (Ok(of_a), Ok(of_b)) = (std::fs::metadata(a), std::fs::metadata(b)) else { return false };
    if !of_a.is_file() || !of_b.is_file() {
        return false;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        (of_a.dev(), of_a.ino()) == (of_b.dev(), of_b.ino())
    }
    #[cfg(not(unix))]
    {
        let real = |path: &Path| std::fs::canonicalize(path).ok();
        real(a).is_some_and(|a| Some(a) == real(b))
    }
}

/// An error of a writer, whose path [`Output::write`] fills in.
pub(super) fn no_path(source: io::Error) -> Error {
    Error::io("", source)
}

/// Counts what is written, and stops writing at Ctrl-C.
struct Counted<'a> {
    target: &'a mut dyn Write,
    n_bytes: u64,
}

impl Write for Counted<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if interrupt::requested() {
            return Err(io::Error::other("interrupted"));
        }
        let n = self.target.write(bytes)?;
        self.n_bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.target.flush()
    }
}

/// Prints a report on stdout.
pub(super) fn print(text: &str) -> Result<()> {
    let end = if text.ends_with('\n') { "" } else { "\n" };
    Output::Stdout.write_bytes(format!("{text}{end}").as_bytes())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_complete_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.ply");
        let names = || std::fs::read_dir(folder.path()).expect("readable").count();

        let failed = Output::open(&path, &[]).expect("opens").write(|file| {
            file.write_all(&[0; 100_000]).map_err(no_path)?;
            Err(Error::input("too many triangles"))
        });
        assert!(matches!(failed, Err(Error::Input(text)) if text == "too many triangles"));
        assert_eq!(names(), 0);

        std::fs::write(&path, "before").expect("written");
        let n_bytes = Output::open(&path, &[]).expect("opens").write_bytes(b"after");
        assert_eq!(n_bytes.expect("written"), 5);
        assert_eq!(std::fs::read(&path).expect("readable"), b"after");
        assert_eq!(names(), 1);
    }

    #[test]
    fn opening_leaves_nothing_and_changes_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.isp");
        Output::open(&path, &[]).expect("opens");
        assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
        std::fs::write(&path, "before").expect("written");
        Output::open(&path, &[]).expect("opens");
        assert_eq!(std::fs::read(&path).expect("readable"), b"before");
    }

    #[test]
    fn an_error_names_the_file_that_could_not_be_written() {
        let path = Path::new("no such folder/a.isp");
        let error = Output::open(path, &[]).expect_err("cannot be written");
        assert!(error.to_string().starts_with("no such folder/a.isp: "), "{error}");
    }
}
