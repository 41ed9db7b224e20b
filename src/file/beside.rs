//! Writes a file beside its place and renames it when it is complete.
//!
//! A full disk, an error or an interruption leaves what was there before, and no part of the new
//! file: the temporary file is removed when it is dropped.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock, RwLockWriteGuard};

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

fn replace(place: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".isospectrum-").suffix(".part");
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
