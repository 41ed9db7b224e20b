//! Outputs: a file that appears only when it is complete, or stdout.
//!
//! A file is written under a temporary name next to its destination and renamed at the end ([`write_atomically`]), so an error, a
//! full disk or a cancellation leaves the previous file unchanged. This is checked before the work begins, so that
//! a missing folder is not found after an hour of computing. An output never replaces an input of the work: a typing mistake must not destroy data.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::atomic_file::{final_path, parent_folder, write_atomically};
use crate::error::{Error, Result};
use crate::progress::Progress;

/// A destination that was writable when it was opened.
#[derive(Debug)]
pub enum Output {
    /// The standard output.
    Stdout,
    /// A file, or what else is at a path: a pipe, a device.
    File(PathBuf),
}

impl Output {
    /// Checks that `path` can be written and is none of `inputs`; `-` is stdout. An existing file stays unchanged.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if it cannot be written, [`Error::Usage`] if it is an input.
    pub fn open(path: &Path, inputs: &[&Path]) -> Result<Self> {
        if path == Path::new("-") {
            return Ok(Output::Stdout);
        }
        let fail = |source| Error::io(path, source);
        match std::fs::metadata(path) {
            Ok(kind) if kind.is_dir() => return Err(fail(io::ErrorKind::IsADirectory.into())),
            // A pipe or a device reports errors when it is written.
            Ok(kind) if !kind.is_file() => return Ok(Output::File(path.to_owned())),
            _ => {}
        }
        Self::check_apart(path, inputs)?;
        check_parent(path)?;
        let place = final_path(path).map_err(fail)?;
        tempfile::tempfile_in(parent_folder(&place)).map_err(fail)?;
        Ok(Output::File(path.to_owned()))
    }

    /// Checks that a file is no input of the command.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] with both names.
    fn check_apart(path: &Path, inputs: &[&Path]) -> Result<()> {
        let Some(found) = inputs.iter().find(|input| is_same_file(path, input)) else {
            return Ok(());
        };
        let (shown, input) = (path.display(), found.display());
        Err(Error::Usage(if path == *found {
            format!("{shown}: is both input and output, expected another output")
        } else {
            format!("{shown}: is the same file as the input {input}, expected another output")
        }))
    }

    /// Returns the name for messages.
    pub fn name(&self) -> String {
        match self {
            Output::File(path) => path.display().to_string(),
            Output::Stdout => "-".to_owned(),
        }
    }

    /// True for stdout, where no report can be printed then.
    pub fn is_stdout(&self) -> bool {
        matches!(self, Output::Stdout)
    }

    /// Writes the content and renames the file to its destination. Returns the size in bytes.
    ///
    /// # Errors
    ///
    /// Those of `fill`; [`Error::Io`] with the path; [`Error::Interrupted`].
    pub fn write(
        self,
        progress: &dyn Progress,
        fill: impl FnOnce(&mut dyn Write) -> Result<()>,
    ) -> Result<u64> {
        let mut n_bytes = 0;
        let mut failure = None;
        // An error of the library is kept outside, as the result of a writer is an io::Error.
        let content = |target: &mut dyn Write| {
            let mut counted = Counted { target, n_bytes: 0, progress };
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
            _ if progress.cancelled() => Err(Error::Interrupted),
            (Some(failure), _) => Err(failure),
            (None, written) => written.map(|()| n_bytes),
        }
    }

    /// Writes bytes, as [`Output::write`].
    ///
    /// # Errors
    ///
    /// As [`Output::write`].
    pub fn write_bytes(self, progress: &dyn Progress, bytes: &[u8]) -> Result<u64> {
        self.write(progress, |target| target.write_all(bytes).map_err(no_path))
    }
}

/// Checks that the folder of a destination exists.
///
/// # Errors
///
/// [`Error::Io`] with the folder.
fn check_parent(path: &Path) -> Result<()> {
    // The destination of a link can be in another folder.
    let place = final_path(path).map_err(|source| Error::io(path, source))?;
    let folder = parent_folder(&place);
    if folder.exists() {
        return Ok(());
    }
    let message =
        format!("the folder {} does not exist, expected an existing one", folder.display());
    Err(Error::io(path, io::Error::new(io::ErrorKind::NotFound, message)))
}

/// True if two paths are the same regular file, through hard or symbolic links.
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

/// Returns an error of a writer; [`Output::write`] adds the path.
pub(crate) fn no_path(source: io::Error) -> Error {
    Error::io("", source)
}

/// Counts bytes, and stops writing after a cancellation.
struct Counted<'a> {
    target: &'a mut dyn Write,
    n_bytes: u64,
    progress: &'a dyn Progress,
}

impl Write for Counted<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.progress.cancelled() {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    #[test]
    fn a_file_appears_complete_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.ply");
        let names = || std::fs::read_dir(folder.path()).expect("readable").count();

        let failed = Output::open(&path, &[]).expect("opens").write(&Silent, |file| {
            file.write_all(&[0; 100_000]).map_err(no_path)?;
            Err(Error::input("too many triangles"))
        });
        assert!(matches!(failed, Err(Error::Input(text)) if text == "too many triangles"));
        assert_eq!(names(), 0);

        std::fs::write(&path, "before").expect("written");
        let n_bytes = Output::open(&path, &[]).expect("opens").write_bytes(&Silent, b"after");
        assert_eq!(n_bytes.expect("written"), 5);
        assert_eq!(std::fs::read(&path).expect("readable"), b"after");
        assert_eq!(names(), 1);
    }

    #[test]
    fn opening_creates_no_file_and_changes_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.isp");
        Output::open(&path, &[]).expect("opens");
        assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
        std::fs::write(&path, "before").expect("written");
        Output::open(&path, &[]).expect("opens");
        assert_eq!(std::fs::read(&path).expect("readable"), b"before");
    }

    #[test]
    fn an_error_names_the_file_and_the_missing_folder() {
        let path = Path::new("no such folder/a.isp");
        let error = Output::open(path, &[]).expect_err("cannot be written").to_string();
        assert!(error.starts_with("no such folder/a.isp: the folder no such folder"), "{error}");
    }
}
