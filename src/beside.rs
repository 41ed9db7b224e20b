//! Writes a file beside its place and renames it when it is complete.
//!
//! A full disk, an error or an interruption leaves what was there before, and no part of the new
//! file: the temporary file is removed when it is dropped.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use crate::error::{Error, Result};

/// Links to links that are followed; as many as Linux follows.
const MOST_LINKS: usize = 40;

/// Held, for reading, while there is a part of a file.
static PARTS: RwLock<()> = RwLock::new(());

/// Waits until no file of this process is there in part, and lets none begin while the guard lives: who holds it may
/// end the process and leaves nothing behind.
pub fn no_parts() -> RwLockWriteGuard<'static, ()> {
    PARTS.write().unwrap_or_else(PoisonError::into_inner)
}

/// Writes what `content` writes to `path`. A link is followed and stays a link, also one to a file
/// that is not there yet, and what is no regular file (a device, a pipe) is written to directly.
///
/// # Errors
///
/// [`Error::Io`] with the path asked for; a regular file at `path` then is what it was.
pub fn write_beside(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let write = || {
        let place = place_of(path)?;
        match fs::metadata(&place) {
            Ok(metadata) if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            Ok(metadata) if !metadata.is_file() => {
                let file = fs::OpenOptions::new().write(true).open(&place)?;
                buffered(file, content)
            }
            _ => replace(&place, content),
        }
    };
    write().map_err(|e| Error::io(path, e))
}

/// Where a file written to `path` comes to lie: behind every link, also where the last one leads to
/// no file yet.
///
/// # Errors
///
/// The system's, as for links that lead in a circle.
pub fn place_of(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(found) if found.is_file() => return fs::canonicalize(path),
        // Links to pipes, as /dev/stdout may be one, have no path behind them.
        Ok(_) => return Ok(path.to_path_buf()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    let mut place = path.to_path_buf();
    // These end somewhere, or the system would have told; a link may be made meanwhile, though.
    for _ in 0..MOST_LINKS {
        let Ok(target) = fs::read_link(&place) else { break };
        // What a link says is meant from its own folder; an absolute path replaces that.
        place = folder_of(&place).join(target);
    }
    Ok(place)
}

/// The folder that a path lies in.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A folder for what a file is made of, beside the file; gone when it is dropped. While it is there nothing may be
/// written by [`write_beside`] in the same thread: who waits in [`no_parts`] would wait for ever.
#[derive(Debug)]
pub struct PartFolder {
    /// Before the guard, so that the folder is gone when that is let go.
    folder: tempfile::TempDir,
    _part: RwLockReadGuard<'static, ()>,
}

impl PartFolder {
    /// Makes one beside where a file written to `path` comes to lie.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with the path asked for, also where something else than a regular file is there.
    pub fn beside(path: &Path) -> Result<Self> {
        let make = || {
            let place = place_of(path)?;
            if fs::metadata(&place).is_ok_and(|there| !there.is_file()) {
                return Err(io::Error::other("is there and no regular file"));
            }
            PartFolder::within(folder_of(&place))
        };
        make().map_err(|error| Error::io(path, error))
    }

    /// As [`PartFolder::beside`], for a folder in which a folder is made.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with the path asked for, also where something is there that `may_be_replaced` does not name.
    pub fn beside_folder(path: &Path, may_be_replaced: impl Fn(&Path) -> bool) -> Result<Self> {
        let make = || {
            if fs::symlink_metadata(path).is_ok() && !may_be_replaced(path) {
                return Err(io::Error::other("is there, expected a name that is free"));
            }
            PartFolder::within(folder_of(path))
        };
        make().map_err(|error| Error::io(path, error))
    }

    fn within(folder: &Path) -> io::Result<Self> {
        let _part = PARTS.read().unwrap_or_else(PoisonError::into_inner);
        Ok(PartFolder { folder: part_builder().tempdir_in(folder)?, _part })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Puts a complete folder of this one where `path` leads to, in place of what is there.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with the path asked for; what was there then is what it was.
    pub fn put_folder(self, name: &str, path: &Path) -> Result<()> {
        let put = || {
            let (new, old) = (self.path().join(name), self.path().join("replaced"));
            let is_there = fs::symlink_metadata(path).is_ok();
            if is_there {
                fs::rename(path, &old)?;
            }
            fs::rename(new, path).or_else(|error| {
                if is_there {
                    fs::rename(&old, path)?;
                }
                Err(error)
            })
        };
        put().map_err(|error| Error::io(path, error))
    }

    /// Puts a complete file of the folder where `path` leads to; the folder goes with all that is left in it.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with the path asked for; what was there then is what it was.
    pub fn put(self, name: &str, path: &Path) -> Result<()> {
        let put = || fs::rename(self.path().join(name), place_of(path)?);
        put().map_err(|error| Error::io(path, error))
    }
}

/// How what is not complete yet is called.
fn part_builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".isospectrum-").suffix(".part");
    builder
}

fn replace(place: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut builder = part_builder();
    #[cfg(unix)]
    {
        // What any program creates, less the umask; the crate's default is the owner only.
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // Declared first, so that it is let go last: after the part, if that is dropped.
    let _part = PARTS.read().unwrap_or_else(PoisonError::into_inner);
    let file = builder.tempfile_in(folder_of(place))?;
    buffered(file.as_file(), content)?;
    file.persist(place).map_err(|e| e.error)?;
    Ok(())
}

fn buffered(
    file: impl Write,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    content(&mut writer)?;
    writer.flush()
}
