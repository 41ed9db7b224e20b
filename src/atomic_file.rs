//! Atomic writes: a file is written under a temporary name in the folder of its target and renamed when it is complete.
//!
//! # Invariants
//!
//! After a full disk, an error or an interruption the target is what it was before, and the temporary file is removed: it
//! is deleted when it is dropped.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use crate::error::{Error, Result};

/// Symbolic links followed for one path; the limit of Linux.
const MAX_LINKS: usize = 40;

/// Locked for reading as long as a temporary file or folder exists.
static UNFINISHED: RwLock<()> = RwLock::new(());

/// Waits until this process has no temporary file, and lets none be created as long as the guard lives. Whoever holds the
/// guard may end the process without leaving temporary files behind.
pub fn block_writes() -> RwLockWriteGuard<'static, ()> {
    UNFINISHED.write().unwrap_or_else(PoisonError::into_inner)
}

/// Writes a file atomically. A symbolic link is followed and stays a link, even if its target does not exist yet. Anything but a
/// regular file (a device, a pipe) is written to directly.
///
/// # Errors
///
/// [`Error::Io`] with `path`; a regular file at `path` is then unchanged.
pub fn write_atomically(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let write = || {
        let target = final_path(path)?;
        match fs::metadata(&target) {
            Ok(metadata) if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            Ok(metadata) if !metadata.is_file() => {
                let file = fs::OpenOptions::new().write(true).open(&target)?;
                write_buffered(file, content)
            }
            _ => replace(&target, content),
        }
    };
    write().map_err(|e| Error::io(path, e))
}

/// The path that a file written to `path` gets once all symbolic links are followed; the last link may lead to a file that does
/// not exist yet.
///
/// # Errors
///
/// Those of the system, for example for a cycle of links.
pub fn final_path(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(found) if found.is_file() => return fs::canonicalize(path),
        // A link to a pipe, which /dev/stdout may be, has no path behind it.
        Ok(_) => return Ok(path.to_path_buf()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    let mut target = path.to_path_buf();
    // The system has just found that the links end, but another process may add one meanwhile.
    for _ in 0..MAX_LINKS {
        let Ok(next) = fs::read_link(&target) else { break };
        // A relative link starts in its own folder; `join` lets an absolute path replace it.
        target = parent_folder(&target).join(next);
    }
    Ok(target)
}

/// The folder that contains a path; `.` for a bare name.
pub fn parent_folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A temporary folder in the folder of a target, removed when it is dropped. As long as it exists, its thread must not call
/// [`write_atomically`]: a thread waiting in [`block_writes`] would deadlock both.
#[derive(Debug)]
pub struct TemporaryFolder {
    /// Declared before the guard, so that it is removed before the guard is released.
    folder: tempfile::TempDir,
    _guard: RwLockReadGuard<'static, ()>,
}

impl TemporaryFolder {
    /// Creates one in the folder of the file `path`, behind its symbolic links.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`, also if something other than a regular file exists there.
    pub fn next_to(path: &Path) -> Result<Self> {
        let create = || {
            let target = final_path(path)?;
            if fs::metadata(&target).is_ok_and(|found| !found.is_file()) {
                return Err(io::Error::other("exists and is not a regular file"));
            }
            TemporaryFolder::within(parent_folder(&target))
        };
        create().map_err(|error| Error::io(path, error))
    }

    /// Creates one in the folder of the folder `path`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`, also if something exists there that `may_be_replaced` rejects.
    pub fn next_to_folder(path: &Path, may_be_replaced: impl Fn(&Path) -> bool) -> Result<Self> {
        let create = || {
            if fs::symlink_metadata(path).is_ok() && !may_be_replaced(path) {
                return Err(io::Error::other("already exists, expected a name that is free"));
            }
            TemporaryFolder::within(parent_folder(path))
        };
        create().map_err(|error| Error::io(path, error))
    }

    fn within(folder: &Path) -> io::Result<Self> {
        let _guard = UNFINISHED.read().unwrap_or_else(PoisonError::into_inner);
        Ok(TemporaryFolder { folder: temporary_name().tempdir_in(folder)?, _guard })
    }

    /// The path of the temporary folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Moves a finished folder out of this one to `path`, in place of what was there.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`; what was there is then unchanged.
    pub fn move_folder(self, name: &str, path: &Path) -> Result<()> {
        let rename = || {
            let (new, old) = (self.path().join(name), self.path().join("replaced"));
            let exists = fs::symlink_metadata(path).is_ok();
            if exists {
                fs::rename(path, &old)?;
            }
            fs::rename(new, path).or_else(|error| {
                if exists {
                    fs::rename(&old, path)?;
                }
                Err(error)
            })
        };
        rename().map_err(|error| Error::io(path, error))
    }

    /// Moves a finished file out of this folder to `path`, behind its symbolic links, and removes the folder.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`; what was there is then unchanged.
    pub fn move_file(self, name: &str, path: &Path) -> Result<()> {
        let rename = || fs::rename(self.path().join(name), final_path(path)?);
        rename().map_err(|error| Error::io(path, error))
    }

    /// Replaces the path in an [`Error::Io`] of a file in this folder, which no user has named, by `path`.
    pub fn hide_in(&self, error: Error, path: &Path) -> Error {
        match error {
            Error::Io { path: inner, source } if inner.starts_with(self.path()) => {
                Error::io(path, source)
            }
            other => other,
        }
    }
}

/// Names of temporary files and folders.
fn temporary_name() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".isospectrum-").suffix(".part");
    builder
}

fn replace(
    target: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut builder = temporary_name();
    #[cfg(unix)]
    {
        // The permissions of any new file, less the umask; by default tempfile grants access to the owner only.
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // Declared first, so that it is released last: after the temporary file, if that is dropped.
    let _guard = UNFINISHED.read().unwrap_or_else(PoisonError::into_inner);
    let file = builder.tempfile_in(parent_folder(target))?;
    write_buffered(file.as_file(), content)?;
    file.persist(target).map_err(|e| e.error)?;
    Ok(())
}

fn write_buffered(
    file: impl Write,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    content(&mut writer)?;
    writer.flush()
}
