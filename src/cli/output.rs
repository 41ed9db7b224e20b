//! Where results go: a file that appears only when it is complete, or stdout.
//!
//! A file is written beside its target under a temporary name and renamed at the end, so an error,
//! a full disk or Ctrl-C leaves what was there before. It is opened before the work begins: a folder
//! that does not exist is no news after an hour of computing.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use isospectrum::{Error, Result};
use tempfile::{NamedTempFile, TempPath};

use super::interrupt;

/// An open destination.
#[derive(Debug)]
pub(super) struct Output {
    path: PathBuf,
    destination: Destination,
}

#[derive(Debug)]
enum Destination {
    Stdout,
    /// A pipe or a device: there is nothing to rename.
    Special(File),
    Beside(File, TempPath),
}

impl Output {
    /// Opens `path`; `-` is stdout.
    pub(super) fn open(path: &Path) -> Result<Self> {
        if path == Path::new("-") {
            let path = PathBuf::from("standard output");
            return Ok(Output { path, destination: Destination::Stdout });
        }
        let fail = |source| Error::io(path, source);
        let kind = std::fs::metadata(path);
        if kind.as_ref().is_ok_and(std::fs::Metadata::is_dir) {
            return Err(fail(io::ErrorKind::IsADirectory.into()));
        }
        if kind.is_ok_and(|kind| !kind.is_file()) {
            let file = OpenOptions::new().write(true).open(path).map_err(fail)?;
            let destination = Destination::Special(file);
            return Ok(Output { path: path.to_owned(), destination });
        }
        // A link stays a link: what it names is replaced.
        let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let temporary = new_file_in(folder).map_err(fail)?;
        interrupt::set_unfinished(Some(temporary.path()));
        let (file, temporary) = temporary.into_parts();
        Ok(Output { path: target, destination: Destination::Beside(file, temporary) })
    }

    /// Whether this is stdout, so that no report can go there.
    pub(super) fn is_stdout(&self) -> bool {
        matches!(self.destination, Destination::Stdout)
    }

    /// Writes everything and puts the file in its place; how many bytes it has.
    pub(super) fn write(self, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<u64> {
        let Output { path, destination } = self;
        let fail = |source| {
            if interrupt::requested() { Error::Interrupted } else { Error::io(&path, source) }
        };
        match destination {
            Destination::Stdout => fill_all(io::stdout().lock(), fill).map_err(fail),
            Destination::Special(file) => fill_all(file, fill).map_err(fail),
            Destination::Beside(file, temporary) => {
                let n_bytes = fill_all(&file, fill).map_err(fail)?;
                drop(file);
                temporary.persist(&path).map_err(|error| fail(error.error))?;
                interrupt::set_unfinished(None);
                Ok(n_bytes)
            }
        }
    }
}

/// A new file with the permissions any other new file would have.
fn new_file_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".isospectrum-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

fn fill_all(
    target: impl Write,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<u64> {
    let mut writer = BufWriter::with_capacity(1 << 16, Counted { target, n_bytes: 0 });
    fill(&mut writer)?;
    writer.flush()?;
    Ok(writer.get_ref().n_bytes)
}

/// Counts what is written, and stops writing at Ctrl-C.
struct Counted<W> {
    target: W,
    n_bytes: u64,
}

impl<W: Write> Write for Counted<W> {
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
    Output::open(Path::new("-"))?
        .write(|stdout| {
            stdout.write_all(text.as_bytes())?;
            if text.ends_with('\n') { Ok(()) } else { stdout.write_all(b"\n") }
        })
        .map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_complete_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.ply");
        let names = || std::fs::read_dir(folder.path()).expect("readable").count();

        let failed = Output::open(&path).expect("opens").write(|file| {
            file.write_all(&[0; 100_000])?;
            Err(io::Error::other("the disk is full"))
        });
        assert!(failed.is_err());
        assert_eq!(names(), 0);

        std::fs::write(&path, "before").expect("written");
        let n_bytes = Output::open(&path).expect("opens").write(|file| file.write_all(b"after"));
        assert_eq!(n_bytes.expect("written"), 5);
        assert_eq!(std::fs::read(&path).expect("readable"), b"after");
        assert_eq!(names(), 1);
    }

    #[test]
    fn an_output_that_is_never_written_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        drop(Output::open(&folder.path().join("a.isp")).expect("opens"));
        assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_a_device_a_device() {
        let folder = tempfile::tempdir().expect("a folder");
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "before").expect("written");
        std::os::unix::fs::symlink(&file, &link).expect("linked");
        Output::open(&link).expect("opens").write(|f| f.write_all(b"after")).expect("written");
        assert!(std::fs::symlink_metadata(&link).expect("there").is_symlink());
        assert_eq!(std::fs::read(&file).expect("readable"), b"after");

        let null = Path::new("/dev/null");
        Output::open(null).expect("opens").write(|f| f.write_all(b"gone")).expect("written");
        assert!(!std::fs::metadata(null).expect("there").is_file());
    }
}
