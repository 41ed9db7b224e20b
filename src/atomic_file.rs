//! Atomic writes: a file is written under a temporary name in the folder of its target and renamed when it is complete.
//!
//! # Invariants
//!
//! After a full disk, an error or an interruption the target is what it was before, and the temporary file is removed: it
//! is deleted when it is dropped. A file is on the disk before it is renamed, and its folder after that, so that a power
//! failure leaves the old file or the new one.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use crate::abandoned::temporary_file;
use crate::error::{Error, Result};

/// Symbolic links followed for one path; the limit of Linux.
const MAX_LINKS: usize = 40;

/// Locked for reading as long as a temporary file or folder exists.
static UNFINISHED: RwLock<()> = RwLock::new(());

/// The guard that the owner of a temporary file or folder keeps.
pub(crate) fn unfinished() -> RwLockReadGuard<'static, ()> {
    UNFINISHED.read().unwrap_or_else(PoisonError::into_inner)
}

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
            _ => replace(&target, content, File::sync_all),
        }
    };
    write().map_err(|e| Error::io(path, e))
}

/// The path that a file or a folder written to `path` gets once all symbolic links are followed; the last link may lead to one
/// that does not exist yet.
///
/// # Errors
///
/// Those of the system, for example for a cycle of links.
pub fn final_path(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(found) if found.is_file() || found.is_dir() => return fs::canonicalize(path),
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

/// Writes the names of the files in a folder down to the disk, where the system can do that.
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    // Some file systems of networks have no such request; a folder may be writable and not readable.
    use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(e) if [InvalidInput, PermissionDenied, Unsupported].contains(&e.kind()) => Ok(()),
        synced => synced,
    }
}

fn replace(
    target: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    sync: impl FnOnce(&File) -> io::Result<()>,
) -> io::Result<()> {
    let folder = parent_folder(target);
    let create = |builder: &mut tempfile::Builder<'_, '_>| {
        #[cfg(unix)]
        {
            // The permissions of any new file, less the umask; by default tempfile grants access to the owner only.
            use std::os::unix::fs::PermissionsExt as _;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        builder.tempfile_in(folder)
    };
    // Declared first, so that it is released last: after the temporary file, if that is dropped.
    let _guard = unfinished();
    let file = temporary_file(folder, target.file_name().unwrap_or_default(), create)?;
    write_buffered(file.as_file(), content)?;
    sync(file.as_file())?;
    file.persist(target).map_err(|e| e.error)?;
    sync_folder(folder)
}

fn write_buffered(
    file: impl Write,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    content(&mut writer)?;
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_synced_replaces_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("a.isp");
        fs::write(&target, "before").expect("written");
        let full = |_: &File| Err(io::ErrorKind::StorageFull.into());
        let error = replace(&target, |writer| writer.write_all(b"after"), full);
        assert_eq!(error.expect_err("not on the disk").kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read(&target).expect("readable"), b"before");
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
    }
}
