//! Temporary folders: files that belong together are written within one, next to their target, and leave it when they are complete.
//!
//! # Invariants
//!
//! A temporary folder contains a file that its process keeps locked. If the process is killed, the next one with the same target
//! finds the file unlocked and removes the folder.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;
use std::sync::RwLockReadGuard;

use crate::abandoned::{LOCK, remove_abandoned, temporary_name};
use crate::atomic_file::{final_path, parent_folder, sync_folder, unfinished};
use crate::error::{Error, Result};

/// A temporary folder in the folder of a target, removed when it is dropped. As long as it exists, its thread must not call
/// [`write_atomically`](crate::atomic_file::write_atomically): a thread waiting in
/// [`block_writes`](crate::atomic_file::block_writes) would deadlock both.
#[derive(Debug)]
pub struct TemporaryFolder {
    /// Declared before the guard, so that it is removed before that is released.
    folder: WorkFolder,
    _guard: RwLockReadGuard<'static, ()>,
}

/// A [`TemporaryFolder`] that any thread may own, without the guard against
/// [`block_writes`](crate::atomic_file::block_writes): for processes that do not call that.
#[derive(Debug)]
pub struct WorkFolder {
    /// Declared before the lock, so that it is removed before that is released.
    folder: tempfile::TempDir,
    _lock: File,
}

impl WorkFolder {
    /// As [`TemporaryFolder::next_to`].
    ///
    /// # Errors
    ///
    /// As [`TemporaryFolder::next_to`].
    pub fn next_to(path: &Path) -> Result<Self> {
        let create = || {
            let target = final_path(path)?;
            if fs::metadata(&target).is_ok_and(|found| !found.is_file()) {
                return Err(io::Error::other("exists and is not a regular file"));
            }
            WorkFolder::beside(&target)
        };
        create().map_err(|error| Error::io(path, error))
    }

    fn beside(target: &Path) -> io::Result<Self> {
        let (parent, name) = (parent_folder(target), target.file_name().unwrap_or_default());
        let folder = temporary_name().tempdir_in(parent)?;
        let _lock = locked(folder.path(), name)?;
        remove_abandoned(parent, name, folder.path());
        Ok(WorkFolder { folder, _lock })
    }

    /// The path of the temporary folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl TemporaryFolder {
    /// Creates one in the folder of the file `path`, behind its symbolic links.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`, also if something other than a regular file exists there.
    pub fn next_to(path: &Path) -> Result<Self> {
        let _guard = unfinished();
        Ok(TemporaryFolder { folder: WorkFolder::next_to(path)?, _guard })
    }

    /// The path of the temporary folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Moves a finished file out of this folder to `path`, behind its symbolic links, and removes the folder.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`; what was there is then unchanged.
    pub fn move_file(self, name: &str, path: &Path) -> Result<()> {
        let rename = || {
            let (new, target) = (self.path().join(name), final_path(path)?);
            // Windows syncs only what is open for writing.
            fs::OpenOptions::new().write(true).open(&new)?.sync_all()?;
            fs::rename(new, &target)?;
            sync_folder(parent_folder(&target))
        };
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

/// Makes the locked file of a temporary folder.
fn locked(folder: &Path, name: &OsStr) -> io::Result<File> {
    let unlocked = folder.join("unlocked.part");
    let mut file = File::create_new(&unlocked)?;
    // On a file system without locks, no process can lock the file, so none takes the folder for an abandoned one.
    let _ = file.try_lock();
    file.write_all(name.as_encoded_bytes())?;
    // It has its name only once it is locked.
    fs::rename(unlocked, folder.join(LOCK))?;
    Ok(file)
}
